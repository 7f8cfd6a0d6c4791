"""Groups of cells that touch each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.types import BoolArray

IndexArray = NDArray[np.intp]


def neighbours(cells: BoolArray) -> BoolArray:
    """The cells that share a side with one of the given, which may be among them."""
    found = np.zeros_like(cells)
    found[1:] |= cells[:-1]
    found[:-1] |= cells[1:]
    found[:, 1:] |= cells[:, :-1]
    found[:, :-1] |= cells[:, 1:]
    return found


def label_groups(cells: BoolArray, block: int) -> tuple[NDArray[np.int32], int]:
    """Numbers the groups of cells that touch by their sides.

    Works on runs, cells of a row that follow each other within a block. The labelling of a general image library costs
    more to import than all of a mission's calls together.

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
    # A run is told by the places of its first and last cell in the flattened array.
    goes_on = cells[:, :-1] & cells[:, 1:]
    goes_on[:, block - 1 :: block] = False
    begins, ends = cells.copy(), cells.copy()
    begins[:, 1:] ^= goes_on
    ends[:, :-1] ^= goes_on
    first, last = begins.ravel().nonzero()[0], ends.ravel().nonzero()[0]

    leader = _connected(first.size, *_neighbours(first, last, cells.shape[1], block))
    number = np.cumsum(leader == np.arange(leader.size), dtype=np.int32)
    labels = np.zeros(cells.shape, dtype=np.int32)
    labels[cells] = np.repeat(number[leader], last - first + 1)
    return labels, int(number[-1]) if number.size else 0


def _neighbours(first: IndexArray, last: IndexArray, columns: int, block: int) -> tuple[IndexArray, IndexArray]:
    """The pairs of runs, one below the other in one block, that have a column in common.

    Args:
        first: the place of each run's first cell, ascending.
        last: that of its last.
        columns: of the array.
        block: rows of a block.
    """
    lowest = last.searchsorted(first - columns)
    counts = first.searchsorted(last - columns, side="right") - lowest
    counts[first // columns % block == 0] = 0
    above = np.repeat(np.arange(first.size), counts)
    below = np.arange(above.size) + np.repeat(lowest + counts - np.cumsum(counts), counts)
    return above, below


def _connected(count: int, one: IndexArray, other: IndexArray) -> IndexArray:
    """For each of so many runs the first run that the pairs, one run and the other, connect it with."""
    leader = np.arange(count)
    while True:
        leads_one, leads_other = leader[one], leader[other]
        if (leads_one == leads_other).all():
            return leader
        # Of two leaders the later follows the earlier; then everyone follows the leader's leader.
        np.minimum.at(leader, np.maximum(leads_one, leads_other), np.minimum(leads_one, leads_other))
        leader = leader[leader]
