"""Regions that are concave or have holes: which cells lie inside, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from regions import regions

from planner.area import SurveyArea
from planner.region import Region, share_within
from planner.types import Strip

SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))
MIDDLE = ((40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0))


def test_cells_on_the_boundary_are_inside_also_on_that_of_a_hole() -> None:
    region = Region(SQUARE, (MIDDLE,))
    inside = region.inside(region.about(0).grid(10))
    # Columns are centred at 0, 10, ..., 100 m, rows at 5, 15, ..., 95 m; only 50 m lies between 40 and 60 m.
    assert np.argwhere(~inside).tolist() == [[4, 5], [5, 5]]


def test_of_a_convex_polygon_it_is_the_same_as_of_a_survey_area() -> None:
    corners = ((0.0, 0.0), (500.0, 100.0), (600.0, 400.0), (100.0, 300.0))
    for heading_rad in (0.0, 0.7, 3.0):
        grid = SurveyArea(corners, heading_rad).grid(7)
        assert Region(corners).about(heading_rad).grid(7) == grid
        assert (Region(corners).inside(grid) == SurveyArea(corners, heading_rad).inside(grid)).all()


@given(regions(), st.floats(0, math.pi))
def test_cells_inside_are_those_of_the_polygon(region: Region, heading_rad: float) -> None:
    grid = region.about(heading_rad).grid(25)
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    points = np.asarray(shapely.points(x_m, y_m))
    inside = region.inside(grid)
    assert shapely.covers(region.polygon.buffer(1e-5), points[inside]).all()
    assert not shapely.covers(region.polygon.buffer(-1e-5), points[~inside]).any()


def test_of_each_cell_the_share_counts_that_lies_there() -> None:
    region = Region(SQUARE)
    grid = region.about(0).grid(10)  # columns from -5 to 5 m, 5 to 15 m and so on, rows from 0 to 10 m and so on
    shares = region.shares(shapely.box(12, 4, 38, 20), grid)
    across, along = [0, 0.3, 1, 1, 0.3, 0, 0, 0, 0, 0, 0], [0.6, 1, 0, 0, 0, 0, 0, 0, 0, 0]
    np.testing.assert_allclose(shares, np.outer(along, across), atol=1e-7)
    # Of the first column only 0 to 5 m are of the region, and of these 4 lie there.
    assert region.shares(shapely.box(-50, 0, 4, 100), grid)[:, 0] == pytest.approx(0.8, abs=1e-7)
    np.testing.assert_array_equal(region.shares(region.polygon, grid), 1.0)
    with_hole = Region(SQUARE, (MIDDLE,)).shares(shapely.box(-9, -9, 109, 109), grid)
    # From 40 to 60 m is the hole: of the column from 35 to 45 m what is not the hole's lies there.
    assert (with_hole[4, 4], with_hole[4, 5], with_hole[3, 5]) == (1, 0, 1)


@settings(max_examples=20)
@given(st.floats(0, math.pi), st.integers(-20, 80), st.integers(-20, 80), st.sampled_from([10.0, 17.0]))
def test_the_share_is_that_of_the_cells_ground_in_the_region(
    heading_rad: float, west_m: int, south_m: int, cell_m: float
) -> None:
    region, there = Region(SQUARE, (MIDDLE,)), shapely.box(west_m, south_m, west_m + 40, south_m + 40)
    grid = region.about(heading_rad).grid(cell_m)
    shares, inside = region.shares(there, grid), region.inside(grid)
    for row, column in np.ndindex(grid.shape):
        left_m, right_m = (column - 0.5) * cell_m, (column + (0.5 if column < grid.columns - 1 else 1.0)) * cell_m
        sides = (left_m, row), (right_m, row), (right_m, row + 1), (left_m, row + 1)
        cell = shapely.Polygon([grid.frame.to_mission(across_m, one * cell_m) for across_m, one in sides])
        ground = region.polygon.intersection(cell)
        held_m2 = ground.area if inside[row, column] else cell_m**2
        assert shares[row, column] == pytest.approx(ground.intersection(there).area / held_m2, abs=1e-5)


def test_of_cells_smaller_than_a_square_metre_too() -> None:
    region = Region(((0, 0), (3, 0), (3, 2), (0, 2)))
    shares = region.shares(shapely.box(-1, -1, 1.3, 0.8), region.about(0).grid(0.5))
    # Columns reach from 0.75 to 1.25 m and from 1.25 to 1.75 m, rows from 0.5 to 1 m.
    np.testing.assert_allclose(shares, np.outer([1, 0.6, 0, 0], [1, 1, 1, 0.1, 0, 0, 0]), atol=1e-6)


def test_what_lies_nowhere_in_it_has_no_share() -> None:
    region = Region(SQUARE)
    grid = region.about(0).grid(10)
    for nowhere in (shapely.box(-90, 0, -10, 100), shapely.Polygon(), shapely.LineString([(0, 0), (100, 100)])):
        assert not region.shares(nowhere, grid).any()


def test_ground_at_an_edge_counts_though_no_cell_has_its_centre_there() -> None:
    region = Region(((0, 0), (108, 0), (108, 102), (0, 102)))
    grid = region.about(0).grid(10)
    assert grid.shape == (11, 11)  # the last row from 100 to 110 m, the last column from 95 to 105 m
    assert not region.inside(grid)[10].any()
    top = region.shares(shapely.box(20, 100, 80, 102), grid)
    assert top.sum() == pytest.approx(60 * 2 / 100)
    # Beyond the last column's 105 m are 3 m of the 13 that it holds.
    assert region.shares(shapely.box(105, 0, 108, 100), grid)[:10, 10] == pytest.approx(3 / 13, abs=1e-7)


@given(regions(), st.floats(0, math.pi), st.floats(-300, 300))
def test_shares_of_two_parts_are_those_of_the_whole(region: Region, heading_rad: float, at_m: float) -> None:
    grid = region.about(heading_rad).grid(25)
    west, east = shapely.box(-2000, -2000, at_m, 2000), shapely.box(at_m, -2000, 2000, 2000)
    both = region.shares(west, grid) + region.shares(east, grid)
    np.testing.assert_allclose(both, region.shares(region.polygon, grid), atol=1e-6)
    inside = region.inside(grid)
    np.testing.assert_allclose(both[inside], 1.0, atol=1e-6)


def test_what_it_is_to_keep_out_of_is_no_part_of_it_also_where_that_divides_it() -> None:
    lane = ((40.0, -10.0), (60.0, -10.0), (60.0, 110.0), (40.0, 110.0))
    divided = Region(SQUARE, (), (lane,))
    grid = divided.about(0).grid(10)
    inside = divided.inside(grid)
    assert [part.area for part in divided.polygon.geoms] == [4000, 4000]  # type: ignore[union-attr]
    assert grid.shape == (10, 11)
    # Columns are centred at 0, 10 and so on: at 50 is the lane's middle, at 40 and 60 its edges, which are inside.
    assert inside.all(axis=0).tolist() == [True] * 5 + [False] + [True] * 5
    assert not inside[:, 5].any()
    one_part = Region(SQUARE, (), (MIDDLE,)).polygon
    assert isinstance(one_part, shapely.Polygon)
    assert one_part.area == 9600
    share = divided.share(0, 0.3, 0)
    assert (share.polygon.area, share.keep_out) == (3000, (lane,))
    with pytest.raises(ValueError, match="leave nothing of the area"):
        Region(SQUARE, (), (((-1.0, -1.0), (101.0, -1.0), (101.0, 101.0), (-1.0, 101.0)),))


@pytest.mark.parametrize(
    ("outline", "holes", "message"),
    [
        (((0, 0), (1, 0)), (), "at least 3 different corners"),
        (SQUARE, (((1, 1), (2, 2), (1, 1)),), "at least 3 different corners"),
        (((0, 0), (math.nan, 0), (1, 1)), (), "finite"),
        (((0, 0), (50, 50), (100, 100)), (), "must have an inside"),
        (((0, 0), (100, 100), (0, 100), (100, 0)), (), "sides must not cross"),
        (SQUARE, (((90, 90), (110, 90), (110, 110), (90, 110)),), "holes must lie in it"),
        (SQUARE, (MIDDLE, ((45, 45), (70, 45), (45, 70))), "holes must lie in it and apart"),
    ],
)
def test_what_is_no_region_is_refused(outline: object, holes: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Region(outline, holes)  # type: ignore[arg-type]


def test_zones_to_keep_out_of_are_looked_at_as_the_outline_is() -> None:
    for zone, message in (
        (((0.0, 0.0), (9.0, 0.0)), "at least 3 different corners"),
        (((0.0, 0.0), (9.0, math.inf), (9.0, 0.0)), "finite"),
        (((0.0, 0.0), (9.0, 9.0), (0.0, 9.0), (9.0, 0.0)), "the sides of a zone to keep out of must not cross"),
    ):
        with pytest.raises(ValueError, match=message):
            Region(SQUARE, (), (MIDDLE, zone))


def test_an_area_has_an_inside_if_it_is_more_than_two_micrometres_wide() -> None:
    def of_width(width_m: float) -> Region:
        return Region(((0.0, 0.0), (100.0, 0.0), (100.0, width_m), (0.0, width_m)))

    with pytest.raises(ValueError, match="must have an inside"):
        of_width(1.9e-6)
    assert of_width(2.1e-6).polygon.area == pytest.approx(2.1e-4)


class TestShare:
    def test_the_second_of_three_of_a_square_by_hand(self) -> None:
        share = Region(SQUARE).share(0.25, 0.5, 0.0)
        assert np.array(sorted(share.outline)) == pytest.approx(np.array([(25, 0), (25, 100), (50, 0), (50, 100)]))

    def test_from_the_beginning_to_the_end_it_is_all_of_it(self) -> None:
        whole = Region(((0, 0), (100, 10), (130, 70), (60, 120), (-20, 60)), (((40, 40), (60, 40), (50, 60)),))
        all_of_it = whole.share(0, 1, 0.4)
        assert all_of_it.polygon.area == pytest.approx(whole.polygon.area)
        assert len(all_of_it.holes) == 1

    def test_tracks_to_the_east_are_laid_from_north_to_south(self) -> None:
        first = Region(SQUARE).share(0, 0.3, math.pi / 2)
        assert min(y_m for _, y_m in first.outline) == pytest.approx(70)

    def test_a_hole_on_the_border_is_a_notch_and_one_inside_stays(self) -> None:
        region = Region(SQUARE, (MIDDLE,))
        assert region.share(0, 0.5, 0).holes == ()
        assert region.share(0, 0.5, 0).polygon.area == pytest.approx(5000 - 200)
        assert len(region.share(0, 0.7, 0).holes) == 1

    def test_corners_at_its_tracks_ends_stay_as_they_were_drawn(self) -> None:
        region = Region(((0, 0), (100, 10), (130, 70), (60, 120), (-20, 60)))
        for heading_rad in np.arange(0.0, 6.3, 0.1).tolist():
            whole, share = region.about(heading_rad), region.share(0.3, 0.7, heading_rad)
            for corner in region.outline:
                across_m = float(whole.frame.to_sweep(*corner)[0])
                if 0.3 * whole.width_m < across_m < 0.7 * whole.width_m:
                    assert corner in share.outline

    @pytest.mark.parametrize(("begin", "end"), [(0.5, 0.5), (0.6, 0.4), (-0.1, 0.5), (0, 1.1), (math.nan, 1)])
    def test_what_is_no_share_is_refused(self, begin: float, end: float) -> None:
        with pytest.raises(ValueError, match="a share runs from"):
            Region(SQUARE).share(begin, end, 0)

    def test_what_would_be_in_pieces_is_refused(self) -> None:
        horseshoe = Region(((0, 0), (100, 0), (100, 20), (20, 20), (20, 80), (100, 80), (100, 100), (0, 100)))
        with pytest.raises(ValueError, match=r"in several pieces, lies from 0.5 to 1 of its width"):
            horseshoe.share(0.5, 1, 0)

    @given(st.data(), st.integers(1, 4), st.floats(0, math.pi))
    def test_shares_are_the_whole_together_and_share_nothing(
        self, data: st.DataObject, count: int, heading_rad: float
    ) -> None:
        whole = data.draw(regions())
        try:
            shares = [whole.share(one / count, (one + 1) / count, heading_rad).polygon for one in range(count)]
        except ValueError:  # in pieces
            assume(False)
        assert sum(share.area for share in shares) == pytest.approx(whole.polygon.area, rel=1e-6)
        together = shapely.union_all([share.buffer(1e-6) for share in shares])
        assert whole.polygon.difference(together.buffer(1e-6)).area == pytest.approx(0, abs=1e-6 * whole.polygon.area)


@pytest.mark.parametrize(
    ("strip", "meets"),
    [
        (Strip(1, (50, 10), 0, 20, 10), True),
        (Strip(1, (104, -20), 0, 200, 10), True),
        (Strip(1, (106, -20), 0, 200, 10), False),
        (Strip(1, (50, -1), math.pi, 20, 10), False),
        (Strip(1, (50, 45), 0, 10, 5), False),  # in the hole
    ],
)
def test_a_strip_meets_a_region_where_they_share_a_point(strip: Strip, meets: bool) -> None:
    assert Region(SQUARE, (MIDDLE,)).meets(strip) is meets


def test_the_share_of_a_strip_within_another() -> None:
    strip = Strip(1, (0, 0), 0, 100, 20)
    assert strip.corners == ((-10, 0), (10, 0), (10, 100), (-10, 100))
    assert share_within(strip, Strip(2, (5, 0), 0, 100, 20)) == pytest.approx(0.75)
    assert share_within(strip, Strip(2, (0, 150), math.pi, 100, 40)) == pytest.approx(0.5)
    assert share_within(strip, Strip(2, (500, 0), 0, 100, 20)) == 0
