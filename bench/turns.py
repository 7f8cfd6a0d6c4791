"""The processes of a fleet as threads of one process that take turns, over sessions like Zenoh's, without a network.

One thread runs at a time, in an order that is always the same, and the time that they see stands still until all of
them wait: so a whole fleet, its processes' own loops included, does the same again from one seed. What is in place of
Zenoh carries all at once and loses nothing.
"""

from __future__ import annotations

import contextlib
import math
import queue
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any
from unittest import mock

import zenoh

import comms.awake_clock
import comms.lockstep.host
import comms.lockstep.hub
import comms.wall.line

LOOPS = (comms.awake_clock, comms.lockstep.host, comms.lockstep.hub, comms.wall.line)
"""Whose queues and clock are those of the turns."""
HANGS_AFTER_S = 60.0
LEAST_STEP_S = 1e-4  # so that who waits for a moment that is all but there does not wait for ever
MOST_MATCHES = 20_000  # keys of which is remembered who hears them


class TurnsClosed(BaseException):
    """Raised where a process waits when the turns are closed."""


class HangsError(Exception):
    """A process does not come to wait any more; the text says where it is."""


@dataclass
class Process:
    """One of them. `error`: what it has ended with. `step_s`: processor time of its longest step, from one wait to the
    next, and `last_step_s` of the last."""

    name: str
    thread: threading.Thread | None = None
    turn: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    waits_for: TurnQueue | None = None
    until_s: float = 0.0
    error: BaseException | None = None
    ended: bool = False
    step_s: float = 0.0
    last_step_s: float = 0.0

    @property
    def is_ready(self) -> bool:
        """Whether there is something for it to do."""
        return not self.ended and (self.waits_for is None or bool(self.waits_for.items))


class TurnQueue:
    """In place of `queue.SimpleQueue`: whoever waits gives the turn away."""

    def __init__(self, turns: Turns) -> None:
        self.items: deque[Any] = deque()
        self._turns = turns

    def put(self, item: Any) -> None:
        self.items.append(item)

    def get(self, timeout: float = math.inf) -> Any:
        self._turns.wait(self, timeout)
        if not self.items:
            raise queue.Empty
        return self.items.popleft()

    def empty(self) -> bool:
        return not self.items


class Turns:
    """Whose turn it is, and `now_s`, what time it is for all."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.processes: list[Process] = []
        self._running: Process | None = None
        self._back = threading.Semaphore(0)
        self._began_s = 0.0
        self._closed = False
        self._timers: list[tuple[float, Callable[[], None]]] = []

    @contextlib.contextmanager
    def as_their_clock(self) -> Iterator[None]:
        """Within it the loops of `comms` wait and tell the time by these turns."""
        clock = SimpleNamespace(monotonic=lambda: self.now_s, perf_counter=time.perf_counter, process_time=lambda: 0.0)
        queues = SimpleNamespace(SimpleQueue=lambda: TurnQueue(self), Empty=queue.Empty)
        with contextlib.ExitStack() as stack:
            for module in LOOPS:
                stack.enter_context(mock.patch.object(module, "time", clock))
                if hasattr(module, "queue"):
                    stack.enter_context(mock.patch.object(module, "queue", queues))
            yield

    def begin(self, name: str, work: Callable[[], Any]) -> Process:
        """A process that does this work when it first has its turn."""
        process = Process(name)
        process.thread = threading.Thread(target=self._live, args=(process, work), name=name, daemon=True)
        self.processes.append(process)
        process.thread.start()
        return process

    @property
    def alive(self) -> bool:
        """Whether one of them has not ended."""
        return not all(one.ended for one in self.processes)

    def take_turn(self) -> bool:
        """Lets the next one act for which there is something to do; False where all wait. Raises HangsError."""
        for _ in self.processes:
            one = self.processes[0]
            self.processes.append(self.processes.pop(0))
            if one.is_ready:
                self._let(one)
                return True
        return False

    def close(self) -> None:
        """Ends those that have not ended, wherever they wait."""
        self._closed = True
        for one in self.processes:
            if not one.ended:
                self._let(one)

    def next_s(self) -> float:
        """When somebody waits no longer."""
        times = [one.until_s for one in self.processes if not one.ended] + [at_s for at_s, _ in self._timers]
        return min(times, default=self.now_s)

    def pass_time(self) -> None:
        """Goes on to when somebody waits no longer, and lets whoever that is act. Raises HangsError."""
        self.now_s = max(self.now_s + LEAST_STEP_S, self.next_s())
        due = [one for one in self._timers if one[0] <= self.now_s]
        self._timers = [one for one in self._timers if one[0] > self.now_s]
        for _, act in due:
            act()
        for one in self.processes:
            if not one.ended and one.until_s <= self.now_s:
                self._let(one)

    def later(self, after_s: float, act: Callable[[], None]) -> None:
        """Does something when so much time has passed."""
        self._timers.append((self.now_s + after_s, act))

    def wait(self, for_queue: TurnQueue, timeout_s: float) -> None:
        """Called by a process: returns when it has its turn again."""
        process = self._running
        if process is None or (for_queue.items and not self._closed):  # it is nobody's turn before the start
            return
        if self._closed and process.error is None:
            process.error = TurnsClosed()
            raise process.error
        process.waits_for, process.until_s = for_queue, self.now_s + max(0.0, timeout_s)
        self._note_step(process)
        self._back.release()
        process.turn.acquire()
        self._began_s = time.thread_time()
        if self._closed:
            process.error = TurnsClosed()
            raise process.error

    def _live(self, process: Process, work: Callable[[], Any]) -> None:
        process.turn.acquire()
        self._began_s = time.thread_time()
        try:
            work()
        except BaseException as error:
            process.error = error
        process.ended = True
        self._note_step(process)
        self._back.release()

    def _note_step(self, process: Process) -> None:
        process.last_step_s = time.thread_time() - self._began_s
        process.step_s = max(process.step_s, process.last_step_s)

    def _let(self, process: Process) -> None:
        self._running = process
        process.turn.release()
        if not self._back.acquire(timeout=HANGS_AFTER_S):
            frame = sys._current_frames()[process.thread.ident or 0]  # type: ignore[union-attr]
            raise HangsError(f"{process.name} does not come to wait:\n{''.join(traceback.format_stack(frame))}")
        self._running = None


class Water:
    """What carries messages between sessions: whoever has subscribed is told at once. `tap`: told key and payload of
    all that a session puts into it."""

    def __init__(self, turns: Turns, tap: Callable[[str, bytes], None]) -> None:
        self.tap = tap
        self.turns = turns
        self._hear: list[tuple[zenoh.KeyExpr, Callable[[Any], None], _Session]] = []
        self._answer: list[tuple[zenoh.KeyExpr, Callable[[Any], None]]] = []
        self._watch: list[tuple[zenoh.KeyExpr, Callable[[Any], None]]] = []
        self._tokens: list[str] = []
        self._heard_by: dict[str, list[tuple[Callable[[Any], None], _Session]]] = {}

    def session(self) -> Any:
        """One more session."""
        return _Session(self)

    def put(self, key: str, payload: bytes, but_for: Any = None) -> None:
        """Carries a message, to all sessions but one."""
        if key not in self._heard_by:
            if len(self._heard_by) > MOST_MATCHES:
                self._heard_by.clear()
            self._heard_by[key] = [(hear, its) for expression, hear, its in self._hear if _fits(expression, key)]
        for hear, its in self._heard_by[key]:
            if its is not but_for:
                hear(_sample(key, payload))

    def subscribe(self, expression: Any, hear: Callable[[Any], None], session: _Session) -> None:
        self._hear.append((zenoh.KeyExpr(str(expression)), hear, session))
        self._heard_by.clear()

    def offer_answers(self, expression: str, answer: Callable[[Any], None]) -> None:
        self._answer.append((zenoh.KeyExpr(expression), answer))

    def ask(
        self, expression: str, on_reply: Callable[[Any], None], on_end: Callable[[], None], within_s: float
    ) -> None:
        wanted = zenoh.KeyExpr(expression)
        asked = [answer for kept, answer in self._answer if kept.intersects(wanted)]
        question = _Question(wanted, on_reply, on_end, len(asked))
        for answer in asked:
            answer(_Query(question))
        self.turns.later(within_s if asked else 0.0, question.end)

    def live(self, key: str) -> None:
        self._tokens.append(key)
        for expression, watch in self._watch:
            if _fits(expression, key):
                watch(_sample(key, b""))

    def watch(self, expression: str, watch: Callable[[Any], None]) -> None:
        self._watch.append((zenoh.KeyExpr(expression), watch))
        for key in self._tokens:
            if _fits(self._watch[-1][0], key):
                watch(_sample(key, b""))


class _Question:
    def __init__(
        self, wanted: zenoh.KeyExpr, on_reply: Callable[[Any], None], on_end: Callable[[], None], asked: int
    ) -> None:
        self.wanted, self.on_reply = wanted, on_reply
        self._on_end, self._open, self._ended = on_end, asked, False

    def answered(self) -> None:
        self._open -= 1
        if self._open == 0:
            self.end()

    def end(self) -> None:
        if not self._ended:
            self._ended = True
            self._on_end()


class _Query:
    def __init__(self, question: _Question) -> None:
        self._question = question
        self.key_expr = question.wanted

    def reply(self, key: str, payload: bytes) -> None:
        self._question.on_reply(SimpleNamespace(ok=_sample(key, payload)))

    def __enter__(self) -> _Query:
        return self

    def __exit__(self, *_: object) -> None:
        self._question.answered()


class _Session:
    """As much of `zenoh.Session` as `comms` uses."""

    def __init__(self, water: Water) -> None:
        self._water = water

    def put(self, key: str, payload: bytes, *, allowed_destination: Any = zenoh.Locality.ANY, **_: Any) -> None:
        self._water.tap(key, payload)
        self._water.put(key, payload, self if allowed_destination == zenoh.Locality.REMOTE else None)

    def get(self, expression: str, handler: Any, *, timeout: float, **_: Any) -> None:
        self._water.ask(expression, handler.callback, handler.drop, timeout)

    def declare_subscriber(self, expression: Any, handler: Any) -> Any:
        if hasattr(handler, "callback"):
            self._water.subscribe(expression, handler.callback, self)
            return None
        waiting: deque[Any] = deque()
        self._water.subscribe(expression, waiting.append, self)
        return SimpleNamespace(try_recv=lambda: waiting.popleft() if waiting else None)

    def declare_queryable(self, expression: str, handler: Any) -> Any:
        self._water.offer_answers(expression, handler.callback)

    def liveliness(self) -> Any:
        water = self._water
        return SimpleNamespace(
            declare_token=water.live,
            declare_subscriber=lambda expression, handler, history: water.watch(expression, handler.callback),
        )


def _sample(key: str, payload: bytes) -> Any:
    return SimpleNamespace(key_expr=key, payload=SimpleNamespace(to_bytes=lambda: payload), kind=zenoh.SampleKind.PUT)


def _fits(expression: zenoh.KeyExpr, key: str) -> bool:
    try:
        return expression.intersects(key)
    except zenoh.ZError:  # no key that could be put
        return False
