"""A process's word with the clock: which start of a node it is, and whose words it heeds."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import pytest
import zenoh
from by_wall import ROUTING, WALL_KEYS, WALL_RUN
from fleets import Scripted, say_state, says

from comms.errors import RefusedError
from comms.result import BusResult, Ending
from comms.runner import Stamp
from comms.said.codec import CLOCK, header_of
from comms.said.topics import RUN
from comms.session import open_client, open_hub, put, subscribe
from comms.wall.host import WallHost, incarnation_at
from comms.wall.seats import NodeSeat
from comms.wall.words import TimeSignal, pack_finish, pack_time
from comms.words import pack, unpack

SOON_S = 10.0
LIMIT_MS = 60_000


@dataclass
class Beta:
    """The helper's process, in a thread, at a hub where the test speaks for the clock."""

    session: zenoh.Session
    own: zenoh.Session
    heard: queue.SimpleQueue[tuple[str, bytes]] = field(default_factory=queue.SimpleQueue)
    result: BusResult | None = None
    error: Exception | None = None

    def __post_init__(self) -> None:
        self._subscribers = subscribe(self.session, [WALL_KEYS.topic("**")], lambda *one: self.heard.put(one))
        node = Scripted(starts=lambda now_ms: says(say_state("beta")))
        seat = NodeSeat({"beta": node}, ROUTING)
        self.host = WallHost(self.own, WALL_KEYS, "beta", seat, ROUTING, WALL_RUN.scenario_sha256, LIMIT_MS)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            self.result = self.host.run()
        except RefusedError as error:
            self.error = error

    def say(self, words: bytes) -> None:
        put(self.session, WALL_KEYS.to_host("beta"), words)

    def comes_at(self, told: TimeSignal) -> None:
        """It is welcome, and told the time and of the run."""
        self.say(pack("welcome"))
        while unpack(self.hears("clock/from/beta", "hello"))[4] is not True:
            pass
        put(self.session, WALL_KEYS.time, pack_time(told))
        announced = Stamp(CLOCK, ROUTING)(RUN.key(), WALL_RUN, 0)
        put(self.session, WALL_KEYS.topic(announced.key), announced.payload)

    def hears(self, key: str, first_word: str = "") -> bytes:
        """The next payload that comes under a key below the run id, and begins with this word."""
        while True:
            found, payload = self.heard.get(timeout=SOON_S)
            if found == WALL_KEYS.topic(key) and (not first_word or unpack(payload)[0] == first_word):
                return payload


@pytest.fixture
def beta() -> Iterator[Beta]:
    session, endpoint = open_hub({"beta": "secret"}, None)
    with session, open_client(endpoint, "beta", "secret") as own:
        started = Beta(session, own)
        instance = unpack(started.hears("clock/from/beta", "hello"))[1]
        assert isinstance(instance, str)
        try:
            yield started
        finally:
            started.host.interrupt()
            started.thread.join(SOON_S)
            assert not started.thread.is_alive()


@pytest.mark.parametrize(
    ("waits", "taken_up", "incarnation"),
    [(True, False, 0), (False, False, 6), (True, True, 6), (False, True, 6)],
)
def test_only_who_waited_for_a_mission_to_begin_is_the_first_of_its_name(
    beta: Beta, waits: bool, taken_up: bool, incarnation: int
) -> None:
    if waits:
        put(beta.session, WALL_KEYS.time, pack_time(TimeSignal(None, 1.0)))
    beta.comes_at(TimeSignal(5_000, 1.0, taken_up=taken_up))
    assert header_of(beta.hears("agent/beta/state")).incarnation == incarnation
    beta.say(pack_finish(BusResult(Ending.OVER, 7_000, None, None, {}, {})))
    assert unpack(beta.hears("clock/from/beta", "done"))[2] == {"state": 1}
    beta.say(pack("goodbye"))
    beta.thread.join(SOON_S)
    assert beta.result is not None
    assert (beta.result.ending, beta.result.mission_ms) == (Ending.OVER, 7_000)


def test_who_comes_in_mid_mission_beats_first_lest_what_it_says_waits_for_that(beta: Beta) -> None:
    beta.comes_at(TimeSignal(5_000, 1.0))
    beat, state = WALL_KEYS.beat("beta"), WALL_KEYS.topic("agent/beta/state")
    heard = (beta.heard.get(timeout=SOON_S)[0] for _ in count())
    assert next(key for key in heard if key in (beat, state)) == beat


def test_who_is_not_welcome_does_nothing_and_heeds_a_refusal_of_its_own_alone(beta: Beta) -> None:
    beta.say(pack("refused", "another", "not for you"))
    put(beta.session, WALL_KEYS.time, pack_time(TimeSignal(5_000, 1.0)))
    instance = unpack(beta.hears("clock/from/beta", "hello"))[1]
    beta.say(pack("refused", instance, "there is no room"))
    beta.thread.join(SOON_S)
    assert str(beta.error) == "refused by the router: there is no room"
    assert beta.host.now_ms == 0


def test_whoever_has_said_hello_is_missed_when_it_ends_welcome_or_not(beta: Beta) -> None:
    lives: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()

    def note(sample: zenoh.Sample) -> None:
        lives.put((str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))

    handler = zenoh.handlers.Callback(note, indirect=False)
    life = WALL_KEYS.life("beta", str(unpack(beta.hears("clock/from/beta", "hello"))[1]))
    with beta.session.liveliness().declare_subscriber(WALL_KEYS.life("*", "*"), handler, history=True):
        assert lives.get(timeout=SOON_S) == (life, True)
        beta.host.interrupt()
        beta.thread.join(SOON_S)
        beta.own.close()  # type: ignore[no-untyped-call]
        assert lives.get(timeout=SOON_S) == (life, False)


def test_later_starts_have_larger_incarnations_that_fit_two_bytes() -> None:
    assert [incarnation_at(ms, LIMIT_MS) for ms in (0, 999, 1000, 59_999)] == [1, 1, 2, 60]
    longest_ms = 10_000_000_000
    assert incarnation_at(longest_ms, longest_ms) <= 2**16 - 1
    assert incarnation_at(200_000, longest_ms) > incarnation_at(0, longest_ms)
