"""Cuts strips: rectangles along the tracks, as wide as the helper's swath, where a second look removes the most risk.

The risk that one look would remove is summed over every window as wide as the swath; along the window each metre has to
pay for its time. Where helpers have not the time for all that is worth a look, windows side by side are chosen
that together remove most of what they do have time for. Then the best window becomes a strip, its cells count as if it
had been flown, and the search goes on.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from coordinator.cut.bands import TOLERANCE, Bands
from coordinator.cut.ground import Growth
from coordinator.cut.window import Window
from planner.types import BoolArray, FloatArray, GridSpec, Point, Strip

MOST_STRIPS_A_CUT = 100


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
class Cut:
    """A strip's window and the risk that one look along it is expected to remove (residual risk times m2); `counts_m2`:
    what that counts in the objective.
    `settles_s`: when all of it will have settled, 0 if it has; `descending`: whether it runs down the rows."""

    window: Window
    removable_m2: float
    counts_m2: float
    settles_s: float = 0.0
    descending: bool = False

    def strip(self, grid: GridSpec, number: int) -> Strip:
        """The strip that it becomes under a number."""
        return strip_of(grid, self.window, number, descending=self.descending)


def cut_strips(
    grid: GridSpec,
    risk: FloatArray,
    open_cells: BoolArray,
    rules: CuttingRules,
    claimed: Sequence[Window] = (),
    growth: Growth | None = None,
    columns: BoolArray | None = None,
    weights: FloatArray | None = None,
) -> list[Cut]:
    """The strips worth flying, best first; before them, where time is short, those that were chosen together.

    `risk`: residual risk of the cells that a strip may serve, 0 elsewhere. `open_cells`: inside the area and not
    settled; what still grows towards such cells is left for later, unless it is as long as a strip may be. A strip is
    from `min_strip_m` to `max_strip_m` long, in whole cells. Best first: by what a band of rows removes beyond its
    cost. `claimed`: strips that are being served; their cells count as if they had been. No strip lies by three
    quarters or more on another one, or on a claimed one: whether a place is worth two looks is asked when it has had
    the first. `growth`: what is about to settle counts as if it had. `columns`: where to search, shape (columns,);
    windows that hold none of them are left out; None for everywhere. `weights`: how many times a cell's risk counts
    when strips are compared, 1 if left out.
    """
    growth = growth or Growth.none(grid)
    removable = np.where(growth.settles_s > 0, growth.risk, risk) * (rules.p_detect * grid.cell_area_m2)
    counts = removable.copy() if weights is None else removable * weights
    cutting = _Cutting(grid, rules, removable, counts, open_cells & (growth.settles_s == 0), growth, claimed)
    cutting.search(counts.any(axis=0) & (np.ones(grid.columns, dtype=np.bool_) if columns is None else columns))
    dearer = rules.marginal_risk / rules.worth_risk
    together = dearer > 1
    for _ in range(MOST_STRIPS_A_CUT):
        found = cutting.bands.side_by_side(dearer) if together else []
        if not found:
            together, found = False, cutting.bands.best()
        if not found or len(cutting.cuts) >= MOST_STRIPS_A_CUT:
            break
        cutting.cut(found)
    return cutting.cuts


class _Cutting:
    """Cuts one strip after another from the same ground; for `open_cells`, `growth` and `claimed` see `cut_strips`.

    `removable`: what one look removes of each cell (residual risk times m2), and `counts`: what that counts; both are
    changed, so that they tell what the strips cut so far leave. `cuts`: these.
    """

    def __init__(
        self,
        grid: GridSpec,
        rules: CuttingRules,
        removable: FloatArray,
        counts: FloatArray,
        open_cells: BoolArray,
        growth: Growth,
        claimed: Iterable[Window],
    ) -> None:
        self.cuts: list[Cut] = []
        self._p_detect = rules.p_detect
        self._width = rules.columns(grid)
        self._shortest = max(1, round(rules.min_strip_m / grid.cell_m))
        self._longest = max(self._shortest, round(rules.max_strip_m / grid.cell_m))
        self._row_cost = rules.worth_risk * rules.p_detect * self._width * grid.cell_area_m2
        self._fixed_cost = self._row_cost * rules.overhead_m / grid.cell_m
        self._removable, self._counts, self._open_cells, self._growth = removable, counts, open_cells, growth
        self._claimed: list[Window] = []
        for window in claimed:
            self._claim(window)
        self.bands = Bands(counts, self._width, self._row_cost, self._fixed_cost)

    def search(self, columns: BoolArray) -> None:
        """Searches these columns, shape (columns,), for the best bands."""
        for stretch in stretches(columns):
            self.bands.search(stretch)

    def cut(self, windows: Sequence[Window]) -> None:
        """Cuts strips from these bands; where one of them gives none the search goes on without it, as others may then
        be chosen beside."""
        no_strips = [window for window in windows if not self._gives_strips(window)]
        for window in no_strips:
            self._counts[window.cells] = 0.0
        for window in [] if no_strips else windows:
            for begin, end in _pieces(window.first_row, window.end_row, self._shortest, self._longest):
                self._cut_piece(replace(window, first_row=begin, end_row=end))
        changed = np.zeros(self._counts.shape[1], dtype=np.bool_)
        for window in no_strips or windows:
            changed[window.columns] = True
        self.search(changed)

    def _gives_strips(self, window: Window) -> bool:
        beside = slice(max(0, window.first_row - 1), window.end_row + 1), window.columns
        least = self._longest if self._open_cells[beside].any() else self._shortest
        return window.rows >= least and not window.is_at_one_of(self._claimed)

    def _cut_piece(self, window: Window) -> None:
        settles_s = float(self._growth.settles_s[window.cells].max())
        descending = bool(self._growth.descending[window.cells].any())
        removed_m2, counts_m2 = (float(each[window.cells].sum()) for each in (self._removable, self._counts))
        pays = counts_m2 > (window.rows * self._row_cost + self._fixed_cost) * (1 + TOLERANCE)
        if pays and not window.is_at_one_of(self._claimed):
            self.cuts.append(Cut(window, removed_m2, counts_m2, settles_s, descending))
            self._claim(window)
        else:
            self._counts[window.cells] = 0.0

    def _claim(self, window: Window) -> None:
        """What a look leaves in a window is all that counts there from now on."""
        self._claimed.append(window)
        self._removable[window.cells] *= 1.0 - self._p_detect
        self._counts[window.cells] *= 1.0 - self._p_detect


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
    """A band of rows in equal pieces; where these would be too short, in longest ones, and a rest that is left out."""
    count = -(-(end - first) // longest)
    if end - first < count * shortest:
        edges = list(range(first, end + 1, longest))
    else:
        edges = [round(first + (end - first) * piece / count) for piece in range(count + 1)]
    return list(pairwise(edges))
