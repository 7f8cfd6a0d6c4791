"""The consensus-based bundle algorithm: each helper claims a bundle of strips, hears the others' claims, and gives up
what another bids more for, until all agree. No coordinator decides.

After Choi, Brunet and How, Consensus-based decentralized auctions for robust task allocation, 2009. What the helpers
would tell each other, over a network in which each hears each, is played within one step and without loss. There nobody
can know more of a helper's claims than it says itself, so that of the rules in the paper's Table 1 two are left: what a
helper says of its own claims is so, and of two claims the higher bid counts.

A bid is what a strip adds to the score of the helper's path at the best place in it. The score is the paper's, reward
discounted by time: what a sweep removes by the deadline, halved for each `HALF_LIFE_S` until its end. So a near strip
is worth more than one far away while both could be served in time, and no strip gains by one put in before it. That is
nearly the diminishing marginal gain which agreement takes: nearly, as a strip put in delays those behind it, and those
that are late already lose less by that. Bids are therefore warped, too: none is above those for what was put into the
bundle before (Johnson, Choi and How, Allowing non-submodular score functions in distributed task allocation, 2012),
with which helpers agree whatever the score.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coordinator.allocate.service import StripTable
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from planner.types import BoolArray, FloatArray

IntArray = NDArray[np.intp]

BUNDLE = 5
"""Strips that a helper claims ahead, at most."""
CHOICE = 12
"""Strips that it has to choose from, at least, where there are as many."""
HALF_LIFE_S = 600.0
NOBODY = -1


class Claims(NamedTuple):
    """What a helper takes for agreed: of each strip the highest bid and the number of the helper that made it, `NOBODY`
    with a bid of 0. Shape (strips,)."""

    bids: FloatArray
    winners: IntArray

    def copy(self) -> Claims:
        """Another, to be changed."""
        return Claims(self.bids.copy(), self.winners.copy())


@dataclass(frozen=True)
class CbbaAllocator:
    """See the module. A helper that has a task bids from where and when it will be free, and is never turned round."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        if not situation.free:
            return {}
        strips = sorted(situation.strips, key=lambda one: one.strip.number)
        return {
            bidder.helper.vehicle: strips[bidder.path[0]].strip.number
            for bidder in agreed(situation, strips)
            if bidder.helper.task is None and bidder.path
        }


def agreed(situation: Situation, strips: Sequence[OpenStrip]) -> list[Bidder]:
    """The helpers, by name, once nobody claims or hears anything new; each round all claim and then all hear."""
    helpers = sorted(situation.helpers, key=lambda one: one.vehicle)
    bidders = [Bidder(number, helper, situation, strips) for number, helper in enumerate(helpers)]
    news = True
    while news:
        claimed = [bidder.claim() for bidder in bidders]
        said = [bidder.claims.copy() for bidder in bidders]
        heard = [bidder.hear(said) for bidder in bidders]
        news = any(claimed) or any(heard)
    return bidders


class Bidder:
    """One helper, the `number`th of all: what it takes for agreed, what it claims in the order of claiming (`bundle`),
    and in the order of flying (`path`), both as places in the list of strips."""

    def __init__(self, number: int, helper: Helper, situation: Situation, strips: Sequence[OpenStrip]) -> None:
        self.helper = helper
        self.claims = Claims(np.zeros(len(strips)), np.full(len(strips), NOBODY))
        self.bundle: list[int] = []
        self.path: list[int] = []
        self._number = number
        # When the others have claimed as many as they may there are still some to choose from.
        self._routes = _Routes(helper, situation, strips, most=CHOICE + BUNDLE * (len(situation.helpers) - 1))

    def claim(self) -> bool:
        """Fills its bundle with what adds the most to it and is not bid more for by another; whether it claimed any."""
        bids, winners = self.claims
        before = len(self.bundle)
        while len(self.bundle) < BUNDLE:
            gains, places = self._routes.gains(self.path)
            warped = np.minimum(gains, bids[self.bundle[-1]]) if self.bundle else gains
            gains[~_beats(warped, self._number, self.claims)] = 0.0
            if gains.max(initial=0.0) <= 0:
                break
            strip = int(gains.argmax())
            self.bundle.append(strip)
            self.path.insert(int(places[strip]), strip)
            bids[strip], winners[strip] = warped[strip], self._number
        return len(self.bundle) > before

    def hear(self, said: Sequence[Claims]) -> bool:
        """Hears what each helper takes for agreed; whether that is news. Where another has bid more for a strip of its
        bundle, it gives up all from there on: what it claimed after that it bid for with that in its path."""
        bids, winners = now = self.claims.copy()
        for other, theirs in enumerate(said):
            if other == self._number:
                continue
            held, believed = theirs.winners == other, winners == other
            counts = held & (believed | _beats(theirs.bids, other, now))
            bids[counts], winners[counts] = theirs.bids[counts], other
            given_up = believed & ~held
            bids[given_up], winners[given_up] = 0.0, NOBODY
        kept = next((n for n, strip in enumerate(self.bundle) if winners[strip] != self._number), len(self.bundle))
        for strip in self.bundle[kept:]:
            self.path.remove(strip)
            if winners[strip] == self._number:
                bids[strip], winners[strip] = 0.0, NOBODY
        del self.bundle[kept:]
        before, self.claims = self.claims, now
        return not all(map(np.array_equal, now, before))


def _beats(bids: FloatArray, bidder: int, claims: Claims) -> BoolArray:
    """Where a helper's bids are above those agreed so far; of equals the first helper's counts."""
    beaten: BoolArray = (bids > claims.bids) | ((bids == claims.bids) & (bidder < claims.winners))
    return beaten


class _Routes:
    """A helper's ways between the strips that it considers: those of which it removes the most risk per second, at most
    `most`. It sets out from where it is free, or from a strip's end: one of these for each way to fly the strip."""

    def __init__(self, helper: Helper, situation: Situation, strips: Sequence[OpenStrip], most: int) -> None:
        self._helper, self._now_s, self._deadline_s = helper, situation.now_s, situation.deadline_s
        alone = StripTable(strips, helper)
        removed_m2, ends_s, _ = alone.best_from(helper.free_at, helper.free_s, situation.deadline_s)
        rates = removed_m2 / (ends_s - helper.free_s)
        best = np.argsort(-rates, kind="stable")[:most]
        self._places = np.sort(best[rates[best] > 0])
        self._strips = len(strips)
        considered = [strips[place] for place in self._places]
        table = StripTable(considered, helper)
        start = np.array([helper.free_at], dtype=np.float64)
        to_begin_s, ways = table.ways.shortest_from_each([start, table.leave.reshape(-1, 3)])
        to_begin_s[0] += helper.wait_s(considered)
        numbers = np.arange(len(considered))
        # From each of these to each strip: for how long the sonar is on and it then sails on, the time until it is free
        # again, and from where it then sets out.
        self._sweep_s, self._run_out_s = table.sonar_on_s[numbers, ways], table.run_out_s[numbers, ways]
        self._takes_s = to_begin_s + self._sweep_s + self._run_out_s
        self._then = 1 + table.leave.shape[1] * numbers + ways
        self._home_s = table.home_s.max(axis=1)
        self._removable_m2 = table.worth_m2

    def gains(self, path: Sequence[int]) -> tuple[FloatArray, IntArray]:
        """What each strip adds to the score of a path at the best place in it, 0 for what is in it already, and that
        place. Shape (strips,)."""
        path = [int(place) for place in np.searchsorted(self._places, path)]
        froms, times_s, scores = [0], [self._helper.free_s], [0.0]
        for strip in path:
            times_s.append(times_s[-1] + float(self._takes_s[froms[-1], strip]))
            scores.append(scores[-1] + float(self._score(froms[-1], strip, np.array(times_s[-1]))))
            froms.append(int(self._then[froms[-1], strip]))
        # Each strip put in at each place, and after that what comes behind.
        free_s = np.array(times_s)[:, np.newaxis] + self._takes_s[froms]
        where, starts, strips = self._then[froms], np.array(froms)[:, np.newaxis], np.arange(self._places.size)
        gained = np.array(scores)[:, np.newaxis] - scores[-1] + self._score(starts, strips, free_s)
        for place, strip in enumerate(path):
            before = slice(place + 1)
            start = where[before]
            free_s[before] += self._takes_s[start, strip]
            gained[before] += self._score(start, strip, free_s[before])
            where[before] = self._then[start, strip]
        gained[:, path] = 0.0
        gains, best = np.zeros(self._strips), np.zeros(self._strips, dtype=np.intp)
        gains[self._places], best[self._places] = gained.max(axis=0), gained.argmax(axis=0)
        return gains, best

    def _score(self, start: int | IntArray, strip: int | IntArray, free_s: FloatArray) -> FloatArray:
        """What is removed of strips by the deadline, discounted, for from where the helper sets out to each and when it
        is free again."""
        ends_s = free_s - self._run_out_s[start, strip]
        share = np.clip((self._deadline_s - ends_s) / self._sweep_s[start, strip] + 1, 0.0, 1.0)
        worth = self._removable_m2[strip] * share * 0.5 ** ((ends_s - self._now_s) / HALF_LIFE_S)
        scores: FloatArray = np.where(ends_s + self._home_s[strip] <= self._helper.lasts_until_s, worth, 0.0)
        return scores
