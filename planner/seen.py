"""Which cells the sensor model says are seen from tracks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner.types import BoolArray, FloatArray, GridSpec, SweepFrame, Track

ON_EDGE_M = 1e-3
"""A cell whose centre is as near to the edge of what is seen as this is seen."""


def seen_cells(grid: GridSpec, tracks: Iterable[Track], nadir_gap_m: float, range_m: float) -> BoolArray:
    """Cells whose centre lies beside one of the tracks, from `nadir_gap_m` to `range_m` away; shape grid.shape."""
    seen = np.zeros(grid.shape, dtype=np.bool_)
    for track in tracks:
        frame = SweepFrame(*track.start, track.heading_rad)
        reach_m, ends_m = range_m + ON_EDGE_M, (-ON_EDGE_M, track.length_m + ON_EDGE_M)
        corners_m = grid.frame.to_sweep(*frame.to_mission(np.array([-reach_m, reach_m] * 2), np.repeat(ends_m, 2)))
        columns, rows = (_between(*axis) for axis in zip((grid.across_m, grid.along_m), corners_m, strict=True))
        centres_m = grid.frame.to_mission(grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis])
        across_m, along_m = frame.to_sweep(*centres_m)
        lateral_m = np.abs(across_m)
        seen[rows, columns] |= (
            (lateral_m >= nadir_gap_m - ON_EDGE_M)
            & (lateral_m <= reach_m)
            & (along_m >= ends_m[0])
            & (along_m <= ends_m[1])
        )
    return seen


def _between(centres_m: FloatArray, corners_m: FloatArray) -> slice:
    """Those along one axis that lie among the corners, and one more on either side."""
    first, behind_last = np.searchsorted(centres_m, (corners_m.min(), corners_m.max())).tolist()
    return slice(max(first - 1, 0), behind_last + 1)
