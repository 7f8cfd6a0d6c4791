"""Where looks fall on the grid: by hand, and bin by bin."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import example, given
from hypothesis import strategies as st

from planner.footprints.cells import EDGE_TOLERANCE_M, _seen_by, look_on_grid, over_cells
from planner.risk import HIGHEST_P_DETECT
from planner.types import FloatArray, GridSpec, LookGeometry, SweepFrame

NORTH, EAST, SOUTH, WEST = (k * math.pi / 2 for k in range(4))
AXIS_HEADINGS = st.sampled_from([NORTH, EAST, SOUTH, WEST])
HEADINGS = AXIS_HEADINGS | st.floats(-7, 7)
PLACES_MM = st.integers(-10, 30).map(lambda n: n * 2500) | st.integers(-20_000, 80_000)


def look_at(
    origin: tuple[float, float], heading_rad: float, bins_m: tuple[float, float], bins: tuple[int, int]
) -> LookGeometry:
    """A look that begins at its track's start."""
    return LookGeometry(origin, heading_rad, 0, *bins_m, *bins)


def on_whole_grid(grid: GridSpec, geometry: LookGeometry, p_detect: FloatArray) -> FloatArray:
    rows, columns, on_cells = look_on_grid(grid, geometry, p_detect)
    whole = np.zeros(grid.shape)
    whole[rows, columns] = on_cells
    return whole


def numbered(geometry: LookGeometry) -> FloatArray:
    """A look of which each bin has a P_d of its own."""
    count = 2 * geometry.along_bins * geometry.range_bins
    return (np.arange(1, count + 1) / (count + 1)).reshape(2, geometry.along_bins, geometry.range_bins)


def cell_by_cell(grid: GridSpec, geometry: LookGeometry, p_detect: FloatArray) -> FloatArray:
    """The definition, for each cell by itself, in the mission frame."""
    whole = np.zeros(grid.shape)
    sin, cos = math.sin(geometry.heading_rad), math.cos(geometry.heading_rad)
    for row, along_m in enumerate(grid.along_m):
        for column, across_m in enumerate(grid.across_m):
            x_m, y_m = grid.frame.to_mission(float(across_m), float(along_m))
            dx_m, dy_m = float(x_m) - geometry.origin[0], float(y_m) - geometry.origin[1]
            ahead_m, starboard_m = dx_m * sin + dy_m * cos, dx_m * cos - dy_m * sin
            along_bin = math.floor((ahead_m - geometry.first_along_m + EDGE_TOLERANCE_M) / geometry.along_bin_m)
            range_bin = math.floor((abs(starboard_m) + EDGE_TOLERANCE_M) / geometry.range_bin_m + 0.5)
            if 0 <= along_bin < geometry.along_bins and range_bin < geometry.range_bins:
                whole[row, column] = p_detect[int(starboard_m >= -EDGE_TOLERANCE_M), along_bin, range_bin]
    return whole


class TestByHand:
    # 6 columns at 0, 5, ..., 25 m east and 4 rows at 2.5, ..., 17.5 m north.
    GRID = GridSpec(SweepFrame(0, 0, NORTH), 5, 6, 4)

    def test_a_look_northward(self) -> None:
        geometry = look_at((10, 5), NORTH, (5, 5), (2, 3))
        port, starboard = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], [[0.11, 0.21, 0.31], [0.41, 0.51, 0.61]]
        whole = on_whole_grid(self.GRID, geometry, np.array([port, starboard]))
        assert whole.tolist() == [
            [0, 0, 0, 0, 0, 0],
            [0.3, 0.2, 0.11, 0.21, 0.31, 0],
            [0.6, 0.5, 0.41, 0.51, 0.61, 0],
            [0, 0, 0, 0, 0, 0],
        ]

    def test_a_look_later_on_a_track(self) -> None:
        geometry = LookGeometry((10, -5), NORTH, 10, 5, 5, 2, 3)
        look = numbered(geometry)
        from_there = look_at((10, 5), NORTH, (5, 5), (2, 3))
        assert on_whole_grid(self.GRID, geometry, look).tolist() == on_whole_grid(self.GRID, from_there, look).tolist()

    def test_the_window_is_little_larger_than_the_look(self) -> None:
        grid = GridSpec(SweepFrame(0, 0, NORTH), 5, 100, 100)
        rows, columns, on_cells = look_on_grid(
            grid, look_at((250, 250), NORTH, (5, 5), (4, 6)), np.full((2, 4, 6), 0.5)
        )
        assert np.count_nonzero(on_cells) == 4 * 11
        assert on_cells.shape == (rows.stop - rows.start, columns.stop - columns.start)
        assert on_cells.size <= (4 + 1) * (11 + 2)

    def test_a_look_southward_has_port_in_the_east(self) -> None:
        geometry = look_at((10, 15), SOUTH, (5, 5), (2, 3))
        port, starboard = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], [[0.11, 0.21, 0.31], [0.41, 0.51, 0.61]]
        whole = on_whole_grid(self.GRID, geometry, np.array([port, starboard]))
        assert whole.tolist() == [
            [0, 0, 0, 0, 0, 0],
            [0.61, 0.51, 0.41, 0.5, 0.6, 0],
            [0.31, 0.21, 0.11, 0.2, 0.3, 0],
            [0, 0, 0, 0, 0, 0],
        ]

    def test_a_look_across_the_grid(self) -> None:
        geometry = look_at((7.5, 7.5), EAST, (5, 5), (2, 2))
        port, starboard = [[0.1, 0.2], [0.4, 0.5]], [[0.11, 0.21], [0.41, 0.51]]
        whole = on_whole_grid(self.GRID, geometry, np.array([port, starboard]))
        assert whole.tolist() == [
            [0, 0, 0.21, 0.51, 0, 0],
            [0, 0, 0.11, 0.41, 0, 0],
            [0, 0, 0.2, 0.5, 0, 0],
            [0, 0, 0, 0, 0, 0],
        ]

    def test_range_bins_finer_than_cells(self) -> None:
        geometry = look_at((12, 0), NORTH, (5, 1), (1, 15))
        look = np.zeros((2, 1, 15))
        look[0, 0, 12], look[1, 0, 3] = 0.12, 0.3  # 0 m and 15 m east
        whole = on_whole_grid(self.GRID, geometry, look)
        assert whole[0].tolist() == [0.12, 0, 0, 0.3, 0, 0]

    def test_the_mean_over_bins_is_of_those_on_a_cell_that_were_seen(self) -> None:
        look = np.zeros((2, 1, 13))
        look[1, 0, 4:13] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]  # from 4 m to 12 m
        port, starboard = over_cells(self.GRID, look_at((10, 0), NORTH, (5, 1), (1, 13)), look)[:, 0]
        assert not port.any()
        assert not starboard[:4].any()
        assert starboard[4:] == pytest.approx([0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8])
        three_a_cell = over_cells(self.GRID, look_at((10, 0), NORTH, (5, 5 / 3), (1, 13)), look)
        assert three_a_cell[1, 0, 4:] == pytest.approx([0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85])
        finer, coarser = (look_at((10, 0), NORTH, (5, bin_m), (1, 13)) for bin_m in (0.1, 5.0))
        assert over_cells(self.GRID, finer, look)[1, 0, 4:] == pytest.approx([0.5] * 9)
        assert (over_cells(self.GRID, coarser, look) == look).all()

    @pytest.mark.parametrize("bins", range(1, 60))
    def test_the_mean_of_the_highest_p_detect_is_no_higher(self, bins: int) -> None:
        look = np.full((2, 1, 80), HIGHEST_P_DETECT)
        mean = over_cells(self.GRID, look_at((10, 0), NORTH, (5, 5 / bins), (1, 80)), look)
        assert mean.max() <= HIGHEST_P_DETECT
        assert mean == pytest.approx(look)

    def test_halfway_between_two_range_bins_the_outer_one_counts(self) -> None:
        # Cells are 2.5, 7.5 and 12.5 m away: bins 1, 2 and 3.
        look = np.array([[[0.1, 0.2, 0.3, 0.4]], [[0.5, 0.6, 0.7, 0.8]]])
        whole = on_whole_grid(self.GRID, look_at((12.5, 0), NORTH, (5, 5), (1, 4)), look)
        assert whole[0].tolist() == [0.4, 0.3, 0.2, 0.6, 0.7, 0.8]
        whole = on_whole_grid(self.GRID, look_at((12.5, 0), NORTH, (5, 5), (1, 3)), look[:, :, :3])
        assert whole[0].tolist() == [0, 0.3, 0.2, 0.6, 0.7, 0]

    @pytest.mark.parametrize("aside_m", [-2e-4, 0, 2e-4])
    @pytest.mark.parametrize("heading_rad", [NORTH, SOUTH])
    def test_a_rounded_position_does_not_decide_about_edges(self, aside_m: float, heading_rad: float) -> None:
        look = np.arange(1, 25).reshape(2, 3, 4) / 100
        start_m = 17.5 if heading_rad == SOUTH else 2.5
        exactly = on_whole_grid(self.GRID, look_at((12.5, start_m), heading_rad, (5, 5), (3, 4)), look)
        nearly = look_at((12.5 + aside_m, start_m + aside_m), heading_rad, (5, 5), (3, 4))
        assert on_whole_grid(self.GRID, nearly, look).tolist() == exactly.tolist()

    @pytest.mark.parametrize("start", [(-500, 5), (500, 5), (10, -500), (10, 500)])
    def test_a_look_beside_the_grid_sees_none(self, start: tuple[float, float]) -> None:
        geometry = look_at(start, NORTH, (5, 5), (4, 10))
        rows, columns, on_cells = look_on_grid(self.GRID, geometry, numbered(geometry))
        assert not on_cells.any()
        assert np.zeros(self.GRID.shape)[rows, columns].shape == on_cells.shape

    @needs_compiling
    def test_is_compiled_for_one_kind_of_looks(self) -> None:
        read_only = np.full((2, 4, 10), 0.5)
        read_only.setflags(write=False)
        on_whole_grid(self.GRID, look_at((10, 5), NORTH, (5, 5), (4, 10)), read_only)
        turned = np.full((10, 4, 2), 0.5).T
        on_whole_grid(self.GRID, look_at((10.5, 5.5), 0.5, (2.5, 1.5), (4, 10)), turned)
        assert times_compiled(_seen_by) == 1


class TestProperties:
    @given(
        frame_rad=HEADINGS,
        heading_rad=HEADINGS,
        start=st.tuples(st.integers(-30, 160), st.integers(-30, 120)),
        first_along_m=st.sampled_from([0.0, 5.0, 40.0]),
        bins_m=st.tuples(st.sampled_from([2.5, 5.0, 7.0]), st.sampled_from([1.0, 4.0, 5.0])),
        bins=st.tuples(st.integers(1, 6), st.integers(1, 40)),
    )
    def test_is_the_definition_cell_by_cell(
        self,
        frame_rad: float,
        heading_rad: float,
        start: tuple[int, int],
        first_along_m: float,
        bins_m: tuple[float, float],
        bins: tuple[int, int],
    ) -> None:
        grid = GridSpec(SweepFrame(12.25, -7.5, frame_rad), 5, 25, 17)
        x_m, y_m = grid.frame.to_mission(*start)
        geometry = LookGeometry((float(x_m), float(y_m)), frame_rad + heading_rad, first_along_m, *bins_m, *bins)
        look = numbered(geometry)
        assert on_whole_grid(grid, geometry, look).tolist() == cell_by_cell(grid, geometry, look).tolist()

    @given(
        frame_rad=HEADINGS,
        heading_rad=HEADINGS,
        # Whole millimetres: many a cell lies on an edge, or by the tolerance before one.
        start_mm=st.tuples(PLACES_MM, PLACES_MM),
        bin_cm=st.sampled_from([500, 250, 100]) | st.integers(50, 700),
        bins=st.lists(st.integers(1, 5), min_size=1, max_size=12),
        in_centimetres=st.booleans(),
    )
    @example(0.3, NORTH, (5000, 2500), 500, [1] * 12, True)
    @example(0.3, EAST, (0, 2500), 500, [1] * 12, False)
    # Cells that lie before an edge by just the tolerance.
    @example(0, NORTH, (5000, 7701), 685, [1] * 12, False)
    @example(0, NORTH, (5000, 8801), 410, [1] * 12, False)
    @example(0, NORTH, (5000, 16901), 204, [5] * 12, False)
    def test_consecutive_looks_see_each_cell_once(
        self,
        frame_rad: float,
        heading_rad: float,
        start_mm: tuple[int, int],
        bin_cm: int,
        bins: list[int],
        in_centimetres: bool,
    ) -> None:
        grid = GridSpec(SweepFrame(3, 4, frame_rad), 5, 25, 25)
        x_m, y_m = grid.frame.to_mission(start_mm[0] / 1000, start_mm[1] / 1000)
        compass_rad, bin_m = frame_rad + heading_rad, bin_cm / 100
        whole = LookGeometry((x_m, y_m), compass_rad, 0, bin_m, 5, sum(bins), 8)
        once = on_whole_grid(grid, whole, np.ones((2, sum(bins), 8)))
        seen = np.zeros(grid.shape)
        first_along_m = 0.0
        for flown, count in zip(itertools.accumulate([0, *bins]), bins, strict=False):
            # A look's begin as it is read from a message, or summed up with what rounding does to sums.
            begin_m = flown * bin_cm / 100 if in_centimetres else first_along_m
            part = LookGeometry((x_m, y_m), compass_rad, begin_m, bin_m, 5, count, 8)
            seen += on_whole_grid(grid, part, np.ones((2, count, 8)))
            first_along_m += count * bin_cm / 100
        assert seen.tolist() == once.tolist()

    @given(frame_rad=HEADINGS, heading_rad=AXIS_HEADINGS, column=st.integers(0, 24))
    def test_right_below_the_track_is_to_starboard(self, frame_rad: float, heading_rad: float, column: int) -> None:
        grid = GridSpec(SweepFrame(3, 4, frame_rad), 5, 25, 25)
        x_m, y_m = grid.frame.to_mission(float(grid.across_m[column]), float(grid.along_m[12]))
        geometry = look_at((float(x_m), float(y_m)), frame_rad + heading_rad, (5, 5), (1, 4))
        look = np.stack([np.full((1, 4), 0.25), np.full((1, 4), 0.75)])
        assert on_whole_grid(grid, geometry, look)[12, column] == 0.75
