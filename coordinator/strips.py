"""Cuts strips: rectangles along the tracks, as wide as the helper's swath, where a second look removes the most risk.

The risk that one look would remove is summed over every window as wide as the swath; along the window each metre has to
pay for the time it takes. The best window becomes a strip, its cells count as looked at, and the search goes on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coordinator.growth import Growth
from planner.types import BoolArray, FloatArray, GridSpec, Point, Strip

MOST_STRIPS_A_CUT = 100
SAME_PLACE = 0.75  # share of a run's cells
MOST_ADDED = 16  # columns that are faster added one by one
TOLERANCE = 1e-9  # relative: sums that differ by no more are taken as equal


@dataclass(frozen=True)
class CuttingRules:
    """`swath_m`: the helper's full swath; `p_detect`: its P_d there. `worth_risk`: mean residual risk over the swath
    from which a further metre is worth flying. `overhead_m`: what getting to a strip costs, in metres flown."""

    swath_m: float
    p_detect: float
    worth_risk: float
    overhead_m: float
    min_strip_m: float
    max_strip_m: float

    def columns(self, grid: GridSpec) -> int:
        """Whole columns of cells that the swath covers, at least one."""
        return columns_across(grid, self.swath_m)


@dataclass(frozen=True)
class Window:
    """A rectangle of whole cells: rows [first_row, end_row), columns [first_column, end_column)."""

    first_row: int
    end_row: int
    first_column: int
    end_column: int

    @property
    def cells(self) -> tuple[slice, slice]:
        """The window of the grid's arrays."""
        return slice(self.first_row, self.end_row), slice(self.first_column, self.end_column)

    def overlap(self, other: Window) -> float:
        """Shared cells as a share of the cells of both together."""
        shared = self.shared(other)
        return shared / (self.size + other.size - shared)

    def shared(self, other: Window) -> int:
        """Number of cells that lie in both."""
        rows = min(self.end_row, other.end_row) - max(self.first_row, other.first_row)
        columns = min(self.end_column, other.end_column) - max(self.first_column, other.first_column)
        return max(rows, 0) * max(columns, 0)

    @property
    def size(self) -> int:
        """Number of cells."""
        return (self.end_row - self.first_row) * (self.end_column - self.first_column)

    @property
    def columns(self) -> slice:
        """Its columns of the grid's arrays."""
        return slice(self.first_column, self.end_column)


@dataclass(frozen=True)
class Cut:
    """A strip's window and the risk that one look along it is expected to remove (residual risk times m2).
    `settles_s`: when all of it will have settled, 0 if it has; `descending`: whether it runs down the rows."""

    window: Window
    removable_m2: float
    settles_s: float = 0.0
    descending: bool = False


def cut_strips(
    grid: GridSpec,
    risk: FloatArray,
    open_cells: BoolArray,
    rules: CuttingRules,
    taken: Sequence[Window] = (),
    growth: Growth | None = None,
    columns: BoolArray | None = None,
) -> list[Cut]:
    """The strips worth flying, best first.

    `risk`: residual risk of the cells that a strip may serve, 0 elsewhere. `open_cells`: inside the area and not
    settled; what still grows towards such cells is left for later, unless it is as long as a strip may be. A strip is
    from `min_strip_m` to `max_strip_m` long, in whole cells. Best first: by what a run of rows removes beyond its cost.
    `taken`: strips that are being served; their cells count as looked at. No strip lies by three quarters or more on
    another one, or on one that is taken: whether a place is worth two looks is asked when it has had the first.
    `growth`: what is about to settle counts as if it had. `columns`: where to look, shape (columns,); windows that hold
    none of them are left out; None for everywhere.
    """
    growth = growth or Growth.none(grid)
    risk = np.where(growth.settles_s > 0, growth.risk, risk)
    open_cells = open_cells & (growth.settles_s == 0)
    width = rules.columns(grid)
    removable = risk * (rules.p_detect * grid.cell_area_m2)
    looked_at = list(taken)
    for window in taken:
        removable[window.cells] *= 1.0 - rules.p_detect
    row_cost = rules.worth_risk * rules.p_detect * width * grid.cell_area_m2
    fixed_cost = row_cost * rules.overhead_m / grid.cell_m
    shortest = max(1, round(rules.min_strip_m / grid.cell_m))
    longest = max(shortest, round(rules.max_strip_m / grid.cell_m))
    windows = grid.columns - width + 1
    value, first_row, end_row = np.zeros(windows), np.zeros(windows, dtype=np.intp), np.zeros(windows, dtype=np.intp)

    def look(columns: slice) -> None:
        """Looks for the best run in these columns' windows."""
        near = slice(max(0, columns.start - width + 1), min(windows, columns.stop))
        profit = _window_sums(removable[:, near.start : near.stop + width - 1], width) - row_cost
        # No run brings more than all rows that bring anything.
        promising = np.flatnonzero(np.maximum(profit, 0.0).sum(axis=0) > fixed_cost * (1 - TOLERANCE))
        value[near] = 0.0
        places = near.start + promising
        value[places], first_row[places], end_row[places] = _best_runs(profit[:, promising])

    to_look_at = np.ones(grid.columns, dtype=np.bool_) if columns is None else columns
    for stretch in stretches(removable.any(axis=0) & to_look_at):
        look(stretch)
    cuts: list[Cut] = []
    for _ in range(MOST_STRIPS_A_CUT):
        best = float(value.max())
        if best <= fixed_cost:
            break
        column = int((value >= best * (1 - TOLERANCE)).argmax())
        rows = (int(first_row[column]), int(end_row[column]))
        column = _centred(removable[rows[0] : rows[1]], column, width)
        run = Window(*rows, column, column + width)
        beside = slice(max(0, rows[0] - 1), rows[1] + 1), slice(column, column + width)
        least = longest if open_cells[beside].any() else shortest
        if rows[1] - rows[0] < least or any(run.shared(other) >= SAME_PLACE * run.size for other in looked_at):
            removable[run.cells] = 0.0  # the search goes on elsewhere
        else:
            for begin, end in _pieces(*rows, shortest, longest):
                window = Window(begin, end, column, column + width)
                settles_s = float(growth.settles_s[window.cells].max())
                descending = bool(growth.descending[window.cells].any())
                cut = Cut(window, float(removable[window.cells].sum()), settles_s, descending)
                if cut.removable_m2 - (end - begin) * row_cost > fixed_cost:
                    cuts.append(cut)
                    looked_at.append(window)
                    removable[window.cells] *= 1.0 - rules.p_detect
                else:
                    removable[window.cells] = 0.0
        look(slice(column, column + width))
    return cuts


def strip_of(grid: GridSpec, window: Window, number: int, *, descending: bool = False) -> Strip:
    """The rectangle of a window, with its centre line along the grid, up or down the rows."""
    across_m = ((window.first_column + window.end_column - 1) / 2) * grid.cell_m
    heading_rad = grid.frame.heading_rad
    if descending:
        heading_rad = (heading_rad + math.pi) % (2 * math.pi)
    x_m, y_m = grid.frame.to_mission(across_m, (window.end_row if descending else window.first_row) * grid.cell_m)
    start: Point = (float(x_m), float(y_m))
    length_m = (window.end_row - window.first_row) * grid.cell_m
    width_m = (window.end_column - window.first_column) * grid.cell_m
    return Strip(number, start, heading_rad, length_m, width_m)


def columns_across(grid: GridSpec, swath_m: float) -> int:
    """Whole columns of cells that a swath covers, at least one."""
    return min(grid.columns, max(1, math.floor(swath_m / grid.cell_m + TOLERANCE)))


def stretches(columns: BoolArray) -> list[slice]:
    """The stretches of neighbouring columns that are set."""
    edges = np.flatnonzero(np.diff(columns, prepend=False, append=False)).tolist()
    return [slice(first, end) for first, end in zip(edges[::2], edges[1::2], strict=True)]


def _window_sums(values: FloatArray, width: int) -> FloatArray:
    """Sums over `width` neighbouring columns, shape (rows, columns - width + 1)."""
    windows = values.shape[1] - width + 1
    if width > MOST_ADDED:
        total = np.zeros((values.shape[0], values.shape[1] + 1))
        values.cumsum(axis=1, out=total[:, 1:])
        return total[:, width:] - total[:, :windows]
    sums = values[:, :windows].copy()
    for column in range(1, width):
        sums += values[:, column : column + windows]
    return sums


def _best_runs(profit: FloatArray) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """For each window the run of rows with the largest sum: the sum, its first row, the row behind its last."""
    rows, windows = profit.shape
    total = np.zeros((rows + 1, windows))
    profit.cumsum(axis=0, out=total[1:])
    lowest_before = np.minimum.accumulate(total, axis=0)
    gain = total - lowest_before
    end_row = gain.argmax(axis=0)
    best = end_row, np.arange(windows)
    first_row = (total == lowest_before[best]).argmax(axis=0)
    return gain[best], first_row, end_row


def _centred(removable: FloatArray, column: int, width: int) -> int:
    """The window of columns moved so that what it holds lies in its middle, where it holds it with room to spare."""
    filled = np.flatnonzero(removable[:, column : column + width].any(axis=0))
    spare_left, spare_right = int(filled[0]), width - 1 - int(filled[-1])
    last: int = removable.shape[1] - width
    return min(max(column + (spare_left - spare_right) // 2, 0), last)


def _pieces(first: int, end: int, shortest: int, longest: int) -> list[tuple[int, int]]:
    """A run of rows in equal pieces; where these would be too short, in longest ones, and a rest that is left out."""
    count = -(-(end - first) // longest)
    if end - first < count * shortest:
        edges = list(range(first, end + 1, longest))
    else:
        edges = [round(first + (end - first) * piece / count) for piece in range(count + 1)]
    return list(pairwise(edges))
