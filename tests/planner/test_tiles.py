"""Tiles: together they hold each cell of the grid once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.tiles import TILE_CELLS, tile_shape, tiles, tiles_about, tiles_holding
from planner.types import GridSpec, SweepFrame


def grid_of(rows: int, columns: int) -> GridSpec:
    return GridSpec(SweepFrame(0, 0, 0), 5, columns, rows)


grids = st.builds(grid_of, st.integers(1, 70), st.integers(1, 70))


@given(grids)
def test_tiles_hold_each_cell_once(grid: GridSpec) -> None:
    count = np.zeros(grid.shape, dtype=int)
    for tile in tiles(grid):
        count[tile.window] += 1
        assert count[tile.window].shape == tile_shape(grid, tile.first_row, tile.first_column)
        assert count[tile.window].size <= TILE_CELLS**2
        rows, columns = tile.window
        assert (rows.start, columns.start) == (tile.first_row, tile.first_column)
        assert rows.stop <= grid.rows
        assert columns.stop <= grid.columns
    assert (count == 1).all()


@given(grids)
def test_tiles_have_names_of_their_own(grid: GridSpec) -> None:
    names = [tile.name for tile in tiles(grid)]
    assert len(set(names)) == len(names)
    assert len(set(tiles(grid))) == len(names)


@pytest.mark.parametrize("part", [(1, 9, 0, 12), (0, 8, 0, 12), (0, 9, 1, 12), (0, 9, 0, 11), (2, 7, 3, 10)])
def test_the_cells_of_a_part_of_a_grid_lie_where_those_of_the_grid_do(part: tuple[int, int, int, int]) -> None:
    grid = GridSpec(SweepFrame(3, 4, 0.3), 5, 12, 9)
    first_row, end_row, first_column, end_column = part
    some = grid.part(*part)
    assert some.shape == (end_row - first_row, end_column - first_column)
    at = some.frame.to_mission(some.across_m[-1], some.along_m[0])
    assert at == pytest.approx(grid.frame.to_mission(grid.across_m[end_column - 1], grid.along_m[first_row]))
    assert grid.part(0, 9, 0, 12) is grid


def test_the_tiles_of_the_papers_grid() -> None:
    every = tiles(grid_of(80, 243))
    assert len(every) == 4 * 13
    assert [tile.name for tile in every[:3]] == ["0-0", "0-1", "0-2"]
    last = every[-1]
    assert (last.name, last.first_row, last.first_column) == ("3-12", 60, 240)
    assert last.window == (slice(60, 80), slice(240, 243))


@given(grids, st.data())
def test_tiles_that_hold_cells_are_told_row_by_row(grid: GridSpec, data: st.DataObject) -> None:
    cells = st.tuples(st.integers(0, grid.rows - 1), st.integers(0, grid.columns - 1))
    marked = np.zeros(grid.shape, dtype=bool)
    for cell in data.draw(st.lists(cells, max_size=8)):
        marked[cell] = True
    every = tiles(grid)
    assert tiles_holding(grid, every, marked) == [tile for tile in every if marked[tile.window].any()]


@pytest.mark.parametrize("place", [(-20, 0), (0, -20), (80, 0), (0, 260), (10, 0), (0, 241), (10**12, 0), (0, 2**70)])
def test_no_tile_begins_elsewhere(place: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="no tile"):
        tile_shape(grid_of(80, 243), *place)


@pytest.mark.parametrize(
    ("corners", "names"),
    [
        # Cells of 5 m, columns centred at 0, 5 and so on: column 20 begins at 97.5 m, row 20 at 100 m.
        ([(10, 10), (97, 99)], ["0-0"]),
        ([(10, 10), (98, 99)], ["0-0", "0-1"]),
        ([(10, 10), (97, 101)], ["0-0", "1-0"]),
        ([(110, 110), (300, 130)], ["1-1", "1-2"]),
        ([(-50, -50), (-10, -10)], []),
        ([(500, 500), (600, 600)], []),
    ],
)
def test_tiles_about_points_share_a_cell_with_the_rectangle_about_them(
    corners: list[tuple[float, float]], names: list[str]
) -> None:
    grid = grid_of(40, 60)
    assert [tile.name for tile in tiles_about(grid, tiles(grid), corners)] == names
