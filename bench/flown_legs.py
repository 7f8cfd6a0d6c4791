"""The legs that a fleet's helpers flew in a mission, from what was said: a schedule to begin a search with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from bench.legs import Leg, Schedule
from comms.messages import AgentState, Mode, StripStatus
from comms.node import Received
from planner.types import GridSpec


@dataclass
class FlownLegs:
    """Told every message of a mission, it knows which strips were swept by whom, in which order and direction."""

    _strips: dict[int, StripStatus] = field(default_factory=dict)
    _swept: dict[str, dict[int, tuple[StripStatus, float]]] = field(default_factory=dict)

    def take(self, received: Received) -> None:
        """Takes one message, in the order of sending."""
        message = received.message
        if isinstance(message, StripStatus):
            self._strips[int(received.key.rsplit("/", 1)[1])] = message
        elif isinstance(message, AgentState) and message.mode is Mode.REVISIT and message.works_on in self._strips:
            flown = self._strips[message.works_on], message.heading_rad
            self._swept.setdefault(received.vehicle, {}).setdefault(message.works_on, flown)

    def schedule(self, grid: GridSpec, helpers: Sequence[str]) -> Schedule:
        """Each helper's strips as one leg each, along the column nearest to the centre line, begun once released."""
        return tuple(tuple(_leg(grid, *one) for one in self._swept.get(name, {}).values()) for name in helpers)


def _leg(grid: GridSpec, strip: StripStatus, heading_rad: float) -> Leg:
    x_m = strip.start_x_m, strip.start_x_m + strip.length_m * math.sin(strip.heading_rad)
    y_m = strip.start_y_m, strip.start_y_m + strip.length_m * math.cos(strip.heading_rad)
    ends = [grid.frame.to_sweep(*end) for end in zip(x_m, y_m, strict=True)]
    first, end = sorted(round(float(along_m) / grid.cell_m) for _, along_m in ends)
    column = round(float(ends[0][0]) / grid.cell_m)
    return Leg(
        column=min(max(column, 0), grid.columns - 1),
        first=min(max(first, 0), grid.rows - 1),
        end=min(max(end, 1), grid.rows),
        up=math.cos(heading_rad - grid.frame.heading_rad) > 0,
        waits=True,
    )
