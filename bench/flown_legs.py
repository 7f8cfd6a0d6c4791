"""The legs that a fleet's helpers flew in a mission, from their looks: a schedule to begin a search with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from bench.legs import Leg, Schedule
from bench.removable import LegHelper
from comms.node import Received
from comms.said.messages import Look
from planner.types import GridSpec


@dataclass
class FlownLegs:
    """Told every message of a mission, it knows by whom which legs were flown, and when."""

    _looks: dict[str, dict[int, list[tuple[float, Look]]]] = field(default_factory=dict)

    def hear(self, received: Received) -> None:
        """Takes one message, in the order of sending."""
        look = received.message
        if isinstance(look, Look) and look.valid:
            legs = self._looks.setdefault(received.vehicle, {})
            legs.setdefault(look.maneuver, []).append((received.header.sent_ms / 1000, look))

    def schedule(self, grid: GridSpec, helpers: Sequence[LegHelper]) -> Schedule:
        """Each helper's legs, on the nearest lines and rows, begun when they were."""
        return tuple(
            tuple(_leg(grid, helper, looks) for looks in self._looks.get(helper.name, {}).values())
            for helper in helpers
        )


def _leg(grid: GridSpec, helper: LegHelper, looks: Sequence[tuple[float, Look]]) -> Leg:
    first_s, first = looks[0]
    end_m = max(look.first_along_m + look.geometry.along_bins * look.along_bin_m for _, look in looks)
    across_m, along_m = map(float, grid.frame.to_sweep(first.origin_x_m, first.origin_y_m))
    up = math.cos(first.heading_rad - grid.frame.heading_rad) > 0
    way = 1 if up else -1
    begin, end = sorted(round((along_m + way * at_m) / grid.cell_m) for at_m in (first.first_along_m, end_m))
    column = helper.sensor.swath.column_at(across_m / grid.cell_m)
    return Leg(
        column=min(max(column, 0), grid.columns - 1),
        first=min(max(begin, 0), grid.rows - 1),
        end=min(max(end, 1), grid.rows),
        up=up,
        waits=False,
        from_s=first_s - first.geometry.along_bins * first.along_bin_m / helper.speed_mps,
    )
