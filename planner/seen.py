"""Which cells the sensor model says are seen from tracks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner.types import BoolArray, GridSpec, SweepFrame, Track

ON_EDGE_M = 1e-3
"""A cell whose centre is as near to the edge of what is seen as this is seen."""


def seen_cells(grid: GridSpec, tracks: Iterable[Track], nadir_gap_m: float, range_m: float) -> BoolArray:
    """Cells whose centre lies beside one of the tracks, from `nadir_gap_m` to `range_m` away; shape grid.shape."""
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    seen = np.zeros(grid.shape, dtype=np.bool_)
    for track in tracks:
        across_m, along_m = SweepFrame(*track.start, track.heading_rad).to_sweep(x_m, y_m)
        lateral_m = np.abs(across_m)
        seen |= (
            (lateral_m >= nadir_gap_m - ON_EDGE_M)
            & (lateral_m <= range_m + ON_EDGE_M)
            & (along_m >= -ON_EDGE_M)
            & (along_m <= track.length_m + ON_EDGE_M)
        )
    return seen
