"""Groups of cells that touch each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.compiled import compiled
from planner.types import BoolArray, IntArray


def label_groups(cells: BoolArray, block: int) -> tuple[NDArray[np.int32], int]:
    """Numbers the groups of cells that touch by their sides.

    Args:
        cells: shape (rows, columns).
        block: groups end at the borders of blocks of so many rows and columns, counted from the array's corner; >= 1.

    Returns:
        The number of each cell's group, 0 elsewhere, same shape; and how many groups there are. Numbers count from 1 in
        the order of the groups' first cells, row by row.

    Raises:
        ValueError: `block` is below 1.
    """
    if block < 1:
        raise ValueError(f"a block has at least one row and column, not {block}")
    labels, count = _labels(np.array(cells).ravel(), cells.shape[1], block)
    return labels.reshape(cells.shape), count


@compiled
def _labels(cells: BoolArray, columns: int, block: int) -> tuple[NDArray[np.int32], int]:
    """The same of cells row after row."""
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


_labels.called_with(lambda: (np.ones(1, dtype=np.bool_), 1, 1))


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
