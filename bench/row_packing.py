"""Where to cross rows of cells, each for itself: the best columns for any number of crossings, exactly.

A crossing at a column looks at all cells in its swath. The first look at a cell brings what `values[0]` says, the
second what `values[1]` says, each further one `values[2]`; each crossing has a price. Rows are solved side by side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.swath import Swath
from planner.types import FloatArray

LOOKS = 3


class RowPacking:
    """Dynamic programming over the column of the last crossing and its distance to the one before.

    `values`: three arrays of shape (rows, columns), none larger than the one before.
    """

    def __init__(self, values: Sequence[FloatArray], swath: Swath) -> None:
        self.rows, self.columns = values[0].shape
        self._swath = swath
        self._span = swath.width - 1
        self._gains, self.alone = self._all_gains(values)

    def solve(self, price: FloatArray) -> Packing:
        """The best packings; `price` of each crossing, above 0 or infinite, shape (rows, columns)."""
        span = self._span
        states = np.full((self.columns, span + 2, self.rows), -np.inf)
        best_to = np.zeros((self.columns, self.rows))
        for column in range(self.columns):
            gains, here, cost = self._gains[column], states[column], price[:, column]
            near = min(span, column)
            if near:
                before = states[column - near : column][::-1]  # by distance 1, 2, ...
                here[1 : near + 1] = (before + gains[1 : near + 1]).max(axis=1)
            earlier = best_to[column - span - 1] if column > span else np.zeros(self.rows)
            here[span + 1] = earlier + self.alone[column]
            here[1:] -= cost
            here[0] = (here[1:] + gains[0, 1:]).max(axis=0) - cost
            here[0] = np.maximum(here[0], here[0] + gains[0, 0] - cost)
            best_here = here.max(axis=0)
            best_to[column] = np.maximum(best_to[column - 1] if column else 0.0, best_here)
        return Packing(self, price, states, best_to)

    def crossings(self, packing: Packing, row: int, far: int) -> list[int]:
        """See `Packing.crossings`."""
        states, best_to = packing.states[:, :, row], packing.best_to[:, row]
        found: list[int] = []
        column = far
        while column >= 0 and best_to[column] > 0:
            if column and best_to[column] == best_to[column - 1]:
                column -= 1
                continue
            distance = int(states[column].argmax())
            while distance <= self._span:
                found.append(column)
                if distance:
                    column, gains = column - distance, self._gains[column, distance, :, row]
                    distance = int((states[column] + gains).argmax())
                    continue
                again = states[column, 1:] + self._gains[column, 0, 1:, row] - packing.price[row, column]
                if states[column, 0] > again.max():  # a third time at one place
                    found.append(column)
                distance = int(again.argmax()) + 1
            found.append(column)
            column -= self._span + 1
        return found[::-1]

    def _all_gains(self, values: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """What a crossing adds: by its column, the distance to the crossing before, that one's to the one before it
        (last entry: too far to overlap) and row; and by column and row with none before that overlaps."""
        span, swath = self._span, self._swath
        sums = [np.concatenate([np.zeros((1, self.rows)), np.cumsum(value.T, axis=0)]) for value in values]

        def between(look: int, begin: int, end: int) -> FloatArray:
            """Sum over columns begin to end - 1."""
            begin, end = max(begin, 0), min(end, self.columns)
            return sums[look][end] - sums[look][begin] if end > begin else np.zeros(self.rows)

        gains = np.zeros((self.columns, span + 1, span + 2, self.rows))
        alone = np.zeros((self.columns, self.rows))
        for column in range(self.columns):
            left, right = column - swath.left, column + swath.right + 1
            alone[column] = between(0, left, right)
            for distance in range(span + 1):
                once = right - distance  # behind the cells that the one before has seen
                for further in range(span + 2):
                    twice = max(left, once - further) if further <= span else left
                    gains[column, distance, further] = (
                        between(0, once, right) + between(1, twice, once) + between(2, left, twice)
                    )
        return gains, alone


class Packing:
    """What `RowPacking.solve` found. `best_to`: by column and row, the best value with no crossing beyond that column,
    0 for none at all."""

    def __init__(self, solver: RowPacking, price: FloatArray, states: FloatArray, best_to: FloatArray) -> None:
        self.price = price
        self.states = states
        self.best_to = best_to
        self._solver = solver

    def crossings(self, row: int, far: int | None = None) -> list[int]:
        """The columns crossed in a row, ascending, none beyond `far`; a column crossed twice is there twice."""
        return self._solver.crossings(self, row, self._solver.columns - 1 if far is None else far)
