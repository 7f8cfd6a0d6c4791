"""Shortest paths between two poses for a vehicle with a turn radius (L. E. Dubins, 1957).

A shortest path has three stretches, each a turn at full rudder or straight: turn, straight, turn; or three turns to
alternating sides. Closed form after Shkel and Lumelsky, Classification of the Dubins set, 2001.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.rounding import rounded
from planner.types import FloatArray, Point

_FULL_TURN_RAD = 2 * math.pi
_ANGLE_TOLERANCE_RAD = 1e-10
"""A turn that is short of a full one by no more is none: rounding must not add a loop to a path."""
_TOLERANCE = 1e-9
"""In turn radii: what differs by no more is decided by the order of the words, not by rounding."""
_LEAST_HALF_RAD = 1e-20
"""That stands for no turn where it is divided by."""
TIE_M = 0.02
"""So much longer at most may the path be that first turns to port: of two that mirror each other, as to the line it
came along, a pose that is told in centimetres and microradians must not decide, or others expect it on the other side.
"""


class Pose(NamedTuple):
    """A position in the mission frame and a compass heading in radians."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True)
class DubinsPath:
    """A path of three stretches, any of which may have no length.

    `turns` holds for each stretch -1 for a turn to port, +1 for one to starboard, 0 for straight ahead; `lengths_m`
    its length along the path. `turn_radius_m` > 0.
    """

    start: Pose
    turn_radius_m: float
    turns: tuple[int, int, int]
    lengths_m: tuple[float, float, float]

    @property
    def length_m(self) -> float:
        """Length of the whole path."""
        return sum(self.lengths_m)

    def pose_at(self, distance_m: float) -> Pose:
        """The pose at a distance along the path; beyond either end, the pose at that end.

        The heading lies in [0, 2 pi).
        """
        left_m = max(distance_m, 0.0)
        pose = self.start
        for turn, length_m in zip(self.turns, self.lengths_m, strict=True):
            stretch_m = min(left_m, length_m)
            pose = along_arc(pose, stretch_m, turn / self.turn_radius_m * stretch_m)
            left_m -= length_m
            if left_m <= 0:
                break
        return Pose(pose.x_m, pose.y_m, _turn(pose.heading_rad))

    def poses_at(self, distances_m: FloatArray) -> FloatArray:
        """The poses at distances along the path, shape (n,); beyond either end, the pose at that end.

        Returns:
            Shape (n, 3): x_m, y_m and heading_rad, in [0, 2 pi).
        """
        return poses_along([self], distances_m)

    @cached_property
    def _stretch_starts(self) -> tuple[Pose, Pose, Pose]:
        """The pose in which each stretch begins, headings not wrapped."""
        (first_m, second_m, _), (first, second, _), radius_m = self.lengths_m, self.turns, self.turn_radius_m
        begin = along_arc(self.start, first_m, first / radius_m * first_m)
        return self.start, begin, along_arc(begin, second_m, second / radius_m * second_m)


def poses_along(paths: Sequence[DubinsPath], distances_m: FloatArray) -> FloatArray:
    """The same along paths, at least one, that follow each other, as if they were one."""
    starts = np.array([start for path in paths for start in path._stretch_starts])
    lengths_m, curvatures = np.array(
        [(m, turn / one.turn_radius_m) for one in paths for m, turn in zip(one.lengths_m, one.turns, strict=True)]
    ).T
    ends_m = lengths_m.cumsum()
    along_m = np.minimum(np.maximum(distances_m, 0.0), ends_m[-1])
    stretch = ends_m.searchsorted(along_m)
    x_m, y_m, heading_rad = starts.take(stretch, axis=0).T
    length_m = along_m - (ends_m - lengths_m).take(stretch)
    turned_rad = curvatures.take(stretch) * length_m
    # The chord of an arc, and of a straight stretch alike.
    half_rad = turned_rad / 2
    chord_heading_rad = heading_rad + half_rad
    half_rad[half_rad == 0.0] = _LEAST_HALF_RAD
    chord_m = length_m * (np.sin(half_rad) / half_rad)
    poses = np.empty((along_m.size, 3))
    poses[:, 0] = x_m + chord_m * np.sin(chord_heading_rad)
    poses[:, 1] = y_m + chord_m * np.cos(chord_heading_rad)
    poses[:, 2] = _compass(heading_rad + turned_rad)
    return poses


def along_arc(start: Pose, length_m: float, turned_rad: float) -> Pose:
    """The pose after a way of a length on which the heading turns evenly, by `turned_rad` to starboard; 0 for straight
    ahead. The heading is not wrapped."""
    half_rad = turned_rad / 2
    chord_m = length_m if half_rad == 0 else length_m * math.sin(half_rad) / half_rad
    chord_heading_rad = start.heading_rad + half_rad
    return Pose(
        start.x_m + chord_m * math.sin(chord_heading_rad),
        start.y_m + chord_m * math.cos(chord_heading_rad),
        start.heading_rad + turned_rad,
    )


def shifted(point: Point, heading_rad: float, distance_m: float) -> Pose:
    """The pose a distance ahead of a point, negative for behind it."""
    return Pose(
        point[0] + distance_m * math.sin(heading_rad), point[1] + distance_m * math.cos(heading_rad), heading_rad
    )


def compass_rad(angle_rad: float) -> float:
    """An angle as a heading in [0, 2 pi)."""
    heading_rad = angle_rad % (2 * math.pi)
    return 0.0 if heading_rad == 2 * math.pi else heading_rad  # the remainder of a tiny negative angle is a full turn


def shortest_path(start: Pose, end: Pose, turn_radius_m: float, first_turns: Sequence[int] = (-1, 1)) -> DubinsPath:
    """The shortest path from one pose to another for a vehicle that only goes ahead.

    Of two paths equally long, to within TIE_M, the one that first turns to port is taken.

    Args:
        start: where the path begins.
        end: where it ends; any compass headings.
        turn_radius_m: the tightest turn, > 0.
        first_turns: which way it may first turn, -1 for to port and 1 for to starboard.

    Raises:
        ValueError: a number is not finite, or the turn radius not above 0.
    """
    if not (all(map(math.isfinite, (*start, *end, turn_radius_m))) and turn_radius_m > 0):
        raise ValueError(
            f"a path needs finite poses and a turn radius above 0, not {start}, {end} and {turn_radius_m} m"
        )
    dx_m, dy_m = end.x_m - start.x_m, end.y_m - start.y_m
    distance = math.hypot(dx_m, dy_m) / turn_radius_m
    bearing_rad = math.atan2(dx_m, dy_m)
    # Headings against the line from start to end, counted to port.
    alpha, beta = bearing_rad - start.heading_rad, bearing_rad - end.heading_rad
    best, turns, arcs = math.inf, (-1, 0, -1), (0.0, 0.0, 0.0)
    for side in first_turns:
        for total, middle, last, word in _words(distance, -side * alpha, -side * beta):
            if total < best - (_TOLERANCE if side == turns[0] else TIE_M / turn_radius_m):
                best, turns, arcs = total, (side, side * middle, side * last), word
    first, second, third = arcs
    return DubinsPath(
        start, turn_radius_m, turns, (first * turn_radius_m, second * turn_radius_m, third * turn_radius_m)
    )


def path_lengths_m(starts: FloatArray, ends: FloatArray, turn_radius_m: float) -> FloatArray:
    """Lengths of the shortest paths from every start to every end, as `shortest_path` finds them.

    Args:
        starts: shape (n, 3): x_m, y_m, heading_rad; finite.
        ends: shape (m, 3), likewise.
        turn_radius_m: the tightest turn, > 0.

    Returns:
        Shape (n, m).
    """
    return rounded(_lengths_m(np.ascontiguousarray(starts), np.ascontiguousarray(ends), float(turn_radius_m)))


@compiled
def _lengths_m(starts: FloatArray, ends: FloatArray, turn_radius_m: float) -> FloatArray:
    lengths_m = np.empty((len(starts), len(ends)))
    from_here, to_there = in_radii(starts, turn_radius_m), in_radii(ends, turn_radius_m)
    for row in range(len(starts)):
        for column in range(len(ends)):
            lengths_m[row, column] = path_length_m(from_here[row], to_there[column], turn_radius_m)
    return lengths_m


_lengths_m.called_with(lambda: (np.zeros((1, 3)), np.zeros((1, 3)), 1.0))


@compiled
def path_length_m(start: FloatArray, end: FloatArray, turn_radius_m: float) -> float:
    """The same of one path, for compiled functions: from pose to pose as `in_radii` tells them."""
    to_port, to_starboard = _length(start, end, -1.0), _length(start, end, 1.0)
    is_shorter = to_starboard < to_port - TIE_M / turn_radius_m
    return (to_starboard if is_shorter else to_port) * turn_radius_m


@compiled
def in_radii(poses: FloatArray, turn_radius_m: float) -> FloatArray:
    """Of each pose, shape (n, 3), where it is in turn radii, the heading counterclockwise from east, and the compass
    heading's cosine and sine, shape (n, 5)."""
    found = np.empty((len(poses), 5))
    for row in range(len(poses)):
        heading_rad = poses[row, 2]
        found[row, 0], found[row, 1] = poses[row, 0] / turn_radius_m, poses[row, 1] / turn_radius_m
        found[row, 2], found[row, 3], found[row, 4] = (
            math.pi / 2 - heading_rad,
            math.cos(heading_rad),
            math.sin(heading_rad),
        )
    return found


@compiled
def _length(start: FloatArray, end: FloatArray, side: float) -> float:
    """The shortest that begins with a turn to a side, -1 for to port and 1 for to starboard, in turn radii, of poses as
    `in_radii` tells them."""
    x, y, alpha, cos, sin = start[0], start[1], start[2], start[3], start[4]
    end_x, end_y, beta, end_cos, end_sin = end[0], end[1], end[2], end[3], end[4]
    from_x, from_y = x + side * cos, y - side * sin

    # From the centre of the first turn to that of a last turn to the same side.
    x, y = end_x + side * end_cos - from_x, end_y - side * end_sin - from_y
    between = math.sqrt(x * x + y * y)
    if between < _TOLERANCE:
        shortest = _wrapped(-side * (beta - alpha))
    else:
        direction = math.atan2(y, x)
        shortest = _wrapped(-side * (direction - alpha)) + between + _wrapped(-side * (beta - direction))
        if between <= 4:
            middle = _FULL_TURN_RAD - 2 * math.asin(between / 4)
            first = _wrapped(-side * (direction - alpha) + middle / 2)
            shortest = min(shortest, first + middle + _wrapped(-side * (beta - alpha) - first + middle))

    # To that of a last turn to the other side.
    x, y = end_x - side * end_cos - from_x, end_y + side * end_sin - from_y
    straight_squared = x * x + y * y - 4
    if straight_squared >= -_TOLERANCE:
        straight = math.sqrt(max(straight_squared, 0.0))
        lean = -side * math.atan2(y, x) + math.atan2(2.0, straight)
        shortest = min(shortest, _wrapped(lean + side * alpha) + straight + _wrapped(lean + side * beta))
    return shortest


@compiled
def _wrapped(angle_rad: float) -> float:
    """As `_turn`, to the last bit within two full turns either way."""
    wrapped_rad = max(angle_rad - math.floor(angle_rad / _FULL_TURN_RAD) * _FULL_TURN_RAD, 0.0)
    return 0.0 if _FULL_TURN_RAD - wrapped_rad < _ANGLE_TOLERANCE_RAD else wrapped_rad


def _words(distance: float, alpha: float, beta: float) -> Iterator[tuple[float, int, int, tuple[float, float, float]]]:
    """The candidates that begin with a turn to port, for a turn radius of 1.

    The end lies at `distance` along the x axis; `alpha` and `beta` are the headings at start and end, in radians
    counterclockwise from that axis.

    Yields:
        Total length; the second and third stretch's turn (1: as the first one, -1: to the other side, 0: straight);
        the lengths of the three stretches.
    """
    sin_a, cos_a, sin_b, cos_b = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)

    # From the centre of the first turn to that of a last turn to the same side.
    x, y = distance + sin_a - sin_b, cos_b - cos_a
    between = math.hypot(x, y)
    if between < _TOLERANCE:
        first, straight, last = _turn(beta - alpha), 0.0, 0.0
    else:
        direction = math.atan2(y, x)
        first, straight, last = _turn(direction - alpha), between, _turn(beta - direction)
    yield first + straight + last, 0, 1, (first, straight, last)
    if _TOLERANCE <= between <= 4:
        middle = _FULL_TURN_RAD - 2 * math.asin(between / 4)
        first = _turn(direction - alpha + middle / 2)
        last = _turn(beta - alpha - first + middle)
        yield first + middle + last, -1, 1, (first, middle, last)

    # To that of a last turn to the other side.
    x, y = distance + sin_a + sin_b, -cos_a - cos_b
    straight_squared = x * x + y * y - 4
    if straight_squared >= -_TOLERANCE:
        straight = math.sqrt(max(straight_squared, 0.0))
        direction = math.atan2(y, x) + math.atan2(2, straight)
        first, last = _turn(direction - alpha), _turn(direction - beta)
        yield first + straight + last, 0, -1, (first, straight, last)


def _turn(angle_rad: float) -> float:
    """An angle wrapped to [0, 2 pi), just short of a full turn taken as none."""
    angle_rad %= _FULL_TURN_RAD
    return 0.0 if _FULL_TURN_RAD - angle_rad < _ANGLE_TOLERANCE_RAD else angle_rad


def _compass(heading_rad: FloatArray) -> FloatArray:
    """Headings wrapped to [0, 2 pi); the remainder of a tiny negative angle rounds to a full turn."""
    wrapped = heading_rad % _FULL_TURN_RAD
    return np.where(wrapped == _FULL_TURN_RAD, 0.0, wrapped)
