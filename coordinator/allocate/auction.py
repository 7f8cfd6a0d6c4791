"""An auction of strips that needs nobody in the middle: sequential single-item, every bid from what its bidder knows.

In each round every helper bids for the one strip, of those not yet sold, that suits it best behind what it has already
bought; the highest bid wins. As bids of all reach all, each helper can tell the winner by itself. (Koenig and others,
The power of sequential single-item auctions for agent coordination, 2006.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from coordinator.allocate.service import StripTable
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.dubins import Pose
from planner.types import FloatArray

AT_ONCE = 3
"""Strips that a helper buys ahead."""


@dataclass(frozen=True)
class Bid:
    """A helper's offer for a strip: the risk it would remove per second of its time, behind what it has bought."""

    m2ps: float
    vehicle: str
    number: int

    @property
    def beats(self) -> tuple[float, int, str]:
        """What the lowest of wins: the highest rate; of equals the lower number, then the first name."""
        return -self.m2ps, self.number, self.vehicle


@dataclass(frozen=True)
class AuctionAllocator:
    """See the module. A helper that has a task bids from where and when it will be free, and is never turned round."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        if not situation.free:
            return {}
        strips = sorted(situation.strips, key=lambda one: one.strip.number)
        bidders = [_Bidder(one, strips, situation.deadline_s) for one in situation.helpers]
        while bids := [bid for bidder in bidders if (bid := bidder.bid()) is not None]:
            winner = min(bids, key=lambda bid: bid.beats)
            for bidder in bidders:
                bidder.sold(winner)
        return {
            bidder.helper.vehicle: bidder.bought[0]
            for bidder in bidders
            if bidder.helper.task is None and bidder.bought
        }


class _Bidder:
    """One helper in the auction: it knows itself, the strips, and what was sold."""

    def __init__(self, helper: Helper, strips: Sequence[OpenStrip], deadline_s: float) -> None:
        self.helper = helper
        self.bought: list[int] = []
        self._numbers = [one.strip.number for one in strips]
        self._table, self._deadline_s = StripTable(strips, helper), deadline_s
        self._pose, self._free_s = helper.free_at, helper.free_s
        self._unsold = np.ones(len(strips), dtype=np.bool_)
        self._rate_strips(helper.wait_s(strips))

    def bid(self) -> Bid | None:
        """Its best bid; None where nothing is left that it wants."""
        if len(self.bought) == AT_ONCE:
            return None
        m2ps = np.where(self._unsold, self._m2ps, 0.0)
        if not m2ps.size or m2ps.max() <= 0:
            return None
        place = int(m2ps.argmax())
        return Bid(float(m2ps[place]), self.helper.vehicle, self._numbers[place])

    def sold(self, bid: Bid) -> None:
        """Hears who has bought what."""
        place = self._numbers.index(bid.number)
        self._unsold[place] = False
        if bid.vehicle != self.helper.vehicle:
            return
        self.bought.append(bid.number)
        self._pose, self._free_s = Pose(*self._leave[place].tolist()), float(self._ends_s[place])
        self._rate_strips()

    def _rate_strips(self, wait_s: float | FloatArray = 0.0) -> None:
        from_s = self._free_s + wait_s
        removed_m2, self._ends_s, self._leave = self._table.best_from(self._pose, from_s, self._deadline_s)
        self._m2ps = removed_m2 / (self._ends_s - self._free_s)
