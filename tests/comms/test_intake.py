"""What does not fit is counted, said once and dropped; what fits comes through."""

from __future__ import annotations

import logging
from dataclasses import replace

import pytest
from fleets import ROSTER, RUN_INFO, nav, state, with_modems
from hypothesis import given, settings
from hypothesis import strategies as st
from same_message import assert_same

from comms.node import Received
from comms.runner import Intake, Stamp
from comms.said.announcement import Role
from comms.said.codec import CLOCK, Header, encode, sealed
from comms.said.routing import Routing
from comms.said.topics import NAV, RUN, STATE, TOPICS, Topic
from comms.said.wire import LARGEST_MS
from secondlook.testing.checks.any_mail import any_message

GOOD = encode(Header("world", 0, 0, 1000), nav(2.0))


@pytest.fixture
def intake() -> Intake:
    return Intake(Routing(ROSTER))


def test_a_message_that_fits_is_opened(intake: Intake) -> None:
    expected = Received("veh/alpha/nav", NAV, "alpha", Header("world", 0, 0, 1000), nav(2.0), GOOD)
    assert intake.open("veh/alpha/nav", GOOD) == expected
    assert not intake.dropped


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
@settings(max_examples=20)
@given(data=st.data())
def test_what_is_opened_without_unpacking_is_what_the_payload_holds(topic: Topic, data: st.DataObject) -> None:
    routing, vehicle = Routing(with_modems(ROSTER)), "beta" if Role.SURVEY not in topic.writers else "alpha"
    key = topic.key(vehicle=vehicle, number=7, tile="3-4")
    route = routing.route(key)
    assert route is not None
    message = data.draw(any_message(topic.message))
    sent = Stamp(route.writer, routing)(key, message, data.draw(st.integers(0, LARGEST_MS)))
    assert sent.size == len(sent.payload)
    unpacked, opened = Intake(routing).open(key, sent.payload), sent.opened()
    assert unpacked is not None
    assert opened._replace(message=message) == unpacked._replace(message=message)
    assert_same(opened.message, unpacked.message)


@pytest.mark.parametrize(
    ("key", "payload", "reason", "said"),
    [
        ("veh/alpha/nav", b"\xc1", "malformed", "from world: malformed: veh/alpha/nav: not a list"),
        ("veh/alpha/nav", sealed([b"\xc1"]), "malformed", "malformed: veh/alpha/nav: "),
        ("veh/alpha/nav", GOOD[:-1] + b"\x07", "malformed", "veh/alpha/nav: the checksum does not fit"),
        ("veh/alpha/nav", encode(Header("world", 0, 0, 0), state()), "malformed", "Nav needs a list of 7 fields"),
        ("veh/alpha/nav", b"\x00" * (NAV.max_bytes + 1), "too long", "too long: veh/alpha/nav: 201 bytes"),
        ("veh/alpha/nav", encode(Header("beta", 0, 0, 0), nav()), "wrong sender", "says it is from beta"),
        ("agent/beta/state", encode(Header("alpha", 0, 0, 0), state()), "wrong sender", "from beta: wrong sender"),
        ("veh/delta/nav", GOOD, "unknown key", "from nobody: unknown key: veh/delta/nav"),
        ("agent/alpha/coverage/*", GOOD, "unknown key", "unknown key: agent/alpha/coverage/*"),
    ],
)
def test_what_does_not_fit_is_counted_and_said_once(
    intake: Intake, caplog: pytest.LogCaptureFixture, key: str, payload: bytes, reason: str, said: str
) -> None:
    for _ in range(3):
        assert intake.open(key, payload) is None
    assert intake.dropped == {reason: 3}
    assert len(caplog.records) == 1
    assert caplog.records[0].levelno == logging.WARNING
    assert said in caplog.messages[0]
    assert intake.open("veh/alpha/nav", GOOD) is not None


def test_a_run_that_is_announced_otherwise_is_not_believed(caplog: pytest.LogCaptureFixture) -> None:
    """Who may write the clock's key could have everyone begin another mission."""
    intake = Intake(Routing(ROSTER, RUN_INFO))
    other = encode(Header(CLOCK, 0, 0, 0), replace(RUN_INFO, seed=RUN_INFO.seed + 1))
    assert intake.open(RUN.key(), other) is None
    assert intake.dropped == {"another run": 1}
    assert caplog.messages == [
        "dropped a message from clock: another run: run: announces a run that is not this one (said once)"
    ]
    received = intake.open(RUN.key(), encode(Header(CLOCK, 0, 0, 0), RUN_INFO))
    assert received is not None
    assert received.message == RUN_INFO


def test_each_sender_and_each_reason_is_said_for_itself(intake: Intake, caplog: pytest.LogCaptureFixture) -> None:
    for key in ("veh/alpha/nav", "agent/alpha/state", "agent/beta/state", "agent/beta/maneuver"):
        intake.open(key, b"\xc1")
    intake.open("agent/beta/state", b"\x00" * (STATE.max_bytes + 1))
    assert intake.dropped == {"malformed": 4, "too long": 1}
    assert [message.split(": ")[:2] for message in caplog.messages] == [
        ["dropped a message from world", "malformed"],
        ["dropped a message from alpha", "malformed"],
        ["dropped a message from beta", "malformed"],
        ["dropped a message from beta", "too long"],
    ]
