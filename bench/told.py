"""A coordinator that is told beforehand what the survey will leave, and what helpers' looks do: what knowing that is
worth to an allocator, apart from what a better plan is."""

from __future__ import annotations

from contextlib import AbstractContextManager
from unittest.mock import patch

import numpy as np

from bench.removable import Removable
from coordinator.expect.expectation import Expectation, ExpectedMap
from planner.rounding import rounded


def told_beforehand(mission: Removable) -> AbstractContextManager[object]:
    """Within it coordinators that begin expect what is true from the first moment, less what helpers have seen."""
    look = rounded(np.max([one.best_p_detect for one in mission.helpers], axis=0))

    class Told(ExpectedMap):
        def now(self) -> Expectation:
            """See `ExpectedMap`."""
            cells = self._place.cells
            risk = rounded(mission.risk[cells] * np.exp(-self._told(surveys=False)))
            return Expectation(risk, look[cells], super().now().is_seen)

    return patch("coordinator.coordinator.ExpectedMap", Told)
