"""Patches of hot cells: where anything about them is new, which cells touch, and which numbers they carry on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.compiled import compiled
from planner.types import BoolArray, FloatArray, IntArray

NumberArray = NDArray[np.int32]

NOT_HOT = -1.0
"""As a cell's risk: that it is not hot."""


class Carried(NamedTuple):
    """The patches of hot cells in a map, under the numbers that they carry on.

    `window`: the blocks that hold all that is new, by the first row, the one behind the last, and so of columns; where
    it holds none the rest says nothing. `labels_there`: the label of the patch of each cell there, 0 for none.
    `numbers`: that of each of the map's cells, 0 for none; `next_number`: the next new one. By patch in the window that
    is large enough, in the order of labels: `labels`, `number_of`, `sizes` in cells, `risk_sums` over these,
    `is_growing`: whether any of these is, `is_reshaped`: whether the number had others before, and `bounds`: the first
    row, the one behind the last, and so of columns, counted from the window's. `gone`: the numbers there that no patch
    carries on, in the order of their first cells, row by row; `heirs`: of each the number that now has most of its
    cells, of equals the lowest, 0 for none. Of all of the map's cells: `risk`, NOT_HOT where they are not hot, and
    `growing`: which hot ones touch an unsettled one by a side.
    """

    window: tuple[int, int, int, int]
    labels_there: NumberArray
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
    risk: FloatArray
    growing: BoolArray


@compiled
def carried_on(
    hot: BoolArray,
    unsettled: BoolArray,
    risk: FloatArray,
    part: tuple[int, int, int, int],
    risk_before: FloatArray,
    growing_before: BoolArray,
    before: NumberArray,
    next_number: int,
    block: int,
    areas_m2: tuple[float, float],
) -> Carried:
    """Which numbers the patches of a map carry on; see `planner.hotspots.update_hotspots`. All arrays are of its shape.

    Args:
        hot: the cells of which there are patches.
        unsettled: the cells that may come to be hot.
        risk: residual risk.
        part: where any of these three may be another than the last time: the first row, the one behind the last, and so
            of columns. Of other cells only those that touch these are looked at.
        risk_before: what came of `risk` then; NaN for what is to count as new.
        growing_before: what `growing` was then.
        before: the number of each cell then, 0 for none.
        next_number: the next new one, above all of these.
        block: patches end at the borders of blocks of so many rows and columns, >= 1.
        areas_m2: of a cell, and of the smallest patch that counts.
    """
    risk_now, growing = risk_before.copy(), growing_before.copy()
    first_row, last_row, first_column, last_column = _compared(hot, unsettled, risk, part, risk_now, growing)
    begin = first_row // block * block, first_column // block * block
    rows = min(last_row // block * block + block, hot.shape[0]) - begin[0]
    columns = min(last_column // block * block + block, hot.shape[1]) - begin[1]
    there = np.empty(max(rows, 0) * max(columns, 0), np.bool_)
    for row in range(rows):
        for column in range(columns):
            there[row * columns + column] = hot[begin[0] + row, begin[1] + column]
    labels_in_rows, count = _labels(there, columns, block)
    labels_there = labels_in_rows.reshape((max(rows, 0), max(columns, 0)))
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

    sizes, risk_sums, is_growing = np.empty(kept, np.int64), np.zeros(kept), np.zeros(kept, np.bool_)
    bounds = np.zeros((kept, 4), np.int64)
    for place in range(kept):
        sizes[place], bounds[place, 0], bounds[place, 2] = cells_of[labels[place]], rows, columns
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

    gone, heirs, count_gone = np.empty(known, np.int64), np.zeros(known, np.int64), 0
    for one in range(known):
        if not is_carried_on[one]:
            heir = -1
            for place in range(kept):
                ahead = shared[place, one] - (shared[heir, one] if heir >= 0 else 0)
                if ahead > 0 or (ahead == 0 and heir >= 0 and number_of[place] < number_of[heir]):
                    heir = place
            gone[count_gone], heirs[count_gone] = had[one], number_of[heir] if heir >= 0 else 0
            count_gone += 1
    return Carried(
        (begin[0], begin[0] + rows, begin[1], begin[1] + columns),
        labels_there,
        numbers,
        next_number,
        labels[:kept],
        number_of,
        sizes,
        risk_sums,
        is_growing,
        is_reshaped,
        bounds,
        gone[:count_gone],
        heirs[:count_gone],
        risk_now,
        growing,
    )


@compiled
def _numbers(shared: IntArray, had: IntArray, sizes: IntArray) -> tuple[IntArray, BoolArray]:
    """The number of each patch, 0 where it carries on none, and which numbers are carried on.

    `shared`: how many of a patch's cells had a number before, shape (patches, numbers); `had`: these numbers; `sizes`:
    how many cells the patches have.
    """
    number_of, is_taken = np.zeros(len(sizes), np.int64), np.zeros(shared.shape[1], np.bool_)
    largest_first = np.empty(len(sizes), np.int64)
    for one in range(len(sizes)):
        at = one
        while at > 0 and sizes[largest_first[at - 1]] < sizes[one]:
            largest_first[at], at = largest_first[at - 1], at - 1
        largest_first[at] = one
    # Nobody takes another number before everybody had a chance at the one wanted most.
    for takes_another in (False, True):
        for at in range(len(sizes)):
            place, best = largest_first[at], -1
            for one in range(len(is_taken)):
                ahead = shared[place, one] - (shared[place, best] if best >= 0 else 0)
                is_free = not (takes_another and is_taken[one])
                if is_free and (ahead > 0 or (ahead == 0 and best >= 0 and had[one] < had[best])):
                    best = one
            if best >= 0 and not is_taken[best] and number_of[place] == 0:
                number_of[place], is_taken[best] = had[best], True
    return number_of, is_taken


@compiled
def _compared(
    hot: BoolArray,
    unsettled: BoolArray,
    risk: FloatArray,
    part: tuple[int, int, int, int],
    risk_now: FloatArray,
    growing: BoolArray,
) -> tuple[int, int, int, int]:
    """Brings the last two, which come as they were, up to date, see `Carried`; returns the first and last row and
    column in which either has become another, the last row -1 if none. All of one shape; `part`: see `carried_on`."""
    rows, columns = hot.shape
    first_row, last_row, first_column, last_column = rows, -1, columns, -1
    for row in range(max(part[0] - 1, 0), min(part[1] + 1, rows)):
        for column in range(max(part[2] - 1, 0), min(part[3] + 1, columns)):
            is_hot = hot[row, column]
            its_risk, grows = risk[row, column] if is_hot else NOT_HOT, False
            if is_hot:
                grows = (
                    (row > 0 and unsettled[row - 1, column])
                    or (row + 1 < rows and unsettled[row + 1, column])
                    or (column > 0 and unsettled[row, column - 1])
                    or (column + 1 < columns and unsettled[row, column + 1])
                )
            if its_risk != risk_now[row, column] or grows != growing[row, column]:
                risk_now[row, column], growing[row, column] = its_risk, grows
                first_row, last_row = min(first_row, row), row
                first_column, last_column = min(first_column, column), max(last_column, column)
    return first_row, last_row, first_column, last_column


@compiled
def _labels(cells: BoolArray, columns: int, block: int) -> tuple[NDArray[np.int32], int]:
    """Numbers the groups of cells that touch by their sides, in the order of their first cells.

    `cells`: row after row of so many columns; groups end at the borders of blocks of so many rows and columns, >= 1.
    Returns the number of each cell's group, from 1, 0 where there is none, and how many groups there are.
    """
    leader = np.empty(cells.size, np.int64)  # of each cell the first of its group, or one before it in that
    for row in range(cells.size // max(columns, 1)):
        begins_block = row % block == 0
        for first_column in range(0, columns, block):
            first = row * columns + first_column
            for place in range(first, row * columns + min(first_column + block, columns)):
                if cells[place]:
                    goes_on = place > first and cells[place - 1]
                    leader[place] = leader[place - 1] if goes_on else place
                    # With two above that touch, too, it is joined as the one before it is.
                    if not begins_block and cells[place - columns] and not (goes_on and cells[place - columns - 1]):
                        _join(leader, place - columns, place)
    labels, count = np.zeros(cells.size, np.int32), 0
    for place in range(cells.size):
        if cells[place]:
            first = _first(leader, place)
            if first == place:
                count += 1
                labels[place] = count
            labels[place] = labels[first]
    return labels, count


@compiled
def _join(leader: IntArray, one: int, other: int) -> None:
    """Makes one group of those of two cells, led by the first cell of both."""
    one, other = _first(leader, one), _first(leader, other)
    leader[max(one, other)] = min(one, other)


@compiled
def _first(leader: IntArray, place: int) -> int:
    """The first cell of a cell's group."""
    while leader[place] != place:
        leader[place] = leader[leader[place]]
        place = leader[place]
    return place


def _sample() -> tuple[object, ...]:
    cells, risk = np.ones((1, 1), dtype=np.bool_), np.ones((1, 1))
    return cells, cells, risk, (0, 1, 0, 1), risk, cells, np.ones((1, 1), dtype=np.int32), 2, 1, (1.0, 1.0)


carried_on.called_with(_sample)
