"""A process of a fleet that the wall clock drives: what sits in it, its post, and its word with the clock."""

from __future__ import annotations

import contextlib
import math
import secrets
from collections.abc import Callable
from typing import Any

import zenoh

from comms.awake_clock import AwakeClock
from comms.errors import Interrupted, NodeError, RefusedError, WordsError, one_line
from comms.keys import RunKeys
from comms.node import Received
from comms.result import BusResult
from comms.runner import Intake
from comms.said.codec import LARGEST_INCARNATION, SCHEMA_VERSION
from comms.said.routing import Routing
from comms.wall.clock import MissionTime
from comms.wall.gate import Gate
from comms.wall.line import WallLine
from comms.wall.post import WallPost, Words
from comms.wall.seats import Seat
from comms.wall.words import Hello, TimeSignal, pack_hello, unpack_finish, unpack_time
from comms.words import pack, pack_last_word

HELLO_EVERY_S = 1.0
FIRST_HELLO_EVERY_S = 0.1  # until the clock has answered
BEAT_EVERY_S = 0.5
GOODBYE_WITHIN_S = 5.0
CATCH_UP_WITHIN_S = 1.0  # so long a node that goes on waits for what it has missed
CLOCK_LOST_AFTER_S = 3.0  # of wall time without a time signal; there are four a second
GIVES_UP_AFTER_S = 20.0  # of wall time beyond the mission's time limit
COMPLETE_WITHIN_S = 5.0  # so long a listener waits at the end for what is still missing


class WallHost:
    """Runs what sits in this process, over an open session, until the clock ends the run or someone interrupts it.

    `host`: under which it speaks with the clock, which is to answer within `answer_within_s`. A while after the time
    limit it ends by itself, where a clock that is not heard any more cannot end it. `notice`: told in words what a
    person should know. `now`: of a fleet that is simulated, whose time stands still while this process is stopped.
    `interrupted`: whether someone has ended it.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        host: str,
        seat: Seat,
        routing: Routing,
        scenario_sha256: str,
        time_limit_ms: int,
        *,
        answer_within_s: float = math.inf,
        notice: Callable[[str], None] = lambda sentence: None,
        now: AwakeClock | None = None,
    ) -> None:
        self.interrupted = False
        self._now = AwakeClock(math.inf) if now is None else now
        self._times_stopped = 0
        self._keys = keys
        self._host = host
        self._seat = seat
        self._notice = notice
        self._scenario_sha256 = scenario_sha256
        self._time_limit_ms = time_limit_ms
        self._instance = secrets.token_hex(8)
        self._time = MissionTime()
        self._welcomed = False
        self._waits_for_start = False
        self._result: BusResult | None = None
        self._finish_by_s = 0.0
        self._hello_at_s = self._beat_at_s = 0.0
        self._answer_by_s = self._now() + answer_within_s
        self._clock_heard_s = self._now()
        self._clock_is_heard = True
        self._catch_up_by_s = 0.0
        self._to_me = f"clock/to/{host}"
        intake = Intake(routing)
        self._gate = Gate(routing, intake)
        # Last comes what the clock tells to this host: when that arrives the hub knows of all the rest.
        self._line = WallLine(
            session,
            keys,
            self._gate,
            expressions=[*seat.reads, "clock/beat/*", "clock/time", self._to_me],
            keeps=seat.keeps,
        )
        self._post = WallPost(self._line, keys, routing, intake, self._now, seat.handled())
        # Before the first hello: whoever the clock has heard of is missed when it ends, however soon that is.
        self._token = session.liveliness().declare_token(keys.life(host, self._instance))

    @property
    def factor(self) -> float:
        """By how much the mission's time runs faster than the wall clock; 1 as long as it is not known."""
        return self._time.factor

    @property
    def now_ms(self) -> int:
        """The mission's time; 0 as long as it is not known."""
        return self._time.now_ms(self._now()) if self._time.known else 0

    def interrupt(self) -> None:
        """From another thread: ends the run here early; listeners keep what they have."""
        self._line.interrupt()

    def run(self) -> BusResult | None:
        """Returns how the run has ended, None where nobody has told: interrupted, or no word from the clock.

        Raises RefusedError, and NodeError after telling the clock.
        """
        try:
            try:
                self._live()
            except Interrupted:
                self.interrupted = True
                return None
            finally:
                self._seat.close()
        except NodeError as error:
            self._say(pack("failed", str(error)))
            raise
        if self._result is not None:
            with contextlib.suppress(Interrupted):
                self._leave()
        return self._result

    def _live(self) -> None:
        while True:
            now_s = self._now()
            if self._now.times_stopped > self._times_stopped:
                self._times_stopped = self._now.times_stopped
                self._time.hold(now_s)  # the clock says how long all have been
            self._speak(now_s)
            self._listen_for_clock(now_s)
            if not self._welcomed and now_s >= self._answer_by_s:
                raise RefusedError(
                    f"no answer from the router to {self._host} in run {self._keys.run}: the run there may be another, "
                    "or the name in the certificate"
                )
            if self._time.known:
                now_ms = self._time.now_ms(now_s)
                if not self._is_catching_up(now_s):
                    self._post.publish(self._seat.act(now_ms))
                if now_ms >= self._time_limit_ms + GIVES_UP_AFTER_S * 1000 * self._time.factor:
                    return
            if self._result is not None and (
                not self._seat.listens or self._post.is_complete or now_s >= self._finish_by_s
            ):
                self._seat.end()
                return
            event = self._line.get(self._next_s(now_s) - self._now())
            for item in [] if event is None else self._post.receive(event, self._seat.kept.values):
                match item:
                    case Received():
                        self._post.keep(item)
                    case Words(key, words):
                        self._hear(key, words)
            self._pass_on()

    def _is_catching_up(self, now_s: float) -> bool:
        """Whether nodes that were taken up are still to hear what they have missed before they are woken: they would
        find others silent that they have not listened to."""
        if now_s < self._catch_up_by_s and self._post.has_caught_up:
            self._catch_up_by_s = 0.0
        return now_s < self._catch_up_by_s

    def _next_s(self, now_s: float) -> float:
        next_s = min(self._hello_at_s, self._beat_at_s)
        if now_s < self._catch_up_by_s:
            return min(next_s, self._catch_up_by_s)
        next_ms = self._seat.next_ms if self._time.known else None
        # A millisecond has begun when it is over that the floor of the time shows it.
        return next_s if next_ms is None else max(now_s, min(next_s, self._time.local_s(next_ms)))

    def _speak(self, now_s: float) -> None:
        if now_s >= self._hello_at_s:
            self._hello_at_s = now_s + (HELLO_EVERY_S if self._welcomed else FIRST_HELLO_EVERY_S)
            self._say_hello(now_s)
        if now_s >= self._beat_at_s:
            self._beat_at_s = now_s + BEAT_EVERY_S
            if self._time.known:
                self._post.beat(self._seat.kept)

    def _say_hello(self, now_s: float) -> None:
        # Who is not welcomed yet tells until when it remembers: a clock that begins goes by it for want of better.
        remembers_ms = None if self._welcomed else self._seat.taken_up_at_ms
        now_ms = self._time.now_ms(now_s) if self._time.known else remembers_ms
        late_ms = self._seat.late_ms() if self._welcomed else 0
        hello = Hello(self._instance, SCHEMA_VERSION, self._scenario_sha256, self._welcomed, now_ms, late_ms)
        self._say(pack_hello(hello))

    def _listen_for_clock(self, now_s: float) -> None:
        heard = now_s - self._clock_heard_s < CLOCK_LOST_AFTER_S
        if heard != self._clock_is_heard:
            self._clock_is_heard = heard
            self._notice("the router is heard again" if heard else "the router is not heard")

    def _pass_on(self) -> None:
        if not self._time.known or self._time.is_held:  # by no time it could be told whether a message is ahead of that
            return
        for received in self._post.in_time(self._time.now_ms(self._now()), self._time.factor):
            self._post.publish(self._seat.hear(received, self._time.now_ms(self._now())))

    def _hear(self, key: str, words: list[Any]) -> None:
        try:
            if key == "clock/time":
                self._hear_time(unpack_time(words))
            elif key == self._to_me:
                self._hear_clock(words)
        except WordsError as error:
            self._post.intake.drop("senseless words", "clock", str(error))

    def _hear_time(self, told: TimeSignal) -> None:
        self._clock_heard_s = self._now()
        now_ms = told.now_ms
        if now_ms is None:
            self._waits_for_start = True
            return
        if not self._welcomed:  # nobody acts who may yet be refused
            return
        if told.held:
            self._time.hold(self._now())
            return
        first = not self._time.known
        self._gate.factor = told.factor
        self._time.hear(now_ms, told.factor, self._now())
        if first:
            self._beat_at_s = 0.0  # of a node that was started anew a beat is overdue
            # Who was there before the start is the first of its name; later ones are told apart by when they came. The
            # wait for a clock that takes up a mission's time was no wait for the start.
            is_first = self._waits_for_start and not told.taken_up
            self._seat.begin(0 if is_first else incarnation_at(now_ms, self._time_limit_ms), told.factor)
            at = f"the mission is at {now_ms / 1000:.0f} s"
            if self._seat.taken_up_at_ms is not None:
                self._catch_up_by_s = self._now() + CATCH_UP_WITHIN_S
                self._notice(f"goes on from {self._seat.taken_up_at_ms / 1000:.0f} s; {at}")
            else:
                self._notice("the mission begins" if is_first else at)

    def _hear_clock(self, words: list[Any]) -> None:
        match words:
            case ["welcome"]:
                if not self._welcomed:
                    self._welcomed = True
                    self._hello_at_s = 0.0
            case ["refused", self._instance, str(sentence)]:  # not for another process of the same name
                raise RefusedError(f"refused by the router: {one_line(sentence)}")
            case ["finish", *_]:
                self._result = unpack_finish(words)
                self._finish_by_s = self._finish_by_s or self._now() + COMPLETE_WITHIN_S

    def _leave(self) -> None:
        """Gives the last word; returns when the clock has heard it, or is gone. The session may be closed then: the
        news of its end cannot overtake the word."""
        self._say_hello(self._now())
        self._post.beat(self._seat.kept)
        self._say(pack_last_word(self._seat.last_word(self._post.intake.dropped)))
        deadline_s = self._now() + GOODBYE_WITHIN_S
        while (left_s := deadline_s - self._now()) > 0:
            event = self._line.get(left_s)
            if event is None:
                return
            for item in self._post.receive(event, self._seat.kept.values):  # others may still ask for what is kept
                if isinstance(item, Words) and item.key == self._to_me and item.words[0] == "goodbye":
                    return

    def _say(self, words: bytes) -> None:
        self._line.say(self._keys.from_host(self._host), words)


def incarnation_at(now_ms: int, time_limit_ms: int) -> int:
    """The incarnation of a node that is started in mid-mission: larger for each later second, in missions of more than
    18 hours for a correspondingly longer time, for an incarnation has two bytes."""
    step_ms = max(1000, math.ceil(time_limit_ms / (LARGEST_INCARNATION - 1)))
    return min(1 + now_ms // step_ms, LARGEST_INCARNATION)
