"""The columns of the grid that a leg along them sees, or the rows that one across does."""

from __future__ import annotations

from dataclasses import dataclass

from coordinator.cut.strips import cells_wide
from planner.types import GridSpec


@dataclass(frozen=True, slots=True)
class Swath:
    """A leg's swath of `width` columns, as wide as a strip for the same sensor would be. Of a leg across, read rows.

    A leg at column c sees columns c - `left` to c + `right`. Its line lies in their middle, as a strip's does: on
    column c where the width is odd, half a cell before it where it is even.
    """

    width: int

    @classmethod
    def of(cls, grid: GridSpec, swath_m: float) -> Swath:
        """The swath of a sensor that sees so many metres across."""
        return cls(min(grid.columns, cells_wide(grid, swath_m)))

    @property
    def left(self) -> int:
        """Columns seen before the leg's own."""
        return self.width // 2

    @property
    def right(self) -> int:
        """Columns seen behind the leg's own."""
        return (self.width - 1) // 2

    def columns(self, column: int, count: int) -> slice:
        """Which of a grid's `count` columns a leg at a column sees."""
        return slice(max(0, column - self.left), min(count, column + self.right + 1))

    def line(self, column: int) -> float:
        """Where a leg's line lies, in columns."""
        return column + (self.right - self.left) / 2

    def column_at(self, line: float) -> int:
        """The column of the leg whose line is nearest."""
        return round(line - (self.right - self.left) / 2)
