"""One conformance suite for every bus: order, addressing, wake-ups, equal times, publishing from within a handler."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fleets import (
    BUSES,
    ROSTER,
    Bus,
    Notes,
    Scripted,
    fleet_that_talks,
    nav,
    say_nav,
    say_over,
    say_state,
    say_status,
    says,
)

from comms.errors import NodeError, RunawayError
from comms.lockstep import clock
from comms.node import Publication, Received, Step
from comms.result import Ending
from comms.runner import GuardedNode
from comms.said.announcement import RunInfo
from comms.said.routing import Routing
from comms.said.topics import TRUTH_TARGETS


@pytest.fixture(params=BUSES)
def bus(request: pytest.FixtureRequest) -> Bus:
    """Each bus in turn."""
    return BUSES[request.param]


def test_everyone_is_started_and_told_of_the_run_first(bus: Bus) -> None:
    nodes = {name: Scripted() for name in ("world", "alpha", "beta", "coordinator")}
    notes = Notes()
    result = bus(nodes, notes)
    for node in nodes.values():
        assert node.log == [("start", 0), (1, "run", "clock", 0, 0)]
    assert [type(one.message) for one in notes.heard] == [RunInfo]
    assert (result.ending, notes.closed) == (Ending.IDLE, 1)


def test_a_message_reaches_its_readers_and_nobody_else(bus: Bus) -> None:
    world = Scripted(starts=lambda now_ms: says(say_nav("alpha", 3.0)))
    alpha, beta, coordinator, notes = Scripted(), Scripted(), Scripted(), Notes()
    bus({"world": world, "alpha": alpha, "beta": beta, "coordinator": coordinator}, notes)
    assert (1, "veh/alpha/nav", "world", 0, 0) in alpha.log
    assert all("nav" not in str(entry) for entry in beta.log + coordinator.log + world.log)
    assert [one.key for one in notes.heard] == ["run", "veh/alpha/nav"]
    assert notes.heard[1].message == nav(3.0)


def test_wake_ups_come_when_asked_for_and_not_otherwise(bus: Bus) -> None:
    times = iter([10, 11, 5000, None])
    world = Scripted(starts=lambda now_ms: Step(wake_ms=7), wakes=lambda now_ms: Step(wake_ms=next(times)))
    bus({"world": world}, Notes())
    assert [entry for entry in world.log if entry[0] == "wake"] == [
        ("wake", 7),
        ("wake", 10),
        ("wake", 11),
        ("wake", 5000),
    ]


def test_mail_due_at_a_wake_up_comes_before_it(bus: Bus) -> None:
    world = Scripted(starts=lambda now_ms: Step(wake_ms=99), wakes=lambda now_ms: says(say_nav("alpha")))
    alpha = Scripted(starts=lambda now_ms: Step(wake_ms=100))
    bus({"world": world, "alpha": alpha}, Notes())
    assert alpha.log[-2:] == [(100, "veh/alpha/nav", "world", 0, 99), ("wake", 100)]


def test_mail_that_wakes_nobody_waits_for_its_readers_next_turn(bus: Bus) -> None:
    world = Scripted(
        starts=lambda now_ms: Step(wake_ms=10),
        wakes=lambda now_ms: says(say_nav("alpha"), wake_ms=now_ms + 10 if now_ms < 50 else None),
    )
    beta = Scripted(starts=lambda now_ms: Step(wake_ms=30))
    alpha = Scripted(starts=lambda now_ms: Step(wake_ms=30))
    bus({"world": world, "alpha": alpha, "beta": beta}, Notes())
    # What was sent at 30 ms is due at 31 ms, and nothing lets alpha act after that.
    assert alpha.log[2:] == [(30, "veh/alpha/nav", "world", n, 10 * n + 10) for n in range(2)] + [("wake", 30)]


def test_messages_of_one_time_are_ordered_by_sender_and_sequence(bus: Bus) -> None:
    def speak(name: str) -> Scripted:
        return Scripted(
            starts=lambda now_ms: Step(wake_ms=50),
            wakes=lambda now_ms: says(*(say_state(name, works_on=n) for n in range(5))),
        )

    coordinator, notes = Scripted(), Notes()
    bus({"alpha": speak("alpha"), "beta": speak("beta"), "coordinator": coordinator}, notes)
    heard = [(entry[2], entry[3]) for entry in coordinator.log if entry[0] == 51]
    assert heard == [(name, n) for name in ("alpha", "beta") for n in range(5)]
    assert [(one.header.sender, one.header.sequence) for one in notes.heard[1:]] == heard


def test_a_handler_may_publish_and_the_answer_comes_a_delay_later(bus: Bus) -> None:
    world = Scripted(starts=lambda now_ms: says(say_status("alpha")))
    alpha = Scripted(hears=lambda received, now_ms: says(say_state("alpha")) if received.vehicle else None)
    coordinator = Scripted()
    bus({"world": world, "alpha": alpha, "coordinator": coordinator}, Notes())
    assert (2, "agent/alpha/state", "alpha", 0, 1) in coordinator.log


def test_everyone_hears_of_the_end_and_says_a_last_word(bus: Bus) -> None:
    coordinator = Scripted(starts=lambda now_ms: Step(wake_ms=2000), wakes=lambda now_ms: says(say_over()))
    alpha = Scripted(
        starts=lambda now_ms: Step(wake_ms=90_000),
        hears=lambda received, now_ms: says(say_state("alpha", 9)) if now_ms > 2000 else None,
    )
    notes = Notes()
    result = bus({"alpha": alpha, "coordinator": coordinator}, notes)
    assert (result.ending, result.mission_ms) == (Ending.OVER, 2000)
    assert [one.key for one in notes.heard[1:]] == ["coord/mission_over", "agent/alpha/state"]
    assert ("wake", 90_000) not in alpha.log


def test_a_fleet_that_goes_on_for_ever_ends_at_its_time_limit(bus: Bus) -> None:
    world = Scripted(starts=lambda now_ms: Step(wake_ms=1000), wakes=lambda now_ms: Step(wake_ms=now_ms + 1000))
    result = bus({"world": world}, Notes(), time_limit_ms=10_500)
    assert result.ending is Ending.TIME_LIMIT
    assert world.log[-1] == ("wake", 10_000)


def test_all_buses_give_one_digest_and_tell_every_node_the_same() -> None:
    told = []
    for run_on in BUSES.values():
        nodes, notes = fleet_that_talks(), Notes()
        result = run_on(nodes, notes)
        heard = [(one.key, one.header, one.payload) for one in notes.heard]
        told.append((result.digest, result.messages, {name: node.log for name, node in nodes.items()}, heard))
    assert len(told[0][3]) > 100
    assert told[1] == told[0]
    assert told[2] == told[0]


def test_the_digest_tells_one_changed_message() -> None:
    nodes = fleet_that_talks()
    before = BUSES["local"](fleet_that_talks(), Notes()).digest
    nodes["alpha"].hears = lambda received, now_ms: says(say_state("alpha", now_ms + (now_ms == 7001)))
    assert BUSES["local"](nodes, Notes()).digest != before


def test_a_node_that_raises_ends_the_run_with_a_sentence_that_names_it() -> None:
    def break_down(now_ms: int) -> Step:
        raise RuntimeError("flooded")

    alpha = Scripted(starts=lambda now_ms: Step(wake_ms=1500), wakes=break_down)
    notes = Notes()
    with pytest.raises(
        NodeError, match=r"^alpha has failed at 1\.500 s: RuntimeError: flooded \(\w+\.py, line \d+, in \w+\)$"
    ):
        BUSES["local"]({"alpha": alpha}, notes)
    assert notes.closed == 1


def test_which_errors_numpy_raises_a_node_sets_for_itself_alone(bus: Bus) -> None:
    def set_all(now_ms: int) -> Step:
        np.seterr(all="raise")
        return Step()

    def ask(now_ms: int) -> Step:
        told.append(np.geterr())
        return Step()

    before, told = np.geterr(), list[object]()
    world = Scripted(starts=lambda now_ms: Step(wake_ms=5), wakes=ask)
    bus({"alpha": Scripted(starts=set_all), "world": world}, Notes())
    assert (told, np.geterr()) == ([before], before)


@pytest.mark.parametrize(
    ("publication", "sentence"),
    [
        (say_nav("alpha"), "alpha may not publish a Nav under veh/alpha/nav"),
        (say_state("beta"), "alpha may not publish a AgentState under agent/beta/state"),
    ],
)
def test_the_local_bus_refuses_what_a_node_may_not_write(publication: object, sentence: str) -> None:
    alpha = Scripted(starts=lambda now_ms: Step((publication,)))  # type: ignore[arg-type]
    with pytest.raises(NodeError, match=sentence):
        BUSES["local"]({"alpha": alpha}, Notes())


step: Any = Step
publication: Any = Publication
ODD: list[tuple[Any, str]] = [
    ([], r"must answer start with a comms\.node\.Step, not \[\]"),
    (((), None), r"must answer start with a comms\.node\.Step, not \(\(\), None\)"),
    (step(publish=None), "answers start with a Step whose publish is None; must be a tuple of comms.node.Publication"),
    (
        step(publish=say_nav("alpha")),
        r"Step whose publish is Publication\(.*; must be a tuple of comms.node.Publication",
    ),
    (step(publish=("word",)), r"Step whose publish is \('word',\); must be a tuple of comms.node.Publication"),
    (step(publish=(publication([], nav(3.0)),)), r"Step whose publish is \(Publication\(.*, each with a key"),
    (step(wake_ms=2.5), r"Step whose wake_ms is 2\.5; must be whole milliseconds, or None"),
    (step(wake_ms="soon"), "Step whose wake_ms is 'soon'; must be whole milliseconds, or None"),
    (step(wake_ms=True), "Step whose wake_ms is True; must be whole milliseconds, or None"),
    (step(dropped="late"), "Step whose dropped is 'late'; must be a tuple of texts"),
    (step(dropped=(7,)), r"Step whose dropped is \(7,\); must be a tuple of texts"),
]


class Odd:
    """A node that answers at its start with what is no step."""

    def __init__(self, answer: Any) -> None:
        self._answer = answer

    def start(self, now_ms: int) -> Any:
        return self._answer

    def on_message(self, received: Received, now_ms: int) -> Step:
        return Step()

    def on_wake(self, now_ms: int) -> Step:
        return Step()


@pytest.mark.parametrize(("answer", "sentence"), ODD)
def test_an_answer_that_is_no_step_is_told_with_the_class_of_the_node(answer: Any, sentence: str) -> None:
    node = GuardedNode("alpha", Odd(answer), Routing(ROSTER))
    told = rf"^alpha has failed at 0\.000 s: ValueError: the node \S*test_buses:Odd .*{sentence}"
    with pytest.raises(NodeError, match=told):
        node.act(0, start=True)


def test_what_a_step_holds_may_be_given_one_by_one_and_by_numpy() -> None:
    node = GuardedNode(
        "alpha", Odd(step(iter([say_state("alpha")]), np.int64(7), iter(["late", "late"]))), Routing(ROSTER)
    )
    (said,) = node.act(0, start=True)
    assert (said.key, node.wake_ms, type(node.wake_ms)) == ("agent/alpha/state", 7, int)
    assert node.dropped == {"late": 2}


def test_agents_have_no_route_to_the_truth() -> None:
    assert {role.value for role in TRUTH_TARGETS.readers} == {"recorder", "observer"}


def test_a_flood_of_messages_is_told_with_its_topics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock, "MOST_MESSAGES_A_SECOND", 100)
    world = Scripted(starts=lambda now_ms: says(*[say_nav("alpha")] * 101))
    with pytest.raises(RunawayError, match=r"^more than 100 messages within simulated second 0; .* nav 10\d"):
        BUSES["local"]({"world": world}, Notes())
