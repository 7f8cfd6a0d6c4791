"""Our allocators, by the names that a scenario knows them by; whether an allocator's answer is one, and which of its
offers may be made now."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol

from coordinator.allocate.auction import AuctionAllocator
from coordinator.allocate.cbba import CbbaAllocator
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.simple import FirstComeAllocator, GreedyAllocator, NearestAllocator, NoAllocator
from coordinator.allocate.situation import Allocator, Helper, OpenStrip, Situation

ALLOCATORS: Mapping[str, Callable[[], Allocator]] = MappingProxyType(
    {
        "plan": RoutesAllocator,
        "auction": AuctionAllocator,
        "cbba": CbbaAllocator,
        "greedy": GreedyAllocator,
        "nearest": NearestAllocator,
        "first_come": FirstComeAllocator,
        "none": NoAllocator,
    }
)


ASKED = 6
"""An allocator is asked so often at most for offers that may be made."""
ASKED_LATER_S = 20.0
"""What may not be offered for long is asked for again after this time."""
LONG_S = 30.0
"""A helper that would have to wait longer is not to wait unless any other strip would be begun still later."""


class Gate(Protocol):
    """Tells which offers must wait."""

    def begin(self) -> None:
        """All offers are judged anew."""

    def wait_s(self, helper: Helper, one: OpenStrip) -> float:
        """How long a helper has to wait before it may set out to a strip; infinite for long."""

    def begins_s(self, helper: Helper, one: OpenStrip) -> float:
        """When it would begin to sweep that strip if it set out at once."""


def checked_offers(offers: Mapping[str, int], situation: Situation) -> list[tuple[str, int]]:
    """An allocator's offers, sorted; raises ValueError for any that is not of an open strip to a helper that is there,
    or for a strip that is offered twice."""
    if not isinstance(offers, Mapping):
        raise ValueError(f"the allocator must answer with a mapping from vehicle to strip number, not {offers!r}")
    helpers = {helper.vehicle for helper in situation.helpers}
    left = {one.strip.number for one in situation.strips}
    for vehicle, number in offers.items():
        if vehicle not in helpers or number not in left:
            gives = f"the allocator gives strip {number!r} to {vehicle!r}"
            raise ValueError(f"{gives}; must give an open strip, and each once, to a helper that is there")
        left.remove(number)
    return sorted(offers.items())


def offers_let_through(allocator: Allocator, situation: Situation, gate: Gate) -> tuple[list[tuple[str, int]], float]:
    """The allocator's offers less those that must wait, and after how many seconds to ask again, infinite for never.

    A helper that would have to wait long for its strip is not to be offered it, and the allocator is asked again. That
    holds for one that is to give its task back, too: else it would circle in another's way. It waits all the same where
    it would begin to sweep what it is given instead later still.
    """
    strips = {one.strip.number: one for one in situation.strips}
    again_s = math.inf
    passed: list[tuple[str, int]] = []
    could_begin_s: dict[str, float] = {}
    for _ in range(ASKED):
        gate.begin()
        helpers = {helper.vehicle: helper for helper in situation.helpers}
        passed, long = [], {}
        for name, number in checked_offers(allocator.assign(situation), situation):
            wait_s = gate.wait_s(helpers[name], strips[number])
            begins_s = gate.begins_s(helpers[name], strips[number]) + wait_s
            if wait_s > LONG_S:
                long[name] = helpers[name].refused | {number}
                could_begin_s[name] = min(begins_s, could_begin_s.get(name, math.inf))
            elif begins_s > could_begin_s.get(name, math.inf):
                wait_s = ASKED_LATER_S
            elif wait_s == 0:
                passed.append((name, number))
            if wait_s > 0:
                again_s = min(again_s, wait_s, ASKED_LATER_S)
        if not long:
            break
        helpers_now = (replace(one, refused=long.get(one.vehicle, one.refused)) for one in situation.helpers)
        situation = replace(situation, helpers=tuple(helpers_now))
    return passed, again_s
