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
        return pose._replace(heading_rad=_turn(pose.heading_rad))

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
    # The axes of what follows: turning to port or to starboard first, start, end.
    side = np.array([-1.0, 1.0])[:, np.newaxis, np.newaxis]
    alpha, from_x, from_y = _turning_circles(starts[:, np.newaxis], turn_radius_m, side)
    beta, to_x, to_y = _turning_circles(ends[np.newaxis], turn_radius_m, side)

    # From the centre of the first turn to that of a last turn to the same side.
    x, y = to_x - from_x, to_y - from_y
    between, direction = np.sqrt(x * x + y * y), np.arctan2(y, x)
    apart = between >= _TOLERANCE
    first = _turns(np.where(apart, -side * (direction - alpha), 0.0))
    last = _turns(-side * (beta - np.where(apart, direction, alpha)))
    same = first + np.where(apart, between, 0.0) + last
    near = (apart & (between <= 4)).nonzero()
    if near[0].size:
        way, row, column = near
        near_side = side[way, 0, 0]
        middle = _FULL_TURN_RAD - 2 * np.arcsin(between[near] / 4)
        towards = -near_side * (direction[near] - alpha[row, 0])
        first = _turns(towards + middle / 2)
        last = _turns(-near_side * (beta[0, column] - alpha[row, 0]) - first + middle)
        same[near] = np.minimum(same[near], first + middle + last)

    # To that of a last turn to the other side.
    x, y = to_x[::-1] - from_x, to_y[::-1] - from_y
    straight_squared = x * x + y * y - 4
    straight = np.sqrt(np.maximum(straight_squared, 0.0))
    lean = -side * np.arctan2(y, x) + np.arctan2(2, straight)
    other = _turns(lean + side * alpha) + straight + _turns(lean + side * beta)
    other[straight_squared < -_TOLERANCE] = np.inf
    to_port, to_starboard = np.minimum(same, other)
    shortest = np.where(to_starboard < to_port - TIE_M / turn_radius_m, to_starboard, to_port)
    return rounded(shortest * turn_radius_m)


def _turning_circles(
    poses: FloatArray, turn_radius_m: float, side: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Headings counterclockwise from east, and the centres of the turns to each side, in turn radii."""
    x, y, heading_rad = poses[..., 0] / turn_radius_m, poses[..., 1] / turn_radius_m, poses[..., 2]
    return math.pi / 2 - heading_rad, x + side * np.cos(heading_rad), y - side * np.sin(heading_rad)


def _turns(angles_rad: FloatArray) -> FloatArray:
    """As `_turn`, for arrays; within two full turns either way this is the same to the last bit, and faster."""
    turns = angles_rad / _FULL_TURN_RAD
    np.floor(turns, out=turns)
    turns *= _FULL_TURN_RAD
    wrapped = np.subtract(angles_rad, turns, out=turns)
    np.maximum(wrapped, 0.0, out=wrapped)  # just short of a full turn its share of one may have been rounded up
    np.putmask(wrapped, _FULL_TURN_RAD - wrapped < _ANGLE_TOLERANCE_RAD, 0.0)
    return wrapped


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
