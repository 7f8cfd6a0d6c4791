"""Groups of cells that touch each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.types import BoolArray


def label_groups(cells: BoolArray, block: int) -> tuple[NDArray[np.int32], int]:
    """Numbers the groups of cells that touch along an edge; returns the number of each cell (0 elsewhere) and how many.

    Groups end at the borders of blocks of `block` x `block` cells, counted from the array's corner. The numbers follow
    the first cell of each group, column by column within a block. Works on runs of cells along the first axis: the
    labelling of a general image library costs more to import than all of a mission's calls together.
    """
    labels = np.zeros(cells.shape, dtype=np.int32)
    count = 0
    rows, columns = cells.shape
    for row in range(0, rows, block):
        for column in range(0, columns, block):
            window = (slice(row, row + block), slice(column, column + block))
            if cells[window].any():
                count += _label_block(cells[window], labels[window], count)
    return labels, count


def _label_block(cells: BoolArray, labels: NDArray[np.int32], offset: int) -> int:
    padded = np.zeros((cells.shape[0] + 2, cells.shape[1]), dtype=np.int8)
    padded[1:-1] = cells
    steps = np.diff(padded, axis=0).T  # per column: +1 where a run begins, -1 behind its end
    columns, begins = (places.tolist() for places in np.nonzero(steps == 1))
    ends = np.nonzero(steps == -1)[1].tolist()
    parent = list(range(len(begins)))

    def root(run: int) -> int:
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run

    other = 0
    for run, column in enumerate(columns):
        while columns[other] < column - 1 or (columns[other] == column - 1 and ends[other] <= begins[run]):
            other += 1
        neighbour = other
        while columns[neighbour] == column - 1 and begins[neighbour] < ends[run]:
            one, two = root(neighbour), root(run)
            parent[max(one, two)] = min(one, two)
            neighbour += 1
    numbers: dict[int, int] = {}
    for run, column in enumerate(columns):
        number = numbers.setdefault(root(run), offset + len(numbers) + 1)
        labels[begins[run] : ends[run], column] = number
    return len(numbers)
