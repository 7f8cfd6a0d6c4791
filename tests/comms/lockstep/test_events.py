"""Planned events of nodes and faults on messages, alike on every bus."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fleets import (
    BUSES,
    ROSTER,
    Bus,
    Notes,
    Scripted,
    fleet_that_talks,
    say_nav,
    say_over,
    say_state,
    say_status,
    says,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comms.lockstep.events import Change, Freeze, Happening, Join, Kill, NodeEvent, timeline
from comms.lockstep.faults import CutOff, FaultKind, Faults, MessageFault
from comms.node import Publication, Step
from comms.result import BusResult
from comms.said.messages import Contact, Task, TaskAction
from comms.said.routing import Routing
from comms.said.topics import CONTACT, TASK

ROUTING = Routing(ROSTER)
END_MS = 1000
QUIET_MS = 200  # a fleet that goes on talking is waited for until 10 s after the mission's end


@pytest.fixture(params=BUSES)
def bus(request: pytest.FixtureRequest) -> Bus:
    """Each bus in turn."""
    return BUSES[request.param]


def say_contact(number: int) -> Publication:
    """A detection of alpha's."""
    return Publication(CONTACT.key(vehicle="alpha", number=number), Contact(number, 0, 0, 0, 0))


def every_ten(*publications: Publication) -> Scripted:
    """Says this every 10 ms, beginning 10 ms after its start, for a while."""

    def next_ms(now_ms: int) -> int | None:
        return now_ms + 10 if now_ms < QUIET_MS else None

    return Scripted(
        starts=lambda now_ms: Step(wake_ms=next_ms(now_ms)),
        wakes=lambda now_ms: says(*publications, wake_ms=next_ms(now_ms)),
    )


def ends(*, at_ms: int = END_MS) -> Scripted:
    """A coordinator that ends the mission."""
    return Scripted(starts=lambda now_ms: Step(wake_ms=at_ms), wakes=lambda now_ms: says(say_over()))


def heard_from(node: Scripted, key: str) -> list[tuple[object, ...]]:
    """When a node was told what under a key: (now, incarnation is not told, sequence, sent)."""
    return [(entry[0], *entry[3:]) for entry in node.log if len(entry) > 2 and entry[1] == key]


def test_what_a_killed_node_has_said_is_delivered_and_no_more(bus: Bus) -> None:
    coordinator, notes = ends(), Notes()
    alpha = every_ten(say_state("alpha"))
    result = bus({"alpha": alpha, "coordinator": coordinator}, notes, events=(Kill("alpha", 30),))
    assert heard_from(coordinator, "agent/alpha/state") == [(11, 0, 10), (21, 1, 20)]
    assert [one.header.sent_ms for one in notes.heard if one.header.sender == "alpha"] == [10, 20]
    assert alpha.log[-1] == ("wake", 20)
    assert (result.mission_ms, result.messages["state"]) == (END_MS, 2)


def test_a_frozen_node_gets_its_mail_and_its_wake_up_when_it_is_thawed(bus: Bus) -> None:
    world = every_ten(say_status("alpha", 3), say_nav("alpha"))
    alpha = Scripted(
        starts=lambda now_ms: Step(wake_ms=25),
        wakes=lambda now_ms: says(say_state("alpha")),
    )
    coordinator = ends(at_ms=60)
    bus({"world": world, "alpha": alpha, "coordinator": coordinator}, Notes(), events=(Freeze("alpha", 15, 45),))
    status = "veh/alpha/maneuver_status"
    assert heard_from(alpha, status)[:5] == [(11, 0, 10), (45, 2, 20), (45, 4, 30), (45, 6, 40), (51, 8, 50)]
    at_thaw = [entry for entry in alpha.log if 45 in entry[:2]]
    assert [entry[1] for entry in at_thaw[:-1]] == [status, "veh/alpha/nav"] * 3
    assert at_thaw[-1] == ("wake", 45)
    assert heard_from(coordinator, "agent/alpha/state") == [(46, 0, 45)]


def test_a_node_frozen_to_the_end_harms_nobody(bus: Bus) -> None:
    result = bus({"coordinator": ends(at_ms=60)}, Notes(), events=(Freeze("alpha", 15, 5000),))
    assert result.mission_ms == 60


def test_who_joins_is_started_and_given_what_was_kept_then_hears_all(bus: Bus) -> None:
    # Of a state the latest is kept, of events all; each is sent at 10 ms, 20 ms and so on.
    alpha = every_ten(say_state("alpha"), say_contact(1), say_contact(2))
    coordinator = Scripted(starts=lambda now_ms: Step(wake_ms=60), wakes=lambda now_ms: says(say_over()))
    bus({"alpha": alpha, "coordinator": coordinator}, Notes(), events=(Join("coordinator", 35),))
    assert coordinator.log[0] == ("start", 35)
    assert coordinator.log[1] == (36, "run", "clock", 0, 0)
    assert heard_from(coordinator, "agent/alpha/state")[:3] == [(36, 6, 30), (41, 9, 40), (51, 12, 50)]
    assert heard_from(coordinator, "agent/alpha/contact/1")[:4] == [(36, 1, 10), (36, 4, 20), (36, 7, 30), (41, 10, 40)]
    kept = [entry[3] for entry in coordinator.log if entry[0] == 36][1:]
    assert kept == [1, 2, 4, 5, 6, 7, 8]  # in the order in which they were sent


def test_what_is_sent_as_one_joins_reaches_it_once(bus: Bus) -> None:
    alpha, coordinator = every_ten(say_contact(1)), ends(at_ms=60)
    bus({"alpha": alpha, "coordinator": coordinator}, Notes(), events=(Join("coordinator", 30),))
    heard = [entry[1:] for entry in heard_from(coordinator, "agent/alpha/contact/1")]
    assert heard[:5] == [(number, 10 * number + 10) for number in range(5)]


def test_who_comes_back_with_its_memory_is_given_what_it_missed_and_woken_then() -> None:
    alpha = every_ten(say_state("alpha"), say_contact(1), say_contact(2))
    coordinator = Scripted(
        starts=lambda now_ms: says(wake_ms=50),
        wakes=lambda now_ms: says(say_over()) if now_ms > 99 else Step(wake_ms=100),
    )
    notes = Notes()
    events = (Kill("coordinator", 25), Join("coordinator", 73, memory=True))
    BUSES["local"]({"alpha": alpha, "coordinator": coordinator}, notes, events=events)
    assert coordinator.log.count(("start", 0)) == 1
    at_once = [entry for entry in coordinator.log if entry[0] == 74 or entry == ("wake", 74)]
    assert at_once[-1] == ("wake", 74)
    # Of the state the latest, of contacts all since those of 20 ms.
    assert [entry[3] for entry in at_once[:-1]] == [7, 8, 10, 11, 13, 14, 16, 17, 18, 19, 20]
    assert [entry[0] for entry in coordinator.log if isinstance(entry[0], int) and 21 < entry[0] < 74] == []
    over = next(one for one in notes.heard if one.key == "coord/mission_over")
    assert (over.header.sent_ms, over.header.incarnation, over.header.sequence) == (100, 0, 0)


def test_who_was_killed_and_comes_back_begins_anew(bus: Bus) -> None:
    def offers(now_ms: int) -> Step:
        task = Publication(TASK.key(vehicle="beta", number=now_ms), Task(TaskAction.TAKE, now_ms, 0, 0, 0, 9, 5))
        return says(task, wake_ms=now_ms + 20) if now_ms < 100 else says(say_over())

    coordinator = Scripted(starts=lambda now_ms: Step(wake_ms=20), wakes=offers)
    first, second = every_ten(say_state("beta", 1)), every_ten(say_state("beta", 2))
    notes = Notes()
    nodes = {"beta": first, "beta.1": second, "coordinator": coordinator}
    events = (Kill("beta", 45), Join("beta", 73))
    digest = bus(nodes, notes, events=events).digest
    assert first.log[-1] == (41, "coord/task/beta/40", "coordinator", 1, 40)
    assert second.log[:5] == [("start", 73), (74, "run", "clock", 0, 0)] + [
        (74, f"coord/task/beta/{sent_ms}", "coordinator", number, sent_ms)
        for number, sent_ms in enumerate([20, 40, 60])
    ]
    said = [one.header for one in notes.heard if one.header.sender == "beta"]
    assert [(one.incarnation, one.sequence) for one in said[:5]] == [(0, 0), (0, 1), (0, 2), (0, 3), (1, 0)]
    assert digest == BUSES["local"]({**nodes, "beta": every_ten(say_state("beta", 1))}, Notes(), events=events).digest


def test_late_mail_comes_when_it_is_due_although_the_clock_does_not_know(bus: Bus) -> None:
    faults = Faults(1, [MessageFault(FaultKind.DELAY, "**/maneuver_status", delay_ms=500, until_ms=15)])
    world = Scripted(
        starts=lambda now_ms: Step(wake_ms=10),
        wakes=lambda now_ms: says(say_status("alpha"), wake_ms=20 if now_ms == 10 else None),
    )
    alpha = Scripted()
    bus({"world": world, "alpha": alpha, "coordinator": ends()}, Notes(), faults=faults)
    assert heard_from(alpha, "veh/alpha/maneuver_status") == [(21, 1, 20), (511, 0, 10)]


def test_late_mail_that_wakes_nobody_wakes_nobody(bus: Bus) -> None:
    faults = Faults(1, [MessageFault(FaultKind.DELAY, "**/nav", delay_ms=50)])
    world = Scripted(starts=lambda now_ms: says(say_nav("alpha")))
    alpha = Scripted(starts=lambda now_ms: Step(wake_ms=300))
    bus({"world": world, "alpha": alpha, "coordinator": ends()}, Notes(), faults=faults)
    assert heard_from(alpha, "veh/alpha/nav") == [(300, 0, 0)]


KINDS = [MessageFault(kind, "agent/**", 0.4, delay_ms=1500) for kind in FaultKind]


@pytest.mark.parametrize("fault", KINDS, ids=lambda fault: fault.kind.value)
def test_faults_strike_alike_on_every_bus(fault: MessageFault) -> None:
    told = [told_of(run_on, Faults(3, [fault])) for run_on in BUSES.values()]
    assert told[0] == told[1] == told[2]
    assert told[0] != told_of(BUSES["local"], Faults(4, [fault]))
    assert told[0][1] != told_of(BUSES["local"], Faults(3))[1]


def told_of(run_on: Bus, faults: Faults, events: tuple[NodeEvent, ...] = ()) -> tuple[BusResult, object, object]:
    """All that comes of a fleet that talks: the result, what each node was told, what the observer heard."""
    nodes = {**fleet_that_talks(8000), **{f"{one}.1": fleet_that_talks()[one] for one in ("alpha", "beta")}}
    notes = Notes()
    result = run_on(nodes, notes, faults=faults, events=events)
    heard = [(one.key, one.header, one.payload) for one in notes.heard]
    return replace(result, latencies_ms={}), {name: node.log for name, node in nodes.items()}, heard


def events_of(node_id: str) -> st.SearchStrategy[list[NodeEvent]]:
    """What may happen to one node, in an order that fits."""
    times = st.lists(st.integers(1, 9000), min_size=4, max_size=4, unique=True).map(sorted)
    return times.flatmap(
        lambda at: st.sampled_from(
            [
                [],
                [Kill(node_id, at[0])],
                [Kill(node_id, at[0]), Join(node_id, at[1])],
                [Freeze(node_id, at[0], at[1]), Kill(node_id, at[2]), Join(node_id, at[3])],
                [Join(node_id, at[0]), Freeze(node_id, at[1], at[2])],
                [Freeze(node_id, at[0], at[1]), Freeze(node_id, at[2], at[3])],
            ]
        )
    )


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    alpha=events_of("alpha"),
    beta=events_of("beta"),
    faults=st.lists(
        st.builds(
            MessageFault,
            st.sampled_from(FaultKind),
            st.sampled_from(["**", "agent/**", "veh/**", "**/state"]),
            st.sampled_from([0.1, 0.5, 1.0]),
            delay_ms=st.integers(1, 3000),
        ),
        max_size=2,
    ),
    cut_off=st.lists(
        st.builds(CutOff, st.sampled_from(["alpha", "beta"]), st.just(1000), st.integers(1, 6000)), max_size=1
    ),
    seed=st.integers(0, 100),
)
def test_whatever_goes_wrong_both_buses_tell_the_same(
    alpha: list[NodeEvent], beta: list[NodeEvent], faults: list[MessageFault], cut_off: list[CutOff], seed: int
) -> None:
    events = (*alpha, *beta)
    local, zenoh = (told_of(BUSES[name], Faults(seed, faults, cut_off), events) for name in ("local", "zenoh"))
    assert local == zenoh


@pytest.mark.parametrize(
    ("events", "sentence"),
    [
        ([Kill("world", 5)], "'world' cannot be killed, frozen or joined; must be one of alpha, beta, coordinator"),
        ([Kill("observer", 5)], "'observer' cannot be .*"),
        ([Freeze("gamma", 5, 9)], "'gamma' cannot be .*"),
        ([Kill("alpha", 0)], "alpha: an event at 0 s is not allowed; must be after 0 s"),
        ([Kill("alpha", 5), Kill("alpha", 9)], "alpha: kill at 9 ms is not allowed; it must be there then"),
        ([Kill("alpha", 5), Freeze("alpha", 9, 10)], "alpha: freeze at 9 ms is not allowed; it must be there then"),
        (
            [Freeze("alpha", 9, 20), Kill("alpha", 15)],
            "alpha: an event at 0.015 s is not allowed; must be after 0.02 s",
        ),
        ([Freeze("alpha", 9, 9)], "alpha: must be thawed after 0.009 s, not at 0.009 s"),
        ([Freeze("alpha", 9, 12), Join("alpha", 20)], "alpha: join at 20 ms is not allowed; it must be absent then"),
        ([Join("alpha", 20, memory=True)], "alpha: join with memory at 20 ms is not allowed; it has none yet"),
    ],
)
def test_events_that_do_not_fit_are_refused(events: list[NodeEvent], sentence: str) -> None:
    with pytest.raises(ValueError, match=rf"^{sentence}$"):
        timeline(events, ROUTING)


def test_the_timeline_is_in_order_and_counts_incarnations() -> None:
    events: list[NodeEvent] = [
        Join("beta", 5),
        Kill("alpha", 5),
        Kill("beta", 8),
        Join("beta", 30),
        Kill("beta", 40),
        Join("beta", 50, memory=True),
        Freeze("coordinator", 8, 20),
    ]
    assert timeline(events, ROUTING) == (
        Happening(5, Change.KILL, "alpha", 0),
        Happening(5, Change.JOIN, "beta", 0),
        Happening(8, Change.KILL, "beta", 0),
        Happening(8, Change.FREEZE, "coordinator", 0),
        Happening(20, Change.THAW, "coordinator", 0),
        Happening(30, Change.JOIN, "beta", 1, start=1),
        Happening(40, Change.KILL, "beta", 1, start=1),
        Happening(50, Change.JOIN, "beta", 1, start=2, memory=True),
    )
