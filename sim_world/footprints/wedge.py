"""A forward-looking sonar's look: the sector ahead of where a stretch of track begins."""

from __future__ import annotations

import math

import numpy as np

from planner.footprints.wedge import ForwardLooking
from planner.types import BoolArray, FloatArray, SonarShape
from sim_world.footprints.swath import Swath


class WedgeSwath(Swath):
    """The cells lie beside the stretch and ahead of it. The look is made where the stretch begins, and told when it is
    passed."""

    @staticmethod
    def bins_of(shape: SonarShape, stretch_bins: int, bins_m: tuple[float, float]) -> tuple[int, int]:
        """As far as the sector reaches, were it made at the stretch's end; to the sides as far as it is wide."""
        sees = ForwardLooking(shape)
        return stretch_bins + sees.bins_ahead(bins_m[0]), math.ceil(sees.widest_m / bins_m[1]) + 1

    def sees(self, along_m: FloatArray, lateral_m: FloatArray) -> BoolArray:
        """What lies in the sector."""
        return ForwardLooking(self.shape).sees(along_m - self.first_along_m, lateral_m)

    def seen_from_m(self, along_m: FloatArray) -> FloatArray:
        """Where the stretch begins."""
        return np.full_like(along_m, self.first_along_m)

    def range_m(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """The distance over the ground."""
        range_m: FloatArray = np.hypot(along_m - self.first_along_m, lateral_m)
        return range_m

    def bearing_rad(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """Off the bow."""
        return self.heading_rad + np.arctan2(lateral_m, along_m - self.first_along_m)

    def area_m2(self, near_m: float, far_m: float) -> float:
        """The part of the sector that lies in between."""
        return self.shape.half_angle_rad * max(0.0, far_m**2 - max(near_m, self.shape.near_m) ** 2)

    def scattered(
        self, count: int, near_m: float, far_m: float, generator: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """The farther the more, as there is more ground."""
        range_m = np.sqrt(generator.uniform(max(near_m, self.shape.near_m) ** 2, far_m**2, count))
        turn_rad = generator.uniform(-self.shape.half_angle_rad, self.shape.half_angle_rad, count)
        return self.first_along_m + range_m * np.cos(turn_rad), range_m * np.sin(turn_rad)
