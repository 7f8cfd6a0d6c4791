"""A side-looking sonar's look: the ground beside a stretch of track, each place seen from abeam."""

from __future__ import annotations

import math

import numpy as np

from planner.types import BoolArray, FloatArray, SonarShape
from sim_world.footprints.swath import Swath


class SideSwath(Swath):
    """The cells lie beside the stretch. Where its P_d is 0, in the nadir gap as elsewhere, is for its curve to say."""

    @staticmethod
    def bins_of(shape: SonarShape, stretch_bins: int, bins_m: tuple[float, float]) -> tuple[int, int]:
        """Range bin 0 is at range 0, the last at or just beyond the farthest range."""
        return stretch_bins, math.ceil(shape.far_m / bins_m[1]) + 1

    def sees(self, along_m: FloatArray, lateral_m: FloatArray) -> BoolArray:
        """All beside the stretch, as far to the sides as its cells reach."""
        return (along_m >= self.first_along_m) & (along_m < self.end_along_m) & (np.abs(lateral_m) <= self.reach_m)

    def seen(self, p_detect: FloatArray) -> FloatArray:
        """All cells are."""
        return p_detect

    def seen_from_m(self, along_m: FloatArray) -> FloatArray:
        """Abeam of each."""
        return along_m

    def range_m(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """The lateral range."""
        return np.abs(lateral_m)

    def bearing_rad(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """Abeam."""
        return self.heading_rad + np.copysign(math.pi / 2, lateral_m)

    def askew(
        self, along_m: FloatArray, lateral_m: FloatArray, crab_rad: float, track_m: float
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Abeam of the bow: on the side from which the stream comes farther ahead, and nowhere as far to the side. Of
        what lies beside the track's ends it passes some before its sonar is on, or after."""
        passed_at_m = along_m + lateral_m * math.tan(crab_rad)
        seen = (passed_at_m >= 0.0) & (passed_at_m <= track_m)
        return np.abs(lateral_m) / math.cos(crab_rad), self.bearing_rad(along_m, lateral_m) + crab_rad, seen

    def area_m2(self, near_m: float, far_m: float) -> float:
        """Both sides together."""
        return 2.0 * (far_m - near_m) * (self.end_along_m - self.first_along_m)

    def scattered(
        self, count: int, near_m: float, far_m: float, generator: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """On either side alike."""
        along_m = generator.uniform(self.first_along_m, self.end_along_m, count)
        sides = generator.choice(np.array([-1.0, 1.0]), count)
        return along_m, sides * generator.uniform(near_m, far_m, count)
