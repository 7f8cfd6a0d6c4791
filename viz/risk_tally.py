"""The risk's statistics block by block, so that a change costs as much as the block and not the whole map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.risk import RiskStatistics
from planner.types import FloatArray

STEPS = 1024  # of risk; within one the worst 30 % are cut off by its mean, so that they are right to a thousandth


class RiskTally:
    """Counts cells and sums their risk, per block and step of risk."""

    def __init__(self, blocks: int) -> None:
        self._cells = np.zeros((blocks, STEPS + 1), dtype=np.int32)  # the last step is that of what nobody has seen
        self._sums = np.zeros((blocks, STEPS + 1))

    def replace(self, block: int, cells: NDArray[np.intp], risk: FloatArray) -> bool:
        """Takes how many of a block's cells have each of these risks; whether another number of them is seen now."""
        step = (risk * STEPS).astype(np.intp)
        before = self._cells[block, STEPS]
        self._cells[block] = np.bincount(step, weights=cells, minlength=STEPS + 1)
        self._sums[block] = np.bincount(step, weights=cells * risk, minlength=STEPS + 1)
        return bool(self._cells[block, STEPS] != before)

    def statistics(self) -> RiskStatistics:
        """As `planner.risk.risk_statistics` has them. Raises ValueError where no cell counts."""
        cells, sums = self._cells.sum(axis=0)[::-1], self._sums.sum(axis=0)[::-1]  # the worst come first
        count = int(cells.sum())
        if not count:
            raise ValueError("no cell lies inside the area")
        worst = max(1, (3 * count + 5) // 10)
        taken = np.diff(np.minimum(np.cumsum(cells), worst), prepend=0)
        worst_sum = float((sums * taken / np.maximum(cells, 1)).sum())
        return RiskStatistics(
            cells=count,
            mean=float(sums.sum()) / count,
            worst30_mean=worst_sum / worst,
            uncovered_share=int(cells[0]) / count,
        )
