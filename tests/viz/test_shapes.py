"""The points of what is drawn, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import rerun.blueprint as rrb
from hypothesis import given
from hypothesis import strategies as st

from comms.said.announcement import ClockMode, Grid, Role, RosterVehicle, RunInfo, Vertex
from planner.types import Strip
from viz.blueprint import FIELD_OF_VIEW_RAD, MARGIN, mission_blueprint
from viz.shapes import Extent, body_quaternions, extent_of, label_place, ring, strip_ring

PRIMARY = RosterVehicle("primary", Role.SURVEY, 1.5, 20, 20, 40, 145, 0.4, 36_000_000)
RUN = RunInfo(1, "x", "0" * 64, 1, ClockMode.WALL, (), Grid(0, 0, 0, 10, 4, 2), 0.0, (PRIMARY,))


def strip(heading_rad: float, number: int = 1) -> Strip:
    return Strip(number, (10, 20), heading_rad, 100, 40)


def test_a_strip_runs_along_its_heading() -> None:
    north = [[-10, 20, 1.5], [-10, 120, 1.5], [30, 120, 1.5], [30, 20, 1.5], [-10, 20, 1.5]]
    np.testing.assert_allclose(strip_ring(strip(0.0), 1.5), np.array(north))
    east = [[10, 40, 0], [110, 40, 0], [110, 0, 0], [10, 0, 0], [10, 40, 0]]
    np.testing.assert_allclose(strip_ring(strip(math.pi / 2), 0.0), np.array(east), atol=1e-9)


@given(st.integers(1, 200), st.floats(0, 6.28))
def test_labels_hang_on_the_centre_line_apart_from_their_neighbours(number: int, heading_rad: float) -> None:
    along = []
    for neighbour in (number, number + 1, number + 2):
        x_m, y_m, z_m = label_place(strip(heading_rad, neighbour), 1.5)
        ahead_m = (x_m - 10) * math.sin(heading_rad) + (y_m - 20) * math.cos(heading_rad)
        assert math.hypot(x_m - 10, y_m - 20) == pytest.approx(ahead_m)
        assert 10 <= ahead_m <= 90
        assert z_m == 1.5
        along.append(ahead_m)
    assert min(abs(along[0] - along[1]), abs(along[0] - along[2]), abs(along[1] - along[2])) > 15


def test_a_ring_is_closed() -> None:
    assert ring([Vertex(1, 2), Vertex(3, 4)], 5.0).tolist() == [[1, 2, 5], [3, 4, 5], [1, 2, 5]]
    assert ring([], 5.0).shape == (0, 3)


def test_a_heading_east_turns_the_body_a_quarter_clockwise() -> None:
    half = math.sqrt(0.5)
    expected = np.array([[0, 0, 0, 1], [0, 0, -half, half]])
    np.testing.assert_allclose(body_quaternions(np.array([0.0, math.pi / 2])), expected, atol=1e-12)


def test_the_extent_holds_area_and_grid() -> None:
    # Heading east: the along axis (2 cells) points east, the across axis (4 cells, the first half outside) south.
    grid = Grid(100, 200, math.pi / 2, 10, 4, 2)
    run = RunInfo(1, "x", "0" * 64, 1, ClockMode.WALL, (Vertex(90, 180),), grid, 0.0, ())
    extent = extent_of(run)
    assert (extent.west_m, extent.south_m) == pytest.approx((90, 165))
    assert (extent.east_m, extent.north_m) == pytest.approx((120, 205))
    assert (extent.width_m, extent.height_m) == pytest.approx((30, 40))
    assert extent.centre == pytest.approx((105, 185))


@pytest.mark.parametrize(
    ("extent", "container"), [(Extent(0, 0, 1200, 400), "Vertical"), (Extent(0, 0, 400, 1200), "Horizontal")]
)
def test_the_layout_follows_the_area(extent: Extent, container: str) -> None:
    layout = mission_blueprint(extent, RUN).root_container
    assert type(layout).__name__ == container
    view = next(iter(layout.contents))
    assert isinstance(view, rrb.View)
    eye = view.properties["EyeControls3D"]
    assert isinstance(eye, rrb.EyeControls3D)
    assert eye.position is not None
    (x_m, y_m, height_m) = eye.position.as_arrow_array().to_pylist()[0]
    assert (x_m, y_m) == pytest.approx(extent.centre, abs=2)
    # High enough to see all of the area from top to bottom.
    assert 2 * height_m * math.tan(FIELD_OF_VIEW_RAD / 2) >= MARGIN * extent.height_m
