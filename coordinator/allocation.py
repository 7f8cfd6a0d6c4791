"""Which open strip goes to which free helper."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from planner.dubins import Pose, shortest_path
from planner.types import Point, Strip


@dataclass(frozen=True)
class OpenStrip:
    """A strip that nobody serves, and the risk (residual risk times m2) that a look is expected to remove there."""

    strip: Strip
    removable_m2: float


@dataclass(frozen=True)
class FreeHelper:
    """A helper without a task: pose (mission frame), speed, turn radius, run-in, and the time its battery still lasts.
    `refused`: strips it will not be offered again."""

    vehicle: str
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    lasts_s: float
    refused: frozenset[int]


class Allocator(Protocol):
    """Decides offers. Pure: the same situation gives the same answer."""

    def assign(self, strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper]) -> Mapping[str, int]:
        """Strip number for each helper that is to be offered one; each strip at most once."""


@dataclass(frozen=True)
class GreedyAllocator:
    """Offers, again and again, the pair of helper and strip that removes the most risk per second of the helper's
    time, transit included."""

    def assign(self, strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper]) -> Mapping[str, int]:
        """See `Allocator`."""
        rated = sorted(
            (-one.removable_m2 / seconds, one.strip.number, helper.vehicle)
            for helper in helpers
            for one in strips
            if one.strip.number not in helper.refused
            for seconds in (service_s(one.strip, helper),)
            if seconds <= helper.lasts_s
        )
        offers: dict[str, int] = {}
        taken: set[int] = set()
        for _, number, vehicle in rated:
            if vehicle not in offers and number not in taken:
                offers[vehicle] = number
                taken.add(number)
        return offers


@dataclass(frozen=True)
class NoAllocator:
    """Offers nothing: the primary alone, for comparison."""

    def assign(self, strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper]) -> Mapping[str, int]:
        """See `Allocator`."""
        return {}


def checked_offers(
    offers: Mapping[str, int], strips: Sequence[OpenStrip], helpers: Sequence[FreeHelper]
) -> list[tuple[str, int]]:
    """An allocator's offers, sorted; raises ValueError for any that is not of an open strip to a free helper, or for a
    strip that is offered twice."""
    if not isinstance(offers, Mapping):
        raise ValueError(f"the allocator must answer with a mapping from vehicle to strip number, not {offers!r}")
    free = {helper.vehicle for helper in helpers}
    left = {one.strip.number for one in strips}
    for vehicle, number in offers.items():
        if vehicle not in free or number not in left:
            gives = f"the allocator gives strip {number!r} to {vehicle!r}"
            raise ValueError(f"{gives}; must give an open strip, and each once, to a free helper")
        left.remove(number)
    return sorted(offers.items())


def service_s(strip: Strip, helper: FreeHelper) -> float:
    """Seconds for a helper to get to the nearer end of a strip and along it once."""
    pose = Pose(helper.x_m, helper.y_m, helper.heading_rad)
    ahead_rad, back_rad = strip.heading_rad, (strip.heading_rad + math.pi) % (2 * math.pi)
    transit_m = min(
        shortest_path(pose, _before(end, heading_rad, helper.run_in_m), helper.turn_radius_m).length_m
        for end, heading_rad in ((strip.start, ahead_rad), (strip.end, back_rad))
    )
    return (transit_m + helper.run_in_m + strip.length_m) / helper.speed_mps


def _before(point: Point, heading_rad: float, distance_m: float) -> Pose:
    x_m, y_m = point
    return Pose(x_m - distance_m * math.sin(heading_rad), y_m - distance_m * math.cos(heading_rad), heading_rad)
