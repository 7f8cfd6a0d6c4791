"""What strips were last cut from, and so where the area has changed since and is to be cut anew."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from coordinator.cut.growth import Growth
from coordinator.cut.strips import CuttingRules, Window, stretches
from planner.types import BoolArray, FloatArray, GridSpec


@dataclass
class LastCut:
    """Remembers one cut at a time; before the first one all has changed."""

    grid: GridSpec
    _arrays: tuple[FloatArray | BoolArray, ...] = ()
    _rules: CuttingRules | None = None
    _looked_at: frozenset[Window] = frozenset()

    def changed_columns(
        self,
        risk: FloatArray,
        open_cells: BoolArray,
        growth: Growth,
        rules: CuttingRules,
        looked_at: Iterable[Window],
    ) -> BoolArray:
        """Columns, shape (columns,), with a cell whose risk, settling or strip is another than at the last cut, and
        those two swaths beside; all of them where the rules are others.

        `looked_at`: the windows that are a strip's, or will be; where one has gone its cells have changed. Remembers
        the arrays and the rules.
        """
        arrays = (risk, open_cells, growth.risk, growth.settles_s, growth.descending)
        if rules != self._rules:
            self._arrays, self._rules = arrays, rules
            return np.ones(self.grid.columns, dtype=np.bool_)
        changed = np.zeros(self.grid.shape, dtype=np.bool_)
        for now, before in zip(arrays, self._arrays, strict=True):
            changed |= now != before
        found = np.zeros(self.grid.columns, dtype=np.bool_)
        found |= changed.any(axis=0)
        for window in self._looked_at.difference(looked_at):
            found[window.columns] = True
        self._arrays = arrays
        reach = 2 * rules.columns(self.grid)
        columns = np.zeros_like(found)
        for stretch in stretches(found):
            columns[max(0, stretch.start - reach) : stretch.stop + reach] = True
        return columns

    def remember(self, looked_at: Iterable[Window]) -> None:
        """Remembers the windows that are a strip's, or will be, after the cut."""
        self._looked_at = frozenset(looked_at)
