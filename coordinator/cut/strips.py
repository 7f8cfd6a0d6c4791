"""Strips as they are cut: what is cut of which length, what a window counts, and the rectangle that it becomes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coordinator.cut.window import Window
from planner.types import GridSpec, Strip

ROUNDING = 1e-9  # of a cell


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
    return max(1, math.floor(swath_m / grid.cell_m + ROUNDING))
