"""The footprint of a side-looking sonar: two lines abeam of the vehicle, beyond a nadir gap."""

from __future__ import annotations

from dataclasses import dataclass, replace

from planner.footprints.footprint import Reach
from planner.types import DetectionCurve, FloatArray, LookGeometry, Point, SonarShape


@dataclass(frozen=True)
class SideLooking:
    """A `Footprint`: it sees each place once, as it passes. Of the shape it knows the nadir gap and the range."""

    shape: SonarShape
    name = "side-looking"
    ahead_m = 0.0
    lead_m = 0.0

    @property
    def reach(self) -> Reach:
        """From the nadir gap to the range."""
        return Reach(self.shape.near_m, self.shape.far_m)

    @property
    def outline(self) -> tuple[tuple[Point, ...], ...]:
        """A line to each side."""
        return tuple(((side * self.shape.near_m, 0.0), (side * self.shape.far_m, 0.0)) for side in (-1, 1))

    @property
    def words(self) -> str:
        """Its range."""
        return f"{self.shape.far_m:g} m a side"

    def told(self, range_m: float) -> SideLooking:
        """The same with another range."""
        return SideLooking(replace(self.shape, far_m=range_m))

    def track_length_m(self, look: LookGeometry) -> float:
        """All of it: a look's bins lie beside its stretch of track."""
        return look.along_bins * look.along_bin_m

    def pass_curve(self, curve: DetectionCurve) -> DetectionCurve:
        """The curve itself: each place has one look."""
        return curve

    def pass_profile(self, look: LookGeometry, p_detect: FloatArray) -> FloatArray:
        """The look itself: each place has one."""
        return p_detect
