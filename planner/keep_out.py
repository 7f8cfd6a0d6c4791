"""Ground that no vehicle may enter, grown by a margin: what stays clear of it, and where one can turn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.dubins import DubinsPath, Pose
from planner.types import BoolArray, FloatArray, Point

TOUCHES_M = 0.05
"""A path may lie so far within the grown zones: it touches their corners."""
CLEARANCE_M = 1.5
"""At least so far off planned ways stay: places travel in whole centimetres, and arcs are judged by chords."""
NEARER_M = 0.25
"""Who is sent may come so much nearer than who sends it, so that nothing is refused for its rounding."""
SAGITTA_M = 0.02
"""So far an arc lies beside the chords by which it is judged."""
MOST_CORNERS = 120
"""Of all grown zones; where there are more they are grown, and their outlines drawn more simply."""
SIMPLER_M = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


@dataclass(frozen=True)
class KeepOut:
    """Zones that no vehicle may enter, and how far all stay off; mission frame, corners in order, not repeated.

    False where there is no zone. Paths are straight lines and turns of a vehicle's radius, anywhere outside.
    """

    zones: tuple[tuple[Point, ...], ...] = ()
    margin_m: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.zones)

    def nearer(self) -> KeepOut:
        """The same for who is told a way that was planned: an agent by the coordinator, a vehicle by its agent."""
        return replace(self, margin_m=max(0.0, self.margin_m - NEARER_M)) if self else self

    @cached_property
    def true_ground(self) -> BaseGeometry:
        """The zones as they are."""
        return shapely.union_all([shapely.Polygon(zone) for zone in self.zones])

    @cached_property
    def ground(self) -> BaseGeometry:
        """The zones grown by the margin, with corners, not arcs."""
        for simpler_m in SIMPLER_M:
            grown = self.true_ground.buffer(self.margin_m + simpler_m, join_style="mitre", mitre_limit=2.0)
            found: BaseGeometry = grown.simplify(simpler_m)
            if shapely.get_num_coordinates(found) <= MOST_CORNERS:
                break
        shapely.prepare(found)
        return found

    @cached_property
    def _lagoons(self) -> list[shapely.Polygon]:
        """What the zones enclose."""
        parts = shapely.get_parts(self.ground)
        return [shapely.Polygon(ring) for part in parts for ring in part.interiors]

    def are_parted(self, one: Point, other: Point) -> bool:
        """Whether the zones enclose one of two places that lie outside of them and not the other: no way joins them."""
        places = shapely.points([one, other])
        return any(len(set(shapely.contains(lagoon, places).tolist())) > 1 for lagoon in self._lagoons)

    @cached_property
    def _closed(self) -> BaseGeometry:
        closed: BaseGeometry = self.ground.buffer(-TOUCHES_M, join_style="mitre")
        shapely.prepare(closed)
        return closed

    def are_clear(self, lines: Sequence[BaseGeometry] | BaseGeometry | np.ndarray) -> BoolArray:
        """Which of some lines or points stay out, shape (n,)."""
        clear: BoolArray = ~shapely.intersects(self._closed, np.asarray(lines, dtype=object))
        return clear

    def is_clear(self, paths: Iterable[DubinsPath]) -> bool:
        """Whether paths stay out."""
        return not self or bool(self.are_clear([as_line(path) for path in paths]).all())

    def circling(self, pose: Pose, turn_radius_m: float) -> int | None:
        """To which side a vehicle at a pose can circle: 1 to starboard, wherever it can, -1 to port, None neither."""
        if not self:
            return 1
        east_m, north_m = turn_radius_m * math.cos(pose.heading_rad), -turn_radius_m * math.sin(pose.heading_rad)
        for side in (1, -1):
            centre = shapely.Point(pose.x_m + side * east_m, pose.y_m + side * north_m)
            if not shapely.dwithin(self._closed, centre, turn_radius_m + SAGITTA_M):
                return side
            if not self._fits_within(turn_radius_m):
                continue
            # What is near may lie within the circle.
            circle = DubinsPath(pose, turn_radius_m, (side, 0, 0), (math.tau * turn_radius_m, 0.0, 0.0))
            if self.is_clear([circle]):
                return side
        return None

    def _fits_within(self, turn_radius_m: float) -> bool:
        """Whether a vehicle may circle about a zone."""
        return bool((self._part_radii_m < turn_radius_m).any())

    @cached_property
    def _part_radii_m(self) -> FloatArray:
        """Of each part of the grown zones, that of the least circle about it."""
        radii_m: FloatArray = shapely.minimum_bounding_radius(shapely.get_parts(self._closed))
        return radii_m

    def is_room(self, begin: Pose, end: Pose, turn_radius_m: float) -> bool:
        """Whether a straight pass stays out, and one can turn before it and behind it."""
        if not self:
            return True
        turns = (self.circling(one, turn_radius_m) is not None for one in (begin, end))
        return bool(self.are_clear([shapely.LineString([begin[:2], end[:2]])]).all()) and all(turns)


NOWHERE = KeepOut()


def as_line(path: DubinsPath) -> BaseGeometry:
    """A path as the chords by which it is judged; a point where it has no length."""
    if path.length_m == 0.0:
        return shapely.Point(path.start[:2])
    if not any(turn and length_m for turn, length_m in zip(path.turns, path.lengths_m, strict=True)):
        return shapely.LineString([path.start[:2], path.pose_at(path.length_m)[:2]])
    step_m = 2 * path.turn_radius_m * math.acos(max(0.5, 1 - SAGITTA_M / path.turn_radius_m))
    at_m, done_m = [0.0], 0.0
    for turn, length_m in zip(path.turns, path.lengths_m, strict=True):
        count = max(1, math.ceil(length_m / step_m)) if turn else 1
        at_m += [done_m + length_m * number / count for number in range(1, count + 1)]
        done_m += length_m
    places: FloatArray = path.poses_at(np.array(at_m))[:, :2]
    return shapely.LineString(places)
