"""What a helper's time is worth: from all that helpers will still have time for, the least of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.types import FloatArray

RISK_STEP = 0.05
"""Worth is told in steps, so that it does not change with every look."""


@dataclass(frozen=True)
class Supply:
    """Strips of a kind: what one look removes at each (residual risk times m2), the seconds it takes, and how many."""

    removed_m2: float
    service_s: float
    count: float


def worth_later_m2ps(supplies: Iterable[Supply], helpers_s: float) -> float:
    """The rate of the last strip served if `helpers_s` seconds go to the strips of the best rates first; 0 where the
    time suffices for all of them."""
    left_s = helpers_s
    for supply in sorted(supplies, key=lambda one: -one.removed_m2 / one.service_s):
        left_s -= supply.service_s * supply.count
        if left_s < 0:
            return supply.removed_m2 / supply.service_s
    return 0.0


def worth_risk(risk: FloatArray, cells: float, least_weight: float = 1.0) -> float:
    """Residual risk from which a cell is worth a second look, if helpers have time for so many: rounded down to a step,
    at least one, of what counts least. `risk`: as it counts, of the cells that may be looked at."""
    count = int(cells)
    least_step = RISK_STEP * least_weight
    if count >= risk.size:
        return least_step
    least = float(np.partition(risk, risk.size - 1 - count)[risk.size - 1 - count])
    return max(least_step, int(least / RISK_STEP + 1e-9) * RISK_STEP)
