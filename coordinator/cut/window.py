"""A rectangle of the grid's cells, where a strip is cut, and what it shares with others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

SAME_PLACE = 0.75  # share of a window's cells


@dataclass(frozen=True)
class Window:
    """A rectangle of whole cells: rows [first_row, end_row), columns [first_column, end_column). Its strip runs up the
    rows, along the tracks, or `across` them, along the columns."""

    first_row: int
    end_row: int
    first_column: int
    end_column: int
    across: bool = False

    @property
    def cells(self) -> tuple[slice, slice]:
        """The window of the grid's arrays."""
        return slice(self.first_row, self.end_row), self.columns

    @property
    def bounds(self) -> tuple[int, int, int, int]:
        """Its first row, the one behind its last, and so its columns."""
        return self.first_row, self.end_row, self.first_column, self.end_column

    @property
    def columns(self) -> slice:
        """Its columns of the grid's arrays."""
        return slice(self.first_column, self.end_column)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.end_row - self.first_row

    @property
    def columns_wide(self) -> int:
        """Number of columns."""
        return self.end_column - self.first_column

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.rows * self.columns_wide

    def holds(self, row: int, column: int) -> bool:
        """Whether a cell lies in it."""
        return self.first_row <= row < self.end_row and self.first_column <= column < self.end_column

    def moved(self, rows: int, columns: int) -> Window:
        """The same so many rows and columns farther."""
        first_row, first_column = self.first_row + rows, self.first_column + columns
        return Window(first_row, self.end_row + rows, first_column, self.end_column + columns, self.across)

    def within(self, other: Window) -> Window:
        """What of it lies in another with which it shares cells, as that counts its rows and columns."""
        first_row, first_column = max(self.first_row, other.first_row), max(self.first_column, other.first_column)
        end_row, end_column = min(self.end_row, other.end_row), min(self.end_column, other.end_column)
        part = Window(first_row, end_row, first_column, end_column, self.across)
        return part.moved(-other.first_row, -other.first_column)

    @property
    def turned(self) -> Window:
        """The same on the grid with rows and columns exchanged."""
        return Window(self.first_column, self.end_column, self.first_row, self.end_row, not self.across)

    def in_blocks(self, block: int) -> Window:
        """The blocks of so many cells a side that hold it."""
        first_row, first_column = self.first_row // block, self.first_column // block
        return Window(first_row, -(-self.end_row // block), first_column, -(-self.end_column // block), self.across)

    def in_cells(self, block: int, shape: tuple[int, int]) -> Window:
        """The cells of a window of blocks, as far as a grid of that shape goes."""
        end_row, end_column = min(self.end_row * block, shape[0]), min(self.end_column * block, shape[1])
        return Window(self.first_row * block, end_row, self.first_column * block, end_column, self.across)

    @property
    def cells_long(self) -> int:
        """Number of cells that its strip is long."""
        return self.columns_wide if self.across else self.rows

    def shared(self, other: Window) -> int:
        """Number of cells that lie in both."""
        if self.end_column <= other.first_column or other.end_column <= self.first_column:
            return 0  # soon told, as most pairs lie apart
        if self.end_row <= other.first_row or other.end_row <= self.first_row:
            return 0
        rows = min(self.end_row, other.end_row) - max(self.first_row, other.first_row)
        columns = min(self.end_column, other.end_column) - max(self.first_column, other.first_column)
        return rows * columns

    def overlap(self, other: Window) -> float:
        """Shared cells as a share of the cells of both together."""
        shared = self.shared(other)
        return shared / (self.size + other.size - shared) if shared else 0.0

    def is_at_one_of(self, others: Iterable[Window]) -> bool:
        """Whether three quarters of it lie in one of these."""
        least = SAME_PLACE * self.size
        return any(self.shared(other) >= least for other in others)
