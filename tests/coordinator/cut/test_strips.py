"""Strips as they are cut: how wide, how long and where they lie."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from coordinator.cut.strips import Cut, CuttingRules, cells_wide, strip_of
from coordinator.cut.window import Window
from planner.types import GridSpec, SweepFrame

EAST = SweepFrame(0, 0, 0)
GRID = GridSpec(EAST, 5, 40, 60)  # 200 m across, 300 m along
RULES = CuttingRules(swath_m=50, overhead_m=40, min_strip_m=30, max_strip_m=400)


class TestLengthsAndWidths:
    @pytest.mark.parametrize(
        ("cell_m", "swath_m", "wide"), [(5, 50, 10), (5, 54.9, 10), (5, 49.9, 9), (5, 4, 1), (0.1, 0.7, 7), (3, 2.9, 1)]
    )
    def test_a_swath_is_as_wide_as_the_whole_cells_in_it_but_for_rounding(
        self, cell_m: float, swath_m: float, wide: int
    ) -> None:
        assert cells_wide(GridSpec(EAST, cell_m, 40, 60), swath_m) == wide

    def test_metres_are_flown_for_a_strip_and_the_way_to_it(self) -> None:
        assert RULES.metres_flown(150) == 190

    @pytest.mark.parametrize(("heading_deg", "across_deg"), [(0, 90), (30, 120), (269, 359), (271, 1), (359, 89)])
    def test_across_the_tracks_it_is_headed_to_starboard_of_them(self, heading_deg: float, across_deg: float) -> None:
        grid = replace(GRID, frame=SweepFrame(1000, -500, math.radians(heading_deg)))
        assert math.degrees(strip_of(grid, Window(10, 40, 12, 22, across=True), 1).heading_rad) == pytest.approx(
            across_deg
        )
        assert math.degrees(strip_of(grid, Window(10, 40, 12, 22), 1).heading_rad) == pytest.approx(heading_deg)


class TestStripOf:
    def test_on_a_grid_that_points_north(self) -> None:
        strip = Cut(Window(10, 40, 12, 22), 1.0, 1.0).strip(GRID, 7)
        # Columns 12 to 21 are centred at 60 to 105 m; rows 10 to 39 lie from 50 to 200 m.
        assert (strip.number, strip.start, strip.end) == (7, (82.5, 50), (82.5, 200))
        assert (strip.length_m, strip.width_m, strip.heading_rad) == (150, 50, 0)

    def test_across_the_rows(self) -> None:
        strip = strip_of(GRID, Window(10, 20, 12, 32, across=True), 7)
        # Columns 12 to 31 reach from 57.5 to 157.5 m, rows 10 to 19 from 50 to 100 m.
        assert strip.start == pytest.approx((57.5, 75))
        assert strip.end == pytest.approx((157.5, 75))
        assert (strip.length_m, strip.width_m) == (100, 50)

    @pytest.mark.parametrize("heading_deg", [30, 90, 200, 359])
    @pytest.mark.parametrize("across", [False, True])
    def test_on_a_rotated_grid_it_holds_the_centres_of_its_cells_and_no_others(
        self, heading_deg: float, across: bool
    ) -> None:
        grid = replace(GRID, frame=SweepFrame(1000, -500, math.radians(heading_deg)))
        window = Window(10, 40, 12, 22, across)
        strip = strip_of(grid, window, 1)
        x_m, y_m = grid.frame.to_mission(*np.meshgrid(grid.across_m, grid.along_m))
        across_m, along_m = SweepFrame(*strip.start, strip.heading_rad).to_sweep(x_m, y_m)
        within = (np.abs(across_m) < strip.width_m / 2) & (along_m > 0) & (along_m < strip.length_m)
        expected = np.zeros(grid.shape, dtype=np.bool_)
        expected[window.cells] = True
        assert (within == expected).all()
