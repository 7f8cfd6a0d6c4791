"""Points drawn uniformly inside an outline."""

from __future__ import annotations

import numpy as np

from planner.types import BoolArray, FloatArray, Point

MOST_BATCHES = 1000


def uniform_points(
    outline: tuple[Point, ...],
    count: int,
    generator: np.random.Generator,
    holes: tuple[tuple[Point, ...], ...] = (),
) -> FloatArray:
    """`count` points inside an outline and outside its holes, uniformly distributed, mission frame, shape (count, 2).

    Raises:
        ValueError: the outline encloses too little of its bounding box for points to be found.
    """
    corners = np.asarray(outline, dtype=np.float64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    found = np.empty((0, 2))
    for _ in range(MOST_BATCHES):
        if len(found) >= count:
            return found[:count]
        candidates = generator.uniform(low, high, size=(max(64, 2 * count), 2))
        inside = _inside(corners, candidates)
        for hole in holes:
            inside &= ~_inside(np.asarray(hole, dtype=np.float64), candidates)
        found = np.concatenate([found, candidates[inside]])
    raise ValueError("the area's outline encloses next to nothing")


def _inside(corners: FloatArray, points: FloatArray) -> BoolArray:
    # Even-odd rule: a ray to the east of an inner point crosses the outline an odd number of times.
    x, y = points[:, 0], points[:, 1]
    inside = np.zeros(len(points), dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            inside ^= crosses & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
    return inside
