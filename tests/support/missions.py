"""Whole missions on the local bus, each flown once for all tests that look at it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeVar

from comms.local_bus import run_local
from comms.node import Node, Received, Step
from comms.result import BusResult
from comms.routing import Routing
from secondlook.fleet import build_fleet
from secondlook.metrics import Metrics
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
        self.metrics.take(received)

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


Loses = Callable[[Received, int], bool]
"""Whether a message that crosses water does not reach a node at this time."""


class HardOfHearing:
    """A node that some of what crosses water does not reach."""

    def __init__(self, node: Node, loses: Loses) -> None:
        self._node = node
        self._loses = loses
        self._wake_ms: int | None = None

    def start(self, now_ms: int) -> Step:
        return self._keep(self._node.start(now_ms))

    def on_message(self, received: Received, now_ms: int) -> Step:
        if received.topic.crosses_water and self._loses(received, now_ms):
            return Step(wake_ms=self._wake_ms)
        return self._keep(self._node.on_message(received, now_ms))

    def on_wake(self, now_ms: int) -> Step:
        return self._keep(self._node.on_wake(now_ms))

    def _keep(self, step: Step) -> Step:
        self._wake_ms = step.wake_ms
        return step


def fly_scenario(scenario: Scenario, loses: Loses | None = None) -> Flown:
    """Flies a mission; `loses`: over a link that loses messages."""
    fleet = build_fleet(scenario, record=False)
    nodes = {node_id: spec.make() for node_id, spec in fleet.specs.items()}
    heard_by = nodes if loses is None else {name: HardOfHearing(node, loses) for name, node in nodes.items()}
    watcher = Watcher()
    result = run_local(Routing(fleet.roster), heard_by, {"observer": watcher}, fleet.run_info, fleet.time_limit_ms)
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
