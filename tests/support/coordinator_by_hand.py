"""A coordinator that is told by hand what a fleet says, and what it makes of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, run_info, vehicle
from one_node import OneNode, Said

from comms.said.announcement import Role, RosterVehicle, Vertex
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    HotspotState,
    Mode,
    Plan,
    PlannedTrack,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.allocate.simple import GreedyAllocator
from coordinator.allocate.situation import Allocator, Situation
from coordinator.config import CoordinatorConfig, Patience
from coordinator.coordinator import Coordinator
from planner.goal import Goal
from planner.risk import to_levels
from planner.tiles import tiles

RUN = run_info(400, 400)
PATIENCE = Patience(silent_ms=30_000, lost_ms=30_000)
GRID = RUN.grid.spec  # 81 columns, 80 rows of 5 m
TWO_HELPERS = (*FLEET, vehicle(SECOND_HELPER, Role.REVISIT))
OPEN, OFFERED, ACCEPTED, UNDER_WAY, DONE, FAILED, WITHDRAWN, NEXT = StripState

# Columns 20 to 29 and rows 10 to 69: a swath wide, 300 m long.
HOT = (97.5, 50.0, 147.5, 350.0)
HOT_CELLS = np.s_[10:70, 20:30]
ELSEWHERE = (297.5, 50.0, 347.5, 350.0)


def box(x0_m: float, y0_m: float, x1_m: float, y1_m: float) -> tuple[Vertex, ...]:
    return (Vertex(x0_m, y0_m), Vertex(x1_m, y0_m), Vertex(x1_m, y1_m), Vertex(x0_m, y1_m))


@dataclass
class Told:
    """A coordinator, and what the fleet tells it."""

    node: OneNode
    version: int = 0

    def hotspot(
        self,
        place: tuple[float, float, float, float] | None = HOT,
        *,
        number: int = 1,
        revision: int = 1,
        mean_risk: float = 1.0,
        growing: bool = False,
        incarnation: int = 0,
    ) -> None:
        """A hotspot of the primary; no place withdraws it."""
        state = HotspotState.WITHDRAWN if place is None else HotspotState.ACTIVE
        outline = () if place is None else box(*place)
        message = Hotspot(revision, state, outline, mean_risk, 600, growing, 0)
        self.node.hear(f"agent/{PRIMARY}/hotspot/{number}", message, incarnation=incarnation)

    def state(
        self,
        name: str,
        mode: Mode,
        works_on: int = 0,
        at_ms: int | None = None,
        battery: float = 1.0,
        *,
        tiles_told: int = 0,
        hotspots_told: int = 0,
        ends_ms: int = 0,
    ) -> None:
        """An agent's state; helpers are at (122.5, 0) and head north. A primary inches on: by 1 m in 1000 s."""
        x_m = 122.5 if name != SECOND_HELPER else 322.5
        y_m = self.node.now_ms / 1e6 if name == PRIMARY else 0.0
        message = AgentState(mode, works_on, battery, ends_ms, x_m, y_m, 0, tiles_told, hotspots_told)
        self.node.hear(f"agent/{name}/state", message, at_ms=at_ms)

    def status(self, name: str, strip: int, state: TaskState, reason: str = "", at_ms: int | None = None) -> None:
        """A helper's word on a strip."""
        message = TaskStatus(strip, state, 0, reason)
        self.node.hear(f"agent/{name}/task_status/1", message, at_ms=at_ms)

    def plan(self, *tracks_x_m: float, revision: int = 1) -> None:
        """The primary's plan: tracks to the north, numbered from 1, none of which it has flown."""
        tracks = (PlannedTrack(at, x_m, x_m, 0, x_m, 400, False) for at, x_m in enumerate(tracks_x_m, 1))
        self.node.hear(f"agent/{PRIMARY}/plan", Plan(revision, tuple(tracks), (60,), (), ""))

    def layer(self, name: str, risk: np.ndarray, settled: np.ndarray | None = None) -> None:
        """All tiles of a vehicle whose layer leaves this risk; settled everywhere if not told otherwise."""
        levels = to_levels(-np.log(risk))
        settled = np.ones(GRID.shape, dtype=np.bool_) if settled is None else settled
        for tile in tiles(GRID):
            self.version += 1
            message = CoverageTile(
                self.version, tile.first_row, tile.first_column, levels[tile.window], levels[tile.window],
                settled[tile.window],
            )  # fmt: skip
            self.node.hear(f"agent/{name}/coverage/{tile.name}", message)

    def keep_alive(self, names: Sequence[str], seconds: float) -> None:
        """Lets time pass in which these vehicles repeat their states."""
        last = {one: self._state_of(one) for one in names}
        until_ms = self.node.now_ms + round(seconds * 1000)
        while self.node.now_ms + 10_000 <= until_ms:
            self.node.wait(10)
            for name, state in last.items():
                y_m = self.node.now_ms / 1e6 if name == PRIMARY else state.y_m
                self.node.hear(f"agent/{name}/state", replace(state, y_m=y_m))
        self.node.wait_until(until_ms)

    def settle(self) -> list[Said]:
        """Lets the coordinator decide on what it was told: 1 ms."""
        return self.node.wait_until(self.node.now_ms + 1)

    def strips(self) -> dict[int, StripStatus]:
        """The last word on each strip."""
        return {one.number: one.message for one in self.node.said if isinstance(one.message, StripStatus)}

    def tasks(self) -> list[tuple[str, TaskAction, int]]:
        """Who was told what, in order."""
        return [
            (one.key.split("/")[2], one.message.action, one.message.strip)
            for one in self.node.said
            if isinstance(one.message, Task)
        ]

    def states(self) -> dict[int, StripState]:
        return {number: strip.state for number, strip in self.strips().items()}

    def _state_of(self, name: str) -> AgentState:
        coordinator = self.node.node
        assert isinstance(coordinator, Coordinator)
        state = coordinator.fleet.vehicles[name].state
        assert state is not None
        return state


class InTurn:
    """Offers the helper these strips, one each time."""

    def __init__(self, *numbers: int) -> None:
        self.numbers = list(numbers)

    def assign(self, situation: Situation) -> dict[str, int]:
        return {HELPER: self.numbers.pop(0)} if self.numbers else {}


def coordinator(
    vehicles: tuple[RosterVehicle, ...] = FLEET,
    *,
    allocator: Allocator | None = None,
    idle: Sequence[str] = (HELPER,),
    max_strip_m: float = 400,
    strips: Literal["reacting", "beforehand", "lanes", "lanes_across"] = "reacting",
    area: Sequence[tuple[float, float]] | None = None,
    deadline_s: float | None = None,
    helpers_a_team: int = 3,
    ahead_ms: int = 0,
    looks_within_ms: int = 0,
    separation_m: float = 0.0,
    lost_after_ms: int = 30_000,
    goal: Goal | None = None,
    contacts: bool = False,
) -> Told:
    """A coordinator that was told of the run; the primary surveys, and these helpers are free. `area`: the corners of
    one that is no full square. `deadline_s`: in place of 1.05 times the survey's duration.
    `ahead_ms`: so long before its end a helper is offered the next strip. `looks_within_ms`: so much later than the
    word that a strip is done looks may come. `lost_after_ms`: a vehicle is silent from 30 s on."""
    config = CoordinatorConfig(
        allocator=allocator or GreedyAllocator(),
        deadline_factor=1.05 if deadline_s is None else math.inf,
        deadline_s=math.inf if deadline_s is None else deadline_s,
        patience=Patience(silent_ms=30_000, lost_ms=lost_after_ms),
        min_strip_m=30,
        max_strip_m=max_strip_m,
        worth_risk=0.3,
        switch_margin=0.2,
        strips=strips,
        across=False,
        objective="mean",
        helpers_a_team=helpers_a_team,
        ahead_ms=ahead_ms,
        looks_within_ms=looks_within_ms,
        separation_m=separation_m,
        goal=goal,
        contacts=contacts,
    )
    told = Told(OneNode(Coordinator(config), Role.COORDINATOR))
    run = run_info(400, 400, vehicles=vehicles)
    if area is not None:
        run = replace(run, area=tuple(Vertex(*corner) for corner in area))
    told.node.hear("run", run, at_ms=1)
    for entry in vehicles:
        if entry.role is Role.SURVEY:
            told.state(entry.vehicle, Mode.SURVEY, 1)
    for name in idle:
        told.state(name, Mode.IDLE)
    told.settle()
    return told


def with_a_helper(
    state: TaskState = TaskState.ACCEPTED,
    vehicles: tuple[RosterVehicle, ...] = FLEET,
    *,
    deadline_s: float | None = None,
    looks_within_ms: int = 0,
) -> Told:
    """Strip 1 is with the helper, as far as this."""
    told = coordinator(vehicles, deadline_s=deadline_s, looks_within_ms=looks_within_ms)
    told.hotspot()
    told.settle()
    assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]
    told.status(HELPER, 1, TaskState.ACCEPTED)
    told.state(HELPER, Mode.TRANSIT, 1)
    if state is TaskState.UNDER_WAY:
        told.status(HELPER, 1, TaskState.UNDER_WAY)
        told.state(HELPER, Mode.REVISIT, 1)
    told.settle()
    return told


def looked(p_detect: float = 0.7) -> np.ndarray:
    """The risk that a look along strip 1 leaves, 1 elsewhere."""
    risk = np.ones(GRID.shape)
    risk[HOT_CELLS] = 1 - p_detect
    return risk
