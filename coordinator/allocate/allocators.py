"""Our allocators, by the names that a scenario knows them by; whether an allocator's answer is one, and which of its
offers may be made now."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Protocol

from coordinator.allocate.auction import AuctionAllocator
from coordinator.allocate.cbba import CbbaAllocator
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.simple import FirstComeAllocator, GreedyAllocator, NearestAllocator, NoAllocator
from coordinator.allocate.situation import LONG_WAIT_S, Allocator, Helper, OpenStrip, Situation
from planner.types import whole_number

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


class Gate(Protocol):
    """Tells which offers must wait. `blocked`: by helper and strip those of them in whose way somebody at work is."""

    blocked: set[tuple[str, int]]

    def begin(self) -> None:
        """All offers are judged anew."""

    def wait_s(self, helper: Helper, one: OpenStrip) -> float:
        """How long a helper has to wait before it may set out to a strip; infinite for long."""


@dataclass(frozen=True)
class LetThrough:
    """`offers` that may be made; after how many seconds to ask again, infinite for never; who is waiting for somebody
    at work to be out of its way."""

    offers: list[tuple[str, int]]
    again_s: float
    waiting: frozenset[str]


def checked_offers(offers: Mapping[str, int], situation: Situation) -> list[tuple[str, int]]:
    """An allocator's offers, sorted, with whole numbers as Python's own; raises ValueError for any that is not of an
    open strip to a helper that is there, or for a strip that is offered twice."""
    if not isinstance(offers, Mapping):
        raise ValueError(f"the allocator must answer with a mapping from vehicle to strip number, not {offers!r}")
    helpers = {helper.vehicle for helper in situation.helpers}
    left = {one.strip.number for one in situation.strips}
    checked = dict[str, int]()
    for vehicle, given in offers.items():
        number = strip_number("the allocator", vehicle, given)
        if vehicle not in helpers or number not in left:
            gives = f"the allocator gives strip {number} to {vehicle!r}"
            raise ValueError(f"{gives}; must give an open strip, and each once, to a helper that is there")
        left.remove(number)
        checked[vehicle] = number
    return sorted(checked.items())


def strip_number(who: str, vehicle: object, given: Any) -> int:
    """The number of the strip that an allocator, `who` it is, gives to a vehicle: an int, or one of numpy's. Raises
    ValueError for anything else, such as 1.0 or True."""
    number = whole_number(given)
    if number is None:
        raise ValueError(f"{who} gives strip {reprlib.repr(given)} to {vehicle!r}; a strip's number must be an int")
    return number


def offers_let_through(
    allocator: Allocator, situation: Situation, gate: Gate, impatient: Collection[str] = ()
) -> LetThrough:
    """The allocator's offers less those that must wait.

    The allocator is told what must wait, and how long, and asked again, until all that it offers may be made or waits
    although it knows that. What must wait for long counts as refused as well; by the `impatient`, which have waited for
    long already, all is refused whose way is blocked. All of it holds for a helper that is to give its task back, too:
    else it would circle in another's way.
    """
    strips = {one.strip.number: one for one in situation.strips}
    again_s = math.inf
    passed, waiting = list[tuple[str, int]](), set[str]()
    for _ in range(ASKED):
        gate.begin()
        helpers = {helper.vehicle: helper for helper in situation.helpers}
        passed, waiting, told = [], set(), dict[str, Helper]()
        for name, number in checked_offers(allocator.assign(situation), situation):
            helper = helpers[name]
            wait_s = gate.wait_s(helper, strips[number])
            if wait_s == 0:
                passed.append((name, number))
                continue
            again_s = min(again_s, wait_s, ASKED_LATER_S)
            is_blocked = (name, number) in gate.blocked
            if is_blocked:
                waiting.add(name)
            if is_blocked and name in impatient:
                told[name] = _without_blocked(gate, helper, strips)
            elif wait_s > helper.waits_s.get(number, 0.0) and not (math.isinf(wait_s) and number in helper.refused):
                told[name] = _told(helper, number, wait_s)
        if not told:
            break
        situation = replace(situation, helpers=tuple(told.get(one.vehicle, one) for one in situation.helpers))
    return LetThrough(passed, again_s, frozenset(waiting))


def _told(helper: Helper, number: int, wait_s: float) -> Helper:
    """A helper that is told of a wait."""
    refused = helper.refused | {number} if math.isinf(wait_s) else helper.refused
    return replace(helper, refused=refused, waits_s={**helper.waits_s, number: min(wait_s, LONG_WAIT_S)})


def _without_blocked(gate: Gate, helper: Helper, strips: Mapping[int, OpenStrip]) -> Helper:
    """A helper that is to be sent to nothing to which its way is blocked."""
    waits = [number for number, one in strips.items() if gate.wait_s(helper, one) > 0]
    blocked = {number for number in waits if (helper.vehicle, number) in gate.blocked}
    waits_s = {number: wait_s for number, wait_s in helper.waits_s.items() if number not in blocked}
    return replace(helper, refused=helper.refused | blocked, waits_s=waits_s)
