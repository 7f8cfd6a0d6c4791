"""Cuts strips: rectangles along the tracks or across them, as wide as the helper's swath, where a second look is worth
the most, at a price for each metre."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coordinator.cut.ground import Ground
from coordinator.cut.search import TOLERANCE, Costs, Left, look_anew, windows_for
from coordinator.cut.window import Window
from planner.types import GridSpec, Strip


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

    def cells_long(self, grid: GridSpec) -> tuple[int, int]:
        """The shortest strip, and the longest, in cells of a grid."""
        shortest = max(1, round(self.min_strip_m / grid.cell_m))
        return shortest, max(shortest, round(self.max_strip_m / grid.cell_m))


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
    """Ground as windows are to be cut of it, all along the tracks, or all across them."""

    def __init__(self, grid: GridSpec, ground: Ground, rules: CuttingRules, *, across: bool = False) -> None:
        self._across = across
        self._counts = ground.counts
        lies = ground.turned if across else ground
        rows, columns = lies.risk.shape
        windows = columns - min(columns, cells_wide(grid, rules.swath_m)) + 1
        self._left = Left(
            risk=np.array(lies.risk, order="C"),
            look=np.ascontiguousarray(lies.look),
            weights=np.ascontiguousarray(lies.weights),
            contacts=np.zeros((rows, columns)) if lies.contacts is None else np.array(lies.contacts[0], order="C"),
            worth=np.empty((rows, columns)),
            sums=np.empty((windows, rows)),
            first_row=np.zeros(windows, dtype=np.int64),
            end_row=np.zeros(windows, dtype=np.int64),
            value=np.zeros(windows),
            is_known=np.zeros(windows, dtype=np.bool_),
        )
        look_anew(self._left, self._counts, 0, rows, 0, columns)
        self._metres = Costs(float(grid.cell_m), float(rules.overhead_m), *rules.cells_long(grid))

    def cut(self, price: float, least_price: float, time_m: float) -> tuple[list[Window], float]:
        """As many windows as there is time for and some to spare, those first that lie side by side; one that lies on
        another is worth a look when that has been flown. With the price of a metre at which they are so many, see
        `windows_for`."""
        found, price = windows_for(self._left, self._counts, self._metres, price, least_price, float(time_m))
        windows = [Window(*each) for each in found.tolist()]
        return ([one.turned for one in windows] if self._across else windows), price


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
