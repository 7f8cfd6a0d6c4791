"""Cuts strips: rectangles along the tracks, as wide as the helper's swath, where a second look removes the most risk.

The risk that one look would remove is summed over every window as wide as the swath; along the window each metre has to
pay for the time it takes. Where helpers have not the time for all that is worth a look, windows side by side are chosen
that together remove most of what they do have time for. Then the best window becomes a strip, its cells count as looked
at, and the search goes on.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from coordinator.cut.ground import Growth
from coordinator.cut.runs import TOLERANCE, Runs
from planner.types import BoolArray, FloatArray, GridSpec, Point, Strip

MOST_STRIPS_A_CUT = 100
SAME_PLACE = 0.75  # share of a run's cells


@dataclass(frozen=True)
class CuttingRules:
    """`swath_m`: the helper's full swath; `p_detect`: its P_d there. `worth_risk`: mean residual risk over the swath
    from which a further metre is worth flying. `marginal_risk`: that of the last metre that helpers have time for;
    where it is more, strips from there up are chosen together. `overhead_m`: what getting to a strip costs, in metres
    flown."""

    swath_m: float
    p_detect: float
    worth_risk: float
    overhead_m: float
    min_strip_m: float
    max_strip_m: float
    marginal_risk: float = field(default=0.0, compare=False)

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
    def rows(self) -> int:
        """Number of rows."""
        return self.end_row - self.first_row

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.rows * (self.end_column - self.first_column)

    @property
    def columns(self) -> slice:
        """Its columns of the grid's arrays."""
        return slice(self.first_column, self.end_column)


@dataclass(frozen=True)
class Cut:
    """A strip's window and the risk that one look along it is expected to remove (residual risk times m2); `counts_m2`:
    what that counts in the objective.
    `settles_s`: when all of it will have settled, 0 if it has; `descending`: whether it runs down the rows."""

    window: Window
    removable_m2: float
    counts_m2: float
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
    weights: FloatArray | None = None,
) -> list[Cut]:
    """The strips worth flying, best first; before them, where time is short, those that were chosen together.

    `risk`: residual risk of the cells that a strip may serve, 0 elsewhere. `open_cells`: inside the area and not
    settled; what still grows towards such cells is left for later, unless it is as long as a strip may be. A strip is
    from `min_strip_m` to `max_strip_m` long, in whole cells. Best first: by what a run of rows removes beyond its cost.
    `taken`: strips that are being served; their cells count as looked at. No strip lies by three quarters or more on
    another one, or on one that is taken: whether a place is worth two looks is asked when it has had the first.
    `growth`: what is about to settle counts as if it had. `columns`: where to look, shape (columns,); windows that hold
    none of them are left out; None for everywhere. `weights`: how many times a cell's risk counts
    when strips are compared, 1 if left out.
    """
    growth = growth or Growth.none(grid)
    risk = np.where(growth.settles_s > 0, growth.risk, risk)
    open_cells = open_cells & (growth.settles_s == 0)
    width = rules.columns(grid)
    removable = risk * (rules.p_detect * grid.cell_area_m2)
    counts = removable.copy() if weights is None else removable * weights
    looked_at = list(taken)
    for window in taken:
        removable[window.cells] *= 1.0 - rules.p_detect
        counts[window.cells] *= 1.0 - rules.p_detect
    shortest = max(1, round(rules.min_strip_m / grid.cell_m))
    longest = max(shortest, round(rules.max_strip_m / grid.cell_m))
    row_cost = rules.worth_risk * rules.p_detect * width * grid.cell_area_m2
    fixed_cost = row_cost * rules.overhead_m / grid.cell_m
    runs = Runs(counts, width, row_cost, fixed_cost)
    to_look_at = np.ones(grid.columns, dtype=np.bool_) if columns is None else columns
    for stretch in stretches(counts.any(axis=0) & to_look_at):
        runs.look(stretch)
    dearer = rules.marginal_risk / rules.worth_risk
    together = dearer > 1
    cuts: list[Cut] = []
    for _ in range(MOST_STRIPS_A_CUT):
        found = runs.side_by_side(dearer) if together else []
        if not found:
            together, found = False, runs.best()
        if not found or len(cuts) >= MOST_STRIPS_A_CUT:
            break
        chosen = [Window(one.first_row, one.end_row, one.first_column, one.first_column + width) for one in found]
        no_strips = []
        for run in chosen:
            beside = slice(max(0, run.first_row - 1), run.end_row + 1), run.columns
            least = longest if open_cells[beside].any() else shortest
            if run.rows < least or _is_one_of(run, looked_at):
                no_strips.append(run)
                counts[run.cells] = 0.0  # the search goes on elsewhere, and others are chosen
        for run in [] if no_strips else chosen:
            for begin, end in _pieces(run.first_row, run.end_row, shortest, longest):
                window = Window(begin, end, run.first_column, run.end_column)
                settles_s = float(growth.settles_s[window.cells].max())
                descending = bool(growth.descending[window.cells].any())
                removed_m2, counts_m2 = (float(each[window.cells].sum()) for each in (removable, counts))
                pays = counts_m2 > ((end - begin) * row_cost + fixed_cost) * (1 + TOLERANCE)
                if pays and not _is_one_of(window, looked_at):
                    cuts.append(Cut(window, removed_m2, counts_m2, settles_s, descending))
                    looked_at.append(window)
                    removable[window.cells] *= 1.0 - rules.p_detect
                    counts[window.cells] *= 1.0 - rules.p_detect
                else:
                    counts[window.cells] = 0.0
        changed = np.zeros(grid.columns, dtype=np.bool_)
        for run in no_strips or chosen:
            changed[run.columns] = True
        for stretch in stretches(changed):
            runs.look(stretch)
    return cuts


def _is_one_of(window: Window, others: Iterable[Window]) -> bool:
    """Whether one of these is at the same place."""
    return any(window.shared(other) >= SAME_PLACE * window.size for other in others)


def strip_of(grid: GridSpec, window: Window, number: int, *, descending: bool = False) -> Strip:
    """The rectangle of a window, with its centre line along the grid, up or down the rows."""
    across_m = ((window.first_column + window.end_column - 1) / 2) * grid.cell_m
    heading_rad = grid.frame.heading_rad
    if descending:
        heading_rad = (heading_rad + math.pi) % (2 * math.pi)
    x_m, y_m = grid.frame.to_mission(across_m, (window.end_row if descending else window.first_row) * grid.cell_m)
    start: Point = (float(x_m), float(y_m))
    length_m = window.rows * grid.cell_m
    width_m = (window.end_column - window.first_column) * grid.cell_m
    return Strip(number, start, heading_rad, length_m, width_m)


def columns_across(grid: GridSpec, swath_m: float) -> int:
    """Whole columns of cells that a swath covers, at least one."""
    return min(grid.columns, max(1, math.floor(swath_m / grid.cell_m + TOLERANCE)))


def stretches(columns: BoolArray) -> list[slice]:
    """The stretches of neighbouring columns that are set."""
    edges = np.flatnonzero(np.diff(columns, prepend=False, append=False)).tolist()
    return [slice(first, end) for first, end in zip(edges[::2], edges[1::2], strict=True)]


def _pieces(first: int, end: int, shortest: int, longest: int) -> list[tuple[int, int]]:
    """A run of rows in equal pieces; where these would be too short, in longest ones, and a rest that is left out."""
    count = -(-(end - first) // longest)
    if end - first < count * shortest:
        edges = list(range(first, end + 1, longest))
    else:
        edges = [round(first + (end - first) * piece / count) for piece in range(count + 1)]
    return list(pairwise(edges))
