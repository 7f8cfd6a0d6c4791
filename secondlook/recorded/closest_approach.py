"""How near vehicles came to each other, and when. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import takewhile
from typing import NamedTuple

from planner.types import Point
from secondlook.recorded.whereabouts import Place

START_S = 1.0
LEGS_KEPT = 40
"""Of a vehicle, for those whose places up to the same time come later."""
NEAR_M = 1_000.0
"""Each pair that came as near as this is told; `mission.separation_m` is at most so long."""


@dataclass(frozen=True)
class Closest:
    """The least distance of two vehicles while both were under way, and when that was, in seconds since the mission's
    start."""

    vehicles: tuple[str, str]
    closest_m: float
    t_s: float


class _Leg(NamedTuple):
    """A vehicle's way from one place to the next."""

    from_s: float
    to_s: float
    start: Point
    end: Point

    def at(self, time_s: float) -> Point:
        share = (time_s - self.from_s) / (self.to_s - self.from_s) if self.to_s > self.from_s else 1.0
        (x_m, y_m), (end_x_m, end_y_m) = self.start, self.end
        return x_m + share * (end_x_m - x_m), y_m + share * (end_y_m - y_m)

    def to_other(self, other: _Leg, time_s: float) -> Point:
        """From where it is on this way to where the other vehicle is on its own."""
        (x_m, y_m), (its_x_m, its_y_m) = self.at(time_s), other.at(time_s)
        return its_x_m - x_m, its_y_m - y_m


class ClosestApproaches:
    """Take the places of each vehicle in order; ask at any time.

    A vehicle counts from when it is first under way, one that lay before from START_S later, as it did not choose where
    it lay; and not while it rests at home. `speeds_mps`: the most that each vehicle does.

    So that a fleet of a thousand costs a vehicle little more than one of ten, a pair is looked at again only when it
    may be nearer than it was, and near enough to be told.
    """

    def __init__(self, speeds_mps: Mapping[str, float]) -> None:
        self._speeds_mps = speeds_mps
        self._legs: dict[str, deque[_Leg]] = {}
        self._counts_from_s: dict[str, float] = {}
        self._lay: set[str] = set()
        self._told_true: set[str] = set()
        self._closest: dict[tuple[str, str], Closest] = {}
        self._nearest_m: defaultdict[str, float] = defaultdict(lambda: math.inf)  # that anybody came to it
        self._due_s: dict[tuple[str, str], float] = {}
        self._looks: defaultdict[str, list[tuple[float, str]]] = defaultdict(list)  # a heap: when at whom, or later

    def hear(self, place: Place) -> None:
        """Folds one place in."""
        name = place.vehicle
        if name not in self._counts_from_s:
            if not place.moves:
                self._lay.add(name)
                return
            self._counts_from_s[name] = place.t_s + (START_S if name in self._lay else 0.0)
        if not place.counts:
            return
        if name not in self._legs:
            for other in self._legs:
                heappush(self._looks[other], (0.0, name))
            self._looks[name] = [(0.0, other) for other in sorted(self._legs)]
            self._legs[name] = deque(maxlen=LEGS_KEPT)
        legs = self._legs[name]
        if place.is_true and name not in self._told_true:  # where it believed to be it was not
            self._told_true.add(name)
            legs.clear()
        from_s, start = (legs[-1].to_s, legs[-1].end) if legs else (place.t_s, place.at)
        leg = _Leg(from_s, place.t_s, start, place.at)
        legs.append(leg)
        self._look_round(name, leg)

    def rest(self, name: str) -> None:
        """A vehicle has come home: nobody can come too close to it there."""
        self._legs.pop(name, None)
        self._counts_from_s.pop(name, None)

    def found(self) -> list[Closest]:
        """Of each vehicle the one that came nearest to it while both were under way, and of each pair that came within
        NEAR_M, how near; the nearest first."""
        told = [
            one
            for one in self._closest.values()
            if one.closest_m <= max(NEAR_M, *(self._nearest_m[name] for name in one.vehicles))
        ]
        return sorted(told, key=lambda one: (one.closest_m, one.vehicles))

    def _look_round(self, name: str, leg: _Leg) -> None:
        """Compares a vehicle's newest leg with those of whom it is due to look at."""
        looks = self._looks[name]
        due: dict[str, None] = {}  # in order; one that was home in between may be there twice
        while looks and looks[0][0] <= leg.to_s:
            due[heappop(looks)[1]] = None
        for other in due:
            others = self._legs.get(other)
            if others is None:
                continue  # at home; under way again it is looked at anew
            pair = (name, other) if name < other else (other, name)
            if self._due_s.get(pair, 0.0) <= leg.to_s:
                for its in reversed(list(takewhile(lambda its: its.to_s >= leg.from_s, reversed(others)))):
                    self._compare(pair, leg, its)
            heappush(looks, (self._due_s.get(pair, 0.0), other))

    def _compare(self, pair: tuple[str, str], one: _Leg, other: _Leg) -> None:
        first, second = pair
        from_s = max(one.from_s, other.from_s, self._counts_from_s[first], self._counts_from_s[second])
        to_s = min(one.to_s, other.to_s)
        if from_s > to_s:
            return
        (x_m, y_m), (end_x_m, end_y_m) = one.to_other(other, from_s), one.to_other(other, to_s)
        by_x_m, by_y_m = end_x_m - x_m, end_y_m - y_m
        square = math.hypot(by_x_m, by_y_m) ** 2
        share = min(1.0, max(0.0, -(x_m * by_x_m + y_m * by_y_m) / square)) if square else 0.0
        apart_m = math.hypot(x_m + share * by_x_m, y_m + share * by_y_m)
        known = self._closest.get(pair)
        if known is None or apart_m < known.closest_m:
            known = self._closest[pair] = Closest(pair, apart_m, from_s + share * (to_s - from_s))
            for name in pair:
                self._nearest_m[name] = min(self._nearest_m[name], apart_m)
        told_m = min(known.closest_m, max(NEAR_M, self._nearest_m[first], self._nearest_m[second]))
        closing_mps = self._speeds_mps.get(first, math.inf) + self._speeds_mps.get(second, math.inf)
        last_m = math.hypot(end_x_m, end_y_m)
        self._due_s[pair] = to_s + (last_m - told_m) / closing_mps if closing_mps > 0 else to_s
