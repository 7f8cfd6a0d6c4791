"""The targets on the seabed, and which of them a look passes over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comms.node import random_stream
from comms.said.messages import TruthTarget, TruthTargets
from planner.types import FloatArray, Point
from sim_world.area import uniform_points
from sim_world.swath import Swath


@dataclass(frozen=True, eq=False)
class Passed:
    """Targets beside a stretch of track: their numbers, ascending, and where they lie in the track's own frame.

    All arrays have shape (n,); `lateral_m` is negative to port.
    """

    numbers: NDArray[np.intp]
    along_m: FloatArray
    lateral_m: FloatArray
    x_m: FloatArray
    y_m: FloatArray


class Targets:
    """All targets of a world, uniformly distributed over its area without the holes; their true positions."""

    def __init__(
        self, area: tuple[Point, ...], count: int, seed: int, holes: tuple[tuple[Point, ...], ...] = ()
    ) -> None:
        points = uniform_points(area, count, random_stream(seed, "world", "targets"), holes)
        self._x_m, self._y_m = points[:, 0], points[:, 1]

    def truth(self) -> TruthTargets:
        """The targets as they are published."""
        pairs = zip(self._x_m.tolist(), self._y_m.tolist(), strict=True)
        return TruthTargets(tuple(TruthTarget(x_m, y_m) for x_m, y_m in pairs))

    def passed(self, swath: Swath) -> Passed:
        """The targets within the stretch of track that a swath covers, as far to the sides as it reaches."""
        along_m, lateral_m = swath.to_track(self._x_m, self._y_m)
        within = (along_m >= swath.first_along_m) & (along_m < swath.end_along_m) & (np.abs(lateral_m) <= swath.reach_m)
        numbers = within.nonzero()[0]
        return Passed(numbers, along_m[numbers], lateral_m[numbers], self._x_m[numbers], self._y_m[numbers])
