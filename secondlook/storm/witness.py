"""Who stands beside the real nodes of a storm: takes note of what reaches each, and looks into it after each step."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comms.node import Node, Received, Step
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    Look,
    MissionOver,
    Mode,
    StripState,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.tally import tally
from coordinator.coordinator import Coordinator
from coordinator.ledger import WITH_A_VEHICLE
from planner.risk import MOST_LEVELS, LevelArray
from vehicle_agent.agent import Agent
from vehicle_agent.coverage import CoverageLayer
from vehicle_agent.revisit import RevisitAgent

_HAIR = 1e-9  # what sums of the same risk in another order may differ by, a cell
SURVEYING = (Mode.TRANSIT, Mode.SURVEY, Mode.RETURNING)
"""In which a primary is until it has surveyed all, or is home before."""


def where(state: AgentState) -> tuple[Mode, int, float, float]:
    """What a vehicle is at, and at what place: one for which that changes stirs."""
    return state.mode, state.works_on, state.x_m, state.y_m


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

# What may come to a node out of order, in words.
LATE_STATE = "a state comes after a newer one, or again"
LATE_TILE = "a tile comes after a newer one"
TILE_AGAIN = "a tile comes again"
TWO_STARTS = "two starts of a vehicle tell of one tile"
LATE_ANSWER = "a word about a strip comes after a newer one, or again"
LOOK_OF_BEFORE = "a look comes to an agent that was started after it"
LOOK_AGAIN = "a look comes again"
TASK_OF_BEFORE = "a task comes to an agent that was started after it"
LATE_TASK = "a task comes after a newer one, or again"
NOTED = (
    LATE_STATE, LATE_TILE, TILE_AGAIN, TWO_STARTS, LATE_ANSWER, LOOK_OF_BEFORE, LOOK_AGAIN,
    TASK_OF_BEFORE, LATE_TASK,
)  # fmt: skip


class Witness:
    """Watches the nodes of one flight on the local bus: give `made` to the fleet as what is told of each node.

    `violations`: what was found so far, the first of each kind a node. `noted`: what has come to a node out of order,
    of NOTED. `logged`: the sentences that nodes have logged. A node of a user's own is left alone. `may_rise`: risk
    may, where maps that were told coarsely are corrected.
    """

    def __init__(self, *, may_rise: bool = False) -> None:
        self.violations: list[Violation] = []
        self._may_rise = may_rise
        self.coordinators: list[CoordinatorWitness] = []
        self.agents: dict[str, list[AgentWitness]] = {}
        self.noted: set[str] = set()
        self.logged: set[str] = set()
        self._told: set[tuple[str, str]] = set()

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Within it what nodes log is heard, down to what is not told to people."""
        log, handler = logging.getLogger("secondlook"), logging.Handler()
        handler.emit = lambda record: self.logged.add(record.getMessage())  # type: ignore[method-assign]
        level = log.level
        log.addHandler(handler)
        log.setLevel(logging.DEBUG)
        try:
            yield
        finally:
            log.setLevel(level)
            log.removeHandler(handler)

    def made(self, node_id: str, node: Node) -> None:
        """A node was made, for the first time or anew."""
        if isinstance(node, Coordinator):
            self.coordinators.append(CoordinatorWitness(node_id, node, self.tell, self.noted, self._may_rise))
            _stand_beside(node, self.coordinators[-1])
        elif isinstance(node, Agent):
            beside = AgentWitness(node_id, node, self.tell, self.noted)
            self.agents.setdefault(node_id, []).append(beside)
            _stand_beside(node, beside)

    def ended_s(self, vehicle: str) -> float:
        """When a coordinator heard that a vehicle has ended its work, of the last of its starts; 0 if never."""
        heard = [at_s for one in self.coordinators for (name, _), at_s in one.ended_s.items() if name == vehicle]
        return max(heard, default=0.0)

    def stirred_s(self, vehicle: str) -> float:
        """When a vehicle said what a coordinator has heard last of it that told of another place or work in its survey
        than what it had heard before; 0 if never. What it said of that before may have been lost."""
        return max((one.stirred_s.get(vehicle, 0.0) for one in self.coordinators), default=0.0)

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


_NONE_YET = (-1, -1)


@dataclass
class CoordinatorWitness:
    """Beside one start of the coordinator. `tiles`: of each vehicle, place and incarnation the newest that came.

    `over`: whether it has said that the mission is over. `may_rise`: see `Witness`. `ended_s`: of each start of
    a vehicle when its first word came that it has ended its work. `stirred_s`: see `Witness`.
    """

    node_id: str
    node: Coordinator
    tell: Tell
    noted: set[str]
    may_rise: bool = False
    tiles: dict[tuple[str, Place], dict[int, CoverageTile]] = field(default_factory=dict)
    started_ms: int = 0
    over: bool = False
    ended_s: dict[tuple[str, int], float] = field(default_factory=dict)
    stirred_s: dict[str, float] = field(default_factory=dict)
    _states: dict[str, tuple[Header, AgentState]] = field(default_factory=dict)  # the newest of each vehicle
    _hotspots: dict[tuple[str, int], dict[int, int]] = field(default_factory=dict)
    _answers: dict[tuple[str, int], tuple[int, int]] = field(default_factory=dict)
    _least_risk: float = np.inf

    def heard(self, received: Received, step: Step, now_ms: int) -> None:
        """A message has reached it."""
        message, header, vehicle = received.message, received.header, received.vehicle
        if not self.node.has_begun:
            return
        if isinstance(message, CoverageTile):
            self._hear_tile(received, message, now_ms)
        elif isinstance(message, Hotspot):
            revisions = self._hotspots.setdefault((vehicle, received.number), {})
            revisions[header.incarnation] = max(message.revision, revisions.get(header.incarnation, 0))
        elif isinstance(message, AgentState):
            self._hear_state(received, message, now_ms)
        elif isinstance(message, TaskStatus):
            self._hear_answer(received, message, now_ms)
        self._check_said(step, now_ms)

    def woke(self, step: Step, now_ms: int) -> None:
        """Its wake-up has come."""
        for record in self.node.ledger.in_state(*WITH_A_VEHICLE) if self.node.has_begun else ():
            heard_ms, lost_after_ms = self._heard_ms(record.vehicle), self.node.config.patience.lost_ms
            # Of one that is lost a word about the strip may still come, which gives it back.
            if heard_ms is None or record.since_ms < heard_ms + lost_after_ms <= now_ms:
                what = f"strip {record.strip.number} is still with {record.vehicle}, heard {_at(heard_ms)}"
                self._tell("the lost have no strip", now_ms, what)
        self._check_said(step, now_ms)

    def _heard_ms(self, vehicle: str) -> int | None:
        state = self._states.get(vehicle)
        return None if state is None else state[0].sent_ms

    def _hear_tile(self, received: Received, tile: CoverageTile, now_ms: int) -> None:
        incarnation = received.header.incarnation
        of_place = self.tiles.setdefault((received.vehicle, (tile.first_row, tile.first_column)), {})
        before = of_place.get(incarnation)
        if before is None or tile.version > before.version:
            of_place[incarnation] = tile
            self._note_looks(received)
        else:
            self.noted.add(LATE_TILE if tile.version < before.version else TILE_AGAIN)
        if len(of_place) > 1:
            self.noted.add(TWO_STARTS)
        self._check_risk(received.vehicle, now_ms)

    def _note_looks(self, received: Received) -> None:
        """Whoever tells of looks goes on with its survey, if it has not said that this is over."""
        vehicle, header = received.vehicle, received.header
        state = self._states.get(vehicle)
        if state is None or state[0].incarnation < header.incarnation or state[1].mode in SURVEYING:
            self.stirred_s[vehicle] = max(self.stirred_s.get(vehicle, 0.0), header.sent_ms / 1000)

    def _hear_answer(self, received: Received, status: TaskStatus, now_ms: int) -> None:
        """Whoever has said last that it is at the strip that it was offered has it; a state may have said since that it
        is not."""
        vehicle = received.vehicle
        before = self._answers.get((vehicle, status.strip), _NONE_YET)
        if vehicle in self._states:
            before = max(before, self._states[vehicle][0].newness)
        if received.header.newness <= before:
            self.noted.add(LATE_ANSWER)
            return
        self._answers[vehicle, status.strip] = received.header.newness
        record = self.node.ledger.get(status.strip)
        is_kept = record is not None and record.state is StripState.OFFERED and record.vehicle == vehicle
        if is_kept and status.state in (TaskState.ACCEPTED, TaskState.UNDER_WAY):
            what = f"{vehicle} said that it is at strip {status.strip}, which is still offered"
            self._tell("an answer counts", now_ms, what)

    def _hear_state(self, received: Received, state: AgentState, now_ms: int) -> None:
        before, vehicle = self._states.get(received.vehicle), received.vehicle
        if before is None or received.header.newness > before[0].newness:
            self._states[vehicle] = received.header, state
            start = received.header.incarnation
            is_told = before is not None and (before[0].incarnation, where(before[1])) == (start, where(state))
            if state.mode in SURVEYING and not is_told:
                self.stirred_s[vehicle] = received.header.sent_ms / 1000
            if state.mode.has_ended:
                self.ended_s.setdefault((vehicle, received.header.incarnation), now_ms / 1000)
        else:
            self.noted.add(LATE_STATE)
        known, (header, newest) = self.node.fleet.vehicles.get(vehicle), self._states[vehicle]
        if known is not None and known.state != newest:
            what = f"of {vehicle} another state is believed than that of {header.sent_ms / 1000:.3f} s"
            self._tell("the newest state counts", now_ms, what)

    def _check_risk(self, vehicle: str, now_ms: int) -> None:
        if self.may_rise:
            return
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
        for key, message in step.publish:
            if isinstance(message, Task) and message.action.is_offer:
                self._check_offer(key.split("/")[2], message.strip, now_ms)
            elif isinstance(message, MissionOver) and not self.over:
                self.over = True  # said again it decides nothing: more may have come by then than states tell of
                if "no strip is left" in message.reason:
                    self._check_all_has_come(now_ms)

    def _check_offer(self, name: str, number: int, now_ms: int) -> None:
        record, heard_ms = self.node.ledger.get(number), self._heard_ms(name)
        if record is None or record.vehicle != name:
            where = "no strip" if record is None else f"with {record.vehicle or 'nobody'}"
            self._tell("an offer is in the books", now_ms, f"strip {number}, offered to {name}, is {where} there")
        if heard_ms is None or now_ms - heard_ms >= self.node.config.patience.silent_ms:
            what = f"strip {number} is offered to {name}, which was heard {_at(heard_ms)}"
            self._tell("nothing is offered to the lost", now_ms, what)

    def _check_all_has_come(self, now_ms: int) -> None:
        """It says that the mission is over before the deadline: then all is there of which those heard lately told."""
        for name, (header, state) in self._states.items():
            tiles = {key: of for key, of in self.tiles.items() if key[0] == name}
            hotspots = {key: of for key, of in self._hotspots.items() if key[0] == name}
            start = header.incarnation
            starts = [max(of) for of in tiles.values()] + [max(of) for of in hotspots.values()]
            newest = max(starts, default=start)
            given_up = now_ms - header.sent_ms >= self.node.config.patience.given_up_ms
            if given_up or newest > start:  # which tells nothing of what the start before has told
                continue
            tiles_come = tally(of[start].version for of in tiles.values() if start in of)
            hotspots_come = tally(of[start] for of in hotspots.values() if start in of)
            if state.tiles_told not in (0, tiles_come) or state.hotspots_told not in (0, hotspots_come):
                what = f"not all has come of what {name} told of at {header.sent_ms / 1000:.3f} s"
                self._tell("the mission ends when all has come", now_ms, what)

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
    tell: Tell
    noted: set[str]
    own: CoverageLayer | None = None
    over: bool = False
    started_ms: int = 0
    _taken: set[tuple[int, int]] = field(default_factory=set)
    _task_order: tuple[int, int] = _NONE_YET

    def heard(self, received: Received, step: Step, now_ms: int) -> None:
        """A message has reached it."""
        message = received.message
        if isinstance(message, RunInfo) and self.own is None:
            self.own = CoverageLayer(self.node_id, message.grid.spec, message.rho)
        elif self.own is None:
            return
        elif isinstance(message, MissionOver):
            self.over = True
        elif isinstance(message, Task) and not self.over:
            self._hear_task(received.header, message, step, now_ms)
        elif isinstance(message, Look) and not self.over and message.valid:
            self._hear_look(received.header, message, self.own)

    def woke(self, step: Step, now_ms: int) -> None:
        """Its wake-up has come."""

    def _hear_look(self, header: Header, look: Look, own: CoverageLayer) -> None:
        name = header.incarnation, look.number
        if header.sent_ms < self.started_ms:
            self.noted.add(LOOK_OF_BEFORE)  # what was seen before it was started is in the layer of the start before
        elif name in self._taken:
            self.noted.add(LOOK_AGAIN)
        else:
            self._taken.add(name)
            own.add(look)

    def _hear_task(self, header: Header, task: Task, step: Step, now_ms: int) -> None:
        if header.sent_ms < self.started_ms:
            self.noted.add(TASK_OF_BEFORE)
            return
        if header.newness <= self._task_order:
            self.noted.add(LATE_TASK)
            return
        self._task_order = header.newness
        kinds = {type(one.message) for one in step.publish}
        is_silent = CoverageTile not in kinds and self.node.coverage is not None and self.node.coverage.told()
        if task.action is TaskAction.TELL_AGAIN and is_silent:
            what = "it was asked to tell again what it has told, and has not"
            self.tell(Violation("who is asked tells again", now_ms / 1000, self.node_id, what))
        if task.action is TaskAction.GIVE_BACK:
            said = [(one.message.strip, one.message.state) for one in step.publish if type(one.message) is TaskStatus]
            works_on = self.node.works_on if isinstance(self.node, RevisitAgent) else 0  # else it may be a track
            answers = {(task.strip, state) for state in (TaskState.GIVEN_BACK, TaskState.DONE)}
            if works_on == task.strip or answers.isdisjoint(said):
                what = f"it was told to give strip {task.strip} back, and has not"
                self.tell(Violation("who is told to give back does", now_ms / 1000, self.node_id, what))


def _at(heard_ms: int | None) -> str:
    return "never" if heard_ms is None else f"last at {heard_ms / 1000:.3f} s"
