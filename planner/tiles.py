"""How the grid is cut into tiles, the pieces in which coverage is published."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from planner.types import BoolArray, FloatArray, GridSpec, Point, Window

TILE_CELLS = 20  # 20 x 20 cells in two channels and a mask stay under 1 kB


@dataclass(frozen=True)
class Tile:
    """One tile: its name, its first cell and its window of the grid's arrays."""

    name: str
    first_row: int
    first_column: int
    window: Window

    def __hash__(self) -> int:
        return hash((self.first_row, self.first_column))


@lru_cache(maxsize=4)  # all vehicles of a fleet have one grid, and a large one has thousands
def tiles(grid: GridSpec) -> tuple[Tile, ...]:
    """All tiles of a grid, row by row; those at the far edges may be smaller."""
    return tuple(
        Tile(
            name=f"{row // TILE_CELLS}-{column // TILE_CELLS}",
            first_row=row,
            first_column=column,
            window=(
                slice(row, min(row + TILE_CELLS, grid.rows)),
                slice(column, min(column + TILE_CELLS, grid.columns)),
            ),
        )
        for row in range(0, grid.rows, TILE_CELLS)
        for column in range(0, grid.columns, TILE_CELLS)
    )


def tiles_holding(grid: GridSpec, all_tiles: tuple[Tile, ...], cells: BoolArray) -> list[Tile]:
    """The tiles, out of all of the grid's, that hold one of these cells; `cells`: shape grid.shape."""
    rows, columns = np.divmod(np.flatnonzero(cells), grid.columns)
    held = np.zeros(len(all_tiles), dtype=np.bool_)
    held[rows // TILE_CELLS * -(-grid.columns // TILE_CELLS) + columns // TILE_CELLS] = True
    return [all_tiles[place] for place in np.flatnonzero(held).tolist()]


def tiles_about(grid: GridSpec, all_tiles: tuple[Tile, ...], points: Sequence[Point]) -> list[Tile]:
    """The tiles, out of all of the grid's, that share a cell with the rectangle about some points, mission frame."""
    x_m, y_m = np.asarray(points).T
    across_m, along_m = grid.frame.to_sweep(x_m, y_m)
    columns = _cells(across_m / grid.cell_m + 0.5, grid.columns)
    return tiles_within(grid, all_tiles, _cells(along_m / grid.cell_m, grid.rows), columns)


def tiles_within(grid: GridSpec, all_tiles: tuple[Tile, ...], rows: slice, columns: slice) -> list[Tile]:
    """The tiles, out of all of the grid's, that share a cell with a window."""
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return []
    a_row = -(-grid.columns // TILE_CELLS)
    return [
        all_tiles[row * a_row + column]
        for row in range(rows.start // TILE_CELLS, (rows.stop - 1) // TILE_CELLS + 1)
        for column in range(columns.start // TILE_CELLS, (columns.stop - 1) // TILE_CELLS + 1)
    ]


def _cells(places: FloatArray, count: int) -> slice:
    """The cells, out of `count`, from the smallest to the largest of these places, counted in cells."""
    return slice(max(0, math.floor(places.min())), min(count, math.ceil(places.max())))


def tile_shape(grid: GridSpec, first_row: int, first_column: int) -> tuple[int, int]:
    """How many rows and columns the tile has that begins at a cell.

    Raises:
        ValueError: no tile of the grid begins there.
    """
    on_grid = 0 <= first_row < grid.rows and 0 <= first_column < grid.columns
    if not on_grid or first_row % TILE_CELLS or first_column % TILE_CELLS:
        raise ValueError(f"no tile of a grid of {grid.rows} x {grid.columns} begins at {first_row}, {first_column}")
    return min(TILE_CELLS, grid.rows - first_row), min(TILE_CELLS, grid.columns - first_column)
