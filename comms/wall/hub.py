"""The hub of a fleet that the wall clock drives: it holds the clock, announces the run, and may seat nodes itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import zenoh

from comms.awake_clock import AwakeClock
from comms.errors import FleetError, HostLostError, WordsError, one_line
from comms.journal import Journal
from comms.keys import HostSpec, RunKeys
from comms.node import Received
from comms.result import BusResult, LastWord
from comms.runner import Intake, Stamp
from comms.said.announcement import RunInfo
from comms.said.codec import CLOCK
from comms.said.routing import Routing
from comms.said.topics import MISSION_OVER, RUN
from comms.session import PATIENCE_S, SIGN_OF_LIFE_EVERY_S
from comms.wall.clock import LAST_WORD_WITHIN_S, Phase, WallClock
from comms.wall.gate import Gate
from comms.wall.host import BEAT_EVERY_S
from comms.wall.line import Life, WallLine
from comms.wall.pace import Pace
from comms.wall.post import WallPost, Words
from comms.wall.seats import NodeSeat
from comms.wall.words import TimeSignal, pack_time, unpack_hello
from comms.words import unpack_last_word

TIME_EVERY_S = 0.25
HELD_TURN_S = 0.1  # while time stands still nothing comes due
FROM = "clock/from/"


class WallHub:
    """The hub of one run over an open session.

    `hosts`: the other processes it waits for. `seat`: the nodes of this process. `strict`: a process that is lost,
    fails or is silent for `patience_s` ends the run; else the others go on without it. `forgiving`: then only silence
    does, as who is lost or fails is started again. `may_be_late_ms`: see `Pace`. `alive`: called with the mission time
    every half second. `notice`: told in words what a person should know. `now`: of a fleet that is simulated, whose
    time stands still with the hub.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        routing: Routing,
        hosts: tuple[HostSpec, ...],
        seat: NodeSeat,
        run_info: RunInfo,
        time_limit_ms: int,
        factor: float,
        *,
        strict: bool,
        forgiving: bool = False,
        may_be_late_ms: float = math.inf,
        patience_s: float = PATIENCE_S,
        alive: Callable[[int], None] = lambda now_ms: None,
        notice: Callable[[str], None] = lambda sentence: None,
        now: AwakeClock | None = None,
    ) -> None:
        self._now = AwakeClock(math.inf) if now is None else now
        self._times_stopped = 0
        self._keys = keys
        self._seat = seat
        self._strict = strict
        self._ends_when_lost = strict and not forgiving
        self._patience_s = patience_s
        self._alive = alive
        self._notice = notice
        listens = {spec.host: all(routing.nodes[node].listens_only for node in spec.nodes) for spec in hosts}
        self._clock = WallClock(listens, run_info.scenario_sha256, time_limit_ms, factor, self._now())
        self._pace = Pace(factor, may_be_late_ms)
        self._announced = Stamp(CLOCK, routing)(RUN.key(), run_info, 0)
        self._kept = Journal()
        self._time_at_s = self._beat_at_s = self._alive_at_s = 0.0
        self._under_way = False
        self._seat_closed = False
        intake = Intake(routing)
        gate = Gate(routing, intake)
        gate.factor = factor
        self._line = WallLine(
            session,
            keys,
            gate,
            expressions=[*seat.reads, MISSION_OVER.expression(), "clock/beat/*", f"{FROM}*"],
            keeps=[*seat.keeps, RUN.expression()],
            watches_lives=True,
        )
        self._post = WallPost(self._line, keys, routing, intake, self._now)

    def interrupt(self) -> None:
        """From another thread or a signal's handler: `run` raises Interrupted."""
        self._line.interrupt()

    def run(self) -> BusResult:
        """Waits for all and runs the fleet to its end; raises FleetError, NodeError and Interrupted."""
        clock = self._clock
        while clock.phase is not Phase.ENDED:
            now_s = self._now()
            clock.pass_time(now_s)
            self._begin_or_end(now_s)
            if self._under_way and not self._seat_closed:
                self._post.publish(self._seat.act(clock.time.now_ms(now_s)))
            self._speak(now_s)
            event = self._line.get(HELD_TURN_S if self._now.is_held else self._next_s(now_s) - self._now())
            for item in [] if event is None else self._post.receive(event, self._all_kept):
                match item:
                    case Received():
                        self._post.keep(item)
                    case Words(key, words) if key.startswith(FROM):
                        self._hear(key.removeprefix(FROM), words)
                    case Life(host, instance, alive) if not alive:
                        self._lose(host, instance)
            self._pass_on()
            self._send_words()
        self._send_words()
        self._find_too_late(at_end=True)
        if self._ends_when_lost and clock.unfinished:
            names = ", ".join(clock.unfinished)
            raise FleetError(f"{names}: has not said within {LAST_WORD_WITHIN_S:g} s of the end that all was heard")
        return clock.result

    def _begin_or_end(self, now_s: float) -> None:
        clock = self._clock
        if clock.phase is Phase.RUNNING and not self._under_way:
            self._under_way = True
            self._pace.begin(now_s)
            self._seat.begin(0, clock.factor)
            self._send_time(now_s)
            self._kept.add(self._announced)
            self._post.publish([self._announced])
        elif clock.phase not in (Phase.WAITING, Phase.RUNNING) and not self._seat_closed:
            self._seat_closed = True
            self._post.beat(self._seat.kept)
            clock.done_here(self._seat.last_word(self._post.intake.dropped))
            clock.done_here(LastWord(messages={RUN.name: 1}))

    def _next_s(self, now_s: float) -> float:
        next_s = min(self._time_at_s, self._beat_at_s, now_s + 0.05)
        next_ms = self._seat.next_ms if self._under_way and not self._seat_closed else None
        return next_s if next_ms is None else max(now_s, min(next_s, self._clock.time.local_s(next_ms)))

    def _speak(self, now_s: float) -> None:
        if now_s >= self._time_at_s or self._now.is_held:  # no time passes then, and one signal alone may be left out
            self._send_time(now_s)
        if now_s >= self._beat_at_s:
            self._beat_at_s = now_s + BEAT_EVERY_S
            if self._under_way:
                self._post.beat({CLOCK: self._kept, **self._seat.kept})
        if now_s >= self._alive_at_s:
            self._alive_at_s = now_s + SIGN_OF_LIFE_EVERY_S
            self._alive(self._now_ms(now_s))
            self._find_too_late()
            if self._strict:
                self._find_silent(now_s)
        for notice in self._clock.notices:
            self._notice(one_line(notice))
        self._clock.notices.clear()

    def _send_time(self, now_s: float) -> None:
        self._time_at_s = now_s + TIME_EVERY_S
        now_ms = self._clock.time.now_ms(self._now()) if self._clock.time.known else None
        held = self._now.is_held or self._now.times_stopped > self._times_stopped
        self._times_stopped = self._now.times_stopped
        signal = pack_time(TimeSignal(now_ms, self._clock.factor, taken_up=self._clock.taken_up, held=held))
        self._line.say(self._keys.time, signal, drop=True)

    def _send_words(self) -> None:
        if self._clock.words:
            self._send_time(self._now())  # who is welcomed before the start is to know that it was there
        for host, words in self._clock.words:
            self._line.say(self._keys.to_host(host), words)
        self._clock.words.clear()

    def _find_too_late(self, *, at_end: bool = False) -> None:
        now_s = self._now()
        if self._clock.phase in (Phase.RUNNING, Phase.ENDED):
            self._pace.hear("the hub", self._seat.late_ms(), self._now_ms(now_s), now_s)
        sentence = self._pace.too_fast(now_s, at_end=at_end)
        if sentence:
            raise FleetError(sentence)

    def _find_silent(self, now_s: float) -> None:
        silent = self._clock.silent(now_s, self._patience_s)
        if silent:
            at_s = self._now_ms(now_s) / 1000
            names = ", ".join(sorted(silent))
            raise FleetError(f"nothing heard for {self._patience_s:g} s at {at_s:.3f} s of the mission from {names}")

    def _pass_on(self) -> None:
        # What the others have said waits: while time is held, and until a clock that was started anew knows the time.
        if self._now.is_held or not self._clock.time.known:
            return
        for received in self._post.in_time(self._now_ms(self._now()), self._clock.factor):
            if received.topic is MISSION_OVER:
                self._clock.over(received.header.sent_ms)
            if self._under_way and not self._seat_closed:
                self._post.publish(self._seat.hear(received, self._now_ms(self._now())))

    def _hear(self, host: str, words: list[Any]) -> None:
        try:
            match words:
                case ["hello", *_]:
                    hello, now_s = unpack_hello(words), self._now()
                    self._clock.hello(host, hello, now_s)
                    self._pace.hear(host, hello.late_ms, self._now_ms(now_s), now_s)
                case ["done", *_]:
                    self._clock.done(host, unpack_last_word(words))
                case ["failed", str(sentence)]:
                    if self._ends_when_lost:
                        raise FleetError(one_line(sentence))
                    self._notice(one_line(sentence))
        except WordsError as error:
            self._post.intake.drop("senseless words", host, str(error))

    def _lose(self, host: str, instance: str) -> None:
        if self._ends_when_lost and not self._clock.is_done(host):
            raise HostLostError(host, self._now_ms(self._now()))
        self._clock.gone(host, instance, self._now())

    def _now_ms(self, now_s: float) -> int:
        return self._clock.time.now_ms(now_s) if self._clock.time.known else 0

    def _all_kept(self) -> list[Journal]:
        return [self._kept, *self._seat.kept.values()]
