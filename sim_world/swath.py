"""The ground beside a stretch of straight track, cut into the cells of a look."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.types import FloatArray

SIDES = np.array([-1.0, 1.0])[:, None, None]
"""Port, then starboard, as the signs of the lateral range."""


@dataclass(frozen=True)
class Swath:
    """Cells to both sides of a stretch of track, mission frame.

    The track starts at `origin_x_m`, `origin_y_m` and heads along `heading_rad`. The stretch begins `first_along_m`
    down the track and has `bins` along-track bins of `along_bin_m`; each side has `range_bins` cells centred at whole
    multiples of `range_bin_m`. Arrays over the cells have shape (2, bins, range_bins), side 0 being port.
    """

    origin_x_m: float
    origin_y_m: float
    heading_rad: float
    first_along_m: float
    along_bin_m: float
    bins: int
    range_bin_m: float
    range_bins: int

    @property
    def end_along_m(self) -> float:
        """Where the stretch ends, down the track."""
        return self.first_along_m + self.bins * self.along_bin_m

    @property
    def reach_m(self) -> float:
        """Range of the outermost cells' centres."""
        return (self.range_bins - 1) * self.range_bin_m

    @cached_property
    def ranges_m(self) -> FloatArray:
        """Lateral ranges of the cells' centres, shape (range_bins,)."""
        return np.arange(self.range_bins, dtype=np.float64) * self.range_bin_m

    def cell_centres(self) -> tuple[FloatArray, FloatArray]:
        """The x and y of the cells' centres."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        along = (self.first_along_m + (np.arange(self.bins) + 0.5) * self.along_bin_m)[:, None]
        lateral = SIDES * self.ranges_m
        return self.origin_x_m + along * sin + lateral * cos, self.origin_y_m + along * cos - lateral * sin

    def bearings_rad(self, lateral: FloatArray) -> FloatArray:
        """Compass bearings of looks to the side that the sign of `lateral` tells: negative is port."""
        return self.heading_rad + np.copysign(math.pi / 2, lateral)

    def to_track(self, x_m: FloatArray, y_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mission-frame points as (along, lateral) of the track; lateral is negative to port."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        dx, dy = x_m - self.origin_x_m, y_m - self.origin_y_m
        return dx * sin + dy * cos, dx * cos - dy * sin
