"""What is kept for whoever comes late or has lost its link: each sender's journal, and what a receiver has of it.

Pure. A sender tells from time to time a tally of what it keeps under each of its key expressions: the sum over the kept
messages of sequence number + 1. A receiver sums up what it has of them in the same way. Of each key it has no newer
message than the sender, so that both sums are equal just where it has everything.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field

from comms.kept import Kept
from comms.node import Received
from comms.runner import Outgoing
from comms.said.codec import Header
from comms.said.topics import Keep, Topic

MOST_HEARD = 100_000  # events of a start, and keys of which it has the latest, that a receiver remembers
MOST_STARTS = 8  # of a sender, that a receiver remembers
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
class _FromStart:
    latest: dict[str, int] = field(default_factory=dict)
    events: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    sums: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    tried: dict[str, tuple[int, int]] = field(default_factory=dict)


class HeardMessages:
    """What a receiver has of the messages that their senders keep, of each of a sender's last starts by itself."""

    def __init__(self) -> None:
        self._starts: dict[str, dict[int, _FromStart]] = {}

    def add(self, received: Received) -> bool:
        """Adds a message; whether it is news: one that came before, or is older than what came, is none. Nor is one of
        too many starts ago."""
        header, topic = received.header, received.topic
        start = self._start(header.sender, header.incarnation)
        if start is None:
            return False
        gain = self._gain(start, topic, received.key, header)
        start.sums[topic.expression(received.vehicle)] += gain
        return gain > 0

    def has(self, received: Received) -> bool:
        """Whether a message has come, or one in its place that is as new or newer."""
        header, topic = received.header, received.topic
        start = self._starts.get(header.sender, {}).get(header.incarnation)
        if start is None:
            return False
        if topic.keep is Keep.EVENTS:
            return header.sequence in start.events[topic.name]
        return header.sequence <= start.latest.get(received.key, -1)

    def has_room(self, received: Received) -> bool:
        """Whether there is room to remember a message: no mission says as much as there is room for."""
        start = self._starts.get(received.header.sender, {}).get(received.header.incarnation)
        if start is None:
            return True
        if received.topic.keep is Keep.EVENTS:
            return len(start.events[received.topic.name]) < MOST_HEARD
        return len(start.latest) < MOST_HEARD or received.key in start.latest

    def missing(self, name: str, incarnation: int, tallies: dict[str, int]) -> list[str]:
        """The key expressions of a sender's newest start under which something is missing, going by its tallies."""
        start = self._start(name, incarnation)
        if start is None or incarnation < max(self._starts[name]):
            return []
        return [
            expression
            for expression, tally in tallies.items()
            if start.sums[expression] < tally and start.tried.get(expression) != (tally, MOST_TRIES)
        ]

    def answered(self, name: str, expression: str, tally: int) -> None:
        """The sender was asked for what a tally tells of, and has answered. Where something of it is missing that does
        not come, it is not asked for for ever."""
        starts = self._starts[name]
        tried = starts[max(starts)].tried
        before, tries = tried.get(expression, (tally, 0))
        tried[expression] = (tally, tries + 1 if before == tally else 1)

    def _start(self, name: str, incarnation: int) -> _FromStart | None:
        starts = self._starts.setdefault(name, {})
        if incarnation not in starts:
            starts[incarnation] = _FromStart()
            if len(starts) > MOST_STARTS:
                del starts[min(starts)]
        return starts.get(incarnation)

    def _gain(self, start: _FromStart, topic: Topic, key: str, header: Header) -> int:
        if topic.keep is Keep.EVENTS:
            seen = start.events[topic.name]
            if header.sequence in seen:
                return 0
            seen.add(header.sequence)
            return header.sequence + 1
        before = start.latest.get(key, -1)
        if header.sequence <= before:
            return 0
        start.latest[key] = header.sequence
        return header.sequence - before
