"""What is let in of each sender: what missions say, and what answers a question; of a flood, as much as has room."""

from __future__ import annotations

import logging

import pytest
from by_wall import ROUTING
from fleets import ROSTER, with_modems

from comms.runner import OVERHEAD_BYTES, Intake
from comms.said.routing import Routing
from comms.said.topics import TOPICS, Topic
from comms.wall.gate import FLOOD, LEEWAY, MOST_QUESTIONS, MOST_WAITING_BYTES, NOBODY, STALL_S, Gate

STATE_OF_ALPHA, STATE_OF_BETA, PLAN = "agent/alpha/state", "agent/beta/state", "agent/alpha/plan"


@pytest.fixture
def intake() -> Intake:
    return Intake(ROUTING)


@pytest.fixture
def gate(intake: Intake) -> Gate:
    return Gate(ROUTING, intake)


def let_in(gate: Gate, key: str, count: int, now_s: float, every_s: float = 0.0, size: int = 40) -> int:
    """How many of so many messages are let in; each has its turn at once."""
    found = 0
    for number in range(count):
        sender = gate.lets_in(key, size, now_s + number * every_s)
        if sender is not None:
            gate.has_turn(sender, size)
            found += 1
    return found


WITH_MODEMS = Routing(with_modems(ROSTER))


def keys_of(topic: Topic) -> str:
    return topic.key(vehicle="alpha" if WITH_MODEMS.route(topic.key(vehicle="alpha", tile="0")) else "beta", tile="0")


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
@pytest.mark.parametrize("factor", [1.0, 100.0])
def test_what_comes_at_its_topics_rate_is_let_in_for_ever_and_a_burst_on_top_of_it(topic: Topic, factor: float) -> None:
    gate = Gate(WITH_MODEMS, Intake(WITH_MODEMS))
    gate.factor = factor
    key, every_s = keys_of(topic), 1 / topic.rate_hz / factor
    assert let_in(gate, key, 5000, 0.0, every_s) == 5000
    assert let_in(gate, key, topic.burst, 5000 * every_s) == topic.burst


def test_a_flood_is_let_in_as_far_as_a_burst_and_said_once(
    gate: Gate, intake: Intake, caplog: pytest.LogCaptureFixture
) -> None:
    most = round(2000 + STALL_S * 0.3 * LEEWAY)
    assert let_in(gate, STATE_OF_BETA, 10_000, 0.0) == most
    assert intake.dropped == {FLOOD: 10_000 - most}
    assert [(one.levelno, one.getMessage()) for one in caplog.records] == [
        (logging.WARNING, f"dropped a message from beta: {FLOOD}: {STATE_OF_BETA} (said once)")
    ]
    assert let_in(gate, STATE_OF_BETA, 100, 100.0) == 60  # 100 s later, at twice 0.3 a second
    # What beta has used up is not taken from others, nor from what else it says.
    assert let_in(gate, STATE_OF_ALPHA, 1000, 0.0) == 1000
    assert let_in(gate, "agent/beta/coverage/0-0", 20_000, 0.0) == 20_000


def test_what_a_sender_has_under_many_keys_of_a_topic_counts_together(gate: Gate) -> None:
    found = sum(let_in(gate, f"agent/beta/contact/{number}", 1, 0.0) for number in range(5000))
    assert found == round(2000 + STALL_S * 0.2 * LEEWAY)


def test_what_was_asked_for_has_no_rate_but_room_as_all_else(gate: Gate, intake: Intake) -> None:
    size = 150_000
    most = MOST_WAITING_BYTES // (size + OVERHEAD_BYTES)
    found = [gate.lets_in(PLAN, size, 0.0, asked_for=True) for _ in range(most + 5)]
    assert found == ["alpha"] * most + [None] * 5
    assert intake.dropped == {FLOOD: 5}
    assert gate.lets_in(STATE_OF_BETA, 40, 0.0) == "beta"
    gate.has_turn("alpha", size)
    assert gate.lets_in(PLAN, size, 0.0) == "alpha"
    for _ in range(most):
        gate.has_turn("alpha", size)
    assert let_in(gate, PLAN, 1000, 0.0) == 1000


def test_strangers_have_room_for_all_of_them_together(gate: Gate) -> None:
    keys = [f"clock/from/{number}" for number in range(4000)]
    assert {gate.lets_in(key, 40, 0.0) for key in keys} == {NOBODY, None}
    assert gate.lets_in("clock/beat/alpha", 40, 0.0) == "alpha"
    assert gate.lets_in("agent/alpha/coverage/*", 40, 1000.0) == NOBODY


def test_of_questions_so_many_wait(gate: Gate) -> None:
    assert [gate.lets_ask() for _ in range(MOST_QUESTIONS + 2)] == [True] * MOST_QUESTIONS + [False] * 2
    gate.has_asked()
    assert gate.lets_ask()
