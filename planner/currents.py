"""What a current makes of a vehicle's speed: it swims at one speed, keeps its track by crabbing, and makes good over
the ground what the stream leaves it."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TypeVar

import numpy as np

from planner.dubins import DubinsPath, Pose
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import Pass
from planner.types import FloatArray, Point
from planner.ways import way_or_direct

Flow = tuple[float, float]
"""How the water flows, to the east and to the north, in m/s."""
ARC_POINTS, STRAIGHT_POINTS = 16, 8
KNOT_M = 50.0
"""Where the water flows differently from place to place a vehicle is expected to keep its speed for so long."""


@dataclass(frozen=True, eq=False)
class FlowGrid:
    """How the water flows from place to place and from time to time; mission frame.

    `x_m`, `y_m`, `time_s`: where and when it is known, each ascending; `east_mps`, `north_mps`: the flow there and
    then, shape (times, rows, columns), a row for each y. Between them it is linear along each axis; beyond the first
    and the last it is as there.
    """

    x_m: FloatArray
    y_m: FloatArray
    time_s: FloatArray
    east_mps: FloatArray
    north_mps: FloatArray

    @property
    def fastest_mps(self) -> float:
        """How fast it flows at most, which is at a node."""
        return float(np.hypot(self.east_mps, self.north_mps).max())

    def until(self, time_s: float) -> FlowGrid:
        """The same as far as it bears on the time from 0 to `time_s` >= 0."""
        first = max(0, int(np.searchsorted(self.time_s, 0.0, side="right")) - 1)
        end = max(first, int(np.searchsorted(self.time_s, time_s))) + 1
        kept = slice(first, end)
        return replace(self, time_s=self.time_s[kept], east_mps=self.east_mps[kept], north_mps=self.north_mps[kept])

    def flow_mps(self, time_s: float, place: Point) -> Flow:
        """The flow at a time and a place."""
        axes, nodes = self._listed
        (at, share), (row, share_y), (column, share_x) = map(_node, axes, (time_s, place[1], place[0]))

        def then(time: int, part: int) -> float:
            south, north = (
                _mixed(
                    nodes[time][one][column][part], nodes[time][one][min(column + 1, len(axes[2]) - 1)][part], share_x
                )
                for one in (row, min(row + 1, len(axes[1]) - 1))
            )
            return _mixed(south, north, share_y)

        after = min(at + 1, len(axes[0]) - 1)
        return _mixed(then(at, 0), then(after, 0), share), _mixed(then(at, 1), then(after, 1), share)

    @cached_property
    def _listed(self) -> tuple[tuple[list[float], ...], list[list[list[list[float]]]]]:
        """Times, rows and columns, and the flow at each: one at a time lists are faster."""
        axes = self.time_s.tolist(), self.y_m.tolist(), self.x_m.tolist()
        return axes, np.stack([self.east_mps, self.north_mps], axis=-1).tolist()

    def flows_mps(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """The flows at places, at each of the times: to the east, then to the north; shape (2, times, ...)."""
        column, share_x = _nodes(self.x_m, x_m)
        row, share_y = _nodes(self.y_m, y_m)
        next_column = np.minimum(column + 1, self.x_m.size - 1)
        south, north = (
            _mixed(self._flows[:, :, one, column], self._flows[:, :, one, next_column], share_x)
            for one in (row, np.minimum(row + 1, self.y_m.size - 1))
        )
        return _mixed(south, north, share_y)

    @cached_property
    def _flows(self) -> FloatArray:
        return np.stack([self.east_mps, self.north_mps])


Value = TypeVar("Value", float, FloatArray)


def _mixed(one: Value, other: Value, share: Value) -> Value:
    """On the way from one to another, of two that are alike exactly the one."""
    return one + share * (other - one)


def _node(axis: list[float], at: float) -> tuple[int, float]:
    """The node before a place on an axis, and how far it is on the way to the next, [0, 1]."""
    if at <= axis[0]:
        return 0, 0.0
    if at >= axis[-1]:
        return len(axis) - 1, 0.0
    before = bisect_right(axis, at) - 1
    return before, (at - axis[before]) / (axis[before + 1] - axis[before])


def _nodes(axis: FloatArray, at: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """The same of many places."""
    if axis.size == 1:
        return np.zeros(np.shape(at), dtype=np.intp), np.zeros(np.shape(at))
    inside = np.minimum(np.maximum(at, axis[0]), axis[-1])
    before = np.minimum(np.searchsorted(axis, inside, side="right") - 1, axis.size - 2)
    return before, (inside - axis[before]) / (axis[before + 1] - axis[before])


@dataclass(frozen=True)
class Current:
    """How the water flows, everywhere alike: at `drift_mps` towards the compass heading `set_rad`.

    With `period_s` it flows to and fro as a sine does, so fast at most; at `slack_s` it turns towards that heading.
    With a `grid` it flows as that tells, at `drift_mps` at most.
    """

    drift_mps: float
    set_rad: float
    period_s: float | None = None
    slack_s: float = 0.0
    grid: FlowGrid | None = None

    def flow_mps(self, time_s: float, place: Point = (0.0, 0.0)) -> Flow:
        """The flow at a time and a place, to the east and to the north."""
        if self.grid is not None:
            return self.grid.flow_mps(time_s, place)
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
    less than that, towards `set_rad`. `tidal`: or the other way, and what is slower counts.

    With a `grid` the water flows as that tells, at `drift_mps` at most; of its times what is slowest counts.
    """

    speed_mps: float
    drift_mps: float = 0.0
    set_rad: float = 0.0
    tidal: bool = False
    grid: FlowGrid | None = None

    @property
    def is_in_still_water(self) -> bool:
        """Whether it makes good what it swims."""
        return self.drift_mps == 0.0

    @property
    def is_known(self) -> bool:
        """Whether what it makes good is known, and not only what is slowest: in still water and where the water always
        flows alike."""
        return not self.tidal and (self.grid is None or self.grid.time_s.size == 1)

    @property
    def slowest_mps(self) -> float:
        """What it makes good right against the stream."""
        return self.speed_mps - self.drift_mps

    def made_good_mps(self, courses_rad: FloatArray, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """The speed over the ground along courses at places, same shape."""
        if self.grid is not None:
            east_mps, north_mps = self.grid.flows_mps(x_m, y_m)
            sin, cos = np.sin(courses_rad), np.cos(courses_rad)
            along_mps, across_mps = east_mps * sin + north_mps * cos, east_mps * cos - north_mps * sin
            slowest_mps: FloatArray = (along_mps + np.sqrt(self.speed_mps**2 - across_mps**2)).min(axis=0)
            return slowest_mps
        from_set_rad = courses_rad - self.set_rad
        along_mps = self.drift_mps * np.cos(from_set_rad)
        across_mps = self.drift_mps * np.sin(from_set_rad)
        if self.tidal:
            along_mps = -np.abs(along_mps)
        made_good_mps: FloatArray = along_mps + np.sqrt(self.speed_mps**2 - across_mps**2)
        return made_good_mps

    def straight_s(self, length_m: float, start: Pose) -> float:
        """How long a straight way takes that begins in a pose."""
        if self.is_in_still_water:
            return length_m / self.speed_mps
        return float(self.straights_s(np.array(length_m), np.array(start, dtype=np.float64)))

    def straights_s(self, lengths_m: FloatArray, starts: FloatArray) -> FloatArray:
        """How long straight ways take that begin in poses, x, y and heading along a last axis of 3; shape without
        it."""
        x_m, y_m, courses_rad = np.moveaxis(starts, -1, 0)
        if self.grid is None:
            took_s: FloatArray = lengths_m / self.made_good_mps(courses_rad, x_m, y_m)
            return took_s
        points, weights = _gauss(STRAIGHT_POINTS)
        x_m, y_m, courses_rad = (one[..., np.newaxis] for one in (x_m, y_m, courses_rad))
        ahead_m = np.asarray(lengths_m)[..., np.newaxis] * points
        x_m, y_m = x_m + ahead_m * np.sin(courses_rad), y_m + ahead_m * np.cos(courses_rad)
        mean_s: FloatArray = (weights / self.made_good_mps(courses_rad, x_m, y_m)).sum(axis=-1)
        return lengths_m * mean_s

    def turns_s(self, radius_m: float, starts: FloatArray, by_rad: FloatArray) -> FloatArray:
        """How long turns of a radius take that begin in poses, as above, by angles, to starboard above 0."""
        points, weights = _gauss(ARC_POINTS)
        x_m, y_m, from_rad = np.moveaxis(starts, -1, 0)[..., np.newaxis]
        beside_m = radius_m * np.sign(by_rad)[..., np.newaxis]
        headings_rad = from_rad + by_rad[..., np.newaxis] * points
        x_m = x_m + beside_m * (np.cos(from_rad) - np.cos(headings_rad))
        y_m = y_m + beside_m * (np.sin(headings_rad) - np.sin(from_rad))
        mps = self.made_good_mps(headings_rad, x_m, y_m)
        took_s: FloatArray = radius_m * np.abs(by_rad) * (weights / mps).sum(axis=-1)
        return took_s

    def path_s(self, path: DubinsPath) -> float:
        """How long a path takes."""
        if self.is_in_still_water:
            return path.length_m / self.speed_mps
        return sum(took_s for _, took_s in self._pieces(path))

    def _pieces(self, path: DubinsPath) -> Iterator[tuple[float, float]]:
        """The turns and straights of a path, where the water flows differently from place to place in pieces: how long
        each is, and how long it takes."""
        heading_rad, done_m = path.start.heading_rad, 0.0
        for turn, length_m in zip(path.turns, path.lengths_m, strict=True):
            count = 1 if self.grid is None else max(1, math.ceil(length_m / KNOT_M))
            for _ in range(count):
                place = path.start[:2] if self.grid is None else path.pose_at(done_m)[:2]
                start, piece_m = Pose(*place, heading_rad), length_m / count
                by_rad = turn * piece_m / path.turn_radius_m
                if turn:
                    yield piece_m, float(self.turns_s(path.turn_radius_m, np.array(start), np.array(by_rad)))
                else:
                    yield piece_m, self.straight_s(piece_m, start)
                heading_rad, done_m = heading_rad + by_rad, done_m + piece_m

    def way_s(self, way: Sequence[DubinsPath]) -> float:
        """How long paths that follow each other take."""
        return sum(self.path_s(path) for path in way)

    def knots(self, paths: Sequence[DubinsPath]) -> tuple[FloatArray, FloatArray]:
        """When a vehicle is how far along paths that follow each other, at the ends of their turns and straights; both
        begin with 0."""
        times_s, lengths_m = [0.0], [0.0]
        for path in paths:
            for length_m, took_s in self._pieces(path):
                times_s.append(times_s[-1] + took_s)
                lengths_m.append(lengths_m[-1] + length_m)
        return np.array(times_s), np.array(lengths_m)

    def passes_s(
        self, passes: Sequence[Pass], turn_radius_m: float, here: Pose | None = None, keep_out: KeepOut = NOWHERE
    ) -> float:
        """How long passes take in their order, with the ways between them, and the way there from a pose, if any."""
        spent_s = 0.0
        for one in passes:
            if here is not None:
                spent_s += self.way_s(way_or_direct(here, one.begin, turn_radius_m, keep_out))
            spent_s += self.straight_s(one.length_m, one.begin)
            here = one.end
        return spent_s


@cache
def _gauss(count: int) -> tuple[FloatArray, FloatArray]:
    """Points within [0, 1] and weights that sum to 1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return (points + 1) / 2, weights / 2
