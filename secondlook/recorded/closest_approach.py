"""How near vehicles came to each other, and when. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from comms.node import Received
from comms.said.messages import Nav, TruthPose


@dataclass(frozen=True)
class Closest:
    """The least distance of two vehicles while both were under way, and when that was, in seconds since the mission's
    start."""

    vehicles: tuple[str, str]
    closest_m: float
    t_s: float


class _Leg(NamedTuple):
    """A vehicle's way from one position told to the next, taken to be straight."""

    from_s: float
    to_s: float
    start: tuple[float, float]
    end: tuple[float, float]

    def at(self, time_s: float) -> tuple[float, float]:
        share = (time_s - self.from_s) / (self.to_s - self.from_s) if self.to_s > self.from_s else 1.0
        return tuple(a + share * (b - a) for a, b in zip(self.start, self.end, strict=True))  # type: ignore[return-value]


class ClosestApproaches:
    """Take the messages in order; ask at any time.

    True positions count where they are told, else those that vehicles believe in. A vehicle counts from when it is
    first under way, and not while it rests at home. Vehicles that are told of at different times are compared where
    their last stretches overlap. `speeds_mps`: the most that each vehicle does; a pair is not looked at again before it
    can be nearer than it was.
    """

    def __init__(self, speeds_mps: Mapping[str, float]) -> None:
        self._speeds_mps = speeds_mps
        self._legs: dict[str, _Leg] = {}
        self._told_true: set[str] = set()
        self._under_way: set[str] = set()
        self._closest: dict[tuple[str, str], Closest] = {}
        self._due_s: dict[tuple[str, str], float] = {}

    def hear(self, received: Received) -> None:
        """Folds one message in."""
        message, name = received.message, received.vehicle
        if isinstance(message, TruthPose):
            self._told_true.add(name)
        elif not isinstance(message, Nav):
            return
        elif message.speed_mps > 0:
            self._under_way.add(name)
        if name not in self._under_way or (isinstance(message, Nav) and name in self._told_true):
            return
        now_s, place = received.t_s, (message.x_m, message.y_m)
        before = self._legs.get(name)
        self._legs[name] = leg = _Leg(before.to_s if before else now_s, now_s, before.end if before else place, place)
        for other, its in self._legs.items():
            if other != name:
                pair = (name, other) if name < other else (other, name)
                if self._due_s.get(pair, 0.0) <= now_s:
                    self._compare(pair, leg, its)

    def rest(self, name: str) -> None:
        """A vehicle has come home: nobody can come too close to it there."""
        self._legs.pop(name, None)
        self._under_way.discard(name)

    def found(self) -> list[Closest]:
        """Of each pair of vehicles that were under way at one time, the nearest first."""
        return sorted(self._closest.values(), key=lambda one: (one.closest_m, one.vehicles))

    def _compare(self, pair: tuple[str, str], one: _Leg, other: _Leg) -> None:
        from_s, to_s = max(one.from_s, other.from_s), min(one.to_s, other.to_s)
        if from_s > to_s:
            return
        begin, end = ([b - a for a, b in zip(one.at(t_s), other.at(t_s), strict=True)] for t_s in (from_s, to_s))
        change = [b - a for a, b in zip(begin, end, strict=True)]
        square = math.hypot(*change) ** 2
        share = min(1.0, max(0.0, -sum(a * b for a, b in zip(begin, change, strict=True)) / square)) if square else 0.0
        apart_m = math.hypot(*(a + share * b for a, b in zip(begin, change, strict=True)))
        known = self._closest.get(pair)
        if known is None or apart_m < known.closest_m:
            known = self._closest[pair] = Closest(pair, apart_m, from_s + share * (to_s - from_s))
        closing_mps = sum(self._speeds_mps.get(name, math.inf) for name in pair)
        self._due_s[pair] = to_s + (math.hypot(*end) - known.closest_m) / closing_mps if closing_mps > 0 else to_s
