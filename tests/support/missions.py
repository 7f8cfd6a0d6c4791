"""Whole missions on the local bus, each flown once for all tests that look at it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, TypeVar

from comms.lockstep.faults import NO_FAULTS, FaultKind, Faults, MessageFault
from comms.lockstep.local_bus import run_local
from comms.node import Received
from comms.result import BusResult
from comms.said.routing import Routing
from comms.said.topics import TOPICS
from secondlook.fleet.build import build_fleet
from secondlook.recorded.metrics import Metrics
from secondlook.scenario import Scenario, load_scenario
from secondlook.scenario.vehicle import Start, Vehicle

M = TypeVar("M")


@dataclass
class Watcher:
    """Listens to all that is said."""

    heard: list[Received] = field(default_factory=list)
    metrics: Metrics = field(default_factory=Metrics)

    def on_message(self, received: Received) -> None:
        self.heard.append(received)
        self.metrics.hear(received)

    def close(self) -> None:
        self.metrics.close()


@dataclass(frozen=True)
class Flown:
    """A mission that was flown: what the bus reports, all that was said, the nodes as they are in the end."""

    result: BusResult
    heard: list[Received]
    metrics: Metrics
    nodes: dict[str, Any]

    @property
    def summary(self) -> dict[str, Any]:
        """The mission's figures."""
        return self.metrics.summary()

    def all(self, kind: type[M]) -> list[tuple[Received, M]]:
        """All messages of a type in the order of their sending."""
        return [(one, one.message) for one in self.heard if isinstance(one.message, kind)]


def bad_water(seed: int, share: float) -> Faults:
    """Of all that crosses water this share is lost."""
    keys = [re.sub(r"{\w+}", "*", topic.pattern) for topic in TOPICS if topic.crosses_water]
    return Faults(seed, [MessageFault(FaultKind.DROP, one, share) for one in keys])


def fly_scenario(scenario: Scenario, faults: Faults = NO_FAULTS) -> Flown:
    """Flies a mission."""
    fleet = build_fleet(scenario, record=False)
    nodes = {node_id: spec.make() for node_id, spec in fleet.specs.items()}
    makers = {node_id: partial(nodes.__getitem__, node_id) for node_id in nodes}
    watcher = Watcher()
    result = run_local(
        Routing(fleet.roster), makers, {"observer": watcher}, fleet.run_info, fleet.time_limit_ms, faults=faults
    )
    return Flown(result, watcher.heard, watcher.metrics, nodes)


@cache
def flown(name: str, seed: int, *overrides: str, helpers: int = 1) -> Flown:
    """The bundled mission with this seed, these overrides and none, one or two helpers."""
    scenario = load_scenario(name, overrides, seed)
    fleet: dict[str, Vehicle] = {**scenario.survey_vehicles}
    if helpers >= 1:
        fleet |= scenario.revisit_vehicles
    if helpers >= 2:
        helper = scenario.revisit_vehicles["helper"]
        fleet["second"] = helper.model_copy(update={"start": Start(x_m=1250, y_m=440, heading_deg=180)})
    return fly_scenario(scenario.model_copy(update={"vehicles": fleet}))
