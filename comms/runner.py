"""Runs one node of a lockstep fleet: its mail in order, its sequence numbers and its digest. No I/O."""

from __future__ import annotations

import bisect
import hashlib
import logging
from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

from comms.node import Node, Publication, Received, Step
from comms.said.codec import CLOCK, Header, body_of, decode, message_of, packed
from comms.said.messages import Message
from comms.said.routing import Route, Routing
from comms.said.wire import WireError

log = logging.getLogger("secondlook.comms")


class NodeError(Exception):
    """A node has broken the rules of the house or raised; the text is one sentence that names it."""


def failure_of(node_id: str, error: Exception, *, at_ms: int | None = None) -> NodeError:
    """What is said of a node that has raised; where it did goes to the log."""
    log.error("%s has failed", node_id, exc_info=error)
    when = "" if at_ms is None else f" at {at_ms / 1000:.3f} s"
    return NodeError(" ".join(f"{node_id} has failed{when}: {type(error).__name__}: {error}".split()))


class Outgoing(NamedTuple):
    """A message on its way: key below the run id, route, the message, its payload, that one's size in bytes, and header
    and body in it."""

    key: str
    route: Route
    message: Message
    payload: bytes
    size: int
    header: Header
    body: list[Any]

    def opened(self) -> Received:
        """The message as its readers get it: what `Intake.open` makes of the payload. That is for a bus within one
        process, where unpacking and checking what has just been checked and packed would be the same work again."""
        topic = self.route.topic
        message = message_of(self.body, topic.message)
        return Received(self.key, topic, self.route.vehicle, self.header, message, self.payload)


@dataclass(frozen=True, slots=True)
class SenderDigest:
    """What one incarnation of a sender has said: how many messages, and the SHA-256 over them in order."""

    sender: str
    incarnation: int
    count: int
    sha256: str


class Stamp:
    """Numbers and hashes what one sender publishes."""

    def __init__(self, sender: str, routing: Routing, incarnation: int = 0) -> None:
        self.sender = sender
        self._routing = routing
        self._incarnation = incarnation
        self._count = 0
        self._hash = hashlib.sha256()

    def __call__(self, key: str, message: Message, now_ms: int) -> Outgoing:
        """The message as it goes out; raises NodeError where the sender may not write it or a field does not fit."""
        route = self._routing.route(key)
        if route is None or route.writer != self.sender or type(message) is not route.topic.message:
            raise NodeError(f"{self.sender} may not publish a {type(message).__name__} under {key}")
        try:
            header, body = Header(self.sender, self._incarnation, self._count, now_ms), body_of(message)
            payload = packed(header, body)
        except WireError as error:
            raise NodeError(f"{self.sender} has published a message that does not fit: {error}") from error
        size = len(payload)
        if size > route.topic.max_bytes:
            raise NodeError(
                f"{self.sender} has published {size} bytes under {key}; at most {route.topic.max_bytes} fit"
            )
        self._count += 1
        self._hash.update(b"%s %d\n%s" % (key.encode(), size, payload))
        return Outgoing(key, route, message, payload, size, header, body)

    def digest(self) -> SenderDigest:
        """What was said so far."""
        return SenderDigest(self.sender, self._incarnation, self._count, self._hash.hexdigest())


class Intake:
    """Opens what arrives: validates, counts and drops what does not fit, and says so once per sender and reason."""

    def __init__(self, routing: Routing) -> None:
        self.dropped: Counter[str] = Counter()
        self._routing = routing
        self._told: set[tuple[str, str]] = set()

    def open(self, key: str, payload: bytes) -> Received | None:
        """The message, or None where it does not fit."""
        route = self._routing.route(key)
        if route is None:
            self.drop("unknown key", "nobody", key)
            return None
        if len(payload) > route.topic.max_bytes:
            self.drop("too long", route.writer, f"{key}: {len(payload)} bytes")
            return None
        try:
            header, message = decode(payload, route.topic.message)
        except WireError as error:
            self.drop("malformed", route.writer, f"{key}: {error}")
            return None
        if header.sender != route.writer:
            self.drop("wrong sender", route.writer, f"{key}: says it is from {header.sender}")
            return None
        return Received(key, route.topic, route.vehicle, header, message, payload)

    def drop(self, reason: str, sender: str, detail: str) -> None:
        """Counts what is not taken, and says why once for each sender and reason."""
        self.dropped[reason] += 1
        if (sender, reason) not in self._told:
            self._told.add((sender, reason))
            log.warning("dropped a message from %s: %s: %s (said once)", sender, reason, detail)


class NodeRunner:
    """One node with its mailbox: `deliver` its mail, then let it `act` when the clock grants it a time."""

    def __init__(self, node_id: str, node: Node, routing: Routing, incarnation: int = 0) -> None:
        self.node_id = node_id
        self.arrived: Counter[str] = Counter()
        self.stamp = Stamp(node_id, routing, incarnation)
        self._node = node
        self._wake_ms: int | None = 0
        self._mail: dict[int, list[Received]] = {}
        self._late_ms: list[int] = []

    def deliver(self, received: Received, due_ms: int | None = None) -> None:
        """Puts a message into the mailbox, to be handled when it is due: as its topic says, or at `due_ms`."""
        if due_ms is None:
            due_ms = received.topic.due_ms(received.header.sent_ms)
        self._mail.setdefault(due_ms, []).append(received)

    def deliver_late(self, received: Received, due_ms: int) -> None:
        """The same for a message that is due later than the clock knows: the runner itself asks to act then."""
        self.deliver(received, due_ms)
        if received.topic.wakes:
            bisect.insort(self._late_ms, due_ms)

    def has_all(self, expected: dict[str, int]) -> bool:
        """Whether as many messages of each sender have arrived as the clock expects."""
        return all(self.arrived[sender] >= count for sender, count in expected.items())

    def act(self, now_ms: int, *, start: bool) -> tuple[int | None, list[Outgoing]]:
        """Starts the node, or handles its due mail in order and then its wake-up if that is due.

        Returns when to act next and what the node publishes. Raises NodeError.
        """
        published: list[Publication] = []
        try:
            if start:
                self._take(self._node.start(now_ms), published)
            else:
                for due in sorted([due for due in self._mail if due <= now_ms]):
                    mail = self._mail.pop(due)
                    if len(mail) > 1:
                        mail.sort(key=lambda one: one.header.order)
                    for received in mail:
                        self._take(self._node.on_message(received, now_ms), published)
                if self._wake_ms is not None and self._wake_ms <= now_ms:
                    self._take(self._node.on_wake(now_ms), published)
        except NodeError:
            raise
        except Exception as error:
            raise failure_of(self.node_id, error, at_ms=now_ms) from error
        if self._wake_ms is not None and self._wake_ms <= now_ms:
            raise NodeError(f"{self.node_id} asks at {now_ms} ms to be woken at {self._wake_ms} ms, which is not later")
        next_ms = self._wake_ms
        if self._late_ms:
            del self._late_ms[: bisect.bisect_right(self._late_ms, now_ms)]
            next_ms = min((ms for ms in (next_ms, *self._late_ms[:1]) if ms is not None), default=None)
        return next_ms, [self.stamp(one.key, one.message, now_ms) for one in published]

    def _take(self, step: Step, published: list[Publication]) -> None:
        self._wake_ms = step.wake_ms
        published.extend(step.publish)


def fleet_digest(senders: list[SenderDigest]) -> str:
    """The SHA-256 over all senders' digests but the clock's: the same run gives the same one on every bus."""
    total = hashlib.sha256()
    for one in sorted((d.sender, d.incarnation, d.count, d.sha256) for d in senders if d.sender != CLOCK):
        total.update(repr(one).encode())
    return total.hexdigest()
