"""The guard around a node or a listener, on every bus: its sequence numbers, its digest, what it may say, how it fails;
and the check of all that arrives. No I/O."""

from __future__ import annotations

import hashlib
import logging
import sys
import threading
from collections import Counter
from collections.abc import Iterable
from contextvars import copy_context
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from comms.errors import NO_FAILURES, NodeError, in_words, one_line
from comms.node import Listener, Node, Publication, Received, Step, checked_step
from comms.said.announcement import RunInfo
from comms.said.codec import CLOCK, Header, body_of, decode, message_again, packed
from comms.said.messages import Heard, Message
from comms.said.routing import Route, Routing
from comms.said.wire import WireError

OVERHEAD_BYTES = 500  # that a message takes while it waits to be opened, beside its payload
MOST_TOLD = 1000  # senders and reasons: strangers may make up any number of senders

log = logging.getLogger("secondlook.comms")


def failure_of(node_id: str, error: BaseException, *, at_ms: int | None = None) -> NodeError:
    """What is said of a node that has raised; where it did goes to the log."""
    log.error("%s has failed", node_id, exc_info=error)
    when = "" if at_ms is None else f" at {at_ms / 1000:.3f} s"
    return NodeError(f"{node_id} has failed{when}: {in_words(error)}")


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
        message = message_again(self.body, topic.message)
        return Received(self.key, topic, self.route.vehicle, self.header, message, self.payload)


@dataclass(frozen=True, slots=True)
class SenderDigest:
    """What one incarnation of a sender has said: how many messages, and the SHA-256 over them in order. Of one that
    goes on after it was away there is one more, over what it has said since, with the count of all."""

    sender: str
    incarnation: int
    count: int
    sha256: str


class Stamp:
    """Numbers and hashes what one sender publishes. `count`: how much it has published before; the hash is over what
    follows."""

    def __init__(self, sender: str, routing: Routing, incarnation: int = 0, count: int = 0) -> None:
        self.sender = sender
        self._routing = routing
        self._incarnation = incarnation
        self._count = count
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
        self._announced = None if routing.announced is None else body_of(routing.announced)
        self._told: set[tuple[str, str]] = set()
        self._lock = threading.Lock()

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
        if isinstance(message, RunInfo) and self._announced not in (None, body_of(message)):
            self.drop("another run", route.writer, f"{key}: announces a run that is not this one")
            return None
        return Received(key, route.topic, route.vehicle, header, message, payload)

    def drop(self, reason: str, sender: str, detail: str) -> None:
        """Counts what is not taken, and says why once for each sender and reason. Any thread may call it."""
        with self._lock:
            self.dropped[reason] += 1
            is_news = (sender, reason) not in self._told and len(self._told) < MOST_TOLD
            if is_news:
                self._told.add((sender, reason))
        if is_news:
            log.warning("dropped a message from %s: %s: %s (said once)", one_line(sender), reason, one_line(detail))


class GuardedNode:
    """A node under its id, kept to the rules of the house: what it publishes is stamped in order, what it raises is
    told as its failure. What a modem has heard for it (`Heard`) it is given as what was said. `wake_ms`: the wake-up it
    has asked for."""

    def __init__(self, node_id: str, node: Node, routing: Routing, incarnation: int = 0) -> None:
        self.node_id = node_id
        self.wake_ms: int | None = None
        self.stamp = Stamp(node_id, routing, incarnation)
        self._node = node
        self._routing = routing
        self._dropped = Counter[str]()

    @property
    def dropped(self) -> Counter[str]:
        """How much was dropped here, by reason: by the node, and of what a modem has heard for it."""
        return self._dropped + self._letters.dropped if "_letters" in vars(self) else self._dropped

    @cached_property
    def _letters(self) -> Intake:
        return Intake(self._routing)  # few fleets have modems, and a large one's announcement takes a while to check

    def is_due(self, now_ms: int) -> bool:
        """Whether the wake-up has come."""
        return self.wake_ms is not None and self.wake_ms <= now_ms

    def act(
        self, now_ms: int, mail: Iterable[Received] = (), *, start: bool = False, wake: bool = False
    ) -> list[Outgoing]:
        """Starts the node, gives it mail in order, and then with `wake` its wake-up if that is due; returns what it
        publishes. Which errors numpy raises a node sets for itself alone, in a context of its own. Raises NodeError."""
        try:
            published = copy_context().run(self._told_by, now_ms, mail, start, wake)
        except (NodeError, *NO_FAILURES):
            raise
        except BaseException as error:
            raise failure_of(self.node_id, error, at_ms=now_ms) from error
        return [self.stamp(one.key, one.message, now_ms) for one in published]

    def _told_by(self, now_ms: int, mail: Iterable[Received], start: bool, wake: bool) -> list[Publication]:
        """What the node has to publish."""
        published: list[Publication] = []
        if start:
            self._note("start", self._node.start(now_ms), published)
        for received in mail:
            message = received.message
            opened = self._letters.open(message.key, message.payload) if type(message) is Heard else received
            if opened is not None:
                self._note("on_message", self._node.on_message(opened, now_ms), published)
        if wake and self.is_due(now_ms):
            self._note("on_wake", self._node.on_wake(now_ms), published)
        return published

    def check_wake(self, now_ms: int) -> None:
        """Raises NodeError where the wake-up asked for is not later than now."""
        if self.is_due(now_ms):
            raise NodeError(f"{self.node_id} asks at {now_ms} ms to be woken at {self.wake_ms} ms, which is not later")

    def _note(self, method: str, answer: Step, published: list[Publication]) -> None:
        step = checked_step(self._node, method, answer)
        self.wake_ms = step.wake_ms
        if step.dropped:
            self._dropped.update(step.dropped)
        published.extend(step.publish)


class GuardedListener:
    """A listener (`comms.node.Listener`) under its node's id; raises NodeError for what that raises."""

    def __init__(self, node_id: str, listener: Listener) -> None:
        self._node_id = node_id
        self._listener = listener

    def on_message(self, received: Received) -> None:
        """Passes one message on."""
        try:
            self._listener.on_message(received)
        except NodeError:
            raise
        except Exception as error:
            raise failure_of(self._node_id, error, at_ms=received.header.sent_ms) from error

    def close(self) -> None:
        """Closes the listener."""
        try:
            self._listener.close()
        except NodeError:
            raise
        except Exception as error:
            raise failure_of(self._node_id, error) from error


def close_all(listeners: Iterable[GuardedListener]) -> None:
    """Closes each, also when another fails to close; then raises the first NodeError, but never in place of an error
    that is on its way already."""
    failures = []
    for listener in listeners:
        try:
            listener.close()
        except NodeError as failure:
            failures.append(failure)
    if failures and sys.exception() is None:
        raise failures[0]


def fleet_digest(senders: list[SenderDigest]) -> str:
    """The SHA-256 over all senders' digests but the clock's: the same run gives the same one on every bus."""
    total = hashlib.sha256()
    for one in sorted((d.sender, d.incarnation, d.count, d.sha256) for d in senders if d.sender != CLOCK):
        total.update(repr(one).encode())
    return total.hexdigest()
