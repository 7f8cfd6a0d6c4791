"""What a current makes of a vehicle's speed: it swims at one speed, keeps its track by crabbing, and makes good over
the ground what the stream leaves it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from planner.dubins import DubinsPath, Pose
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import Pass
from planner.types import FloatArray
from planner.ways import way_or_direct

Flow = tuple[float, float]
"""How the water flows, to the east and to the north, in m/s."""
ARC_POINTS = 16


@dataclass(frozen=True)
class Current:
    """How the water flows, everywhere alike: at `drift_mps` towards the compass heading `set_rad`.

    With `period_s` it flows to and fro as a sine does, so fast at most; at `slack_s` it turns towards that heading.
    """

    drift_mps: float
    set_rad: float
    period_s: float | None = None
    slack_s: float = 0.0

    def flow_mps(self, time_s: float) -> Flow:
        """The flow at a time, to the east and to the north."""
        drift_mps = self.drift_mps
        if self.period_s is not None:
            drift_mps *= math.sin(2 * math.pi * (time_s - self.slack_s) / self.period_s)
        return drift_mps * math.sin(self.set_rad), drift_mps * math.cos(self.set_rad)


def along_and_across_mps(heading_rad: float, flow_mps: Flow) -> Flow:
    """A flow along a compass heading, and to starboard of it."""
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    return flow_mps[0] * sin + flow_mps[1] * cos, flow_mps[0] * cos - flow_mps[1] * sin


def made_good_mps(course_rad: float, speed_mps: float, flow_mps: Flow) -> float:
    """The speed over the ground along a course of a vehicle that swims at `speed_mps` in a slower flow."""
    along_mps, across_mps = along_and_across_mps(course_rad, flow_mps)
    return along_mps + math.sqrt(speed_mps**2 - across_mps**2)


@dataclass(frozen=True)
class Sailing:
    """What a vehicle makes good, as it is reckoned with: `speed_mps` > 0 through the water, which flows at `drift_mps`,
    less than that, towards `set_rad`. `tidal`: or the other way, and what is slower counts."""

    speed_mps: float
    drift_mps: float = 0.0
    set_rad: float = 0.0
    tidal: bool = False

    @property
    def is_in_still_water(self) -> bool:
        """Whether it makes good what it swims."""
        return self.drift_mps == 0.0

    @property
    def slowest_mps(self) -> float:
        """What it makes good right against the stream."""
        return self.speed_mps - self.drift_mps

    def made_good_mps(self, courses_rad: FloatArray) -> FloatArray:
        """The speed over the ground along courses, same shape."""
        from_set_rad = courses_rad - self.set_rad
        along_mps = self.drift_mps * np.cos(from_set_rad)
        across_mps = self.drift_mps * np.sin(from_set_rad)
        if self.tidal:
            along_mps = -np.abs(along_mps)
        made_good_mps: FloatArray = along_mps + np.sqrt(self.speed_mps**2 - across_mps**2)
        return made_good_mps

    def straight_s(self, length_m: float, course_rad: float) -> float:
        """How long a straight way takes."""
        if self.is_in_still_water:
            return length_m / self.speed_mps
        return length_m / float(self.made_good_mps(np.array(course_rad)))

    def turns_s(self, radius_m: float, from_rad: FloatArray, by_rad: FloatArray) -> FloatArray:
        """How long turns of a radius take, from headings by angles, to starboard above 0; same shape."""
        points, weights = _gauss()
        headings_rad = from_rad[..., np.newaxis] + by_rad[..., np.newaxis] * points
        took_s: FloatArray = radius_m * np.abs(by_rad) * (weights / self.made_good_mps(headings_rad)).sum(axis=-1)
        return took_s

    def path_s(self, path: DubinsPath) -> float:
        """How long a path takes."""
        if self.is_in_still_water:
            return path.length_m / self.speed_mps
        heading_rad, spent_s = path.start.heading_rad, 0.0
        for turn, length_m in zip(path.turns, path.lengths_m, strict=True):
            by_rad = turn * length_m / path.turn_radius_m
            if turn:
                spent_s += float(self.turns_s(path.turn_radius_m, np.array(heading_rad), np.array(by_rad)))
            else:
                spent_s += self.straight_s(length_m, heading_rad)
            heading_rad += by_rad
        return spent_s

    def way_s(self, way: Sequence[DubinsPath]) -> float:
        """How long paths that follow each other take."""
        return sum(self.path_s(path) for path in way)

    def knots(self, paths: Sequence[DubinsPath]) -> tuple[FloatArray, FloatArray]:
        """When a vehicle is how far along paths that follow each other, at the ends of their turns and straights; both
        begin with 0."""
        times_s, lengths_m = [0.0], [0.0]
        for path in paths:
            heading_rad = path.start.heading_rad
            for turn, length_m in zip(path.turns, path.lengths_m, strict=True):
                one = DubinsPath(Pose(0.0, 0.0, heading_rad), path.turn_radius_m, (turn, 0, 0), (length_m, 0.0, 0.0))
                times_s.append(times_s[-1] + self.path_s(one))
                lengths_m.append(lengths_m[-1] + length_m)
                heading_rad += turn * length_m / path.turn_radius_m
        return np.array(times_s), np.array(lengths_m)

    def passes_s(
        self, passes: Sequence[Pass], turn_radius_m: float, here: Pose | None = None, keep_out: KeepOut = NOWHERE
    ) -> float:
        """How long passes take in their order, with the ways between them, and the way there from a pose, if any."""
        spent_s = 0.0
        for one in passes:
            if here is not None:
                spent_s += self.way_s(way_or_direct(here, one.begin, turn_radius_m, keep_out))
            spent_s += self.straight_s(one.length_m, one.begin.heading_rad)
            here = one.end
        return spent_s


@cache
def _gauss() -> tuple[FloatArray, FloatArray]:
    """Points within [0, 1] and weights that sum to 1."""
    points, weights = np.polynomial.legendre.leggauss(ARC_POINTS)
    return (points + 1) / 2, weights / 2
