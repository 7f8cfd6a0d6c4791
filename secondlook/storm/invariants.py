"""What must hold of a mission in any storm, looked for when it has been flown; `secondlook.storm.witness` has looked
while it was."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from comms.node import Received
from comms.said.messages import (
    AgentState,
    CoverageTile,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    Task,
    TaskAction,
)
from planner.fleet_map import CLOSED
from planner.risk import LevelArray
from secondlook.errors import UserError
from secondlook.fleet.link import heard_within_ms_of, patience_of
from secondlook.fleet.nodes import COORDINATOR
from secondlook.recorded.mission import load_run
from secondlook.storm.witness import SURVEYING, Violation, Witness, where
from secondlook.testing.flight import Flight, Heard
from secondlook.testing.mission_assertions import assert_home_before_empty, assert_no_message_dropped
from secondlook.testing.plan import TroublePlan
from secondlook.testing.strip_assertions import (
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
)

AGREE_WITHIN_S = 60.0  # after the core is healed: what is late by half a minute, the next report, and its answer
END_WITHIN_S = 30.0  # of the deadline
MOST_CALLED_BACK, WITHIN_S = 12, 60.0  # no more often in that time is a vehicle called back from where it was sent


def check_flight(flight: Flight, plan: TroublePlan, witness: Witness) -> list[Violation]:
    """All that does not hold of a flight, what the witness saw first."""
    found = list(witness.violations)
    checks = [_ends_in_time, _books_are_kept, _books_agree_with_agents, _map_is_what_came, _layers_are_what_was_seen]
    checks += [_full_disk_is_told, _who_is_sent_may_go]
    if any(one.t_s > plan.heals_s for one in flight.said(MissionOver)):  # else it was over before the core was healed
        checks += [_core_has_finished, _core_is_all_on_the_map]
    for check in checks:
        found += check(flight, plan, witness)
    if not plan.trouble:
        found += _calm(flight, witness)
    return found


def _ends_in_time(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """The mission ends by its deadline, that of the core where others have failed."""
    overs = flight.said(MissionOver)
    if not overs:
        yield Violation("the mission ends", flight.end_s, COORDINATOR, "it was never said that it is over")
        return
    mission = plan.scenario.mission
    core, failed_s = _core_vehicles(plan), plan.heals_s
    surveyed_s = 0.0
    for name in plan.scenario.survey_vehicles:
        if name in core:
            surveyed_s = max(surveyed_s, _last_s(flight, name, *SURVEYING))
        else:  # who has failed may say to the end that it is at a track, after a survey that went slowly
            states = flight.said(AgentState, f"agent/{name}/state")
            for before, one in pairwise(states):
                if one.message.mode in SURVEYING and where(one.message) != where(before.message):
                    failed_s = max(failed_s, one.t_s)
            failed_s = max(failed_s, witness.stirred_s(name))  # over a link its word of that may be lost for minutes
            surveyed_s = max(surveyed_s, witness.ended_s(name))  # or its word that it has ended comes late
    surveyed_s = max(surveyed_s, failed_s + patience_of(plan.scenario).stuck_ms / 1000)
    ends_s = mission.ends_s(surveyed_s + heard_within_ms_of(plan.scenario) / 1000) + END_WITHIN_S
    if overs[-1].t_s > ends_s + END_WITHIN_S:
        yield Violation("the mission ends", overs[-1].t_s, COORDINATOR, f"it was to be over by {ends_s:.0f} s")


def _core_has_finished(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    for name in _core_vehicles(plan):
        states = flight.said(AgentState, f"agent/{name}/state")
        if not states:
            yield Violation("the core finishes", flight.end_s, name, "it was never heard")
        elif not (states[-1].message.mode.has_ended or states[-1].message.mode.is_out_of_work):
            what = f"its last word is that it is in {states[-1].message.mode.value}"
            yield Violation("the core finishes", states[-1].t_s, name, what)


def _books_are_kept(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    yield from _asserted("no strip is lost", assert_no_strip_lost, flight)
    yield from _asserted("a vehicle has one strip", assert_one_strip_at_a_time, flight)


def _asserted(invariant: str, holds: Callable[[Flight], None], flight: Flight) -> Iterator[Violation]:
    try:
        holds(flight)
    except AssertionError as error:
        first = str(error).splitlines()[1].strip()
        yield Violation(invariant, flight.end_s, COORDINATOR, first)


def _who_is_sent_may_go(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """No vehicle is sent and called back again and again."""
    for name in plan.scenario.vehicles:
        back_s, sent_to = list[float](), set[tuple[int, int]]()
        for one in flight.said(Task, f"coord/task/{name}/*"):
            strip = one.header.incarnation, one.message.strip  # one that was started anew calls back from all before
            if one.message.action.is_offer:
                sent_to.add(strip)
            elif one.message.action is TaskAction.GIVE_BACK and strip in sent_to:
                sent_to.remove(strip)
                back_s.append(one.t_s)
        for first_s, last_s in zip(back_s, back_s[MOST_CALLED_BACK:], strict=False):
            if last_s - first_s < WITHIN_S:
                what = f"called back {MOST_CALLED_BACK + 1} times from {first_s:.3f} s on"
                yield Violation("who is sent may go", last_s, name, what)
                break


_AT_WORK = (StripState.ACCEPTED, StripState.UNDER_WAY)


def _books_agree_with_agents(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """When the core has been healed for a while, no helper of it is for long at a strip that is not with it by the
    books, nor has a strip there that it is not at."""
    booked: dict[str, int] = {}
    where: dict[int, str] = {}
    agreed_s: dict[str, float] = {}
    helpers = [name for name in _core_vehicles(plan) if name in plan.scenario.revisit_vehicles]
    start = 0
    for one in flight.heard:
        message = one.message
        if one.sender == COORDINATOR and one.header.incarnation > start:  # it has books of its own
            start = one.header.incarnation
            booked.clear()
            where.clear()
        if isinstance(message, MissionOver):
            return
        if isinstance(message, StripStatus):
            _book(booked, where, one.number, message)
        elif isinstance(message, AgentState) and one.vehicle in helpers:
            before_s = agreed_s.setdefault(one.vehicle, max(plan.heals_s, one.t_s))
            has = booked.get(one.vehicle, 0)
            offered = where.get(message.works_on) == one.vehicle
            if message.works_on == has or (offered and not has):
                agreed_s[one.vehicle] = max(plan.heals_s, one.t_s)
            elif one.t_s - before_s > AGREE_WITHIN_S + heard_within_ms_of(plan.scenario) / 1000:
                what = f"at strip {message.works_on} (0 for none), by the books at {has}, since {before_s:.3f} s"
                yield Violation("books and agents agree", one.t_s, one.vehicle, what)
                return


def _book(booked: dict[str, int], where: dict[int, str], number: int, status: StripStatus) -> None:
    """Keeps which strip is with whom, as the coordinator says: `booked` those accepted, `where` those offered, too."""
    before = where.pop(number, "")
    if booked.get(before) == number:
        del booked[before]
    if status.state in _AT_WORK:
        booked[status.vehicle] = number
    if status.state in (*_AT_WORK, StripState.OFFERED):
        where[number] = status.vehicle


def _map_is_what_came(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """The map that a coordinator holds is the join of all tiles that reached it, of all starts of each vehicle."""
    for beside in witness.coordinators:
        if not beside.node.has_begun:
            continue
        held = beside.node.fleet.map
        for vehicle, (sums, largest) in beside.joined().items():
            layer = held.layers.get(vehicle)
            if layer is None or any(CLOSED in versions.values() for versions in layer.versions.values()):
                wrong = 0 if layer is not None else sums.size  # of more than 8 starts the first are held as one
            else:
                wrong = int(np.count_nonzero((layer.sum_levels != sums) | (layer.largest_levels != largest)))
            if wrong:
                what = f"{wrong} of {sums.size} cells of {vehicle} are not what its tiles say"
                yield Violation("the map is what came", flight.end_s, beside.node_id, what)


def _layers_are_what_was_seen(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """An agent holds what its looks sum up to, no less and no more, and tells of no more."""
    for name, starts in witness.agents.items():
        for incarnation, beside in enumerate(starts):
            if beside.own is None or beside.node.coverage is None:
                continue
            own, held = beside.own.layer, beside.node.coverage.layer
            if not np.array_equal(own.sum_levels, held.sum_levels):
                wrong = int(np.count_nonzero(own.sum_levels != held.sum_levels))
                yield Violation("layers are what was seen", flight.end_s, name, f"{wrong} cells are others")
            for one in flight.said(CoverageTile, f"agent/{name}/coverage/*"):
                if one.header.incarnation == incarnation and not _within(one, own.sum_levels):
                    what = f"{one.key} tells of more than it has seen"
                    yield Violation("coverage is never invented", one.t_s, name, what)
                    break


def _within(said: Received[CoverageTile], levels: LevelArray) -> bool:
    tile = said.message
    rows, columns = tile.sum_levels.shape
    window = slice(tile.first_row, tile.first_row + rows), slice(tile.first_column, tile.first_column + columns)
    return bool((tile.sum_levels <= levels[window]).all())


def _core_is_all_on_the_map(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    """What those of the core have told since they were last started has all reached the coordinator in the end. Not by
    modem, as tiles do not cross the water: the coordinator has such as its modem puts together from stretches."""
    if plan.scenario.link is not None:
        return
    if not witness.coordinators or not witness.coordinators[-1].node.has_begun:
        return
    beside = witness.coordinators[-1]
    for name in _core_vehicles(plan):
        newest: dict[tuple[int, int], Received[CoverageTile]] = {}
        last = max((one.header.incarnation for one in flight.said(AgentState, f"agent/{name}/state")), default=0)
        for one in flight.said(CoverageTile, f"agent/{name}/coverage/*"):
            place = one.message.first_row, one.message.first_column
            is_newer = place not in newest or one.message.version > newest[place].message.version
            if one.header.incarnation == last and is_newer:
                newest[place] = one
        for place, one in newest.items():
            come = beside.tiles.get((name, place), {}).get(last)
            if come is None or come.version < one.message.version:
                what = f"{one.key} in version {one.message.version} has not reached the coordinator"
                yield Violation("the maps converge", one.t_s, name, what)
                break


def _calm(flight: Flight, witness: Witness) -> Iterator[Violation]:
    """What must hold beside that where nothing goes wrong."""
    yield from _asserted("no strip is served twice", assert_no_strip_served_twice, flight)
    yield from _asserted("no message is dropped", assert_no_message_dropped, flight)
    yield from _asserted("vehicles come home", assert_home_before_empty, flight)
    for entered in flight.entered:
        what = f"{entered.vehicle} entered zone {entered.zone} of area.keep_out_m"
        yield Violation("vehicles keep out", entered.t_s, entered.vehicle, what)
    gives_way_s = {
        one.vehicle: (
            _surveyed_s(flight, one.vehicle) if one.role.surveys else 0.0,
            _out_of_work_s(flight, one.vehicle),
        )
        for one in flight.run.vehicles
        if one.role.revisits
    }
    for one in flight.closest:
        # Who surveys or goes home gives way to nobody, and who has nowhere to go cannot: that is logged.
        first, second = one.vehicles
        spans_s = [gives_way_s.get(name, (np.inf, 0.0)) for name in one.vehicles]
        could = any(from_s < one.t_s <= until_s for from_s, until_s in spans_s)
        told = [said for said in witness.logged if "nowhere to go" in said and {first, second} <= set(said.split())]
        known = flight.scenario.link is None  # else who gives way knows where others were a while ago
        if one.closest_m < flight.scenario.mission.separation_m and could and known and not told:
            what = f"{' and '.join(one.vehicles)} came within {one.closest_m:.1f} m of each other"
            yield Violation("vehicles keep apart", one.t_s, one.vehicles[0], what)


def _surveyed_s(flight: Flight, name: str) -> float:
    """When a primary first said that it has surveyed all, and may be told to give way; infinite if never."""
    said = flight.said(AgentState, f"agent/{name}/state")
    return min((one.t_s for one in said if one.message.mode is Mode.FINISHED), default=np.inf)


def _out_of_work_s(flight: Flight, name: str) -> float:
    """When a vehicle first said that it takes on nothing more; infinite if never."""
    said = flight.said(AgentState, f"agent/{name}/state")
    return min((one.t_s for one in said if one.message.mode.is_out_of_work), default=np.inf)


def _last_s(flight: Flight, name: str, *modes: Mode) -> float:
    """When a vehicle last said that it is in one of these modes; 0 if never."""
    said = flight.said(AgentState, f"agent/{name}/state")
    return max((one.t_s for one in said if one.message.mode in modes), default=0.0)


def _core_vehicles(plan: TroublePlan) -> list[str]:
    """The vehicles that must come to the end: those of the core, all where there is none."""
    return [name for name in plan.scenario.vehicles if not plan.core or name in plan.core]


_NAMES_A_FILE = re.compile(r"(/.+?): .+; must be a file that can be written")


def _full_disk_is_told(flight: Flight, plan: TroublePlan, witness: Witness) -> Iterator[Violation]:
    if _disk_was_full(plan, flight.heard):
        yield Violation("a full disk is told", flight.end_s, "run", "it was full, and the mission has not failed")


def _disk_was_full(plan: TroublePlan, heard: Heard) -> bool:
    return any(one.what == "disk_full" and one.at_s <= heard.now_s for one in plan.trouble)


def check_failed(error: str, plan: TroublePlan, folder: Path, heard: Heard) -> list[Violation]:
    """What does not hold of a mission that has failed. One may fail: whose disk is full; its sentence names a file in
    the folder of the flight, and what is on disk is the beginning of what was said."""
    if not _disk_was_full(plan, heard):
        return [Violation("the mission ends", heard.now_s, "run", error)]
    match = _NAMES_A_FILE.fullmatch(error)
    if match is None or folder not in Path(match[1]).parents:
        return [Violation("a full disk is told", heard.now_s, "run", error)]
    try:
        there = [(one.key, one.payload) for one in load_run(folder, quiet=True).messages()]
    except UserError as unreadable:
        return [Violation("what is on disk is read back", heard.now_s, "run", str(unreadable))]
    if there != [(one.key, one.payload) for one in heard][: len(there)]:
        return [Violation("what is on disk is read back", heard.now_s, "run", "it is not what was said first")]
    return []
