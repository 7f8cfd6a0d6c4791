"""The simple allocators: they weigh the open strips and the free helpers alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from coordinator.allocate.service import Service, expected_service, removed_m2
from coordinator.allocate.situation import Helper, OpenStrip, Situation


@dataclass(frozen=True)
class GreedyAllocator:
    """Offers, again and again, the pair of helper and strip that removes the most risk per second of the helper's
    time, the way there included."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        return _best_pairs(situation, _rate)


@dataclass(frozen=True)
class NearestAllocator:
    """Offers, again and again, the pair of helper and strip that the helper reaches first."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        return _best_pairs(situation, lambda helper, one, served, removed: -served.begins_s)


@dataclass(frozen=True)
class FirstComeAllocator:
    """Offers the strips in the order in which they were cut, each to the helper that reaches it first."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        return _best_pairs(situation, lambda helper, one, served, removed: (-one.strip.number, -served.begins_s))


@dataclass(frozen=True)
class NoAllocator:
    """Offers nothing: the primary alone, for comparison."""

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `Allocator`."""
        return {}


def _rate(helper: Helper, one: OpenStrip, served: Service, removed: float) -> float:
    return removed / (served.ends_s - helper.free_s)


def _best_pairs(
    situation: Situation, merit: Callable[[Helper, OpenStrip, Service, float], float | tuple[float, float]]
) -> dict[str, int]:
    """The pairs of most merit first; of equals the lower number, then the first name. What removes nothing by the
    deadline is left out."""
    rated = []
    for helper in situation.free:
        for one in situation.strips:
            if one.strip.number not in helper.refused:
                served = expected_service(one, helper)
                removed = removed_m2(one, helper, served, situation.deadline_s)
                if removed > 0:
                    rated.append((merit(helper, one, served, removed), -one.strip.number, helper.vehicle))
    rated.sort(key=lambda pair: pair[2])
    rated.sort(key=lambda pair: pair[:2], reverse=True)
    offers: dict[str, int] = {}
    for _, minus_number, vehicle in rated:
        if vehicle not in offers and -minus_number not in offers.values():
            offers[vehicle] = -minus_number
    return offers
