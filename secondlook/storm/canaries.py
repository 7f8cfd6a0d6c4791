"""Canaries: bugs planted on purpose, each of which storms must find; else what is looked for is too little."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from comms.said.messages import TaskAction, TaskState
from coordinator.briefing import Briefing
from coordinator.dispatch import Dispatch
from coordinator.fleet import KnownFleet
from coordinator.keep_apart.right_of_way import RightOfWay
from coordinator.mission_end import MissionEnd
from coordinator.strip_life import StripLife
from coordinator.vehicles import KnownVehicle
from planner.fleet_map import VehicleLayer
from planner.risk import MOST_LEVELS
from secondlook.engine.engine import do_all, own_processes
from secondlook.engine.work_process import Lost
from secondlook.scenario import Scenario
from secondlook.storm.campaign import quietly, storm_of
from secondlook.storm.fly import fly_storm
from vehicle_agent.agent import Agent
from vehicle_agent.coverage import CoverageLayer
from vehicle_agent.revisit import SecondLooks

Method = Callable[..., Any]


@dataclass(frozen=True)
class Canary:
    """A bug: what `bugged` does in place of a method of a class. It is called with the method itself, then with what
    that was called with."""

    owner: type
    method: str
    bugged: Method

    @contextmanager
    def planted(self) -> Iterator[None]:
        """Within it the bug is there, in this process."""
        before = getattr(self.owner, self.method)

        def bugged(*arguments: Any, **options: Any) -> Any:
            return self.bugged(before, *arguments, **options)

        setattr(self.owner, self.method, bugged)
        try:
            yield
        finally:
            setattr(self.owner, self.method, before)


def _hear_at_work(method: Method, strips: StripLife, *about: Any, under_way: bool) -> None:
    if under_way:
        method(strips, *about, under_way=True)


def _offer(method: Method, dispatch: Dispatch, offers: Iterable[tuple[str, int]], situation: Any, now_ms: int) -> None:
    made = list(offers)
    method(dispatch, made, situation, now_ms)
    strips = {one.strip.number: one.strip for one in situation.strips}
    for name, number in made:
        others = [helper.vehicle for helper in situation.free if helper.vehicle != name]
        if others and name in {helper.vehicle for helper in situation.free}:
            dispatch._outbox.add_task(TaskAction.TAKE, others[0], strips[number])


def _helper(method: Method, briefing: Briefing, vehicle: KnownVehicle, now_ms: int) -> Any:
    before, vehicle.silent, vehicle.lost = (vehicle.silent, vehicle.lost), False, False
    try:
        return method(briefing, vehicle, now_ms)
    finally:
        vehicle.silent, vehicle.lost = before


def _hear_state(method: Method, vehicle: KnownVehicle, *about: Any) -> Any:
    vehicle._state_order = (-1, -1)
    return method(vehicle, *about)


def _take(method: Method, layer: VehicleLayer, place: tuple[int, int], window: Any, start: int, tile: Any) -> Any:
    versions = layer.versions.get(place, {})
    if start in versions:
        versions[start] = -1
    return method(layer, place, window, start, tile)


def _hear_look(method: Method, agent: Agent, *about: Any) -> None:
    agent._looks_taken.clear()
    method(agent, *about)


def _say(method: Method, layer: CoverageLayer, tile: Any) -> Any:
    said = method(layer, tile)
    levels = said.message.sum_levels
    more = levels + (levels < MOST_LEVELS).astype(levels.dtype)
    return said._replace(message=replace(said.message, sum_levels=more))


def _give_back(method: Method, looks: SecondLooks, number: int, now_ms: int) -> None:
    looks._tell(number, TaskState.GIVEN_BACK, now_ms)


def _check(method: Method, right: RightOfWay, fleet: Any, now_s: float) -> list[Any]:
    right.check_s = now_s + 90
    return []


CANARIES: dict[str, Canary] = {
    "the coordinator forgets that a strip was accepted": Canary(StripLife, "_hear_at_work", _hear_at_work),
    "a strip is offered to two": Canary(Dispatch, "_offer", _offer),
    "strips are offered to who is lost": Canary(Briefing, "_helper", _helper),
    "a strip stays with a helper that is lost": Canary(
        StripLife, "find_overdue", lambda method, strips, lost, now_ms: method(strips, (), now_ms)
    ),
    "a helper stays at a strip that it gives back": Canary(SecondLooks, "_give_back", _give_back),
    "an older state is believed": Canary(KnownVehicle, "hear_state", _hear_state),
    "the map forgets what a vehicle told before it was started anew": Canary(
        VehicleLayer, "_with_other_starts", lambda method, layer, place, window, start, told: told
    ),
    "an older tile takes a newer one's place": Canary(VehicleLayer, "take", _take),
    "more is told than was seen": Canary(CoverageLayer, "_say", _say),
    "a look that comes again counts again": Canary(Agent, "_hear_look", _hear_look),
    "tiles are not said again to who asks for them": Canary(CoverageLayer, "again", lambda method, layer: []),
    "the mission ends before all has come": Canary(KnownFleet, "lacking", lambda method, fleet, now_ms: []),
    "the deadline is passed over": Canary(MissionEnd, "deadline_ms", lambda method, end: math.inf),
    "who is under way does not give way": Canary(RightOfWay, "check", _check),
}
"""By name in plain words."""


@dataclass(frozen=True)
class Find:
    """How a canary was found: after how many `storms`, in which of them, by what that must hold; None where it was
    not."""

    storms: int
    number: int | None = None
    invariant: str | None = None


def find_canary(name: str, scenario: Scenario | None, numbers: Sequence[int]) -> Find:
    """Flies these storms with a bug planted, until something does not hold that holds without it."""
    for flown, number in enumerate(numbers, 1):
        plan = storm_of(scenario, number)
        with CANARIES[name].planted():
            violations = fly_storm(plan).violations
        if violations:
            anyway = {one.invariant for one in fly_storm(plan).violations}
            for one in violations:
                if one.invariant not in anyway:
                    return Find(flown, number, one.invariant)
    return Find(len(numbers))


def find_canaries(
    scenario: Scenario | None, numbers: Sequence[int], jobs: int, finds: dict[str, Find], progress: Callable[[], None]
) -> None:
    """Looks for all of CANARIES in `jobs` processes. `finds` is filled by name as they end, and `progress` is told."""
    with own_processes(min(jobs, len(CANARIES))) as engine:
        for name, find in do_all(partial(_find, scenario, numbers), CANARIES, engine, count=len(CANARIES)):
            finds[name] = Find(0) if isinstance(find, Lost) else find
            progress()


def _find(scenario: Scenario | None, numbers: Sequence[int], name: str) -> Find:
    quietly()
    return find_canary(name, scenario, numbers)
