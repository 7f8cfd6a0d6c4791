"""What must hold of strips and of those who serve them, from the messages of a flight and from the books that its
coordinator held in the end."""

from __future__ import annotations

from dataclasses import dataclass

from comms.lockstep.events import Kill
from comms.node import Received
from comms.said.announcement import Role
from comms.said.messages import (
    AgentState,
    MissionOver,
    Mode,
    StripState,
    StripStatus,
    Task,
    TaskState,
    TaskStatus,
)
from coordinator.ledger import NUMBERS_A_SECOND, WITH_A_VEHICLE
from coordinator.mission_end import GOAL_REACHED
from secondlook.fleet.link import answer_within_ms_of, patience_of
from secondlook.testing.flight import Flight, check_limit, fail_if, lives, reached

_AT_WORK = (TaskState.ACCEPTED, TaskState.UNDER_WAY)


def assert_no_strip_lost(flight: Flight) -> None:
    """Every strip that was ever published is accounted for: numbers and revisions have no gaps, an ended strip stays
    as it is, and at the end each is done, failed, withdrawn, open, or with a vehicle that is at it. Of a coordinator
    that was started anew only what it has published itself counts.

    On the local bus the books that the coordinator itself holds in the end say what it has said of each strip; over
    Zenoh they are known by what it has said alone.

    Open ones are left only where the deadline has ended the mission. A strip that is with a vehicle counts as lost when
    that vehicle has not said for `coordinator.lost_after_s` and 10 s more that it is at it; with a link for
    600 s, or more where cycles are long.
    """
    __tracebackhide__ = True
    problems = []
    strips: dict[int, Received[StripStatus]] = {}
    incarnation, first = 0, None
    for one in flight.said(StripStatus):
        number, status = one.number, one.message
        if first is None or one.header.incarnation != incarnation:  # started anew it gives numbers of its own
            incarnation, strips, first = one.header.incarnation, {}, _first_number(number)
        before = strips.get(number)
        at = f"at {_s(one)} s"
        if before is None and number != first + len(strips):
            problems.append(f"strip {number} is published {at}, but strip {first + len(strips)} never was")
        expected = 1 if before is None else before.message.revision + 1
        if status.revision != expected:
            problems.append(f"strip {number} comes in revision {status.revision} {at}, where {expected} was due")
        if before is not None and before.message.state.has_ended:
            was = f"was {before.message.state.value} at {_s(before)} s"
            problems.append(f"strip {number} {was}, and is {status.state.value} {at}")
        strips[number] = one
    newest = max((one.header.incarnation for one in flight.messages("coord/**")), default=0)
    strips = {number: one for number, one in strips.items() if one.header.incarnation == newest}
    problems += [word for last in strips.values() if (word := _lost(flight, last))]
    problems += _left_too_early(flight, strips) + _books_differ(flight)
    fail_if(problems, "strips are lost")


def _first_number(number: int) -> int:
    """The first number of the coordinator that gives this one to the first strip that is heard of."""
    return number - (number - 1) % NUMBERS_A_SECOND


def _lost(flight: Flight, said: Received[StripStatus]) -> str | None:
    number, status = said.number, said.message
    if status.state not in WITH_A_VEHICLE:
        return None
    vehicle, signs_ms = status.vehicle, [said.header.sent_ms] if status.state is StripState.OFFERED else []
    if vehicle not in flight.scenario.vehicles:
        return f"strip {number} is {status.state.value} with nobody since {_s(said)} s"
    for one in flight.messages(f"agent/{vehicle}/**"):
        message = one.message
        at_it = isinstance(message, TaskStatus) and message.strip == number and message.state in _AT_WORK
        working = isinstance(message, AgentState) and message.works_on == number and message.mode is not Mode.SURVEY
        if at_it or working:
            signs_ms.append(one.header.sent_ms)
    end_ms = flight.heard.now_ms
    if signs_ms and end_ms - max(signs_ms) <= patience_of(flight.scenario).lost_ms + answer_within_ms_of(
        flight.scenario
    ):
        return None
    last = f"last said at {max(signs_ms) / 1000:.3f} s that it is" if signs_ms else "never said that it is"
    at_the_end = f"is {status.state.value} with {vehicle} at the end, {end_ms / 1000:.3f} s"
    return f"strip {number} {at_the_end}, but {vehicle} {last} at it"


def _left_too_early(flight: Flight, strips: dict[int, Received[StripStatus]]) -> list[str]:
    overs = flight.said(MissionOver)
    if flight.scenario.mission.goal is not None and overs and overs[0].message.reason.startswith(GOAL_REACHED):
        return []
    over_ms = overs[0].header.sent_ms if overs else 0
    surveyed_ms = _surveyed_ms(flight, over_ms)
    if surveyed_ms is None or over_ms >= int(flight.scenario.mission.ends_s(surveyed_ms / 1000) * 1000):
        return []
    return [
        f"strip {number} was still {last.message.state.value} when the mission was over at {over_ms / 1000:.3f} s,"
        " before its deadline"
        for number, last in strips.items()
        if not last.message.state.has_ended
    ]


def _surveyed_ms(flight: Flight, over_ms: int) -> int | None:
    """When the last primary had surveyed all, as far as the coordinator was told before the mission was over: one of
    whom it hears nothing it gives up. One that had, is started anew and has at its first word has since before. None
    where it was told of none."""
    ends_ms: dict[str, tuple[int, int]] = {}
    its_lives = lives(flight, "coordinator")
    for at_ms, one in reached(flight, "coordinator", its_lives[-1]) if its_lives else []:
        if one.sender not in flight.scenario.survey_vehicles or at_ms > over_ms:
            continue
        incarnation, ended_ms = ends_ms.get(one.sender, (-1, at_ms))
        if isinstance(one.message, AgentState) and one.header.incarnation > incarnation:
            ends_ms.pop(one.sender, None)
            if one.message.mode.has_ended:
                ends_ms[one.sender] = one.header.incarnation, ended_ms
    return max((at_ms for _, at_ms in ends_ms.values()), default=None)


def _books_differ(flight: Flight) -> list[str]:
    """Where the books that the coordinator holds in the end are not what it has said since its last start."""
    its_lives = lives(flight, "coordinator")
    held = None if flight.inside is None else flight.inside.strips("coordinator")
    if held is None or not its_lives:
        return []
    said = {one.number: one for one in flight.said(StripStatus) if one.header.incarnation == its_lives[-1].incarnation}
    problems = [f"strip {number} is in the books, and was never told" for number in held.keys() - said.keys()]
    for number, one in said.items():
        told = one.message.state, one.message.revision, one.message.vehicle
        record = held.get(number)
        if record is None or (record.state, record.revision, record.vehicle) != told:
            now = f"{record.state.value} in revision {record.revision}" if record else "not in the books"
            problems.append(
                f"strip {number} was told to be {told[0].value} in revision {told[1]} at {_s(one)} s, and is {now}"
            )
    return problems


@dataclass(frozen=True)
class _Service:
    vehicle: str
    since_ms: int


def assert_no_strip_served_twice(flight: Flight) -> None:
    """No strip is worked on by two vehicles at the same time, and none is swept to its end twice.

    What vehicles go on saying of the work they had from a coordinator before one that was started anew is left out.
    """
    __tracebackhide__ = True
    problems = []
    of_old: set[tuple[int, str]] = set()
    at_work: dict[int, dict[str, _Service]] = {}
    done: dict[int, tuple[str, int]] = {}
    incarnations: dict[str, int] = {}
    kills = sorted((one for one in flight.events if isinstance(one, Kill)), key=lambda one: -one.at_ms)
    for one in flight.heard:
        now_ms, sender = one.header.sent_ms, one.header.sender
        gone = {sender} if one.header.incarnation != incarnations.setdefault(sender, one.header.incarnation) else set()
        incarnations[sender] = one.header.incarnation
        while kills and kills[-1].at_ms <= now_ms:
            gone.add(kills.pop().node_id)
        for serving in at_work.values():
            for vehicle in gone:
                serving.pop(vehicle, None)
        if sender in gone and flight.routing.nodes[sender].role is Role.COORDINATOR:
            of_old = {(strip, vehicle) for strip, serving in at_work.items() for vehicle in serving}
            at_work, done = {}, {}
        status = one.message
        if isinstance(status, Task):
            of_old.discard((status.strip, one.vehicle))
        if not isinstance(status, TaskStatus) or (status.strip, sender) in of_old:
            continue
        serving = at_work.setdefault(status.strip, {})
        if status.state in _AT_WORK:
            for other in serving.values():
                if other.vehicle != sender and sender not in serving:
                    meanwhile = f"{other.vehicle} was at it too, since {other.since_ms / 1000:.3f} s"
                    problems.append(f"strip {status.strip} was taken by {sender} at {_s(one)} s while {meanwhile}")
            serving.setdefault(sender, _Service(sender, now_ms))
            continue
        was_at_it = serving.pop(sender, None) is not None
        if status.state is TaskState.DONE and (was_at_it or status.strip not in done):
            if status.strip in done:
                vehicle, before_ms = done[status.strip]
                before = f"by {vehicle} until {before_ms / 1000:.3f} s and by {sender} until {_s(one)} s"
                problems.append(f"strip {status.strip} was swept twice, {before}")
            done[status.strip] = sender, now_ms
    fail_if(problems, "strips are served twice")


def assert_one_strip_at_a_time(flight: Flight) -> None:
    """No vehicle has two strips by the coordinator's books, and none that is with a vehicle is without its name.

    The books at any time are what the coordinator has said of them. That they are, in the end, what it holds is looked
    at on the local bus, and cannot be over Zenoh.
    """
    __tracebackhide__ = True
    problems = []
    strip_of: dict[str, int] = {}
    incarnation = 0
    for one in flight.said(StripStatus):
        if one.header.incarnation != incarnation:  # started anew it has books of its own
            incarnation, strip_of = one.header.incarnation, {}
        number, status = one.number, one.message
        strip_of = {vehicle: its for vehicle, its in strip_of.items() if its != number}
        if status.state not in WITH_A_VEHICLE:
            continue
        what = f"strip {number} is {status.state.value}"
        if not status.vehicle:
            problems.append(f"{what} at {_s(one)} s with nobody")
        elif status.vehicle in strip_of:
            other = strip_of[status.vehicle]
            problems.append(f"{what} with {status.vehicle} at {_s(one)} s, which has strip {other} as well")
        else:
            strip_of[status.vehicle] = number
    fail_if(problems + _books_differ(flight), "vehicles have two strips")


def assert_never_assigned_to_lost(flight: Flight) -> None:
    """No strip is offered to a vehicle whose newest state that had reached the coordinator by then was as old as
    `coordinator.lost_after_s` or older; with a link as 6 cycles, where that is longer."""
    __tracebackhide__ = True
    problems = []
    for life in lives(flight, "coordinator"):
        states = [(due_ms, one) for due_ms, one in reached(flight, "coordinator", life) if one.topic.name == "state"]
        for one in flight.said(Task):
            now_ms, task = one.header.sent_ms, one.message
            if not task.action.is_offer or one.header.incarnation != life.incarnation:
                continue
            sent_ms = [
                said.header.sent_ms for due_ms, said in states if said.vehicle == one.vehicle and due_ms <= now_ms
            ]
            if not sent_ms or now_ms - max(sent_ms) >= patience_of(flight.scenario).silent_ms:
                heard = f"had last heard of at {max(sent_ms) / 1000:.3f} s" if sent_ms else "had never heard of"
                problems.append(
                    f"strip {task.strip} was given to {one.vehicle} at {_s(one)} s, which the coordinator {heard}"
                )
    fail_if(problems, "strips are given to vehicles that are lost")


def assert_strips_offered_within(flight: Flight, within_s: float) -> None:
    """No strip stays open for longer than `within_s` while a helper is free that has neither refused it nor failed at
    it; a helper is free as long as it says that it is idle."""
    __tracebackhide__ = True
    check_limit("within_s", within_s, "seconds, 0 or more")
    problems = []
    open_since: dict[int, int] = {}
    idle_since: dict[str, int] = {}
    not_for: set[tuple[int, str]] = set()
    serving: dict[int, str] = {}
    helpers = {one.vehicle for one in flight.run.vehicles if one.role.revisits}
    told: set[int] = set()
    kills = sorted((one for one in flight.events if isinstance(one, Kill)), key=lambda one: -one.at_ms)
    for one in flight.heard:
        now_ms, message = one.header.sent_ms, one.message
        free = {vehicle: since_ms for vehicle, since_ms in idle_since.items() if vehicle not in serving.values()}
        for number, opened_ms in open_since.items():
            waits_ms = [max(opened_ms, ms) for name, ms in free.items() if (number, name) not in not_for]
            if waits_ms and now_ms - min(waits_ms) > within_s * 1000 and number not in told:
                told.add(number)
                since_s = min(waits_ms) / 1000
                problems.append(f"strip {number} waits since {since_s:.3f} s and was not offered by {_s(one)} s")
        if isinstance(message, AgentState) and one.vehicle in helpers:
            if message.mode is Mode.IDLE:
                idle_since.setdefault(one.vehicle, now_ms)
            else:
                idle_since.pop(one.vehicle, None)
        elif isinstance(message, TaskStatus) and message.state in (TaskState.REFUSED, TaskState.FAILED):
            not_for.add((message.strip, one.vehicle))
        elif isinstance(message, StripStatus):
            number = one.number
            serving.pop(number, None)
            if message.state is StripState.OPEN:
                open_since.setdefault(number, now_ms)
            else:
                open_since.pop(number, None)
            if message.state in WITH_A_VEHICLE:
                serving[number] = message.vehicle
        while kills and kills[-1].at_ms <= now_ms:
            idle_since.pop(kills.pop().node_id, None)
    fail_if(problems, "strips wait for a helper that is free")


def _s(received: Received) -> str:
    return f"{received.t_s:.3f}"
