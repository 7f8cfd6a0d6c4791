"""The bands that together are worth most: rows of windows as wide as the swath, side by side, at a price for each
row."""

from __future__ import annotations

import numpy as np

from coordinator.cut.window import Window
from planner.types import FloatArray

MOST_ADDED = 16  # columns that are faster added one by one
TOLERANCE = 1e-9  # relative: sums that differ by no more count as equal


def side_by_side(worth: FloatArray, width: int, row_cost: float, fixed_cost: float) -> list[Window]:
    """The bands in windows of `width` columns that do not overlap which together are worth most beyond their costs;
    best first.

    `worth`: what one look brings of each cell, shape (rows, columns); `row_cost`: what each row of a band costs,
    `fixed_cost`: what each band does. Each is moved to the middle of what it holds, where it may overlap the next one
    on what holds nothing, or is flown over twice.
    """
    profit = _window_sums(worth, width) - row_cost
    value = np.zeros(profit.shape[1])
    first_row, end_row = np.zeros((2, value.size), dtype=np.intp)
    # No band brings more than all rows that bring anything.
    promising = np.flatnonzero(np.maximum(profit, 0.0).sum(axis=0) > fixed_cost * (1 + TOLERANCE))
    value[promising], first_row[promising], end_row[promising] = _best_bands(profit[:, promising])
    profits = (value - fixed_cost).tolist()
    most = [0.0] * (value.size + width)  # behind so many zeros: the most up to a window
    for place, here in enumerate(profits, start=width):
        most[place] = max(most[place - 1], most[place - width] + here)
    chosen: list[int] = []
    place = len(most) - 1
    while most[place] > 0:
        if most[place] == most[place - 1]:
            place -= 1
        else:
            chosen.append(place - width)
            place -= width
    bands = []
    for column in sorted(chosen, key=lambda one: -profits[one]):
        first, end = int(first_row[column]), int(end_row[column])
        moved_to = _centred(worth[first:end], column, width)
        bands.append(Window(first, end, moved_to, moved_to + width))
    return bands


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
    filled = np.flatnonzero(worth[:, column : column + width].any(axis=0))
    spare_left, spare_right = int(filled[0]), width - 1 - int(filled[-1])
    last: int = worth.shape[1] - width
    return min(max(column + (spare_left - spare_right) // 2, 0), last)
