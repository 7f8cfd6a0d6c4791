"""The footprint of a forward-looking sonar: a sector ahead of the vehicle, seen again and again as it draws nearer."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.footprints.footprint import Reach
from planner.risk import HIGHEST_P_DETECT
from planner.types import BoolArray, DetectionCurve, FloatArray, LookGeometry, Point, SonarShape

OUTLINE_STEPS = 16
PASS_RANGES = 161
PASS_PLACES = 32
TOLERANCE = 1e-9


@dataclass(frozen=True)
class ForwardLooking:
    """A `Footprint`: one look is made where each stretch of `look_m` begins, of what lies from `near_m` to `far_m` away
    and within `half_angle_rad` of the bow. All of the shape counts; `far_m` > `near_m` + `look_m`.

    Its swath is as wide as a rectangle of the length of a stretch that fits into the sector: then the rectangles of
    one look after the other leave no gap. They begin `lead_m` ahead of the vehicle.
    """

    shape: SonarShape
    name = "forward-looking"

    @property
    def reach(self) -> Reach:
        """Half the width of the rectangle, whose corners lie on the far arc; the near ones on the sector's edges, or
        else as far ahead as the near arc."""
        shape, sin, cos = self.shape, math.sin(self.shape.half_angle_rad), math.cos(self.shape.half_angle_rad)
        to_edges_m = sin * (math.sqrt(shape.far_m**2 - (shape.look_m * sin) ** 2) - shape.look_m * cos)
        return Reach(0.0, min(to_edges_m, math.sqrt(shape.far_m**2 - (shape.near_m + shape.look_m) ** 2)))

    @property
    def widest_m(self) -> float:
        """Where the edges of the sector meet the far arc."""
        return self.shape.far_m * math.sin(self.shape.half_angle_rad)

    @property
    def ahead_m(self) -> float:
        """The farthest range."""
        return self.shape.far_m

    @property
    def lead_m(self) -> float:
        """To where the rectangle begins."""
        return self._lead_m(self.reach.far_m)

    def _lead_m(self, range_m: float) -> float:
        return max(self.shape.near_m, range_m / math.tan(self.shape.half_angle_rad))

    @property
    def outline(self) -> tuple[tuple[Point, ...], ...]:
        """The sector, closed."""
        turns = np.linspace(-1.0, 1.0, OUTLINE_STEPS + 1) * self.shape.half_angle_rad
        near = [(self.shape.near_m * math.sin(turn), self.shape.near_m * math.cos(turn)) for turn in turns]
        far = [(self.shape.far_m * math.sin(turn), self.shape.far_m * math.cos(turn)) for turn in turns[::-1]]
        return ((*near, *far, near[0]),)

    @property
    def words(self) -> str:
        """Range and opening."""
        return f"{self.shape.far_m:g} m ahead, {math.degrees(self.shape.half_angle_rad):.4g}° to a side"

    def told(self, range_m: float) -> ForwardLooking:
        """The same with the range at which the corners lie where they should."""
        far_m = math.hypot(self._lead_m(range_m) + self.shape.look_m, range_m)
        return ForwardLooking(replace(self.shape, far_m=far_m))

    def bins_ahead(self, along_bin_m: float) -> int:
        """By how many along-track bins a look reaches beyond its stretch of track."""
        return math.ceil(round(self.shape.far_m, 2) / along_bin_m - TOLERANCE)

    def track_length_m(self, look: LookGeometry) -> float:
        """What the bins are more than the sonar sees ahead; 0 of a look that has fewer, as none of this sonar has."""
        return max(0, look.along_bins - self.bins_ahead(look.along_bin_m)) * look.along_bin_m

    def sees(self, ahead_m: FloatArray, lateral_m: FloatArray) -> BoolArray:
        """Which places lie in the sector, by how far they lie ahead of the vehicle and to its side."""
        range_m, turn_rad = np.hypot(ahead_m, lateral_m), np.abs(np.arctan2(lateral_m, ahead_m))
        within = (range_m >= self.shape.near_m) & (range_m <= self.shape.far_m)
        seen: BoolArray = within & (turn_rad <= self.shape.half_angle_rad + TOLERANCE)
        return seen

    def pass_curve(self, curve: DetectionCurve) -> DetectionCurve:
        """Of the looks that a place gets one stretch after the other, the mean over where in a stretch it lies."""
        lateral_m = np.linspace(0.0, self.widest_m, PASS_RANGES)[:, np.newaxis, np.newaxis]
        places_m = (np.arange(PASS_PLACES)[:, np.newaxis] + 0.5) / PASS_PLACES * self.shape.look_m
        ahead_m = places_m + np.arange(math.ceil(self.shape.far_m / self.shape.look_m)) * self.shape.look_m
        p_detect = curve.at(np.hypot(ahead_m, lateral_m)) * self.sees(ahead_m, lateral_m)
        return DetectionCurve(lateral_m[:, 0, 0], _together(p_detect, axis=2).mean(axis=1))

    def pass_profile(self, look: LookGeometry, p_detect: FloatArray) -> FloatArray:
        """One for each place of a stretch: what one look sees there now it has seen, and will see, of places as far
        before and behind in other stretches."""
        places = max(1, round(self.shape.look_m / look.along_bin_m))
        stretches = math.ceil(look.along_bins / places)
        whole = np.zeros((2, stretches * places, look.range_bins))
        whole[:, : look.along_bins] = p_detect
        return _together(whole.reshape(2, stretches, places, look.range_bins), axis=1)


def _together(p_detect: FloatArray, axis: int) -> FloatArray:
    """P_d of all looks along an axis together, which are independent of each other (equation 2 of the paper)."""
    together: FloatArray = np.minimum(-np.expm1(np.log1p(-p_detect).sum(axis=axis)), HIGHEST_P_DETECT)
    return together
