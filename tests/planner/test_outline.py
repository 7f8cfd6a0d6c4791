"""Outlines of patches of cells: exact for few vertices, simpler and no smaller for many."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from compiling import needs_compiling, times_compiled
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from planner.outline import _holds_any, _vertices, outline
from planner.types import BoolArray

Corner = tuple[int, int]


def cells_of(picture: str) -> BoolArray:
    """A patch drawn with its first row at the bottom."""
    return np.array([[mark == "#" for mark in line] for line in reversed(picture.split())])


corners = st.tuples(st.integers(0, 9), st.integers(0, 9))


@given(st.tuples(corners, corners, corners), st.sets(corners, max_size=60))
# One on each side.
@example(((0, 0), (0, 4), (4, 4)), {(0, 2)})
@example(((0, 0), (0, 4), (4, 4)), {(2, 4)})
@example(((0, 0), (4, 4), (4, 0)), {(4, 2)})
@example(((0, 0), (4, 4), (4, 0)), {(2, 0)})
# Of each corner both figures: where one is the least, the other is the greatest.
@example(((0, 4), (4, 4), (4, 0)), {(1, 3)})
@example(((4, 4), (4, 0), (0, 4)), {(1, 3)})
@example(((4, 0), (0, 4), (4, 4)), {(1, 3)})
@example(((0, 0), (0, 4), (4, 0)), {(1, 3)})
@example(((0, 4), (4, 0), (0, 0)), {(1, 3)})
@example(((4, 0), (0, 0), (0, 4)), {(1, 3)})
def test_whether_a_triangle_holds_any_vertex(triangle: tuple[Corner, Corner, Corner], vertices: set[Corner]) -> None:
    area = shapely.Polygon(triangle)
    assume(area.area > 0)
    if area.exterior.is_ccw:
        triangle = triangle[::-1]  # it bends right
    others = vertices - set(triangle)
    ring = np.array([*triangle, *others])
    places = np.arange(len(ring))
    assert _holds_any(ring, np.roll(places, 1), 1, np.roll(places, -1)) == any(
        area.covers(shapely.Point(one)) for one in others
    )


def fill_one_by_one(cells: BoolArray, most_vertices: int) -> shapely.Polygon:
    """The definition: the smallest notch that leaves the polygon simple is filled, again and again."""
    polygon = shapely.Polygon(exterior_of(cells))
    while len(polygon.exterior.coords) - 1 > most_vertices:
        ring = list(polygon.exterior.coords)[:-1]
        smaller = []
        for k, corner in enumerate(ring):
            filled = shapely.Polygon(ring[:k] + ring[k + 1 :])
            triangle = shapely.Polygon([ring[k - 1], corner, ring[(k + 1) % len(ring)]])
            gained = filled.area - polygon.area
            if filled.is_valid and gained >= 0 and gained == triangle.area:
                smaller.append((gained, corner, filled))
        if not smaller:
            return polygon
        polygon = min(smaller, key=lambda choice: choice[:2])[2]
    return polygon


def exterior_of(cells: BoolArray) -> shapely.LinearRing:
    """A patch's outer boundary without needless vertices, counterclockwise."""
    rows, columns = np.nonzero(cells)
    patch = shapely.union_all(shapely.box(columns, rows, columns + 1, rows + 1))
    assert isinstance(patch, shapely.Polygon)
    exterior = shapely.orient_polygons(shapely.Polygon(patch.exterior)).exterior
    ring = list(exterior.coords)[:-1]
    bends = [
        (b[0] - a[0]) * (c[1] - b[1]) != (b[1] - a[1]) * (c[0] - b[0])
        for a, b, c in zip([ring[-1], *ring], ring, [*ring[1:], ring[0]], strict=False)
    ]
    return shapely.LinearRing([corner for corner, bend in zip(ring, bends, strict=True) if bend])


@st.composite
def patches(draw: st.DrawFn, side: int = 24) -> BoolArray:
    """A walk over a grid that leaves cells behind: one patch, often with holes and ragged sides."""
    rng = np.random.default_rng(draw(st.integers(0, 1_000_000)))
    steps = np.array([(0, 1), (0, -1), (1, 0), (-1, 0)])[rng.integers(0, 4, draw(st.integers(1, side * side // 2)))]
    cells = np.zeros((side, side), dtype=bool)
    row, column = side // 2, side // 2
    for down, right in steps.tolist():
        cells[row, column] = True
        row, column = min(max(row + down, 0), side - 1), min(max(column + right, 0), side - 1)
    return cells


class TestByHand:
    def test_one_cell(self) -> None:
        assert outline(np.array([[False, True]]), 40).tolist() == [[2, 0], [2, 1], [1, 1], [1, 0]]

    def test_a_patch_with_few_vertices_keeps_its_exact_boundary(self) -> None:
        vertices = outline(cells_of("#.. ##. ###"), 40)
        assert shapely.Polygon(vertices).equals(
            shapely.Polygon([(0, 0), (3, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3)])
        )
        assert len(vertices) == 8

    def test_of_too_many_vertices_the_smallest_notches_are_filled(self) -> None:
        # The notch on the left is one cell deep, the one on the right three.
        cells = cells_of("######## .####... ######## ########")
        polygon = shapely.Polygon(outline(cells, 10))
        assert polygon.contains(shapely.box(0, 2, 1, 3))
        assert not polygon.contains(shapely.box(5, 2, 8, 3))

    def test_a_hole_is_filled(self) -> None:
        assert shapely.Polygon(outline(cells_of("### #.# ###"), 40)).area == 9

    def test_a_hole_closed_by_corners_only_is_filled(self) -> None:
        polygon = shapely.Polygon(outline(cells_of("##. #.# ###"), 40))
        assert polygon.is_valid
        assert polygon.area == 8

    def test_a_round_patch_gets_straight_sides_about_it(self) -> None:
        row, column = np.mgrid[:100, :100]
        cells = (row - 50) ** 2 + (column - 50) ** 2 < 2400
        polygon = shapely.Polygon(outline(cells, 12))
        assert len(polygon.exterior.coords) == 13
        # A regular polygon of 12 sides about a circle is 2.4 % larger than it.
        assert cells.sum() < polygon.area < 1.06 * cells.sum()

    @pytest.mark.parametrize("tip", [11, 12, 13, 14])
    @pytest.mark.parametrize("most_vertices", range(6, 14))
    def test_no_notch_is_filled_over_the_tip_of_a_finger(self, tip: int, most_vertices: int) -> None:
        # A plate with a step on the left and a wall on the right, from which a finger points at the step.
        cells = np.zeros((20, 40), dtype=bool)
        cells[:5], cells[5:10, :14], cells[10:14, :10], cells[5:, 30:], cells[11, tip:] = True, True, True, True, True
        polygon = shapely.Polygon(outline(cells, most_vertices))
        assert polygon.is_valid
        assert polygon.equals(fill_one_by_one(cells, most_vertices))
        assert len(polygon.exterior.coords) - 1 <= most_vertices

    @pytest.mark.parametrize("most_vertices", range(6, 18))
    def test_nor_over_a_corner_that_lies_right_on_its_side(self, most_vertices: int) -> None:
        # Once those beside it are filled there is a notch (3, 0), (4, 1), (7, 2), of one cell in all: without it the
        # side would touch the finger's corner at (5, 1).
        cells = cells_of("############ #######...## #######...## ####......## ###..#######")
        polygon = shapely.Polygon(outline(cells, most_vertices))
        assert polygon.is_valid
        assert polygon.equals(fill_one_by_one(cells, most_vertices))


class TestProperties:
    @settings(max_examples=60)
    @given(patches(side=18), st.integers(8, 20))
    def test_fills_the_smallest_notch_first(self, cells: BoolArray, most_vertices: int) -> None:
        expected = fill_one_by_one(cells, most_vertices)
        assume(len(expected.exterior.coords) - 1 <= most_vertices)
        assert shapely.Polygon(outline(cells, most_vertices)).equals(expected)

    @settings(max_examples=200)
    @given(patches(), st.sampled_from([4, 6, 10, 20, 40]))
    def test_covers_the_patch_with_few_vertices(self, cells: BoolArray, most_vertices: int) -> None:
        vertices = outline(cells, most_vertices)
        polygon = shapely.Polygon(vertices)
        assert len(vertices) <= most_vertices
        assert polygon.is_valid
        assert polygon.exterior.is_ccw
        rows, columns = np.nonzero(cells)
        patch = shapely.union_all(shapely.box(columns, rows, columns + 1, rows + 1))
        assert shapely.covers(polygon.buffer(1e-9), patch)
        hull = patch.convex_hull
        assert isinstance(hull, shapely.Polygon)
        if len(hull.exterior.coords) - 1 <= most_vertices:
            assert shapely.covers(hull, polygon)

    @given(patches())
    def test_with_vertices_enough_is_the_boundary_itself(self, cells: BoolArray) -> None:
        rows, columns = np.nonzero(cells)
        patch = shapely.union_all(shapely.box(columns, rows, columns + 1, rows + 1))
        assert isinstance(patch, shapely.Polygon)
        assert shapely.Polygon(outline(cells, 10_000)).equals(shapely.Polygon(patch.exterior))


@needs_compiling
def test_is_compiled_for_one_kind_of_arguments() -> None:
    for cells in (cells_of("#.. ##. ###").T, cells_of("#.#.#. ######")[:, ::2]):
        outline(cells, 5)
    assert times_compiled(_vertices) == 1
