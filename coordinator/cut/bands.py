"""The best bands, rows of windows as wide as the swath: one alone, or those side by side that together bring most."""

from __future__ import annotations

import numpy as np

from coordinator.cut.window import Window
from planner.types import FloatArray

MOST_ADDED = 16  # columns that are faster added one by one
TOLERANCE = 1e-9  # relative: sums that differ by no more count as equal


class Bands:
    """The best band in every window of columns as wide as the swath: what it removes beyond what its rows cost.

    `removable`: what one look removes of each cell, as it counts; `search` again where it has changed. `fixed_cost`:
    of each strip.
    """

    def __init__(self, removable: FloatArray, width: int, row_cost: float, fixed_cost: float) -> None:
        self._removable = removable
        self._width = width
        self._row_cost = row_cost
        self._fixed_cost = fixed_cost
        self._windows = removable.shape[1] - width + 1
        self._value = np.zeros(self._windows)
        self._first_row, self._end_row = np.zeros((2, self._windows), dtype=np.intp)

    def search(self, columns: slice) -> None:
        """Searches for the best bands in these columns' windows."""
        near = slice(max(0, columns.start - self._width + 1), min(self._windows, columns.stop))
        profit = (
            _window_sums(self._removable[:, near.start : near.stop + self._width - 1], self._width) - self._row_cost
        )
        # No band brings more than all rows that bring anything.
        promising = np.flatnonzero(np.maximum(profit, 0.0).sum(axis=0) > self._fixed_cost * (1 - TOLERANCE))
        self._value[near] = 0.0
        places = near.start + promising
        self._value[places], self._first_row[places], self._end_row[places] = _best_bands(profit[:, promising])

    def best(self) -> list[Window]:
        """The best band, if one is worth its costs."""
        best = float(self._value.max())
        return [self._band(int((self._value >= best * (1 - TOLERANCE)).argmax()))] if best > self._fixed_cost else []

    def side_by_side(self, dearer: float) -> list[Window]:
        """The bands in windows that do not overlap which together bring most, if all costs so much more; best first.

        Their rows are those of the best bands at the price as it is. Each is then moved to the middle of what it holds,
        where it may overlap the next one on what holds nothing, or is flown over twice.
        """
        rows_cost = (self._end_row - self._first_row) * self._row_cost
        profits = self._value - (dearer - 1.0) * rows_cost - dearer * self._fixed_cost
        if not (profits > 0).any():
            return []
        profit = profits.tolist()
        most = [0.0] * (self._windows + self._width)  # behind so many zeros: the most up to a window
        for place, here in enumerate(profit, start=self._width):
            most[place] = max(most[place - 1], most[place - self._width] + here)
        chosen: list[int] = []
        place = len(most) - 1
        while most[place] > 0:
            if most[place] == most[place - 1]:
                place -= 1
            else:
                chosen.append(place - self._width)
                place -= self._width
        return [self._band(column) for column in sorted(chosen, key=lambda one: -profit[one])]

    def _band(self, column: int) -> Window:
        first, end = int(self._first_row[column]), int(self._end_row[column])
        moved_to = _centred(self._removable[first:end], column, self._width)
        return Window(first, end, moved_to, moved_to + self._width)


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


def _centred(removable: FloatArray, column: int, width: int) -> int:
    """The window of columns moved so that what it holds lies in its middle, where it holds it with room to spare."""
    filled = np.flatnonzero(removable[:, column : column + width].any(axis=0))
    spare_left, spare_right = int(filled[0]), width - 1 - int(filled[-1])
    last: int = removable.shape[1] - width
    return min(max(column + (spare_left - spare_right) // 2, 0), last)
