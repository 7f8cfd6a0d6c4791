"""What a second look at each cell is expected to find, as a factor on the P_d that the helper's sensor has in general.

A seabed that hides mines from the primary hides them from a helper, too. Where a helper has looked, its next look is
expected to find what its best one did. Elsewhere cells of one column are compared, which a primary has passed at like
ranges: what it saw worse than others there lies on such a seabed.
"""

from __future__ import annotations

import numpy as np

from coordinator.cut.strips import Window
from planner.types import BoolArray, FloatArray, GridSpec

WELL_SEEN = 0.75
"""So many of a column's cells were seen no better than where the seabed hides nothing."""
CARRIES_OVER = 0.5
"""Power of a cell's share of that, as a helper looks from nearer and from other sides."""
LEAST_SHARE = 0.3
UNSEEN_RISK = 0.999
"""Residual risk from which a cell tells nothing of its seabed."""


class ExpectedLooks:
    """Factors of grid shape, worked out anew only in columns where something has changed."""

    def __init__(self, grid: GridSpec) -> None:
        self._found: FloatArray = np.full(grid.shape, np.nan)
        self._risk: FloatArray = np.zeros(grid.shape)
        self._factor: FloatArray = np.ones(grid.shape)
        self._has_news: BoolArray = np.zeros(grid.columns, dtype=np.bool_)

    def learn(self, window: Window, p_detect: FloatArray, typical: float) -> None:
        """Learns from a helper's looks at a window's cells.

        `p_detect`: of its best look at each, shape of the window, 0 where it did not look; `typical`: its P_d as the
        run tells it.
        """
        seen = p_detect > 0
        found = self._found[window.cells]
        found[seen] = np.fmax(found[seen], p_detect[seen] / typical)
        self._has_news[window.columns] = True

    def factor(self, risk: FloatArray) -> FloatArray:
        """The factor of each cell. `risk`: residual risk where a second look is thought of, 0 elsewhere."""
        columns = np.flatnonzero((risk != self._risk).any(axis=0) | self._has_news)
        self._factor[:, columns] = self._of_columns(risk[:, columns], self._found[:, columns])
        self._risk = risk
        self._has_news[:] = False
        return self._factor

    def _of_columns(self, risk: FloatArray, found: FloatArray) -> FloatArray:
        tells = (risk > 0) & (risk < UNSEEN_RISK)
        ranked = np.sort(np.where(tells, 1.0 - risk, np.inf), axis=0)
        last = np.maximum(0, tells.sum(axis=0) - 1)
        well_seen = ranked[(last * WELL_SEEN).astype(np.intp), np.arange(risk.shape[1])]
        share = np.clip((1.0 - risk) / well_seen, LEAST_SHARE, 1.0)
        return np.where(np.isnan(found), np.where(tells, share**CARRIES_OVER, 1.0), found)
