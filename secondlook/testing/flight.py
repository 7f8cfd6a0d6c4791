"""A mission that was flown, to its end or so far: what was said, the figures, the risk map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from comms.lockstep.events import NodeEvent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.node import Received
from comms.said.messages import RunInfo
from comms.said.routing import Routing
from planner.fleet_map import FleetMap
from planner.types import BoolArray
from secondlook.launch.mission import Bus
from secondlook.recorded.closest_approach import Closest
from secondlook.recorded.metrics import Metrics
from secondlook.scenario import Scenario
from secondlook.testing.heard import Heard


@dataclass(frozen=True)
class Flight:
    """`heard`: every message but the clock's control words, in the order of sending. `summary`: summary.json's content.
    `folder`: where the files of the run are. `routing`: who writes and who reads what. `faults`, `events`: what went
    wrong on purpose."""

    scenario: Scenario
    bus: Bus
    folder: Path
    heard: Heard
    summary: dict[str, Any]
    routing: Routing
    faults: Faults = NO_FAULTS
    events: tuple[NodeEvent, ...] = ()

    @property
    def digest(self) -> str | None:
        """The digest over all that was said; None for a mission that was not flown to its end."""
        digest: str | None = self.summary["digest"]
        return digest

    @property
    def end_s(self) -> float:
        """Simulated time of the mission's end, or of the last message so far."""
        end_s: float = self.summary["time"]["mission_s"]
        return end_s

    def messages(self, keys: str = "*") -> list[Received]:
        """The messages whose keys are like a pattern; see `Heard.messages`."""
        return self.heard.messages(keys)

    @property
    def run_info(self) -> RunInfo:
        """What the run was announced with: area, grid, vehicles."""
        message = self.messages("run")[0].message
        assert isinstance(message, RunInfo)
        return message

    @property
    def risk_map(self) -> FleetMap:
        """The joined map: `risk`, each vehicle's layer in `layers`, `grid`; arrays of shape (rows, columns)."""
        assert self._figures.map is not None
        return self._figures.map

    @property
    def inside(self) -> BoolArray:
        """Which of the map's cells lie in the survey area."""
        return self._figures.inside

    @property
    def closest(self) -> list[Closest]:
        """How near each two vehicles came to each other while both were under way, the nearest first."""
        return self._figures.approaches.found()

    @cached_property
    def _figures(self) -> Metrics:
        figures = Metrics()
        for one in self.heard:
            figures.take(one)
        return figures
