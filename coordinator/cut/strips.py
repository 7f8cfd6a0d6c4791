"""Cuts strips: rectangles along the tracks or across them, as wide as the helper's swath, where a second look is worth
the most.

What a look is expected to bring is summed over every window as wide as the swath; each metre of a strip, and each way
to one, has its price. Windows side by side are chosen that together bring most beyond that; their cells then count as
if they had been flown, and the search goes on with what is left.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from itertools import pairwise

from coordinator.cut.bands import TOLERANCE, Bands
from coordinator.cut.ground import Ground
from coordinator.cut.window import Window
from planner.types import GridSpec, Strip

MOST_PASSES = 6  # of the search, each over what those before have left


@dataclass(frozen=True)
class CuttingRules:
    """`swath_m`: the helper's full swath. `overhead_m`: what getting to a strip costs, in metres flown. A strip is from
    `min_strip_m` to `max_strip_m` long, in whole cells."""

    swath_m: float
    overhead_m: float
    min_strip_m: float
    max_strip_m: float

    def metres_flown(self, length_m: float) -> float:
        """For a strip of some length, the way there included."""
        return length_m + self.overhead_m


@dataclass(frozen=True)
class Counted:
    """A strip's window, and what one look along it counts in the objective (residual risk times m2)."""

    window: Window
    counts_m2: float

    def strip(self, grid: GridSpec, number: int) -> Strip:
        """The strip that it becomes under a number."""
        return strip_of(grid, self.window, number)


@dataclass(frozen=True)
class Cut(Counted):
    """The same and the risk that the look is expected to remove (residual risk times m2). `foreseen`: whether most of
    what it counts is expected, and not seen yet; `why`: what makes it so, in words."""

    removable_m2: float
    foreseen: bool = False
    why: str = ""


class Cutting:
    """Ground as windows are cut of it and flown, all along the tracks, or all across them."""

    def __init__(self, grid: GridSpec, ground: Ground, rules: CuttingRules, *, across: bool = False) -> None:
        self._cell_m, self._rules, self._across = grid.cell_m, rules, across
        left = ground.copy()
        self._ground = left.turned if across else left  # as it lies when strips run up the rows
        width = min(self._ground.risk.shape[1], cells_wide(grid, rules.swath_m))
        self._worth = self._ground.worth()
        self._bands = Bands(self._worth, width)

    def copy(self) -> Cutting:
        """One that may be cut by itself."""
        new = copy(self)
        new._ground, new._bands = self._ground.copy(), self._bands.copy()
        return new

    def cut(self, price: float) -> list[Window]:
        """Cuts the windows worth flying at a price for each metre flown, those first that lie side by side; one that
        lies on another is worth a look when that has been flown. The ground is left as they leave it."""
        found = list[Window]()
        for _ in range(MOST_PASSES):
            new = self._side_by_side(price)
            if not new:
                break
            for window in new:
                self._ground.fly(window)
            self._worth = self._ground.worth()
            self._bands.change(self._worth, new)
            found += new
        return [one.turned for one in found] if self._across else found

    def _side_by_side(self, price: float) -> list[Window]:
        """Windows up the rows that pay for themselves."""
        row_cost, fixed_cost = price * self._cell_m, price * self._rules.overhead_m
        shortest = max(1, round(self._rules.min_strip_m / self._cell_m))
        longest = max(shortest, round(self._rules.max_strip_m / self._cell_m))
        found = []
        for band in self._bands.side_by_side(row_cost, fixed_cost):
            for begin, end in _pieces(band.first_row, band.end_row, shortest, longest):
                piece = Window(begin, end, band.first_column, band.end_column)
                counts_m2 = float(self._worth[piece.cells].sum())
                if counts_m2 > (piece.rows * row_cost + fixed_cost) * (1 + TOLERANCE):
                    found.append(piece)
        return found


def strip_of(grid: GridSpec, window: Window, number: int) -> Strip:
    """The rectangle of a window, with its centre line up the grid's rows, or across them."""
    first_across_m, width_m = (window.first_column - 0.5) * grid.cell_m, window.columns_wide * grid.cell_m
    first_along_m, length_m = window.first_row * grid.cell_m, window.rows * grid.cell_m
    heading_rad = grid.frame.heading_rad
    if window.across:
        start = grid.frame.to_mission(first_across_m, first_along_m + length_m / 2)
        heading_rad, length_m, width_m = (heading_rad + math.pi / 2) % (2 * math.pi), width_m, length_m
    else:
        start = grid.frame.to_mission(first_across_m + width_m / 2, first_along_m)
    return Strip(number, start, heading_rad, length_m, width_m)


def cells_wide(grid: GridSpec, swath_m: float) -> int:
    """Whole cells that a swath covers side by side, at least one."""
    return max(1, math.floor(swath_m / grid.cell_m + TOLERANCE))


def _pieces(first: int, end: int, shortest: int, longest: int) -> list[tuple[int, int]]:
    """A band of rows in equal pieces; where these would be too short, in longest ones, and a rest that is left out."""
    if shortest <= end - first <= longest:
        return [(first, end)]
    count = -(-(end - first) // longest)
    if end - first < count * shortest:
        edges = list(range(first, end + 1, longest))
    else:
        edges = [round(first + (end - first) * piece / count) for piece in range(count + 1)]
    return list(pairwise(edges))
