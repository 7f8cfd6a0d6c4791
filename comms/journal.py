"""What is kept for whoever comes late or has lost its link: each sender's journal, and what a receiver has of it.

Pure. A sender tells from time to time a tally of what it keeps under each of its key expressions: the sum over the kept
messages of sequence number + 1. A receiver sums up what it has of them in the same way. Of each key it has no newer
message than the sender, so that both sums are equal just where it has everything.
"""

from __future__ import annotations

import copy
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from comms.kept import Kept
from comms.node import Received
from comms.runner import Outgoing
from comms.said.codec import Header
from comms.said.topics import Keep, Topic

MOST_HEARD = 100_000  # events of a sender, and keys of which it has the latest, that a receiver remembers
MOST_TRIES = 3  # to get what a tally tells of, where answers come but something is still missing


class Journal:
    """What one incarnation of a sender has said, as far as the topic table says that it is kept; `tallies`: of each key
    expression; `said`: how many messages of each topic."""

    def __init__(self, incarnation: int = 0) -> None:
        self.incarnation = incarnation
        self.kept = Kept()
        self.tallies: dict[str, int] = {}
        self.said: Counter[str] = Counter()

    def add(self, sent: Outgoing) -> None:
        """The sender's next message."""
        topic = sent.route.topic
        self.said[topic.name] += 1
        expression = topic.expression(topic.vehicle_of(sent.key))
        gain = self.kept.add(topic, sent.key, sent.payload)
        self.tallies[expression] = self.tallies.get(expression, 0) + gain


@dataclass
class _FromSender:
    incarnation: int
    latest: dict[str, int] = field(default_factory=dict)
    events: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    sums: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    tried: dict[str, tuple[int, int]] = field(default_factory=dict)


class HeardMessages:
    """What a receiver has of the messages that their senders keep."""

    def __init__(self) -> None:
        self._senders: dict[str, _FromSender] = {}

    def add(self, received: Received) -> bool:
        """Adds a message; whether it is news: one that came before, or is older than what came, is none."""
        header, topic = received.header, received.topic
        sender = self._sender(header.sender, header.incarnation)
        if sender is None:
            return False
        gain = self._gain(sender, topic, received.key, header)
        sender.sums[topic.expression(received.vehicle)] += gain
        return gain > 0

    @classmethod
    def joined(cls, parts: Iterable[HeardMessages]) -> HeardMessages:
        """A copy of what is in all of them, no sender being in two."""
        joined = cls()
        for part in parts:
            joined._senders |= copy.deepcopy(part._senders)
        return joined

    def has(self, received: Received) -> bool:
        """Whether a message has come, or one in its place that is as new or newer."""
        header, topic = received.header, received.topic
        sender = self._senders.get(header.sender)
        if sender is None or sender.incarnation != header.incarnation:
            return False
        if topic.keep is Keep.EVENTS:
            return header.sequence in sender.events[topic.name]
        return header.sequence <= sender.latest.get(received.key, -1)

    def has_room(self, received: Received) -> bool:
        """Whether there is room to remember a message: no mission says as much as there is room for."""
        sender = self._senders.get(received.header.sender)
        if sender is None or sender.incarnation != received.header.incarnation:
            return True
        if received.topic.keep is Keep.EVENTS:
            return len(sender.events[received.topic.name]) < MOST_HEARD
        return len(sender.latest) < MOST_HEARD or received.key in sender.latest

    def missing(self, name: str, incarnation: int, tallies: dict[str, int]) -> list[str]:
        """The key expressions of a sender under which something is missing, going by its tallies."""
        sender = self._sender(name, incarnation)
        if sender is None:
            return []
        return [
            expression
            for expression, tally in tallies.items()
            if sender.sums[expression] < tally and sender.tried.get(expression) != (tally, MOST_TRIES)
        ]

    def answered(self, name: str, expression: str, tally: int) -> None:
        """The sender was asked for what a tally tells of, and has answered. Where something of it is missing that does
        not come, it is not asked for for ever."""
        sender = self._senders[name]
        before, tries = sender.tried.get(expression, (tally, 0))
        sender.tried[expression] = (tally, tries + 1 if before == tally else 1)

    def _sender(self, name: str, incarnation: int) -> _FromSender | None:
        known = self._senders.get(name)
        if known is None or known.incarnation < incarnation:
            known = self._senders[name] = _FromSender(incarnation)
        return known if known.incarnation == incarnation else None

    def _gain(self, sender: _FromSender, topic: Topic, key: str, header: Header) -> int:
        if topic.keep is Keep.EVENTS:
            seen = sender.events[topic.name]
            if header.sequence in seen:
                return 0
            seen.add(header.sequence)
            return header.sequence + 1
        before = sender.latest.get(key, -1)
        if header.sequence <= before:
            return 0
        sender.latest[key] = header.sequence
        return header.sequence - before
