"""How the map is cut for drawing: into blocks of whole tiles, so that a change draws little anew."""

from __future__ import annotations

from dataclasses import dataclass

from planner.tiles import TILE_CELLS
from planner.types import GridSpec

SMALLEST_CELLS = 2 * TILE_CELLS  # every drawing costs some 2 kB beside its cells
MOST_BLOCKS = 500  # each is an entity of its own, which the viewer has to find


@dataclass(frozen=True)
class Block:
    """One block: its name, its first cell and its window of the grid's arrays."""

    name: str
    first_row: int
    first_column: int
    window: tuple[slice, slice]


class Blocks:
    """All blocks of a grid, row by row; those at the far edges may be smaller.

    `are_large`: whether the grid is so large that they have longer edges than the shortest.
    """

    def __init__(self, grid: GridSpec) -> None:
        edge = SMALLEST_CELLS
        while -(-grid.rows // edge) * -(-grid.columns // edge) > MOST_BLOCKS:
            edge *= 2
        self._edge = edge
        self.are_large = edge > SMALLEST_CELLS
        self._a_row = -(-grid.columns // edge)
        self.all = tuple(
            Block(
                name=f"{row // edge}-{column // edge}",
                first_row=row,
                first_column=column,
                window=(slice(row, min(row + edge, grid.rows)), slice(column, min(column + edge, grid.columns))),
            )
            for row in range(0, grid.rows, edge)
            for column in range(0, grid.columns, edge)
        )

    def index_at(self, row: int, column: int) -> int:
        """The place in `all` of the block that a cell of the grid lies in."""
        return row // self._edge * self._a_row + column // self._edge
