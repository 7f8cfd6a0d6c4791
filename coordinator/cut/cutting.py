"""Cuts windows, along the tracks or across them and as wide as the helper's swath, where a second look is worth the
most.

What a look is expected to bring is summed over every window as wide as the swath; each metre of a strip, and each way
to one, has its price. Windows side by side are chosen that together bring most beyond that; their cells then count as
if they had been flown, and the search goes on with what is left. All of that is compiled.
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np

from coordinator.cut.ground import WORST, Ground
from coordinator.cut.strips import CuttingRules, cells_wide
from coordinator.cut.window import Window
from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, GridSpec, IntArray

MOST_PASSES = 6  # of the search, each over what those before have left
TOLERANCE = 1e-9  # relative: sums that differ by no more count as equal


class Left(NamedTuple):
    """Ground as windows that are flown leave it, see `Ground`, strips running up the rows; shape (rows, columns).
    `contacts`: what a look at the objects in a cell counts; `worth`: what a look at a cell does, all in all.

    `sums`, shape (windows, rows): what each row brings of every window of columns. Of each of these, shape (windows,),
    the band of rows that brings most: its `first_row`, `end_row`, the one behind its last, and `value`, what it brings
    beyond what its rows cost; where that `is_known`.
    """

    risk: FloatArray
    look: FloatArray
    weights: FloatArray
    contacts: FloatArray
    worth: FloatArray
    sums: FloatArray
    first_row: IntArray
    end_row: IntArray
    value: FloatArray
    is_known: BoolArray


class Terms(NamedTuple):
    """`mean`: what the risk counts that a look removes; `worst`: what as much of it as lies above the `threshold` does
    beside that. `row_cost`: what each row of a band costs; `fixed_cost`: what each band does. `shortest`,
    `longest`: of the strips into which a band is cut, in rows."""

    mean: float
    worst: float
    threshold: float
    row_cost: float
    fixed_cost: float
    shortest: int
    longest: int


class Cutting:
    """Ground as windows are cut of it and flown, all along the tracks, or all across them."""

    def __init__(self, grid: GridSpec, ground: Ground, rules: CuttingRules, *, across: bool = False) -> None:
        self._cell_m, self._rules, self._across = grid.cell_m, rules, across
        self._objective, self._threshold = ground.objective, ground.threshold
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
        _look_anew(self._left, self._terms(0.0), 0, rows, 0, columns)

    def _terms(self, price: float) -> Terms:
        shortest = max(1, round(self._rules.min_strip_m / self._cell_m))
        longest = max(shortest, round(self._rules.max_strip_m / self._cell_m))
        mean, worst, overhead_m = self._objective.mean, self._objective.worst / WORST, self._rules.overhead_m
        return Terms(mean, worst, self._threshold, price * self._cell_m, price * overhead_m, shortest, longest)

    def copy(self) -> Cutting:
        """One that may be cut by itself."""
        new, left = copy.copy(self), self._left
        own = {name: getattr(left, name).copy() for name in ("risk", "contacts", "worth", "sums")}
        bands = {name: getattr(left, name).copy() for name in ("first_row", "end_row", "value", "is_known")}
        new._left = left._replace(**own, **bands)
        return new

    def cut(self, price: float) -> list[Window]:
        """Cuts the windows worth flying at a price for each metre flown, those first that lie side by side; one that
        lies on another is worth a look when that has been flown. The ground is left as they leave it."""
        self._left.is_known[:] = False
        found = [Window(*each) for each in _cut(self._left, self._terms(price)).tolist()]
        return [one.turned for one in found] if self._across else found


@compiled
def _cut(left: Left, terms: Terms) -> IntArray:
    """The windows that are cut, shape (n, 4): first row, the one behind the last, and so their columns."""
    (rows, columns), (windows,) = left.risk.shape, left.value.shape
    most = (windows // (columns - windows + 1) + 1) * (rows // terms.shortest + 1)
    found, count = np.empty((MOST_PASSES * most, 4), np.int64), np.zeros(MOST_PASSES + 1, np.int64)
    for turn in range(MOST_PASSES):
        count[turn + 1] = _side_by_side(left, terms, found, count[turn])
        if count[turn + 1] == count[turn]:
            return found[: count[turn]]
        for first_row, end_row, first_column, end_column in found[count[turn] : count[turn + 1]]:
            for row in range(first_row, end_row):
                for column in range(first_column, end_column):
                    left.risk[row, column] *= 1.0 - left.look[row, column]
                    left.contacts[row, column] = 0.0
            _look_anew(left, terms, first_row, end_row, first_column, end_column)
    return found[: count[-1]]


@compiled
def _look_anew(left: Left, terms: Terms, first_row: int, end_row: int, first_column: int, end_column: int) -> None:
    """Works out what looks at some cells are worth, and what hangs on it."""
    windows, width = left.value.size, left.risk.shape[1] - left.value.size + 1
    for row in range(first_row, end_row):
        for column in range(first_column, end_column):
            risk, look = left.risk[row, column], left.look[row, column]
            above = max(risk - terms.threshold, 0.0) - max(risk * (1.0 - look) - terms.threshold, 0.0)
            worth = (terms.mean * risk * look + above * terms.worst) * left.weights[row, column]
            left.worth[row, column] = worth + left.contacts[row, column]
        for window in range(max(first_column - width + 1, 0), min(end_column, windows)):
            total = left.worth[row, window]
            for column in range(window + 1, window + width):
                total += left.worth[row, column]
            left.sums[window, row] = total
    for window in range(max(first_column - width + 1, 0), min(end_column, windows)):
        left.is_known[window] = False


@compiled
def _side_by_side(left: Left, terms: Terms, found: IntArray, count: int) -> int:
    """Puts behind the first so many the windows that do not overlap which together are worth most beyond their costs,
    best first, each cut into strips; returns how many there are then.

    Each is moved to the middle of what it holds, where it may overlap the next one on what holds nothing, or is flown
    over twice.
    """
    _find_bands(left, terms)
    width = left.risk.shape[1] - left.value.size + 1
    profits = left.value - terms.fixed_cost
    for window in _best_apart(profits, width):
        first, end = left.first_row[window], left.end_row[window]
        column = _centred(left.worth, first, end, window, width)
        edges = _edges(first, end, terms.shortest, terms.longest)
        for piece in range(edges.size - 1):
            begin, behind, counts = edges[piece], edges[piece + 1], 0.0
            for row in range(begin, behind):
                for its_column in range(column, column + width):
                    counts += left.worth[row, its_column]
            if counts > ((behind - begin) * terms.row_cost + terms.fixed_cost) * (1.0 + TOLERANCE):
                found[count] = begin, behind, column, column + width
                count += 1
    return count


@compiled
def _find_bands(left: Left, terms: Terms) -> None:
    """Finds the best band of each window of columns, where it is not known."""
    for window in range(left.value.size):
        if not left.is_known[window]:
            total = lowest = promising = left.value[window] = 0.0
            lowest_row = 0
            for row in range(left.sums.shape[1]):
                profit = left.sums[window, row] - terms.row_cost
                promising += max(profit, 0.0)
                total += profit
                if total < lowest:
                    lowest, lowest_row = total, row + 1
                if total - lowest > left.value[window]:
                    left.value[window] = total - lowest
                    left.first_row[window], left.end_row[window] = lowest_row, row + 1
            # No band brings more than all rows that bring anything.
            if promising <= terms.fixed_cost * (1.0 + TOLERANCE):
                left.value[window] = 0.0
            left.is_known[window] = True


@compiled
def _best_apart(profits: FloatArray, width: int) -> IntArray:
    """The windows of so many columns that do not overlap which together bring most, the best first; by what each
    brings, from the first column on."""
    most = np.zeros(profits.size + width)  # behind so many zeros: the most up to a window
    for place in range(width, most.size):
        most[place] = max(most[place - 1], most[place - width] + profits[place - width])
    chosen, count, place = np.empty(profits.size, np.int64), 0, most.size - 1
    while most[place] > 0:
        if most[place] == most[place - 1]:
            place -= 1
        else:
            place -= width
            at = count
            while at > 0 and profits[chosen[at - 1]] < profits[place]:
                chosen[at] = chosen[at - 1]
                at -= 1
            chosen[at], count = place, count + 1
    return chosen[:count]


@compiled
def _centred(worth: FloatArray, first_row: int, end_row: int, column: int, width: int) -> int:
    """The window of columns moved so that what it holds lies in its middle, where it holds it with room to spare."""
    first, last = width, -1  # of the columns that hold anything
    for row in range(first_row, end_row):
        for place in range(width):
            if worth[row, column + place] != 0.0:
                first, last = min(first, place), max(last, place)
    moved: int = min(max(column + (first - (width - 1 - last)) // 2, 0), worth.shape[1] - width)
    return moved


@compiled
def _edges(first: int, end: int, shortest: int, longest: int) -> IntArray:
    """Between which rows a band is cut: into equal pieces; where these would be too short, into longest ones, and a
    rest that is left out."""
    rows, pieces = end - first, -(-(end - first) // longest)
    if shortest <= rows <= longest:
        return np.array([first, end])
    if rows < pieces * shortest:
        return np.arange(first, end + 1, longest)
    edges = np.empty(pieces + 1, np.int64)
    for piece in range(pieces + 1):
        edges[piece] = np.rint(first + rows * piece / pieces)
    return edges
