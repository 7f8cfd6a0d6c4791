"""Areas: the rectangle about them, their grid and their legs, by hand and for every convex polygon."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from planner.area import SurveyArea
from planner.types import GridSpec, SweepFrame

headings = st.floats(-7, 7) | st.integers(-4, 4).map(lambda n: n * math.pi / 2)


def rectangle(width_m: float, length_m: float, heading_rad: float, corner: tuple[float, float] = (0, 0)) -> SurveyArea:
    """A rectangle whose tracks run along `length_m` at a heading, with the sweep frame's origin at `corner`."""
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    corners = [(0, 0), (width_m, 0), (width_m, length_m), (0, length_m)]
    vertices = tuple((corner[0] + u * cos + v * sin, corner[1] - u * sin + v * cos) for u, v in corners)
    return SurveyArea(vertices, heading_rad)


@st.composite
def convex_areas(draw: st.DrawFn) -> SurveyArea:
    """Points on an ellipse, which are convex in their order round it."""
    angles = draw(st.lists(st.integers(0, 359), min_size=3, max_size=12, unique=True))
    a_m, b_m = draw(st.floats(50, 800)), draw(st.floats(50, 800))
    x_m, y_m = draw(st.floats(-2000, 2000)), draw(st.floats(-2000, 2000))
    ordered = sorted(angles, reverse=draw(st.booleans()))
    vertices = tuple((x_m + a_m * math.cos(math.radians(k)), y_m + b_m * math.sin(math.radians(k))) for k in ordered)
    return SurveyArea(vertices, draw(headings))


class TestRectangle:
    @given(headings)
    def test_gives_the_papers_grid_at_any_heading(self, heading_rad: float) -> None:
        area = rectangle(1212, 400, heading_rad, (1000, -500))
        assert (area.width_m, area.length_m) == pytest.approx((1212, 400))
        assert (area.frame.origin_x_m, area.frame.origin_y_m) == pytest.approx((1000, -500))
        grid = area.grid(5)
        assert (grid.columns, grid.rows) == (243, 80)
        assert area.inside(grid).all()

    @given(headings, st.floats(-129, 1341), st.booleans())
    def test_gives_whole_legs(self, heading_rad: float, across_m: float, reverse: bool) -> None:
        area = rectangle(1212, 400, heading_rad)
        track = area.track(3, across_m, reverse, 130)
        assert track is not None
        assert (track.number, track.across_m) == (3, across_m)
        assert track.length_m == pytest.approx(400)
        across, along = area.frame.to_sweep(*np.array([track.start, track.end]).T)
        assert across == pytest.approx([across_m, across_m], abs=1e-6)
        assert along == pytest.approx([400, 0] if reverse else [0, 400], abs=1e-6)

    @pytest.mark.parametrize("across_m", [-130, 1212 + 130, -500, 5000])
    @pytest.mark.parametrize("heading_rad", [0, 1.1, math.pi / 2])
    def test_gives_no_leg_out_of_reach(self, across_m: float, heading_rad: float) -> None:
        assert rectangle(1212, 400, heading_rad).track(1, across_m, False, 130) is None

    def test_along_its_long_side(self) -> None:
        area = SurveyArea(((0, 0), (1212, 0), (1212, 400), (0, 400)), math.pi / 2)
        assert (area.width_m, area.length_m) == pytest.approx((400, 1212))
        assert (area.frame.origin_x_m, area.frame.origin_y_m) == pytest.approx((0, 400))
        track = area.track(1, 100, False, 50)
        assert track is not None
        assert track.start == pytest.approx((0, 300))
        assert track.end == pytest.approx((1212, 300))

    @pytest.mark.parametrize(
        ("width_m", "length_m", "columns", "rows"),
        [(10, 10, 3, 2), (9.99, 10.01, 2, 3), (10 - 1e-7, 10 + 1e-7, 3, 2), (0.5, 0.5, 1, 1), (14, 14, 3, 3)],
    )
    def test_grid_by_hand(self, width_m: float, length_m: float, columns: int, rows: int) -> None:
        grid = rectangle(width_m, length_m, 0).grid(5)
        assert (grid.columns, grid.rows) == (columns, rows)

    def test_the_narrowest_area_there_may_be_has_a_row(self) -> None:
        assert rectangle(1000, 2.1e-6, 0).grid(0.5).shape == (1, 2001)

    @pytest.mark.parametrize(("beyond_m", "inside"), [(0.9e-6, True), (1.1e-6, False)])
    def test_a_cell_is_on_the_boundary_as_far_as_a_micrometre_beyond_it(self, beyond_m: float, inside: bool) -> None:
        area = rectangle(10, 10, 0, (1000, 2000))
        to_the_west = GridSpec(SweepFrame(1000 - beyond_m, 2000, 0), 5, columns=3, rows=2)
        to_the_south = GridSpec(SweepFrame(1000, 1997.5 - beyond_m, 0), 5, columns=3, rows=2)
        assert area.inside(to_the_west).tolist() == [[inside, True, True]] * 2
        assert area.inside(to_the_south).tolist() == [[inside] * 3, [True] * 3]

    def test_a_swath_a_micrometre_wide_along_its_side_is_long_as_that(self) -> None:
        track = rectangle(1212, 400, 0).track(1, 0.0, False, 1e-6)
        assert track is not None
        assert track.length_m == 400

    def test_a_cell_beyond_the_far_side_is_outside(self) -> None:
        area = rectangle(12, 11, 0)
        assert area.inside(area.grid(5)).tolist() == [[True] * 3, [True] * 3, [False] * 3]


class TestTriangle:
    # Right angle at the origin; tracks run north.
    AREA = SurveyArea(((0, 0), (300, 0), (0, 300)), 0)

    def test_cells_by_hand(self) -> None:
        inside = self.AREA.inside(self.AREA.grid(100))
        # Rows at 50, 150, 250 m; columns at 0, 100, 200, 300 m: inside where their sum is at most 300 m.
        assert inside.tolist() == [
            [True, True, True, False],
            [True, True, False, False],
            [True, False, False, False],
        ]

    def test_a_leg_is_as_long_as_the_area_in_its_swath(self) -> None:
        track = self.AREA.track(1, 200, False, 50)
        assert track is not None
        # The swath's near edge lies at 150 m across, where the area is 150 m long.
        assert track.start == pytest.approx((200, 0), abs=1e-5)
        assert track.end == pytest.approx((200, 150), abs=1e-5)

    def test_a_leg_beyond_the_area_still_passes_what_is_in_reach(self) -> None:
        track = self.AREA.track(1, 310, True, 40)
        assert track is not None
        assert track.start == pytest.approx((310, 30), abs=1e-5)
        assert track.end == pytest.approx((310, 0), abs=1e-5)

    def test_a_leg_past_less_than_a_metre_of_the_area_is_as_long_as_that(self) -> None:
        # Half a metre of a triangle that is a metre wide lies within the swath, as long as 50 m.
        track = SurveyArea(((0, 0), (1, 0), (1, 100)), 0).track(1, 0, False, 0.5)
        assert track is not None
        assert (*track.start, *track.end) == pytest.approx((0, 0, 0, 50), abs=1e-3)


class TestConvexAreas:
    @given(convex_areas())
    def test_the_rectangle_touches_the_area_on_all_sides(self, area: SurveyArea) -> None:
        across_m, along_m = area.frame.to_sweep(*np.array(area.vertices).T)
        assert (across_m.min(), along_m.min()) == pytest.approx((0, 0), abs=1e-6)
        assert (across_m.max(), along_m.max()) == pytest.approx((area.width_m, area.length_m), abs=1e-6)

    @given(convex_areas(), st.sampled_from([10.0, 25.0]))
    def test_cells_inside_are_those_of_the_polygon(self, area: SurveyArea, cell_m: float) -> None:
        grid = area.grid(cell_m)
        x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
        polygon, points = shapely.Polygon(area.vertices), np.asarray(shapely.points(x_m, y_m))
        inside = area.inside(grid)
        assert inside.shape == grid.shape
        assert shapely.covers(polygon.buffer(1e-5), points[inside]).all()
        assert not shapely.covers(polygon.buffer(-1e-5), points[~inside]).any()

    @given(convex_areas(), st.floats(0, 1), st.floats(20, 150))
    def test_a_leg_passes_all_of_the_area_in_its_swath_and_no_more(
        self, area: SurveyArea, share: float, reach_m: float
    ) -> None:
        track = area.track(1, share * area.width_m, False, reach_m)
        assert track is not None
        (near_m, far_m), (start_m, end_m) = area.frame.to_sweep(*np.array([track.start, track.end]).T)
        assert near_m == pytest.approx(far_m, abs=1e-6)
        polygon = shapely.Polygon(np.column_stack(area.frame.to_sweep(*np.array(area.vertices).T)))
        in_swath = polygon.intersection(shapely.box(near_m - reach_m, -10, near_m + reach_m, area.length_m + 10))
        # A swath that ends at a steep edge: the tolerance across shows as more along.
        assert (start_m, end_m) == pytest.approx((in_swath.bounds[1], in_swath.bounds[3]), abs=1e-3)


class TestRefusals:
    @pytest.mark.parametrize(
        ("vertices", "message"),
        [
            ((), "at least 3 different vertices, not 0"),
            (((0, 0),), "at least 3 different vertices, not 1"),
            (((0, 0), (1, 0)), "at least 3 different vertices, not 2"),
            (((0, 0), (1, 0), (0, 0)), "at least 3 different vertices, not 2"),
            (((0, 0), (1, 0), (1, 0), (0, 0)), "at least 3 different vertices, not 2"),
            (((0, 0), (math.nan, 0), (1, 1)), "finite"),
            (((0, 0), (math.inf, 0), (1, 1)), "finite"),
            (((0, 0), (100, 100), (0, 100), (100, 0)), "cross or touch itself"),
            (((0, 0), (100, 0), (200, 0), (100, 0), (100, 100)), "cross or touch itself"),
            (((0, 0), (50, 50), (100, 100)), "on one line"),
            (((0, 0), (100, 0), (200, 1e-9)), "on one line"),
            (((0, 0), (100, 0), (100, 100), (50, 10), (0, 100)), "convex"),
        ],
    )
    def test_of_polygons(self, vertices: tuple[tuple[float, float], ...], message: str) -> None:
        with pytest.raises(ValueError, match=message):
            SurveyArea(vertices, 0)

    def test_of_what_is_narrower_or_dented_by_no_more_than_a_micrometre_along_its_sides(self) -> None:
        # All sides together 200 m: two ten-thousandths of a square metre.
        with pytest.raises(ValueError, match="on one line"):
            SurveyArea(((0, 0), (100, 0), (100, 1.9e-6), (0, 1.9e-6)), 0)
        assert SurveyArea(((0, 0), (100, 0), (100, 2.1e-6), (0, 2.1e-6)), 0).width_m == pytest.approx(100)
        # All sides together 400 m: a dent of half of 100 m by 8 micrometres.
        assert len(SurveyArea(((0, 0), (100, 0), (100 - 7.9e-6, 40), (100, 100), (0, 100)), 0).vertices) == 5
        with pytest.raises(ValueError, match="convex"):
            SurveyArea(((0, 0), (100, 0), (100 - 8.1e-6, 40), (100, 100), (0, 100)), 0)

    def test_of_headings_cells_and_legs(self) -> None:
        with pytest.raises(ValueError, match="heading"):
            rectangle(100, 100, math.nan)
        area = rectangle(100, 100, 0)
        for cell_m in (0, -5, math.nan, math.inf):
            with pytest.raises(ValueError, match="cell's side"):
                area.grid(cell_m)
        for across_m, reach_m in ((math.nan, 10), (10, 0), (10, math.inf)):
            with pytest.raises(ValueError, match="reach above 0"):
                area.track(1, across_m, False, reach_m)

    def test_but_not_of_repeated_or_needless_vertices(self) -> None:
        area = SurveyArea(((0, 0), (50, 0), (100, 0), (100, 0), (100, 100), (0, 100), (0, 0)), -math.pi)
        assert area.vertices[0] != area.vertices[-1]
        assert (area.width_m, area.length_m) == pytest.approx((100, 100))
        assert area.track_heading_rad == math.pi
        assert SurveyArea(area.vertices, -1e-20).track_heading_rad == 0
        assert area.inside(area.grid(10)).all()
