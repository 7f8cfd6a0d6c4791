from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from regions import regions

from planner.area import SurveyArea
from planner.region import Region

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
