"""Points inside a polygon, against a general library."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from planner.region import points_inside

COLUMNS, ROWS = np.arange(12.0), np.arange(9.0)
HALVES = st.integers(-4, 26).map(lambda half: half / 2)


def inside_by_shapely(polygon: shapely.Polygon) -> np.ndarray:
    return np.asarray(shapely.contains_xy(polygon, *np.meshgrid(COLUMNS, ROWS)))


@given(st.lists(st.tuples(HALVES, HALVES), min_size=3, max_size=9, unique=True))
def test_they_are_those_that_a_general_library_finds(corners: list[tuple[float, float]]) -> None:
    # About their middle by angle: simple, and through points of the lattice as often as past them.
    middle = np.mean(corners, axis=0)
    corners.sort(key=lambda corner: float(np.arctan2(corner[1] - middle[1], corner[0] - middle[0])))
    polygon = shapely.Polygon(corners)
    if polygon.is_valid:
        x, y = np.array(corners).T
        assert (points_inside(x, y, COLUMNS, ROWS) == inside_by_shapely(polygon)).all()
        assert (points_inside(x[::-1], y[::-1], COLUMNS, ROWS) == inside_by_shapely(polygon)).all()


def test_a_rectangle_with_its_sides_on_the_lattice_holds_what_is_between_them() -> None:
    inside = points_inside(np.array([2.0, 6, 6, 2]), np.array([1.0, 1, 5, 5]), COLUMNS, ROWS)
    expected = np.zeros((9, 12), dtype=bool)
    expected[2:5, 3:6] = True
    assert (inside == expected).all()


def test_nothing_lies_in_what_is_beside_the_lattice_or_begins_at_its_last_column() -> None:
    assert not points_inside(np.array([20.0, 30, 25]), np.array([1.0, 1, 5]), COLUMNS, ROWS).any()
    assert not points_inside(np.array([11.0, 14, 14, 11]), np.array([1.0, 1, 5, 5]), COLUMNS, ROWS).any()
