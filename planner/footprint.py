"""Where a look falls on the grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner.types import FloatArray, GridSpec, Point

EDGE_TOLERANCE_M = 1e-3
"""A cell centre this close before a bin's edge counts as on it: positions travel in centimetres, headings in
microradians."""


@dataclass(frozen=True)
class LookGeometry:
    """A look's frame and bins.

    `origin` (mission frame) and `heading_rad` (compass) are the track's; along bin i covers
    `first_along_m + [i, i + 1) * along_bin_m` from the origin; range bin k is centred at `k * range_bin_m` to a side.
    """

    origin: Point
    heading_rad: float
    first_along_m: float
    along_bin_m: float
    range_bin_m: float
    along_bins: int
    range_bins: int


def look_on_grid(grid: GridSpec, geometry: LookGeometry, p_detect: FloatArray) -> tuple[slice, slice, FloatArray]:
    """The window of the grid that a look may touch, and the P_d that each of its cells gets, 0 where it is not seen.

    `p_detect`: shape (2, along_bins, range_bins), port first. A cell is seen if its centre is (paper, section V). A
    centre on the edge between two bins belongs to the one that begins there, which of two range bins is the outer; one
    right under the track belongs to starboard. Of consecutive looks of one track exactly one sees a cell.
    """
    # Rounded, so that one look's end is the next one's begin to the last bit, however each was computed.
    begin_m = round(geometry.first_along_m, 6)
    end_m = round(geometry.first_along_m + geometry.along_bins * geometry.along_bin_m, 6)
    reach_m = (geometry.range_bins - 0.5) * geometry.range_bin_m
    turn_rad = geometry.heading_rad - grid.frame.heading_rad
    sin, cos = math.sin(turn_rad), math.cos(turn_rad)
    origin_across, origin_along = map(float, grid.frame.to_sweep(*geometry.origin))
    corners = [(lateral_m, along_m) for lateral_m in (-reach_m, reach_m) for along_m in (begin_m, end_m)]
    columns = _window([origin_across + u_m * cos + v_m * sin for u_m, v_m in corners], grid.across_m)
    rows = _window([origin_along - u_m * sin + v_m * cos for u_m, v_m in corners], grid.along_m)
    du = (grid.across_m[columns] - origin_across)[np.newaxis, :]
    dv = (grid.along_m[rows] - origin_along)[:, np.newaxis]
    lateral_m = du * cos - dv * sin
    along_m = du * sin + dv * cos + EDGE_TOLERANCE_M
    along_bin = np.floor((along_m - begin_m) / geometry.along_bin_m).astype(np.intp)
    range_bin = np.floor((np.abs(lateral_m) + EDGE_TOLERANCE_M) / geometry.range_bin_m + 0.5).astype(np.intp)
    side = (lateral_m >= -EDGE_TOLERANCE_M).astype(np.intp)
    seen = (along_m >= begin_m) & (along_m < end_m) & (range_bin < geometry.range_bins)
    along_bin = np.minimum(np.maximum(along_bin, 0), geometry.along_bins - 1)  # clip takes longer with whole numbers
    range_bin = np.minimum(range_bin, geometry.range_bins - 1)
    return rows, columns, np.where(seen, p_detect[side, along_bin, range_bin], 0.0)


def _window(corners_m: list[float], centres_m: FloatArray) -> slice:
    """The cells along one axis of the grid with their centres between a look's corners, all in the sweep frame."""
    margin_m = 2 * EDGE_TOLERANCE_M  # one that a bin may begin early, one for rounding
    ends_m = min(corners_m) - margin_m, max(corners_m) + margin_m
    first, behind_last = centres_m.searchsorted(ends_m).tolist()
    return slice(first, behind_last)
