"""The shortest ways past ground to keep out of, for a vehicle with a turn radius.

A way leaves its start on one of the two turns there, goes straight from turn to turn, and comes to its end on one of
the two turns there. The turns between lie at corners of the zones: circles of the turn radius that touch a corner from
within. Of all such ways the shortest is found by a search over the straight lines between circles (a tangent graph);
all of it is held against the zones. Where nothing is in the way it is Dubins's shortest path.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from planner.dubins import TIE_M, DubinsPath, Pose, path_lengths_m, shifted, shortest_path
from planner.keep_out import KeepOut
from planner.types import BoolArray, FloatArray, Point

Way = tuple[DubinsPath, ...]
"""Paths that follow each other."""

STRAIGHT_FIRST = (0.0, 1.0, 2.0, 4.0)
"""Turn radii that a way may go straight on before its first turn, and before its end, where there is no other."""
_LEAST_M = 1e-9
_MOST_RAD = 1.5 * math.pi
"""By less than that a shortest way turns at a corner, even where it comes back past a spit narrower than a turn."""
_FULL_RAD = math.tau


def way_length_m(way: Sequence[DubinsPath]) -> float:
    """Length of a way."""
    return sum(path.length_m for path in way)


def shortest_way(start: Pose, end: Pose, turn_radius_m: float, keep_out: KeepOut) -> Way | None:
    """The shortest way from one pose to another that stays out of the zones; None where none is found.

    Raises:
        ValueError: a number is not finite, or the turn radius not above 0.
    """
    if not keep_out:
        return (shortest_path(start, end, turn_radius_m),)
    return _way_past(start, end, turn_radius_m, keep_out)


def way_or_direct(start: Pose, end: Pose, turn_radius_m: float, keep_out: KeepOut) -> Way:
    """The same; where none is found Dubins's shortest path, for who has to expect something."""
    way = shortest_way(start, end, turn_radius_m, keep_out)
    return (shortest_path(start, end, turn_radius_m),) if way is None else way


@lru_cache(maxsize=20_000)
def _way_past(start: Pose, end: Pose, turn_radius_m: float, keep_out: KeepOut) -> Way | None:
    direct, here, there = shortest_path(start, end, turn_radius_m), start[:2], end[:2]
    if keep_out.is_clear([direct]):
        return (direct,)
    if not keep_out.are_clear(shapely.points([here, there])).all() or keep_out.are_parted(here, there):
        return None
    # Of the paths that first turn to port and to starboard one may stay out where the other, as short, does not.
    to_sides = [shortest_path(start, end, turn_radius_m, (side,)) for side in (-1, 1)]
    least_m = min(path.length_m for path in to_sides)
    for path in to_sides:
        if path != direct and path.length_m <= least_m + TIE_M and keep_out.is_clear([path]):
            return (path,)
    graph = _graph(keep_out, turn_radius_m)
    for first_m, last_m in sorted(
        ((one * turn_radius_m, other * turn_radius_m) for one in STRAIGHT_FIRST for other in STRAIGHT_FIRST), key=sum
    ):
        begin, arrive = shifted(start[:2], start.heading_rad, first_m), shifted(end[:2], end.heading_rad, -last_m)
        lead_in, lead_out = _straight(start, first_m, turn_radius_m), _straight(arrive, last_m, turn_radius_m)
        if keep_out.is_clear([*lead_in, *lead_out]):
            found = graph.way(begin, arrive)
            if found is not None:
                return (*lead_in, *found, *lead_out)
    return None


@dataclass(frozen=True, eq=False)
class _Lines:
    """Straight lines that stay out: `start`, `end`, the circles, by their places, that they join; `heading`: radians
    counterclockwise from east; `length_m`. A circle's place counts its sense of turning, too: `2 * circle` to port,
    one more to starboard."""

    start: np.ndarray
    end: np.ndarray
    heading: FloatArray
    length_m: FloatArray


class _Graph:
    """The circles at the zones' corners and the lines between them."""

    def __init__(self, keep_out: KeepOut, turn_radius_m: float) -> None:
        self._keep_out = keep_out
        self._radius_m = turn_radius_m
        self._is_turn_clear = lru_cache(maxsize=20_000)(self._judged_turn)
        self._centres = _corner_circles(keep_out, turn_radius_m)
        count = len(self._centres)
        every = np.arange(2 * count)
        self._lines = self._joined(self._centres, every, every)
        order = np.argsort(self._lines.start, kind="stable")
        self._from = np.searchsorted(self._lines.start[order], np.arange(2 * count + 1))
        self._order = order

    def way(self, start: Pose, end: Pose) -> Way | None:
        """The shortest way that begins with a turn at the start and ends with one at the end."""
        count = len(self._centres)
        centres = np.vstack([self._centres, _both_sides(start, self._radius_m), _both_sides(end, self._radius_m)])
        corners = np.arange(2 * count)
        # Of the circles of a pose each is turned on in the one sense in which the pose is on it.
        begins = np.array([2 * count, 2 * (count + 1) + 1])
        ends = np.array([2 * (count + 2), 2 * (count + 3) + 1])
        out = self._joined(centres, begins, np.concatenate([corners, ends]))
        into = self._joined(centres, corners, ends)
        return self._search(centres, start, end, out, into, ends)

    def _search(
        self, centres: FloatArray, start: Pose, end: Pose, out: _Lines, into: _Lines, ends: np.ndarray
    ) -> Way | None:
        """By the length so far and the beeline from there (A*). What is searched are lines that end on a circle."""
        radius_m, goal = self._radius_m, end[:2]
        first_rad, last_rad = _math_heading(start), _math_heading(end)
        kinds = (out, self._lines, into)
        into_by = {place: np.flatnonzero(into.start == place) for place in set(into.start.tolist())}
        is_end = set(ends.tolist())
        queue: list[tuple[float, float, tuple[int, int], tuple[int, int] | None]] = []
        came: dict[tuple[int, int], tuple[int, int] | None] = {}

        def push(line: tuple[int, int], before: tuple[int, int] | None, turned_rad: float, so_far_m: float) -> None:
            lines, number = kinds[line[0]], line[1]
            done_m = so_far_m + turned_rad * radius_m + float(lines.length_m[number])
            place, heading = int(lines.end[number]), float(lines.heading[number])
            if place in is_end:
                left_m = _turned(heading, last_rad, place) * radius_m
            else:
                left_m = math.dist(_on_circle(centres, place, heading, radius_m), goal)
            heapq.heappush(queue, (done_m + left_m, done_m, line, before))

        for number in range(out.start.size):
            leaves = int(out.start[number])
            # Of two ways equally long the one that first turns to port is taken, as where nothing is in the way.
            handicap_m = TIE_M if leaves % 2 else 0.0
            push((0, number), None, _turned(first_rad, float(out.heading[number]), leaves), handicap_m)
        while queue:
            _, done_m, line, before = heapq.heappop(queue)
            if line in came:
                continue
            lines, number = kinds[line[0]], line[1]
            leaves, arrives = int(lines.start[number]), int(lines.end[number])
            heading = float(lines.heading[number])
            came_rad = first_rad if before is None else float(kinds[before[0]].heading[before[1]])
            if not self._is_arc_clear(centres, leaves, came_rad, heading):
                continue
            if arrives in is_end:
                if self._is_arc_clear(centres, arrives, heading, last_rad):
                    return self._told(start, (first_rad, last_rad), (*_back(came, before), line), kinds)
                continue
            came[line] = before
            for other in self._leaving(arrives, into_by):
                its = kinds[other[0]]
                turned_rad = _turned(heading, float(its.heading[other[1]]), arrives)
                if other not in came and turned_rad < _MOST_RAD:
                    push(other, line, turned_rad, done_m)
        return None

    def _leaving(self, place: int, into_by: dict[int, np.ndarray]) -> Iterator[tuple[int, int]]:
        yield from ((1, int(number)) for number in self._order[self._from[place] : self._from[place + 1]])
        yield from ((2, int(number)) for number in into_by.get(place, ()))

    def _told(
        self, start: Pose, headings: tuple[float, float], found: Sequence[tuple[int, int]], kinds: Sequence[_Lines]
    ) -> Way:
        """The lines found as paths: a turn and a line each, the last one with a second turn."""
        radius_m, pose, came_rad = self._radius_m, start, headings[0]
        way = []
        for place, (kind, number) in enumerate(found):
            lines = kinds[kind]
            heading, length_m = float(lines.heading[number]), float(lines.length_m[number])
            first, last = int(lines.start[number]), int(lines.end[number])
            is_last = place == len(found) - 1
            last_m = _turned(heading, headings[1], last) * radius_m if is_last else 0.0
            path = DubinsPath(
                pose,
                radius_m,
                (_side(first), 0, _side(last)),
                (_turned(came_rad, heading, first) * radius_m, length_m, last_m),
            )
            way.append(path)
            pose, came_rad = path.pose_at(path.length_m), heading
        return tuple(way)

    def _is_arc_clear(self, centres: FloatArray, place: int, from_rad: float, to_rad: float) -> bool:
        """Whether the turn from one heading to another on a circle stays out."""
        turned_rad = _turned(from_rad, to_rad, place)
        if turned_rad * self._radius_m < _LEAST_M:
            return True
        x_m, y_m = _on_circle(centres, place, from_rad, self._radius_m)
        return self._is_turn_clear(Pose(x_m, y_m, math.pi / 2 - from_rad), _side(place), turned_rad * self._radius_m)

    def _judged_turn(self, pose: Pose, side: int, length_m: float) -> bool:
        return self._keep_out.is_clear([DubinsPath(pose, self._radius_m, (side, 0, 0), (length_m, 0.0, 0.0))])

    def _joined(self, centres: FloatArray, starts: np.ndarray, ends: np.ndarray) -> _Lines:
        """All lines from some circles to others that stay out."""
        start, end = (places.ravel() for places in np.meshgrid(starts, ends, indexing="ij"))
        from_side, to_side = 2 * (start % 2) - 1, 2 * (end % 2) - 1
        x_m, y_m = (centres[end // 2] - centres[start // 2]).T
        apart_m, crossing = np.hypot(x_m, y_m), from_side != to_side
        may = np.where(crossing, apart_m >= 2 * self._radius_m, apart_m > _LEAST_M)
        start, end, x_m, y_m = start[may], end[may], x_m[may], y_m[may]
        apart_m, crossing, from_side, to_side = apart_m[may], crossing[may], from_side[may], to_side[may]
        across_m = np.where(crossing, 2 * self._radius_m, 0.0)
        heading = np.arctan2(y_m, x_m) - from_side * np.arcsin(across_m / apart_m)
        length_m = np.sqrt(apart_m**2 - across_m**2)
        normal = np.column_stack([-np.sin(heading), np.cos(heading)]) * self._radius_m
        begin = centres[start // 2] + from_side[:, np.newaxis] * normal
        stop = centres[end // 2] + to_side[:, np.newaxis] * normal
        clear = self._keep_out.are_clear(shapely.linestrings(np.stack([begin, stop], axis=1)))
        return _Lines(start[clear], end[clear], heading[clear], length_m[clear])


@lru_cache(maxsize=64)
def _graph(keep_out: KeepOut, turn_radius_m: float) -> _Graph:
    return _Graph(keep_out, turn_radius_m)


def _corner_circles(keep_out: KeepOut, turn_radius_m: float) -> FloatArray:
    """The centres of circles that touch the corners that a way can turn round, from within; shape (n, 2)."""
    corners, outward = _corners(keep_out)
    return corners - turn_radius_m * outward


def _corners(keep_out: KeepOut) -> tuple[FloatArray, FloatArray]:
    """The corners of the grown zones that point outward, and in which direction; shape (n, 2) each."""
    found, directions = [np.empty((0, 2))], [np.empty((0, 2))]
    for polygon in shapely.get_parts(shapely.orient_polygons(keep_out.ground)):
        for ring in (polygon.exterior, *polygon.interiors):
            corners = np.array(ring.coords[:-1])
            to_it, from_it = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
            outward = to_it[:, 0] * from_it[:, 1] - to_it[:, 1] * from_it[:, 0] > 0
            to_it /= np.hypot(*to_it.T)[:, np.newaxis]
            from_it /= np.hypot(*from_it.T)[:, np.newaxis]
            bisector = to_it - from_it
            length = np.hypot(*bisector.T)
            outward &= length > _LEAST_M
            found.append(corners[outward])
            directions.append(bisector[outward] / length[outward, np.newaxis])
    return np.concatenate(found), np.concatenate(directions)


def _both_sides(pose: Pose, turn_radius_m: float) -> FloatArray:
    """The centres of the turns to port and to starboard."""
    sin, cos = math.sin(pose.heading_rad), math.cos(pose.heading_rad)
    beside = np.array([[-cos, sin], [cos, -sin]]) * turn_radius_m
    return np.array(pose[:2]) + beside


def _side(place: int) -> int:
    return 2 * (place % 2) - 1


def _on_circle(centres: FloatArray, place: int, heading: float, radius_m: float) -> Point:
    """Where one is on a circle with a heading counterclockwise from east."""
    x_m, y_m = centres[place // 2].tolist()
    side_m = _side(place) * radius_m
    return x_m - side_m * math.sin(heading), y_m + side_m * math.cos(heading)


def _turned(from_rad: float, to_rad: float, place: int) -> float:
    """By how much one turns on a circle from one heading to another, [0, 2 pi); just short of all the way is none."""
    turned = (_side(place) * (from_rad - to_rad)) % _FULL_RAD
    return 0.0 if _FULL_RAD - turned < _LEAST_M else turned


def _math_heading(pose: Pose) -> float:
    return math.pi / 2 - pose.heading_rad


def _back(
    came: dict[tuple[int, int], tuple[int, int] | None], last: tuple[int, int] | None
) -> tuple[tuple[int, int], ...]:
    found = []
    while last is not None:
        found.append(last)
        last = came[last]
    return tuple(reversed(found))


def _straight(pose: Pose, length_m: float, turn_radius_m: float) -> Way:
    return (DubinsPath(pose, turn_radius_m, (0, 0, 0), (length_m, 0.0, 0.0)),) if length_m else ()


def way_lengths_m(starts: FloatArray, ends: FloatArray, turn_radius_m: float, keep_out: KeepOut) -> FloatArray:
    """About how long the ways are from every start to every end, as `planner.dubins.path_lengths_m` tells it without
    zones: where one lies on the beeline, the way from corner to corner and what turns add to the beeline.

    Infinite where no such way is found. Shapes as there.
    """
    lengths_m = path_lengths_m(starts, ends, turn_radius_m)
    if not keep_out or not lengths_m.size:
        return lengths_m
    row, column = (places.ravel() for places in np.indices(lengths_m.shape))
    beelines = np.stack([starts[row, :2], ends[column, :2]], axis=1)
    blocked: BoolArray = np.logical_not(keep_out.are_clear(shapely.linestrings(beelines))).reshape(lengths_m.shape)
    if not blocked.any():
        return lengths_m
    rows, columns = np.flatnonzero(blocked.any(axis=1)), np.flatnonzero(blocked.any(axis=0))
    corners, between_m = _between_corners(keep_out)
    to_m, from_m = _seen_from(starts[rows], corners, keep_out), _seen_from(ends[columns], corners, keep_out)
    round_m = np.full((rows.size, columns.size), np.inf)
    by_corner_m = np.array([(one + between_m.T).min(axis=1) for one in to_m])
    for place, one in enumerate(from_m):
        round_m[:, place] = (by_corner_m + one).min(axis=1)
    beeline_m = np.hypot(*(starts[rows, np.newaxis, :2] - ends[np.newaxis, columns, :2]).transpose(2, 0, 1))
    some = np.ix_(rows, columns)
    lengths_m[some] = np.where(blocked[some], lengths_m[some] - beeline_m + round_m, lengths_m[some])
    return lengths_m


@lru_cache(maxsize=8)
def _between_corners(keep_out: KeepOut) -> tuple[FloatArray, FloatArray]:
    """The corners that ways turn round, shape (n, 2), and how far it is from each to each past the zones, (n, n)."""
    corners, _ = _corners(keep_out)
    between_m = _seen_from(corners, corners, keep_out)
    for middle in range(len(corners)):
        between_m = np.minimum(between_m, between_m[:, middle, np.newaxis] + between_m[middle])
    return corners, between_m


def _seen_from(poses: FloatArray, corners: FloatArray, keep_out: KeepOut) -> FloatArray:
    """How far it is straight from each place to each corner, infinite where a zone lies between; shape (n, corners)."""
    here, there = np.repeat(poses[:, :2], len(corners), axis=0), np.tile(corners, (len(poses), 1))
    clear: BoolArray = keep_out.are_clear(shapely.linestrings(np.stack([here, there], axis=1)))
    return np.where(clear, np.hypot(*(here - there).T), np.inf).reshape(len(poses), len(corners))
