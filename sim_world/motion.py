"""How a vehicle moves: at one speed, along arcs and straights no tighter than its turn radius; in closed form, but
where a current carries it."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

from planner.currents import Current, made_good_mps
from planner.dubins import Pose, along_arc, compass_rad, shifted
from planner.keep_out import NOWHERE, KeepOut
from planner.types import Point
from planner.ways import Way, shortest_way

ROUNDING_MS = 1e-6
"""A time is not rounded up to the next millisecond for as little as this."""
ROUNDING_M = 1e-6
"""Nor is a turn one that is no longer."""
CIRCLE_PARTS = 8
"""At so many places of a circle a vehicle looks for a way off it."""
MOST_DEPARTURES = 60


class NoWayError(Exception):
    """A manoeuvre that cannot be sailed without entering ground to keep out of; `str()` says why."""


@dataclass(frozen=True, slots=True)
class Arc:
    """A leg of one curvature in 1/m, to starboard where that is above 0; 0 for a straight one. `length_m`: infinity for
    a circle without end."""

    start: Pose
    length_m: float
    curvature: float = 0.0

    def pose_at(self, distance_m: float) -> Pose:
        """The pose at a distance from the start."""
        pose = along_arc(self.start, distance_m, distance_m * self.curvature)
        return Pose(pose.x_m, pose.y_m, compass_rad(pose.heading_rad))


def arcs_of(way: Way) -> list[Arc]:
    """The turns and straights of a way."""
    arcs: list[Arc] = []
    for path in way:
        start = path.start
        for turn, length_m in zip(path.turns, path.lengths_m, strict=True):
            if length_m > ROUNDING_M:
                arcs.append(Arc(start, length_m, turn / path.turn_radius_m))
                start = arcs[-1].pose_at(length_m)
    return arcs


class Path:
    """Legs one after the other, begun at `start_ms`; the last one has no end.

    `held_m`: stretches, as distances from the path's start, that are sailed to their end even when a new manoeuvre
    arrives on them.
    """

    def __init__(self, start_ms: int, speed_mps: float, legs: list[Arc], held_m: list[tuple[float, float]]) -> None:
        self.start_ms = start_ms
        self.speed_mps = speed_mps
        self._legs = legs
        self._starts_m = [0.0, *itertools.accumulate(leg.length_m for leg in legs[:-1])]
        self._held_m = held_m

    def distance_at(self, time_ms: int) -> float:
        """How far along the path the vehicle is."""
        return (time_ms - self.start_ms) * self.speed_mps / 1000.0

    def pose_at(self, time_ms: int) -> Pose:
        """The pose at a time from `start_ms`."""
        return self.pose_after(self.distance_at(time_ms))

    def pose_after(self, distance_m: float) -> Pose:
        """The pose at a distance from the start."""
        number = self._leg_at(distance_m)
        return self._legs[number].pose_at(distance_m - self._starts_m[number])

    def curvature_at(self, time_ms: int) -> float:
        """That of the leg the vehicle is on; where it comes from one to the next, of the next."""
        return self._legs[self._leg_at(self.distance_at(time_ms) + ROUNDING_M)].curvature

    def cut(self, from_m: float, to_m: float) -> list[Arc]:
        """The path from one distance to another."""
        arcs: list[Arc] = []
        for start_m, leg in zip(self._starts_m, self._legs, strict=True):
            begin_m, end_m = max(from_m, start_m), min(to_m, start_m + leg.length_m)
            if begin_m < end_m:
                arcs.append(Arc(leg.pose_at(begin_m - start_m), end_m - begin_m, leg.curvature))
        return arcs

    def steady_until_ms(self, from_ms: int, most_ms: int) -> int:
        """Until when, at most until a time after `from_ms`, the vehicle is where it would be if it went on as it does
        at `from_ms`, at one speed and one rate of turn."""
        number = self._leg_at(self.distance_at(from_ms) + ROUNDING_M)
        for start_m, leg in zip(self._starts_m[number + 1 :], self._legs[number + 1 :], strict=True):
            if leg.curvature != self._legs[number].curvature:
                return min(most_ms, max(self.time_ms(start_m), from_ms + 1))
        return most_ms

    def _leg_at(self, distance_m: float) -> int:
        return bisect_right(self._starts_m, distance_m) - 1

    @property
    def circles_from_m(self) -> float:
        """The distance from which on it circles."""
        return self._starts_m[-1]

    def time_ms(self, distance_m: float) -> int:
        """When the vehicle has come so far, rounded up to the millisecond."""
        return self.start_ms + math.ceil(distance_m / self.speed_mps * 1000.0 - ROUNDING_MS)

    def still_held_m(self, time_ms: int) -> float:
        """Length of what is left of the held stretch that the vehicle is on, 0 for none."""
        distance_m = self.distance_at(time_ms)
        left = (end - distance_m for start, end in self._held_m if start - ROUNDING_M <= distance_m < end)
        return max(left, default=0.0)


FAR_STEP, LONGEST_STEP_S = 1e-3, 30.0
"""A step straight ahead may be so much of the way so far, and take so long in still water."""
STEP_OF_RADIUS = 0.1
"""A vehicle that is carried by a current turns by no more a step."""
OFF_M = 1.0
"""So far a vehicle may be from where its course leads by what it has told, before it tells another one,"""
OFTEN_MS = 1_000
"""but for this alone not sooner."""


class CarriedPath(Path):
    """A path in a current: the vehicle swims at `speed_mps`, keeps the path by crabbing, and makes good what the stream
    leaves it. Its way over time is summed up step by step, as far as it is asked for."""

    def __init__(
        self,
        start_ms: int,
        speed_mps: float,
        legs: list[Arc],
        held_m: list[tuple[float, float]],
        current: Current,
        step_m: float,
    ) -> None:
        super().__init__(start_ms, speed_mps, legs, held_m)
        self._current = current
        self._step_m = step_m
        self._along_m, self._times_s = [0.0], [0.0]  # at each step

    def distance_at(self, time_ms: int) -> float:
        """How far along the path the vehicle is."""
        time_s = (time_ms - self.start_ms) / 1000.0
        while self._times_s[-1] <= time_s:
            self._go_on()
        step = bisect_right(self._times_s, time_s) - 1
        since_s, took_s = time_s - self._times_s[step], self._times_s[step + 1] - self._times_s[step]
        return self._along_m[step] + since_s / took_s * (self._along_m[step + 1] - self._along_m[step])

    def time_ms(self, distance_m: float) -> int:
        """When the vehicle has come so far, rounded up to the millisecond."""
        while self._along_m[-1] <= distance_m:
            self._go_on()
        step = bisect_right(self._along_m, distance_m) - 1
        share = (distance_m - self._along_m[step]) / (self._along_m[step + 1] - self._along_m[step])
        time_s = self._times_s[step] + share * (self._times_s[step + 1] - self._times_s[step])
        return self.start_ms + math.ceil(time_s * 1000.0 - ROUNDING_MS)

    def steady_until_ms(self, from_ms: int, most_ms: int) -> int:
        """The same, but for OFF_M that the vehicle may be ahead or behind."""
        most_ms = super().steady_until_ms(from_ms, most_ms)
        from_s, from_m = (from_ms - self.start_ms) / 1000.0, self.distance_at(from_ms)
        speed_mps = self.made_good_mps(from_m, from_s)
        near_ms = from_ms + OFTEN_MS
        for step in itertools.count(bisect_right(self._along_m, from_m)):
            while len(self._times_s) <= step:
                self._go_on()
            time_s = self._times_s[step]
            if abs(self._along_m[step] - from_m - speed_mps * (time_s - from_s)) > OFF_M:
                break
            near_ms = max(near_ms, self.start_ms + math.floor(time_s * 1000.0))
            if near_ms >= most_ms:
                break
        return min(near_ms, most_ms)

    def made_good_mps(self, distance_m: float, time_s: float) -> float:
        """The speed over the ground at a distance from the start, so long after it."""
        pose = self.pose_after(distance_m)
        flow_mps = self._current.flow_mps(self.start_ms / 1000.0 + time_s, pose[:2])
        return made_good_mps(pose.heading_rad, self.speed_mps, flow_mps)

    def _go_on(self) -> None:
        """A step more, at the speed in its middle."""
        distance_m, time_s = self._along_m[-1], self._times_s[-1]
        step_m = max(self._step_m, self._far_step_m(distance_m))
        half_s = step_m / 2 / self.made_good_mps(distance_m, time_s)
        self._along_m.append(distance_m + step_m)
        self._times_s.append(time_s + step_m / self.made_good_mps(distance_m + step_m / 2, time_s + half_s))

    def _far_step_m(self, distance_m: float) -> float:
        """Straight ahead steps become longer with the way before them, so that one of a thousand kilometres is summed
        up as well; they end where the straight does."""
        number = self._leg_at(distance_m + ROUNDING_M)
        left_m = self._starts_m[number] + self._legs[number].length_m - distance_m
        return (
            0.0 if self._legs[number].curvature else min(FAR_STEP * distance_m, LONGEST_STEP_S * self.speed_mps, left_m)
        )


@dataclass(frozen=True)
class FollowedTrack:
    """A track as it is sailed: it starts `start_m` down the path and is `length_m` long."""

    path: Path
    start_m: float
    length_m: float

    def time_ms(self, along_m: float) -> int:
        """When the vehicle is so far down the track, rounded up to the millisecond."""
        return self.path.time_ms(self.start_m + along_m)


class Motion:
    """A vehicle's movement, manoeuvre by manoeuvre.

    It waits at its start pose until the first manoeuvre. After a manoeuvre it loiters: a circle to starboard of the
    turn radius. A new manoeuvre replaces the one under way from the pose of that moment, except that the run-out of a
    track that is done is sailed to its end first, so that the sonar stays straight to the end of the swath. In a
    `current` it keeps its speed through the water; its turns are as wide over the ground. Where it lies it lies.

    Of ground to `keep_out` of all stays clear, and so does the circle at the end of each manoeuvre, which is to port
    where there is no room to starboard. Where no way leads off from where a manoeuvre arrives, the vehicle first sails
    on as it was told before, as far as it must.
    """

    def __init__(
        self,
        start: Pose,
        *,
        speed_mps: float,
        turn_radius_m: float,
        keep_out: KeepOut = NOWHERE,
        current: Current | None = None,
    ) -> None:
        self._keep_out = keep_out
        self._nearest = keep_out.nearer().nearer()
        self._start = start._replace(heading_rad=compass_rad(start.heading_rad))
        self._speed_mps = speed_mps
        self._turn_radius_m = turn_radius_m
        self._current = current
        self._path: Path | None = None

    @property
    def lies(self) -> bool:
        """Whether it does: before the first manoeuvre, and where it was stopped."""
        return self._path is None

    def pose_at(self, time_ms: int) -> Pose:
        """The pose at a time not before the last manoeuvre's start."""
        return self._start if self._path is None else self._path.pose_at(time_ms)

    def place_at(self, time_ms: int) -> Point:
        """Where it is at a time; before the last manoeuvre's start, which is a moment at most, where it was then."""
        pose = self.pose_at(time_ms if self._path is None else max(time_ms, self._path.start_ms))
        return pose.x_m, pose.y_m

    def speed_mps(self, time_ms: int) -> float:
        """The speed over the ground: 0 where it lies."""
        if isinstance(self._path, CarriedPath):
            return self._path.made_good_mps(self._path.distance_at(time_ms), (time_ms - self._path.start_ms) / 1000.0)
        return 0.0 if self._path is None else self._speed_mps

    def curvature_at(self, time_ms: int) -> float:
        """That of its way over the ground in 1/m, to starboard if above 0; 0 where it lies."""
        return 0.0 if self._path is None else self._path.curvature_at(time_ms)

    def steady_until_ms(self, from_ms: int, most_ms: int) -> int:
        """Until when, at most until a time after `from_ms`, it is where it would be if it went on as it does at
        `from_ms`; in a current within OFF_M."""
        return most_ms if self._path is None else self._path.steady_until_ms(from_ms, most_ms)

    def stop(self, now_ms: int) -> None:
        """Lies where it is, until the next manoeuvre."""
        self._start, self._path = self.pose_at(now_ms), None

    def hold(self, now_ms: int) -> None:
        """Loiters from here, or from where there is room for it first.

        Raises:
            NoWayError: there is none.
        """
        for legs, held_m, pose in self._departures(now_ms):
            if self._circling(pose) is not None:
                self._sail(legs, held_m, now_ms)
                return
        raise NoWayError("there is no room to circle beside ground to keep out of")

    def go_to(self, point: Point, heading_rad: float | None, now_ms: int, *, loiters: bool = True) -> int:
        """Goes to a point the shortest way and loiters there.

        Args:
            point: mission frame.
            heading_rad: the heading on arrival; None for the bearing of the point from where the vehicle departs, or
                its heading where it is there already.
            now_ms: when the manoeuvre begins.
            loiters: False where it is stopped there, and needs no room to circle.

        Returns:
            When it arrives.

        Raises:
            NoWayError: no way there stays out of ground to keep out of, or there is no room to circle there.
        """
        for legs, held_m, pose in self._departures(now_ms):
            there = math.dist(pose[:2], point) == 0.0
            bearing = pose.heading_rad if there else bearing_rad(pose[:2], point)
            end = Pose(*point, bearing if heading_rad is None else heading_rad)
            way = self._way(pose, end)
            if way is not None and (not loiters or self._circling(end) is not None):
                legs.extend(arcs_of(way))
                arrival_m = sum(leg.length_m for leg in legs)
                return self._sail(legs, held_m, now_ms).time_ms(arrival_m)
        raise NoWayError("no way there, to circle there, stays out of ground to keep out of")

    def follow(self, start: Point, end: Point, run_in_m: float, now_ms: int) -> FollowedTrack:
        """Sails a straight track, with a straight run of `run_in_m` >= 0 before its start and after its end.

        Args:
            start: the track's start, mission frame.
            end: its end, not the same point.
            run_in_m: length of run-in and run-out.
            now_ms: when the manoeuvre begins.

        Returns:
            When the vehicle is where on the track.

        Raises:
            NoWayError: the track or its runs enter ground to keep out of, or no way there stays out of it.
        """
        heading_rad, length_m = bearing_rad(start, end), math.dist(start, end)
        run_in = shifted(start, heading_rad, -run_in_m)
        whole = Arc(run_in, length_m + 2 * run_in_m)
        if not self._nearest.is_room(run_in, whole.pose_at(whole.length_m), self._turn_radius_m):
            raise NoWayError("the track, with its runs and turns, enters ground to keep out of")
        for legs, held_m, pose in self._departures(now_ms):
            way = self._way(pose, run_in)
            if way is not None:
                legs.extend(arcs_of(way))
                start_m = sum(leg.length_m for leg in legs) + run_in_m
                legs.append(whole)
                held_m.append((start_m + length_m, start_m + length_m + run_in_m))
                return FollowedTrack(self._sail(legs, held_m, now_ms), start_m, length_m)
        raise NoWayError("no way to the track stays out of ground to keep out of")

    def _way(self, start: Pose, end: Pose) -> Way | None:
        """The way that those expect who planned this, or else one that comes nearer to the zones by what they leave for
        rounding."""
        way = shortest_way(start, end, self._turn_radius_m, self._keep_out)
        return shortest_way(start, end, self._turn_radius_m, self._nearest) if way is None else way

    def _circling(self, pose: Pose) -> int | None:
        side = self._keep_out.circling(pose, self._turn_radius_m)
        return self._nearest.circling(pose, self._turn_radius_m) if side is None else side

    def _departures(self, now_ms: int) -> Iterator[tuple[list[Arc], list[tuple[float, float]], Pose]]:
        """What has to be sailed before a new manoeuvre, as legs and held stretches, and the pose it starts from.

        Where there is ground to keep out of: beside the least that has to be, ever more of the way under way.
        """
        pose = self.pose_at(now_ms)
        held_m = 0.0 if self._path is None else self._path.still_held_m(now_ms)
        if held_m == 0.0:
            yield [], [], pose
        else:
            run_out = Arc(pose, held_m)
            yield [run_out], [(0.0, held_m)], run_out.pose_at(held_m)
        if self._keep_out and self._path is not None:
            path, here_m = self._path, self._path.distance_at(now_ms)
            for further_m in _further(here_m + held_m, path.circles_from_m, self._turn_radius_m):
                held = [(0.0, held_m)] if held_m else []
                yield path.cut(here_m, further_m), held, path.pose_after(further_m)

    def _sail(self, legs: list[Arc], held_m: list[tuple[float, float]], now_ms: int) -> Path:
        last = legs[-1].pose_at(legs[-1].length_m) if legs else self.pose_at(now_ms)
        legs = [*legs, Arc(last, math.inf, (self._circling(last) or 1) / self._turn_radius_m)]
        if self._current is None:
            self._path = Path(now_ms, self._speed_mps, legs, held_m)
        else:
            step_m = STEP_OF_RADIUS * self._turn_radius_m
            self._path = CarriedPath(now_ms, self._speed_mps, legs, held_m, self._current, step_m)
        return self._path


def _further(from_m: float, circles_from_m: float, turn_radius_m: float) -> list[float]:
    """Distances along a path at which it may be left: on the way each turn radius, then on the circle at its end."""
    way_m, on_circle = max(0.0, circles_from_m - from_m), math.tau * turn_radius_m / CIRCLE_PARTS
    count = min(math.ceil(way_m / turn_radius_m), MOST_DEPARTURES)
    on_way_m = [from_m + way_m * number / count for number in range(1, count + 1)] if count else []
    begin_m = max(from_m, circles_from_m)
    return [*on_way_m, *(begin_m + on_circle * number for number in range(1, CIRCLE_PARTS + 1))]


def bearing_rad(start: Point, end: Point) -> float:
    """Compass bearing of one point from another, [0, 2 pi)."""
    return compass_rad(math.atan2(end[0] - start[0], end[1] - start[1]))
