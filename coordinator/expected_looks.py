"""What a second look at each cell is expected to find, as a factor on the P_d that the helper's sensor has in general.

A seabed that hides mines from the primary hides them from a helper, too. Where a helper has looked, its next look is
expected to find what its best one did.
"""

from __future__ import annotations

import numpy as np

from coordinator.strips import Window
from planner.types import FloatArray, GridSpec

CARRIES_OVER = 0.5
"""Power of the share that the seabed leaves a primary, as a helper looks from nearer and from other sides."""


class ExpectedLooks:
    """Factors of grid shape."""

    def __init__(self, grid: GridSpec) -> None:
        self._found: FloatArray = np.full(grid.shape, np.nan)

    def learn(self, window: Window, p_detect: FloatArray, typical: float) -> None:
        """Learns from a helper's looks at a window's cells.

        `p_detect`: of its best look at each, shape of the window, 0 where it did not look; `typical`: its P_d as the
        run tells it.
        """
        seen = p_detect > 0
        found = self._found[window.cells]
        found[seen] = np.fmax(found[seen], p_detect[seen] / typical)

    def factor(self, share: FloatArray) -> FloatArray:
        """The factor of each cell. `share`: of its P_d that the seabed leaves a primary."""
        return np.where(np.isnan(self._found), share**CARRIES_OVER, self._found)
