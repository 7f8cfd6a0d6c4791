"""A process's line to the fleet when the wall clock drives it: one queue for all that arrives, and the sending.

State goes with congestion control DROP, everything else with BLOCK: what is kept of the latest alone may be left out
where the link is too slow for all. Whoever misses something that is kept asks its sender for it with a Zenoh query.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Iterable
from dataclasses import dataclass

import zenoh

from comms.errors import Interrupted
from comms.keys import RunKeys
from comms.runner import Outgoing
from comms.said.topics import Keep
from comms.session import subscribe
from comms.wall.gate import Gate

ANSWER_WITHIN_S = 5.0


@dataclass(frozen=True, slots=True)
class Mail:
    """What has arrived under a key (below the run id): a message or the clock's words. `sender`: as the gate knows
    it."""

    key: str
    payload: bytes
    sender: str = ""


@dataclass(frozen=True, slots=True)
class Asked:
    """Someone asks for what is kept under a key expression."""

    query: zenoh.Query


@dataclass(frozen=True, slots=True)
class Answered:
    """What we have asked a sender for has come, `answers` of them, or will not come any more."""

    sender: str
    expression: str
    tally: int
    answers: int


@dataclass(frozen=True, slots=True)
class Life:
    """The connection of a process has come up, or is gone."""

    host: str
    instance: str
    alive: bool


Event = Mail | Asked | Answered | Life


class WallLine:
    """Speaks and hears for a process over an open session.

    `gate`: what it takes of what arrives. `expressions`: below the run id, what it subscribes to. `keeps`: key
    expressions of what it keeps for others. `watches_lives`: it is told who comes and goes.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: RunKeys,
        gate: Gate,
        *,
        expressions: Iterable[str],
        keeps: Iterable[str] = (),
        watches_lives: bool = False,
    ) -> None:
        self._session = session
        self._keys = keys
        self._gate = gate
        self._queue: queue.SimpleQueue[Event | None] = queue.SimpleQueue()
        self._reads = [zenoh.KeyExpr(keys.topic(one)) for one in expressions]
        self._held = [
            session.declare_queryable(keys.topic(one), zenoh.handlers.Callback(self._on_query, indirect=False))
            for one in keeps
        ]
        if watches_lives:
            handler = zenoh.handlers.Callback(self._on_token, indirect=False)
            self._lives = session.liveliness().declare_subscriber(keys.life("*", "*"), handler, history=True)
        self._subscribers = subscribe(session, map(str, self._reads), self._on_mail)

    def get(self, timeout_s: float) -> Event | None:
        """The next thing that has arrived, None if nothing has in time; raises Interrupted."""
        try:
            event = self._queue.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return None
        match event:
            case None:
                raise Interrupted
            case Mail(_, payload, sender):
                self._gate.has_turn(sender, len(payload))
            case Asked():
                self._gate.has_asked()
        return event

    def interrupt(self) -> None:
        """From another thread: the next `get` raises Interrupted."""
        self._queue.put(None)

    def publish(self, outgoing: Iterable[Outgoing]) -> None:
        """Sends messages."""
        for one in outgoing:
            self._put(self._keys.topic(one.key), one.payload, drop=one.route.topic.keep is Keep.LATEST)

    def say(self, key: str, words: bytes, *, drop: bool = False) -> None:
        """Sends words under a full key; `drop`: they may be left out, for there will be others."""
        self._put(key, words, drop=drop)

    def reads(self, expression: str) -> bool:
        """Whether messages under a key expression (below the run id) are for this process."""
        other = zenoh.KeyExpr(self._keys.topic(expression))
        return any(one.intersects(other) for one in self._reads)

    def ask(self, sender: str, expression: str, tally: int) -> None:
        """Asks a sender for what it keeps under a key expression of its own; the answers come as mail, then
        `Answered`."""
        answers = 0

        def on_reply(reply: zenoh.Reply) -> None:
            nonlocal answers
            if reply.ok is not None:
                answers += 1
                self._on_mail(str(reply.ok.key_expr), reply.ok.payload.to_bytes(), asked_for=True)

        def on_end() -> None:
            self._queue.put(Answered(sender, expression, tally, answers))

        self._session.get(
            self._keys.topic(expression),
            zenoh.handlers.Callback(on_reply, on_end, indirect=False),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=ANSWER_WITHIN_S,
        )

    def answer(self, asked: Asked, kept: Iterable[tuple[str, bytes]]) -> None:
        """Answers with key (below the run id) and payload of each message."""
        with asked.query as query:
            for key, payload in kept:
                query.reply(self._keys.topic(key), payload)

    def is_asked_for(self, asked: Asked, key: str) -> bool:
        """Whether a key below the run id is among what is asked for."""
        return asked.query.key_expr.intersects(zenoh.KeyExpr(self._keys.topic(key)))

    def _put(self, key: str, payload: bytes, *, drop: bool) -> None:
        control = zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK
        # One priority for all: nothing overtakes, and a beat comes after what it tells of. Not express: then each
        # message would take a place of its own in a short queue, and a burst would lose some on a healthy link.
        self._session.put(key, payload, congestion_control=control, priority=zenoh.Priority.DATA, express=False)

    def _on_mail(self, key: str, payload: bytes, *, asked_for: bool = False) -> None:
        below = key.removeprefix(self._keys.root)
        sender = self._gate.lets_in(below, len(payload), time.monotonic(), asked_for=asked_for)
        if sender is not None:
            self._queue.put(Mail(below, payload, sender))

    def _on_query(self, query: zenoh.Query) -> None:
        if self._gate.lets_ask():
            self._queue.put(Asked(query))
        else:
            with query:  # ends it, without an answer
                pass

    def _on_token(self, sample: zenoh.Sample) -> None:
        _, host, instance = str(sample.key_expr).rsplit("/", 2)
        alive = sample.kind == zenoh.SampleKind.PUT  # not `is`: each look at it makes a new one
        self._queue.put(Life(host, instance, alive))
