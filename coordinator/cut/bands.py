"""The bands that together are worth most: rows of windows as wide as the swath, side by side, at a price for each
row."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy

import numpy as np

from coordinator.cut.ground import CELLS_AT_ONCE
from coordinator.cut.window import Window
from planner.types import BoolArray, FloatArray

MOST_ADDED = 16  # columns that are faster added one by one
TOLERANCE = 1e-9  # relative: sums that differ by no more count as equal


class Bands:
    """Bands in windows of `width` columns of a map, which is searched at one price after another and may change; where
    nothing has changed since the last search they are known.

    `worth`: what one look brings of each cell, shape (rows, columns).
    """

    def __init__(self, worth: FloatArray, width: int) -> None:
        self._worth, self._width = worth, width
        self._sums = _window_sums(worth, width)
        self._costs = (np.nan, np.nan)  # those by which what follows was found, of each window of columns
        self._changed: BoolArray = np.ones(self._sums.shape[1], dtype=np.bool_)  # where it is not known any more
        self._value: FloatArray = np.zeros(self._changed.size)
        self._first_row, self._end_row = np.zeros((2, self._changed.size), dtype=np.intp)

    def copy(self) -> Bands:
        """One that may be changed by itself."""
        new = copy(self)
        new._value, new._first_row, new._end_row = self._value.copy(), self._first_row.copy(), self._end_row.copy()
        new._changed = self._changed.copy()
        return new

    def change(self, worth: FloatArray, windows: Iterable[Window]) -> None:
        """From now on looks bring this, which is something else at cells of these windows alone."""
        self._worth, self._sums = worth, _window_sums(worth, self._width)
        for window in windows:
            self._changed[max(window.first_column - self._width + 1, 0) : window.end_column] = True
        if self._width > MOST_ADDED:  # rounding reaches farther
            self._changed[:] = True

    def side_by_side(self, row_cost: float, fixed_cost: float) -> list[Window]:
        """The bands that do not overlap which together are worth most beyond their costs; best first.

        `row_cost`: what each row of a band costs, `fixed_cost`: what each band does. Each is moved to the middle of
        what it holds, where it may overlap the next one on what holds nothing, or is flown over twice.
        """
        self._find(row_cost, fixed_cost)
        profits = (self._value - fixed_cost).tolist()
        bands = []
        for column in sorted(_best_apart(profits, self._width), key=lambda one: -profits[one]):
            first, end = int(self._first_row[column]), int(self._end_row[column])
            moved_to = _centred(self._worth[first:end], column, self._width)
            bands.append(Window(first, end, moved_to, moved_to + self._width))
        return bands

    def _find(self, row_cost: float, fixed_cost: float) -> None:
        """Finds the best band of each window of columns, where it is not known."""
        if self._costs != (row_cost, fixed_cost):
            self._costs, self._changed[:] = (row_cost, fixed_cost), True
        (changed,) = self._changed.nonzero()
        at_once = max(1, CELLS_AT_ONCE // len(self._sums))
        for begin in range(0, changed.size, at_once):
            columns = changed[begin : begin + at_once]
            profit = self._sums.take(columns, axis=1)
            profit -= row_cost
            # No band brings more than all rows that bring anything.
            promising = np.maximum(profit, 0.0).sum(axis=0) > fixed_cost * (1 + TOLERANCE)
            self._value[columns] = 0.0
            if promising.any():
                columns = columns[promising]
                found = _best_bands(profit[:, promising])
                self._value[columns], self._first_row[columns], self._end_row[columns] = found
        self._changed[:] = False


def _best_apart(profits: Sequence[float], width: int) -> list[int]:
    """The windows of so many columns that do not overlap which together bring most; by what each brings, from the first
    column on."""
    most = [0.0] * (len(profits) + width)  # behind so many zeros: the most up to a window
    for place, here in enumerate(profits, start=width):
        without, with_it = most[place - 1], most[place - width] + here
        most[place] = with_it if with_it > without else without
    chosen: list[int] = []
    place = len(most) - 1
    while most[place] > 0:
        if most[place] == most[place - 1]:
            place -= 1
        else:
            chosen.append(place - width)
            place -= width
    return chosen


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


def _best_bands(profit: FloatArray) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """For each window the band with the largest sum: the sum, its first row, the row behind its last."""
    rows, windows = profit.shape
    total = np.zeros((rows + 1, windows))
    profit.cumsum(axis=0, out=total[1:])
    lowest_before = np.minimum.accumulate(total, axis=0)
    gain = total - lowest_before
    end_row = gain.argmax(axis=0)
    best = end_row, np.arange(windows)
    first_row = (total == lowest_before[best]).argmax(axis=0)
    return gain[best], first_row, end_row


def _centred(worth: FloatArray, column: int, width: int) -> int:
    """The window of columns moved so that what it holds lies in its middle, where it holds it with room to spare."""
    (filled,) = np.logical_or.reduce(worth[:, column : column + width], axis=0).nonzero()
    spare_left, spare_right = int(filled[0]), width - 1 - int(filled[-1])
    last: int = worth.shape[1] - width
    return min(max(column + (spare_left - spare_right) // 2, 0), last)
