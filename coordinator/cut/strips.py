"""Cuts strips: rectangles along the tracks or across them, as wide as the helper's swath, where a second look is worth
the most.

What a look is expected to bring is summed over every window as wide as the swath; each metre of a strip, and each way
to one, has its price. Windows side by side are chosen that together bring most beyond that; their cells then count as
if they had been flown, and the search goes on with what is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

from coordinator.cut.bands import TOLERANCE, side_by_side
from coordinator.cut.ground import Ground
from coordinator.cut.window import Window
from planner.types import GridSpec, Point, Strip

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


def cut_windows(
    grid: GridSpec, ground: Ground, rules: CuttingRules, price: float, *, across: bool = False
) -> list[Window]:
    """The windows worth flying at a price for each metre flown, those first that lie side by side; all along the
    tracks, or all across them. One that lies on another is worth a look when that has been flown."""
    left, found = ground.copy(), list[Window]()
    as_cut = left.turned if across else left
    for _ in range(MOST_PASSES):
        new = _side_by_side(grid, as_cut, rules, price)
        if not new:
            break
        for window in new:
            as_cut.fly(window)
        found += new
    return [one.turned for one in found] if across else found


def _side_by_side(grid: GridSpec, ground: Ground, rules: CuttingRules, price: float) -> list[Window]:
    """Windows up the rows that pay for themselves."""
    width = min(ground.risk.shape[1], cells_wide(grid, rules.swath_m))
    worth, cell_m = ground.worth(), grid.cell_m
    row_cost, fixed_cost = price * cell_m, price * rules.overhead_m
    shortest = max(1, round(rules.min_strip_m / cell_m))
    longest = max(shortest, round(rules.max_strip_m / cell_m))
    found = []
    for band in side_by_side(worth, width, row_cost, fixed_cost):
        for begin, end in _pieces(band.first_row, band.end_row, shortest, longest):
            piece = replace(band, first_row=begin, end_row=end)
            if float(worth[piece.cells].sum()) > (piece.rows * row_cost + fixed_cost) * (1 + TOLERANCE):
                found.append(piece)
    return found


def strip_of(grid: GridSpec, window: Window, number: int) -> Strip:
    """The rectangle of a window, with its centre line up the grid's rows, or across them."""
    first_across_m, width_m = (window.first_column - 0.5) * grid.cell_m, window.columns_wide * grid.cell_m
    first_along_m, length_m = window.first_row * grid.cell_m, window.rows * grid.cell_m
    heading_rad = grid.frame.heading_rad
    if window.across:
        x_m, y_m = grid.frame.to_mission(first_across_m, first_along_m + length_m / 2)
        heading_rad, length_m, width_m = (heading_rad + math.pi / 2) % (2 * math.pi), width_m, length_m
    else:
        x_m, y_m = grid.frame.to_mission(first_across_m + width_m / 2, first_along_m)
    start: Point = (float(x_m), float(y_m))
    return Strip(number, start, heading_rad, length_m, width_m)


def cells_wide(grid: GridSpec, swath_m: float) -> int:
    """Whole cells that a swath covers side by side, at least one."""
    return max(1, math.floor(swath_m / grid.cell_m + TOLERANCE))


def _pieces(first: int, end: int, shortest: int, longest: int) -> list[tuple[int, int]]:
    """A band of rows in equal pieces; where these would be too short, in longest ones, and a rest that is left out."""
    count = -(-(end - first) // longest)
    if end - first < count * shortest:
        edges = list(range(first, end + 1, longest))
    else:
        edges = [round(first + (end - first) * piece / count) for piece in range(count + 1)]
    return list(pairwise(edges))
