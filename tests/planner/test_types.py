"""The shapes that planning and messages share, with headings whose sine is 0.6 and whose cosine 0.8."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.types import DetectionCurve, GridSpec, SonarShape, Strip, SweepFrame, Track, whole_number

HEADING_RAD = math.atan2(3, 4)
FRAME = SweepFrame(100, 200, HEADING_RAD)
GRID = GridSpec(FRAME, 2.5, columns=3, rows=4)


def test_along_is_the_way_of_the_heading_and_across_to_the_right_of_it() -> None:
    # 10 m along is 6 m east and 8 m north, 5 m across 4 m east and 3 m south.
    assert FRAME.to_mission(0.0, 10.0) == pytest.approx((106, 208))
    assert FRAME.to_mission(5.0, 0.0) == pytest.approx((104, 197))
    assert FRAME.to_mission(5.0, 10.0) == pytest.approx((110, 205))
    assert FRAME.to_sweep(110.0, 205.0) == pytest.approx((5, 10))
    across_m, along_m = FRAME.to_sweep(np.array([100.0, 106.0, 104.0]), np.array([200.0, 208.0, 197.0]))
    assert across_m == pytest.approx(np.array([0, 0, 5]))
    assert along_m == pytest.approx(np.array([0, 10, 0]))


class TestGrid:
    def test_columns_are_centred_at_whole_cells_and_rows_at_halves(self) -> None:
        assert GRID.shape == (4, 3)
        assert GRID.cell_area_m2 == 6.25
        assert GRID.across_m.tolist() == [0.0, 2.5, 5.0]
        assert GRID.along_m.tolist() == [1.25, 3.75, 6.25, 8.75]

    def test_a_cell_takes_half_a_side_across_and_a_whole_one_along_also_beyond_the_grid(self) -> None:
        grid = GridSpec(SweepFrame(100, 200, 0), 2.5, columns=3, rows=4)
        x_m, y_m = np.array([(98.6, 199.9), (98.8, 200), (101.2, 202.4), (101.3, 202.5), (108.7, 210)]).T
        rows, columns = grid.cells_of(x_m, y_m)
        assert rows.tolist() == [-1, 0, 0, 1, 4]
        assert columns.tolist() == [-1, 0, 0, 1, 3]

    def test_a_part_begins_at_its_first_row_and_column(self) -> None:
        part = GRID.part(2, 4, 1, 2)
        assert (part.rows, part.columns, part.cell_m) == (2, 1, 2.5)
        # 5 m along and 2.5 m across.
        assert (part.frame.origin_x_m, part.frame.origin_y_m) == pytest.approx((105, 202.5))
        assert part.frame.heading_rad == HEADING_RAD

    def test_the_part_that_is_all_of_it_is_the_same_one(self) -> None:
        assert GRID.part(0, 4, 0, 3) is GRID
        for some in ((1, 4, 0, 3), (0, 3, 0, 3), (0, 4, 1, 3), (0, 4, 0, 2)):
            assert GRID.part(*some).shape == (some[1] - some[0], some[3] - some[2]) != GRID.shape


def test_a_track_heads_from_its_start_to_its_end() -> None:
    assert Track(1, 0.0, (10, 20), (40, 60)).length_m == 50
    assert Track(1, 0.0, (10, 20), (40, 60)).heading_rad == pytest.approx(HEADING_RAD)
    assert Track(1, 0.0, (40, 60), (10, 20)).heading_rad == pytest.approx(HEADING_RAD + math.pi)
    assert Track(1, 0.0, (10, 20), (-20, 60)).heading_rad == pytest.approx(2 * math.pi - HEADING_RAD)


def test_the_corners_of_a_strip_lie_beside_its_centre_line_in_order() -> None:
    strip = Strip(7, (100, 200), HEADING_RAD, 50, 20)
    assert strip.end == pytest.approx((130, 240))
    # Half its width, 10 m, to the right is 8 m east and 6 m south; the first corner lies left of the start.
    expected = ((92, 206), (108, 194), (138, 234), (122, 246))
    assert np.array(strip.corners) == pytest.approx(np.array(expected))


def test_a_curve_is_linear_in_between_and_0_outside() -> None:
    curve = DetectionCurve(np.array([10.0, 20.0, 40.0]), np.array([0.2, 0.6, 0.4]))
    assert curve.at(np.array([9.9, 10.0, 15.0, 35.0, 40.0, 40.1])) == pytest.approx(
        np.array([0, 0.2, 0.4, 0.45, 0.4, 0])
    )
    assert float(curve.at(20.0)) == 0.6


def test_a_sonar_of_which_no_more_is_told_looks_along_a_line_every_20_m() -> None:
    assert SonarShape("side", 5, 30) == SonarShape("side", 5, 30, half_angle_rad=0.0, look_m=20.0)


@pytest.mark.parametrize(
    ("given", "number"),
    [
        *((7, 7), (-1, -1), (np.int64(7), 7), (np.uint8(7), 7)),
        *((given, None) for given in (1.0, np.float64(1), True, np.True_, "1", None, math.nan, np.ones(2, dtype=int))),
    ],
)
def test_a_whole_number_is_an_int_or_one_of_numpys(given: object, number: int | None) -> None:
    assert whole_number(given) == number
    assert type(whole_number(given)) in (int, type(None))
