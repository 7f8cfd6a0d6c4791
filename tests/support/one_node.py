"""One node driven by hand: messages go in and out through the codec, wake-ups come when they are due."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TypeVar

from comms.node import Node, Received, Step
from comms.said.announcement import Role
from comms.said.codec import Header, decode, encode
from comms.said.messages import Message
from comms.said.topics import number_of, topic_of

M = TypeVar("M")


@dataclass(frozen=True)
class Said:
    """What a node has published: when, under which key, and the message as its readers get it."""

    at_ms: int
    key: str
    message: Message

    @property
    def number(self) -> int:
        """The number that ends the key."""
        return number_of(self.key)


def received(
    key: str, message: Message, *, sender: str = "", sent_ms: int = 0, sequence: int = 0, incarnation: int = 0
) -> Received:
    """A message as a node gets it, its values quantised. The sender is whom the key tells, if none is given."""
    found = topic_of(key)
    assert found is not None, key
    topic, vehicle = found
    header = Header(sender or _writer(key, vehicle), incarnation, sequence, sent_ms)
    payload = encode(header, message)
    assert len(payload) <= topic.max_bytes
    header, opened = decode(payload, topic.message)
    return Received(key, topic, vehicle, header, opened, payload)


@dataclass
class OneNode:
    """A node and what it has said so far. All that it says must fit the wire; wake-ups must lie in the future."""

    node: Node
    role: Role
    now_ms: int = 0
    wake_ms: int | None = None
    said: list[Said] = field(default_factory=list)
    _sequences: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._take(self.node.start(self.now_ms))

    def hear(
        self,
        key: str,
        message: Message,
        *,
        at_ms: int | None = None,
        sent_ms: int | None = None,
        sequence: int | None = None,
        incarnation: int = 0,
    ) -> list[Said]:
        """Tells the node a message, at `at_ms` (now, if left out) after all wake-ups due before; sent 1 ms earlier and
        numbered on, unless told otherwise. Returns what the node says to it."""
        if at_ms is not None:
            self.wait_until(at_ms - 1)
            self.now_ms = at_ms
        found = topic_of(key)
        assert found is not None, key
        sender = _writer(key, found[1])
        if sequence is None:
            sequence = self._sequences[sender]
        self._sequences[sender] = max(self._sequences[sender], sequence + 1)
        mail = received(
            key,
            message,
            sender=sender,
            sent_ms=max(0, self.now_ms - 1) if sent_ms is None else sent_ms,
            sequence=sequence,
            incarnation=incarnation,
        )
        return self.hear_again(mail)

    def hear_again(self, mail: Received) -> list[Said]:
        """Tells the node a message that is at hand, now."""
        return self._take(self.node.on_message(mail, self.now_ms), may_be_due=True)

    def wait_until(self, until_ms: int) -> list[Said]:
        """Lets time pass, this moment included; returns what the node says in it."""
        already = len(self.said)
        while self.wake_ms is not None and self.wake_ms <= until_ms:
            self.now_ms = max(self.now_ms, self.wake_ms)
            self._take(self.node.on_wake(self.now_ms))
        self.now_ms = max(self.now_ms, until_ms)
        return self.said[already:]

    def wait(self, seconds: float) -> list[Said]:
        """Lets so much time pass."""
        return self.wait_until(self.now_ms + round(seconds * 1000))

    def all(self, kind: type[M], said: list[Said] | None = None) -> list[M]:
        """All messages of one type, of all that was said or of these."""
        return [one.message for one in (self.said if said is None else said) if isinstance(one.message, kind)]

    def last(self, kind: type[M]) -> M:
        """The last message of a type."""
        return self.all(kind)[-1]

    def _take(self, step: Step, *, may_be_due: bool = False) -> list[Said]:
        if step.wake_ms is not None:
            assert step.wake_ms > self.now_ms or (may_be_due and step.wake_ms == self.wake_ms)
        self.wake_ms = step.wake_ms
        now = []
        for publication in step.publish:
            found = topic_of(publication.key)
            assert found is not None, publication.key
            assert self.role in found[0].writers
            assert type(publication.message) is found[0].message
            now.append(Said(self.now_ms, publication.key, received(publication.key, publication.message).message))
        self.said += now
        return now


def _writer(key: str, vehicle: str) -> str:
    if key.startswith("agent/"):
        return vehicle
    return {"run": "clock", "coord": "coordinator"}.get(key.split("/", maxsplit=1)[0], "world")
