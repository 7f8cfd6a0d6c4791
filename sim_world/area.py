"""The ground of a world, in which its targets and patches lie, and points that are drawn in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.types import BoolArray, FloatArray, Point

MOST_BATCHES = 1000


@dataclass(frozen=True)
class Ground:
    """What lies inside an outline and outside its holes, mission frame; holes may overlap, and reach beyond it."""

    outline: tuple[Point, ...]
    holes: tuple[tuple[Point, ...], ...] = ()

    @cached_property
    def polygon(self) -> BaseGeometry:
        """The same for geometry."""
        return shapely.Polygon(self.outline).difference(shapely.union_all([shapely.Polygon(one) for one in self.holes]))

    def holds(self, points: FloatArray) -> BoolArray:
        """Which of some points, shape (n, 2), lie in it."""
        inside = _inside(np.asarray(self.outline, dtype=np.float64), points)
        for hole in self.holes:
            inside &= ~_inside(np.asarray(hole, dtype=np.float64), points)
        return inside

    def points(self, count: int, draw: Callable[[int], FloatArray]) -> FloatArray:
        """The first `count` of those points that `draw` gives and that lie in it, shape (count, 2). `draw` is told how
        many to give at once.

        Raises:
            ValueError: the outline encloses too little of what is drawn for points to be found.
        """
        found = np.empty((0, 2))
        for _ in range(MOST_BATCHES):
            if len(found) >= count:
                return found[:count]
            candidates = draw(max(64, 2 * count))
            found = np.concatenate([found, candidates[self.holds(candidates)]])
        raise ValueError("the area's outline encloses next to nothing")

    def uniform_points(self, count: int, generator: np.random.Generator) -> FloatArray:
        """`count` points in it, uniformly distributed, shape (count, 2); raises as `points`."""
        corners = np.asarray(self.outline, dtype=np.float64)
        low, high = corners.min(axis=0), corners.max(axis=0)
        return self.points(count, lambda batch: generator.uniform(low, high, size=(batch, 2)))


def _inside(corners: FloatArray, points: FloatArray) -> BoolArray:
    # Even-odd rule: a ray to the east of an inner point crosses the outline an odd number of times.
    x, y = points[:, 0], points[:, 1]
    inside = np.zeros(len(points), dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            inside ^= crosses & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
    return inside
