"""Missions of no length, for sweeps that are about rows."""

from __future__ import annotations

import signal
from typing import Any

from secondlook.sweeps.plan import SweptMission


def risk_of(mission: SweptMission) -> float:
    """The residual risk that such a mission leaves: of its seed, and 0.1 more with `none`."""
    return mission.seed % 97 / 100 + (0.1 if mission.scenario.coordinator.allocator == "none" else 0.0)


def flown(mission: SweptMission) -> dict[str, Any]:
    """Figures by hand."""
    return {"digest": mission.key, "risk.mean": risk_of(mission), "vehicles.primary.r_adpt_m": [60, 70]}


def fails_at_five(mission: SweptMission) -> dict[str, Any]:
    """The same; seed 5 fails, and seed 6 hangs."""
    if mission.seed == 5:
        return {"failure": "the battery is empty"}
    while mission.seed == 6:
        signal.pause()
    return flown(mission)
