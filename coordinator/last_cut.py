"""What strips were last cut from, and so where the area has changed since and is to be cut anew."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from coordinator.growth import Growth
from coordinator.strips import Window, stretches
from planner.types import BoolArray, FloatArray, GridSpec


@dataclass
class LastCut:
    """Remembers one cut at a time; before the first one all has changed."""

    grid: GridSpec
    _arrays: tuple[FloatArray | BoolArray, ...] = ()
    _looked_at: frozenset[Window] = frozenset()

    def changed_columns(
        self, risk: FloatArray, open_cells: BoolArray, growth: Growth, looked_at: Iterable[Window], reach: int
    ) -> BoolArray:
        """Columns, shape (columns,), with a cell whose risk, settling or strip is another than at the last cut, and
        those up to `reach` columns beside.

        `looked_at`: the windows that are a strip's, or will be; where one has gone its cells have changed. Remembers
        the arrays.
        """
        arrays = (risk, open_cells, growth.risk, growth.settles_s, growth.descending)
        if not self._arrays:
            self._arrays = arrays
            return np.ones(self.grid.columns, dtype=np.bool_)
        found = np.zeros(self.grid.columns, dtype=np.bool_)
        for now, before in zip(arrays, self._arrays, strict=True):
            found |= (now != before).any(axis=0)
        for window in self._looked_at.difference(looked_at):
            found[window.columns] = True
        self._arrays = arrays
        columns = np.zeros_like(found)
        for stretch in stretches(found):
            columns[max(0, stretch.start - reach) : stretch.stop + reach] = True
        return columns

    def remember(self, looked_at: Iterable[Window]) -> None:
        """Remembers the windows that are a strip's, or will be, after the cut."""
        self._looked_at = frozenset(looked_at)
