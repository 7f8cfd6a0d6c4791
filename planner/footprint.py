"""Where a look falls on the grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner.types import FloatArray, GridSpec, Point, SweepFrame

# Positions travel in centimetres, headings in microradians: a cell centre this close to a bin's edge counts as on it.
EDGE_TOLERANCE_M = 1e-3


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

    `p_detect`: shape (2, along_bins, range_bins), port first. A cell is seen if its centre is (paper, section V); a
    centre right under the track belongs to starboard. Consecutive looks of one track never see a cell twice.
    """
    track = SweepFrame(*geometry.origin, geometry.heading_rad)
    length_m = geometry.along_bins * geometry.along_bin_m
    reach_m = (geometry.range_bins - 0.5) * geometry.range_bin_m
    along_ends = np.array([geometry.first_along_m, geometry.first_along_m + length_m])
    corners = track.to_mission(np.array([-reach_m, reach_m, -reach_m, reach_m]), np.repeat(along_ends, 2))
    across, along = grid.frame.to_sweep(*corners)
    columns = _window(across / grid.cell_m, grid.columns)
    rows = _window(along / grid.cell_m - 0.5, grid.rows)
    turn_rad = geometry.heading_rad - grid.frame.heading_rad
    origin_across, origin_along = grid.frame.to_sweep(*geometry.origin)
    du = (grid.across_m[columns] - origin_across)[np.newaxis, :]
    dv = (grid.along_m[rows] - origin_along)[:, np.newaxis]
    sin, cos = math.sin(turn_rad), math.cos(turn_rad)
    lateral_m = du * cos - dv * sin
    along_m = du * sin + dv * cos - geometry.first_along_m
    along_bin = np.floor((along_m + EDGE_TOLERANCE_M) / geometry.along_bin_m).astype(np.intp)
    range_bin = np.rint(np.abs(lateral_m) / geometry.range_bin_m).astype(np.intp)
    side = (lateral_m >= -EDGE_TOLERANCE_M).astype(np.intp)
    seen = (along_bin >= 0) & (along_bin < geometry.along_bins) & (range_bin < geometry.range_bins)
    np.clip(along_bin, 0, geometry.along_bins - 1, out=along_bin)
    np.minimum(range_bin, geometry.range_bins - 1, out=range_bin)
    return rows, columns, np.where(seen, p_detect[side, along_bin, range_bin], 0.0)


def _window(cells: FloatArray, count: int) -> slice:
    first = min(max(math.floor(float(cells.min()) - 0.5), 0), count)
    last = min(max(math.ceil(float(cells.max()) + 0.5) + 1, first), count)
    return slice(first, last)
