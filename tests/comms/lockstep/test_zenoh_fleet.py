"""The toy fleet over Zenoh when all is not well: slow, silent, failing and absent hosts, and words without sense."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgpack
import pytest
from fleets import (
    EACH_ALONE,
    KEYS,
    Bus,
    Notes,
    Scripted,
    fleet_that_talks,
    on_local,
    over_zenoh,
    password,
    say_nav,
    says,
)

from comms.errors import FleetError, HostLostError, NodeError, Stop
from comms.keys import HostSpec
from comms.node import Received, Step
from comms.said.codec import Header, encode
from comms.said.messages import Maneuver, ManeuverKind
from comms.said.topics import MANEUVER
from comms.session import open_client, put
from comms.words import pack


def test_nothing_is_lost_at_the_start_in_whatever_order_the_hosts_come() -> None:
    generator = random.Random(5)
    expected = on_local(fleet_that_talks(2000), Notes())
    for _ in range(30):
        notes = Notes()
        plans = tuple(generator.sample(EACH_ALONE, len(EACH_ALONE)))
        result = over_zenoh(fleet_that_talks(2000), notes, plans=plans)
        assert (result.digest, result.messages) == (expected.digest, expected.messages)
        assert len(notes.heard) == sum(expected.messages.values())


@dataclass
class Slow(Notes):
    """A listener that does not come back from its first message before it is released."""

    released: threading.Event = field(default_factory=threading.Event)

    def on_message(self, received: Received) -> None:
        assert self.released.wait(timeout=20)
        super().on_message(received)


def test_a_listener_hears_of_a_mission_while_it_goes_on() -> None:
    @dataclass
    class First(Notes):
        hears: threading.Event = field(default_factory=threading.Event)

        def on_message(self, received: Received) -> None:
            super().on_message(received)
            if received.header.sent_ms > 0:
                self.hears.set()

    listener, until_s = First(), time.monotonic() + 20

    def goes_on(now_ms: int) -> Step:
        ends = listener.hears.is_set() or time.monotonic() > until_s
        return says(say_nav("alpha"), wake_ms=None if ends else now_ms + 1)

    world = Scripted(starts=lambda now_ms: says(wake_ms=1), wakes=goes_on)
    over_zenoh({"world": world}, listener, time_limit_ms=10_000_000, most_behind_bytes=1 << 30)
    assert time.monotonic() < until_s


def test_the_clock_waits_for_a_listener_that_is_too_far_behind_and_says_the_same_as_without() -> None:
    prompt, slow = Notes(), Slow()
    expected = on_local(fleet_that_talks(50_000), prompt)
    seen_ms: list[int] = []

    def alive(now_ms: int) -> None:
        if not slow.released.is_set():
            seen_ms.append(now_ms)
            if seen_ms[-2:] == [now_ms, now_ms]:  # half a second of wall time later: the clock stands still
                slow.released.set()

    result = over_zenoh(fleet_that_talks(50_000), slow, most_behind_bytes=1600, alive=alive)
    said_bytes = sum(len(one.payload) for one in prompt.heard if one.header.sent_ms <= seen_ms[-1])
    assert 1600 <= said_bytes <= 1900  # the bound, an eighth of it and a round
    assert sum(len(one.payload) for one in prompt.heard) > 4 * 1600
    assert (result.digest, result.messages) == (expected.digest, expected.messages)
    assert [(one.key, one.payload) for one in slow.heard] == [(one.key, one.payload) for one in prompt.heard]
    assert slow.closed == 1


def test_a_listener_that_never_comes_back_is_given_up_and_named() -> None:
    slow = Slow()
    with pytest.raises(FleetError, match=r"^nothing heard for 3 s .*: no acknowledgement from observer$"):
        over_zenoh(fleet_that_talks(), slow, most_behind_bytes=1600, patience_s=3, on_failure=slow.released.set)


def test_a_host_that_does_not_answer_is_given_up_and_named() -> None:
    event = threading.Event()

    def sleep(now_ms: int) -> Step:
        assert event.wait(timeout=20)
        return says()

    beta = Scripted(starts=lambda now_ms: Step(wake_ms=1000), wakes=sleep)
    with pytest.raises(FleetError, match=r"^nothing heard for 3 s at 1\.000 s of the mission: no answer from beta$"):
        over_zenoh({"beta": beta}, Notes(), patience_s=3, on_failure=event.set)


def test_hosts_that_do_not_come_are_given_up_and_named() -> None:
    with pytest.raises(FleetError, match=r"^nothing heard for 3 s .*: no start from beta, coordinator$"):
        over_zenoh({}, Notes(), absent=("beta", "coordinator"), patience_s=3)


def test_a_host_that_dies_is_named_at_once() -> None:
    def die(now_ms: int) -> Step:
        raise Stop

    beta = Scripted(starts=lambda now_ms: Step(wake_ms=1500), wakes=die)
    plans = (HostSpec("both", ("beta", "coordinator")), HostSpec("alpha", ("alpha",)), EACH_ALONE[-1])
    with pytest.raises(HostLostError, match=r"^both was lost at 1\.500 s of the mission$") as caught:
        over_zenoh({"beta": beta}, Notes(), plans=plans)
    assert (caught.value.host, caught.value.at_ms) == ("both", 1500)


def break_down(*_: object) -> Step:
    raise RuntimeError("flooded\n  to the top")


def test_a_node_that_raises_is_named_with_what_it_raised() -> None:
    alpha = Scripted(starts=lambda now_ms: Step(wake_ms=1500), wakes=break_down)
    notes = Notes()
    with pytest.raises(
        FleetError,
        match=r"^alpha has failed at 1\.500 s: RuntimeError: flooded to the top \(\w+\.py, line \d+, in \w+\)$",
    ):
        over_zenoh({"alpha": alpha}, notes)
    assert notes.closed == 1


class Failing(Notes):
    """A listener that fails at its sixth message."""

    def on_message(self, received: Received) -> None:
        super().on_message(received)
        if len(self.heard) == 6:
            raise OSError("no space left")


class FailingToClose(Notes):
    """A listener that cannot write its last."""

    def close(self) -> None:
        super().close()
        raise OSError("no space left")


@pytest.mark.parametrize("run_on", [on_local, over_zenoh])
@pytest.mark.parametrize(
    ("listener", "sentence"),
    [
        (Failing, r"^observer has failed at 0\.001 s: OSError: no space left \(\w+\.py, line \d+, in \w+\)$"),
        (FailingToClose, r"^observer has failed: OSError: no space left \(\w+\.py, line \d+, in \w+\)$"),
    ],
)
def test_a_listener_that_raises_is_named_and_closed_once(run_on: Bus, listener: type[Notes], sentence: str) -> None:
    notes = listener()
    with pytest.raises((FleetError, NodeError), match=sentence):
        run_on(fleet_that_talks(), notes)
    assert notes.closed == 1


def test_what_a_node_raises_is_not_hidden_by_a_listener_that_cannot_be_closed() -> None:
    alpha, notes = Scripted(starts=break_down), FailingToClose()
    with pytest.raises(NodeError, match=r"^alpha has failed"):
        on_local({"alpha": alpha}, notes)
    assert notes.closed == 1


def fly_while_beta(says: Callable[[Any], None]) -> None:
    """Flies the toy fleet while a second session of beta's says something, from 1 s on in each round of the world's."""

    def act(now_ms: int) -> Step:
        says(sessions[0])
        return Step(wake_ms=now_ms + 1)

    def connect(endpoint: str) -> None:
        sessions.append(open_client(endpoint, "beta", password("beta")))

    sessions: list[Any] = []
    world = Scripted(starts=lambda now_ms: Step(wake_ms=1000), wakes=act)
    try:
        over_zenoh({"world": world}, Notes(), before=connect, time_limit_ms=20_000)
    finally:
        sessions[0].close()


@pytest.mark.parametrize(
    "words",
    [
        b"",
        b"\xc1",
        msgpack.packb("hello"),
        pack(1),
        pack("please"),
        pack("answer"),
        pack("answer", [["beta"]]),
        pack("answer", [["beta", "soon", []]]),
        pack("answer", [["beta", 5000, [["agent/beta/state", -1]]]]),
        pack("answer", [["beta", 5000, []]]),  # it was not asked
        pack("answer", []),
        pack("ack", 1),
        pack("ack", "1"),
        pack("done", 1),
    ],
    ids=repr,
)
def test_words_without_sense_end_the_run_with_a_sentence_that_names_the_host(words: bytes) -> None:
    with pytest.raises(FleetError, match=r"^beta has said what makes no sense to the clock: "):
        fly_while_beta(lambda beta: put(beta, KEYS.from_host("beta"), words))


@pytest.mark.parametrize(
    ("bound", "sentence"),
    [
        ("comms.lockstep.arrivals.MOST_AHEAD_BYTES", r"^beta floods world: \d+ messages have come of which the clock "),
        ("comms.lockstep.hub.MOST_WAITING_BYTES", r"^the hub is flooded, last under agent/beta/maneuver: more than "),
    ],
)
def test_who_floods_the_hub_ends_the_run_with_a_sentence(
    monkeypatch: pytest.MonkeyPatch, bound: str, sentence: str
) -> None:
    monkeypatch.setattr(bound, 50_000)
    maneuver = Maneuver(1, ManeuverKind.HOLD, 0, 0, 0, 0, 0)

    def flood(beta: Any) -> None:
        for sequence in range(1000):
            payload = encode(Header("beta", 0, sequence, 2**40), maneuver)
            put(beta, KEYS.topic(MANEUVER.key(vehicle="beta")), payload)

    with pytest.raises(FleetError, match=sentence):
        fly_while_beta(flood)
