"""Patches of hot cells: where anything about them is new, and which numbers they carry on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, IntArray

NumberArray = NDArray[np.int32]

NOT_HOT = -1.0
"""As a cell's risk: that it is not hot."""


@compiled
def compared(
    hot: BoolArray,
    unsettled: BoolArray,
    risk: FloatArray,
    growing: BoolArray,
    risk_before: FloatArray,
    growing_before: BoolArray,
) -> tuple[int, int, int, int]:
    """Marks in the risk which cells are not hot, and which of those that are touch an unsettled one by a side, as
    growing; returns the first and last row and column in which either is another than before, the last row -1 if none.

    All of one shape, (rows, columns); `growing` comes without any.
    """
    rows, columns = hot.shape
    first_row, last_row, first_column, last_column = rows, -1, columns, -1
    for row in range(rows):
        for column in range(columns):
            if not hot[row, column]:
                risk[row, column] = NOT_HOT
            elif (
                (row > 0 and unsettled[row - 1, column])
                or (row + 1 < rows and unsettled[row + 1, column])
                or (column > 0 and unsettled[row, column - 1])
                or (column + 1 < columns and unsettled[row, column + 1])
            ):
                growing[row, column] = True
            if risk[row, column] != risk_before[row, column] or growing[row, column] != growing_before[row, column]:
                first_row, last_row = min(first_row, row), row
                first_column, last_column = min(first_column, column), max(last_column, column)
    return first_row, last_row, first_column, last_column


class Carried(NamedTuple):
    """The patches in a window of a map, under the numbers that they carry on.

    `numbers`: that of each of the map's cells, 0 for none; `next_number`: the next new one. By patch, in the order of
    labels: `labels`, `number_of`, `sizes` in cells, `risk_sums` over these, `is_growing`: whether any of these is,
    `is_reshaped`: whether the number had others before, and `bounds`: the first row, the one behind the last, and so of
    columns, counted from the window's. `gone`: the numbers there that no patch carries on, in the order of their first
    cells, row by row; `heirs`: of each the number that now has most of its cells, of equals the lowest, 0 for none.
    """

    numbers: NumberArray
    next_number: int
    labels: IntArray
    number_of: IntArray
    sizes: IntArray
    risk_sums: FloatArray
    is_growing: BoolArray
    is_reshaped: BoolArray
    bounds: IntArray
    gone: IntArray
    heirs: IntArray


@compiled
def carried_on(
    labels_there: NumberArray,
    begin: tuple[int, int],
    count: int,
    risk: FloatArray,
    growing: BoolArray,
    before: NumberArray,
    next_number: int,
    areas_m2: tuple[float, float],
) -> Carried:
    """Which numbers the patches of a window carry on; see `planner.hotspots.update_hotspots`.

    Args:
        labels_there: the patch of each of the window's cells, from 1, 0 for none; shape of the window.
        begin: the row and column of the map at which the window begins.
        count: how many patches there are.
        risk: residual risk of the map's cells.
        growing: which of these touch an unsettled one.
        before: the numbers that these had.
        next_number: the next new one, above all of these.
        areas_m2: of a cell, and of the smallest patch that counts.
    """
    rows, columns = labels_there.shape
    cells_of = np.zeros(count + 1, np.int64)
    had, place_of_number, known = np.empty(next_number, np.int64), np.full(next_number, -1, np.int64), 0
    for row in range(rows):
        for column in range(columns):
            cells_of[labels_there[row, column]] += 1
            number = before[begin[0] + row, begin[1] + column]
            if number > 0 and place_of_number[number] < 0:
                had[known], place_of_number[number] = number, known
                known += 1
    labels, place_of, kept = np.empty(count, np.int64), np.full(count + 1, -1, np.int64), 0
    for label in range(1, count + 1):
        if cells_of[label] * areas_m2[0] >= areas_m2[1]:
            labels[kept], place_of[label] = label, kept
            kept += 1
    labels, had = labels[:kept].copy(), had[:known].copy()

    risk_sums, is_growing, bounds = np.zeros(kept), np.zeros(kept, np.bool_), np.empty((kept, 4), np.int64)
    bounds[:, 0], bounds[:, 2], bounds[:, 3] = rows, columns, 0
    shared = np.zeros((kept, known), np.int64)  # how many of a patch's cells had a number
    for row in range(rows):
        for column in range(columns):
            place = place_of[labels_there[row, column]]
            if place >= 0:
                at_row, at_column = begin[0] + row, begin[1] + column
                risk_sums[place] += risk[at_row, at_column]
                is_growing[place] |= growing[at_row, at_column]
                bounds[place, 0], bounds[place, 1] = min(bounds[place, 0], row), row + 1
                bounds[place, 2], bounds[place, 3] = min(bounds[place, 2], column), max(bounds[place, 3], column + 1)
                if before[at_row, at_column] > 0:
                    shared[place, place_of_number[before[at_row, at_column]]] += 1

    sizes = cells_of[labels]
    number_of, is_carried_on = _numbers(shared, had, sizes)
    first_new = next_number
    for place in range(kept):
        if number_of[place] == 0:
            number_of[place] = next_number
            next_number += 1

    numbers, is_reshaped, has_lost = before.copy(), np.zeros(kept, np.bool_), np.zeros(known, np.bool_)
    for row in range(rows):
        for column in range(columns):
            place, number = place_of[labels_there[row, column]], before[begin[0] + row, begin[1] + column]
            now = number_of[place] if place >= 0 else 0
            if now != number:
                numbers[begin[0] + row, begin[1] + column] = now
                if place >= 0:
                    is_reshaped[place] = True
                if number > 0:
                    has_lost[place_of_number[number]] = True
    for place in range(kept):
        if number_of[place] < first_new:
            is_reshaped[place] |= has_lost[place_of_number[number_of[place]]]

    heirs = np.zeros(known, np.int64)
    for one in range(known):
        most = 0
        for place in range(kept):
            if shared[place, one] > most or (shared[place, one] == most > 0 and number_of[place] < heirs[one]):
                most, heirs[one] = shared[place, one], number_of[place]
    is_gone = ~is_carried_on
    return Carried(
        numbers,
        next_number,
        labels,
        number_of,
        sizes,
        risk_sums,
        is_growing,
        is_reshaped,
        bounds,
        had[is_gone],
        heirs[is_gone],
    )


@compiled
def _numbers(shared: IntArray, had: IntArray, sizes: IntArray) -> tuple[IntArray, BoolArray]:
    """The number of each patch, 0 where it carries on none, and which numbers are carried on.

    `shared`: how many of a patch's cells had a number before, shape (patches, numbers); `had`: these numbers; `sizes`:
    how many cells the patches have.
    """
    number_of, is_taken = np.zeros(len(sizes), np.int64), np.zeros(len(had), np.bool_)
    # Nobody takes another number before everybody had a chance at the one wanted most.
    for takes_another in (False, True):
        for place in np.argsort(-sizes, kind="mergesort"):
            best = -1
            for one in range(len(had)):
                ahead = shared[place, one] - (shared[place, best] if best >= 0 else 0)
                is_free = not (takes_another and is_taken[one])
                if is_free and (ahead > 0 or (ahead == 0 and best >= 0 and had[one] < had[best])):
                    best = one
            if best >= 0 and not is_taken[best] and number_of[place] == 0:
                number_of[place], is_taken[best] = had[best], True
    return number_of, is_taken


def _map_of_one() -> tuple[FloatArray, BoolArray]:
    return np.ones((1, 1)), np.ones((1, 1), dtype=np.bool_)


compared.called_with(lambda: (*np.ones((2, 1, 1), dtype=np.bool_), *_map_of_one(), *_map_of_one()))
carried_on.called_with(
    lambda: (np.ones((1, 1), np.int32), (0, 0), 1, *_map_of_one(), np.ones((1, 1), np.int32), 2, (1.0, 1.0))
)
