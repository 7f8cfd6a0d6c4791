"""Who stands beside the real nodes of a storm: takes note of what reaches each, and looks into it after each step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comms.node import Node, Received, Step
from comms.said.announcement import RunInfo
from comms.said.messages import AgentState, CoverageTile, Look, MissionOver, Task, TaskAction
from coordinator.coordinator import Coordinator
from coordinator.ledger import WITH_A_VEHICLE
from planner.risk import MOST_LEVELS, LevelArray
from vehicle_agent.agent import Agent
from vehicle_agent.coverage import CoverageLayer

_HAIR = 1e-9  # what sums of the same risk in another order may differ by, a cell


@dataclass(frozen=True)
class Violation:
    """What must hold and did not: at what time of the mission, of whom, and what was found instead."""

    invariant: str
    t_s: float
    who: str
    what: str

    def __str__(self) -> str:
        return f"{self.invariant}: {self.what} ({self.who}, {self.t_s:.3f} s)"


Tell = Callable[[Violation], None]


class Witness:
    """Watches the nodes of one flight on the local bus: give `made` to the fleet as what is told of each node.

    `violations`: what was found so far, the first of each kind a node. A node of a user's own is left alone.
    """

    def __init__(self) -> None:
        self.violations: list[Violation] = []
        self.coordinators: list[CoordinatorWitness] = []
        self.agents: dict[str, list[AgentWitness]] = {}
        self._told: set[tuple[str, str]] = set()

    def made(self, node_id: str, node: Node) -> None:
        """A node was made, for the first time or anew."""
        if isinstance(node, Coordinator):
            self.coordinators.append(CoordinatorWitness(node_id, node, self.tell))
            _stand_beside(node, self.coordinators[-1])
        elif isinstance(node, Agent):
            beside = AgentWitness(node_id, node)
            self.agents.setdefault(node_id, []).append(beside)
            _stand_beside(node, beside)

    def tell(self, found: Violation) -> None:
        """Something does not hold; said once of each node."""
        if (found.invariant, found.who) not in self._told:
            self._told.add((found.invariant, found.who))
            self.violations.append(found)


def _stand_beside(node: Any, beside: Any) -> None:
    """From now on `beside` is told of each step of the node, after it."""
    start, on_message, on_wake = node.start, node.on_message, node.on_wake

    def begin(now_ms: int) -> Step:
        step: Step = start(now_ms)
        beside.started_ms = now_ms
        return step

    def hear(received: Received, now_ms: int) -> Step:
        step: Step = on_message(received, now_ms)
        beside.heard(received, step, now_ms)
        return step

    def wake(now_ms: int) -> Step:
        step: Step = on_wake(now_ms)
        beside.woke(step, now_ms)
        return step

    node.start, node.on_message, node.on_wake = begin, hear, wake


Place = tuple[int, int]


@dataclass
class CoordinatorWitness:
    """Beside one start of the coordinator. `tiles`: of each vehicle, place and incarnation the newest that came."""

    node_id: str
    node: Coordinator
    tell: Tell
    tiles: dict[tuple[str, Place], dict[int, CoverageTile]] = field(default_factory=dict)
    started_ms: int = 0
    _state_ms: dict[str, int] = field(default_factory=dict)
    _state_order: dict[str, tuple[int, int]] = field(default_factory=dict)
    _least_risk: float = np.inf

    def heard(self, received: Received, step: Step, now_ms: int) -> None:
        """A message has reached it."""
        message, header, vehicle = received.message, received.header, received.vehicle
        if not self.node.has_begun:
            return
        if isinstance(message, CoverageTile):
            of_place = self.tiles.setdefault((vehicle, (message.first_row, message.first_column)), {})
            before = of_place.get(header.incarnation)
            if before is None or message.version > before.version:
                of_place[header.incarnation] = message
            self._check_risk(vehicle, now_ms)
        elif isinstance(message, AgentState):
            order = header.incarnation, header.sequence
            if order > self._state_order.get(vehicle, (-1, -1)):
                self._state_order[vehicle] = order
                self._state_ms[vehicle] = header.sent_ms
        self._check_said(step, now_ms)

    def woke(self, step: Step, now_ms: int) -> None:
        """Its wake-up has come."""
        self._check_said(step, now_ms)

    def _check_risk(self, vehicle: str, now_ms: int) -> None:
        risk = float(self.node.fleet.map.risk.sum())
        if risk > self._least_risk + _HAIR * self.node.fleet.map.risk.size:
            what = f"the sum over all cells rose from {self._least_risk:.6f} to {risk:.6f} with a tile of {vehicle}"
            self._tell("risk never rises", now_ms, what)
        self._least_risk = min(self._least_risk, risk)

    def _check_said(self, step: Step, now_ms: int) -> None:
        if not step.publish:
            return
        with_whom = Counter(record.vehicle for record in self.node.ledger.in_state(*WITH_A_VEHICLE))
        for name, count in with_whom.items():
            if count > 1 or name not in self.node.fleet.vehicles:
                self._tell("a vehicle has one strip", now_ms, f"{count} strips are with {name or 'nobody'}")
        lost_after_ms = self.node.config.lost_after_ms
        for key, message in step.publish:
            if isinstance(message, Task) and message.action is TaskAction.TAKE:
                name = key.split("/")[2]
                heard_ms = self._state_ms.get(name)
                if heard_ms is None or now_ms - heard_ms >= lost_after_ms:
                    since = "never" if heard_ms is None else f"last at {heard_ms / 1000:.3f} s"
                    what = f"strip {message.strip} is offered to {name}, which was heard {since}"
                    self._tell("nothing is offered to the lost", now_ms, what)

    def _tell(self, invariant: str, now_ms: int, what: str) -> None:
        self.tell(Violation(invariant, now_ms / 1000, self.node_id, what))

    def joined(self) -> Mapping[str, tuple[LevelArray, LevelArray]]:
        """What all that came sums up to, of each vehicle: sums and maxima, reckoned apart from the map's own way."""
        found: dict[str, tuple[Any, Any]] = {}
        for (vehicle, (row, column)), of_place in self.tiles.items():
            if vehicle not in found:
                shape = self.node.fleet.map.grid.shape
                found[vehicle] = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
            sums, largest = found[vehicle]
            for tile in of_place.values():
                rows, columns = tile.sum_levels.shape
                window = slice(row, row + rows), slice(column, column + columns)
                sums[window] = np.minimum(sums[window] + tile.sum_levels, MOST_LEVELS)
                largest[window] = np.maximum(largest[window], tile.largest_levels)
        return found


@dataclass
class AgentWitness:
    """Beside one start of an agent. `own`: what the looks that reached it, each once, sum up to; None before it began.

    `over`: whether it has heard that the mission is over, after which it takes no look any more.
    """

    node_id: str
    node: Agent
    own: CoverageLayer | None = None
    over: bool = False
    started_ms: int = 0
    _taken: set[tuple[int, int]] = field(default_factory=set)

    def heard(self, received: Received, step: Step, now_ms: int) -> None:
        """A message has reached it."""
        message = received.message
        if isinstance(message, RunInfo) and self.own is None:
            self.own = CoverageLayer(self.node_id, message.grid.spec)
        elif isinstance(message, MissionOver):
            self.over = self.over or self.own is not None
        elif isinstance(message, Look) and self.own is not None and not self.over and message.valid:
            name = received.header.incarnation, message.number
            # What was seen before it was started is in the layer of the start before.
            if name not in self._taken and received.header.sent_ms >= self.started_ms:
                self._taken.add(name)
                self.own.add(message)

    def woke(self, step: Step, now_ms: int) -> None:
        """Its wake-up has come."""
