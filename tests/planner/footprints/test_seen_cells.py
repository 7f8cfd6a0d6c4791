"""Which cells are seen from tracks, by hand and cell by cell."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.footprints.cells import seen_cells
from planner.footprints.footprint import Reach
from planner.types import GridSpec, SweepFrame, Track

turns = st.floats(0, 6.28)
places = st.tuples(st.floats(-60, 160), st.floats(-60, 160))


def test_by_hand() -> None:
    # Cells of 5 m centred at 0, 5, 10, ... across; the track runs along the third column's centre, from 5 to 15 m.
    grid = GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, 6, 4)
    seen = seen_cells(grid, [Track(1, 10.0, (10.0, 5.0), (10.0, 15.0))], Reach(5.0, 12.0))
    assert seen.astype(int).tolist() == [
        [0, 0, 0, 0, 0, 0],
        [1, 1, 0, 1, 1, 0],
        [1, 1, 0, 1, 1, 0],
        [0, 0, 0, 0, 0, 0],
    ]


@given(places, turns, places, turns, st.floats(1, 150), st.floats(0, 40), st.floats(0.5, 90))
def test_is_what_each_cell_says_for_itself(
    origin: tuple[float, float],
    turn_rad: float,
    start: tuple[float, float],
    heading_rad: float,
    length_m: float,
    gap_m: float,
    side_m: float,
) -> None:
    grid = GridSpec(SweepFrame(*origin, turn_rad), 5.0, 20, 25)
    end = (start[0] + length_m * math.sin(heading_rad), start[1] + length_m * math.cos(heading_rad))
    seen = seen_cells(grid, [Track(1, 0.0, start, end)], Reach(gap_m, gap_m + side_m))
    ahead = np.array([math.sin(heading_rad), math.cos(heading_rad)])
    starboard = np.array([ahead[1], -ahead[0]])
    for row, column in np.ndindex(grid.shape):
        x_m, y_m = grid.frame.to_mission(5.0 * column, 5.0 * row + 2.5)
        from_start_m = np.array([float(x_m), float(y_m)]) - start
        lateral_m, along_m = abs(from_start_m @ starboard), from_start_m @ ahead
        # How far within what is seen it lies; what lies on the edge may be either.
        within_m = min(lateral_m - gap_m, gap_m + side_m - lateral_m, along_m, length_m - along_m)
        assert seen[row, column] or within_m < 0.01
        assert not seen[row, column] or within_m > -0.01
