"""The lockstep clock: who may act next, and at which simulated time. Pure; the buses carry its grants and answers.

A message sent at t is due at t + its topic's delay. The clock grants the earlier of the next wake-up and the next
delivery that is due, to every node that has either then; it goes on when all of them have answered. What is due of a
topic that wakes nobody comes along with the next grant. Nothing happens in between, so there is no tick.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from comms.routing import Routing
from comms.topics import MISSION_OVER

WRAP_UP_MS = 100  # simulated time in which the fleet's last words are delivered after the mission is over
MOST_ROUNDS_A_SECOND = 10_000
MOST_MESSAGES_A_SECOND = 200_000


class RunawayError(Exception):
    """Too many rounds or messages within one simulated second: nodes answer each other without end."""


@dataclass(frozen=True, slots=True)
class Sent:
    """One message that a node has published in a round: its key and its payload's size in bytes."""

    key: str
    size: int


@dataclass(frozen=True, slots=True)
class Grant:
    """Leave for one node to act. `expected`: how many messages of each sender must have arrived in all, for the
    senders whose count has grown since the node's last grant."""

    node_id: str
    wake: bool
    expected: dict[str, int]


@dataclass(frozen=True, slots=True)
class Round:
    """Grants for one simulated time; `start` marks the first, in which nodes are started."""

    now_ms: int
    start: bool
    grants: tuple[Grant, ...]


class LockstepClock:
    """The clock of one run. After its last round `over_ms` tells when the mission was over, None if it was not, and
    `timed_out` whether the time limit has ended it.

    Ask for `next_round`, carry out its grants, report each node with `answer`, and so on until there is none.
    `routing` names the nodes; those that only listen are never waited for, but counted (`watched`, `watched_bytes`).
    """

    def __init__(self, routing: Routing, time_limit_ms: int) -> None:
        self.now_ms = 0
        self.rounds = 0
        self.messages: Counter[str] = Counter()
        self.over_ms: int | None = None
        self.timed_out = False
        self._routing = routing
        self._time_limit_ms = time_limit_ms
        self._started = False
        acting = [node.node_id for node in routing.roster if not node.listens_only and node.role.value != "clock"]
        self._wakes: dict[str, int | None] = dict.fromkeys(acting, 0)
        self._waiting: set[str] = set()
        self._due: dict[int, set[str]] = {}
        self._due_times: list[int] = []
        self._sent_to: dict[str, Counter[str]] = {node: Counter() for node in acting}
        self._grown: dict[str, set[str]] = {node: set() for node in acting}
        listening = [node.node_id for node in routing.roster if node.listens_only]
        self.watched: dict[str, Counter[str]] = {node: Counter() for node in listening}
        self.watched_bytes: dict[str, int] = dict.fromkeys(listening, 0)
        self._second = -1
        self._rounds_in_second = 0
        self._topics_in_second: Counter[str] = Counter()

    def publish(self, sender: str, sent: Sequence[Sent]) -> None:
        """Takes note of messages published at the present time: by a node that was granted it, or by the clock."""
        for one in sent:
            route = self._routing.route(one.key)
            if route is None or route.writer != sender:
                raise ValueError(f"{sender} has published {one.key}, which it may not write")
            self.messages[route.topic.name] += 1
            self._topics_in_second[route.topic.name] += 1
            if route.topic is MISSION_OVER and self.over_ms is None:
                self.over_ms = self.now_ms
            for reader in route.readers:
                self._sent_to[reader][sender] += 1
                self._grown[reader].add(sender)
            if route.readers and route.topic.wakes:
                due = self.now_ms + route.topic.delay_ms
                if due not in self._due:
                    self._due[due] = set()
                    heapq.heappush(self._due_times, due)
                self._due[due].update(route.readers)
            for watcher in route.watchers:
                self.watched[watcher][sender] += 1
                self.watched_bytes[watcher] += one.size

    def answer(self, node_id: str, wake_ms: int | None, sent: Sequence[Sent]) -> None:
        """Takes a granted node's answer: the wake-up it wants next (in the future) and what it has published.

        Raises ValueError for a node that was not granted anything or has answered, for a wake-up that is not in the
        future, and for a key that the node may not write.
        """
        if node_id not in self._waiting:
            raise ValueError(f"{node_id} has answered at {self.now_ms} ms without being asked")
        self._waiting.remove(node_id)
        if wake_ms is not None and wake_ms <= self.now_ms:
            raise ValueError(f"{node_id} asks at {self.now_ms} ms to be woken at {wake_ms} ms, which is not later")
        self._wakes[node_id] = wake_ms
        self.publish(node_id, sent)

    def next_round(self) -> Round | None:
        """The next grants, or None when the mission is over, nothing is left to happen, or the time limit has passed.

        Raises RunawayError after more than 10,000 rounds or 200,000 messages within one simulated second.
        """
        if self._waiting:
            raise ValueError(f"the round is not over: no answer from {', '.join(sorted(self._waiting))}")
        start = not self._started
        self._started = True
        next_ms = min((wake for wake in self._wakes.values() if wake is not None), default=None)
        if self._due_times and (next_ms is None or self._due_times[0] < next_ms):
            next_ms = self._due_times[0]
        if next_ms is None:
            return None
        if next_ms > self._last_ms():
            self.timed_out = self.over_ms is None
            return None
        self._count_round(next_ms)
        self.now_ms = next_ms
        receivers: set[str] = set()
        if self._due_times and self._due_times[0] == next_ms:
            receivers = self._due.pop(heapq.heappop(self._due_times))
        grants = []
        for node_id, wake_ms in self._wakes.items():
            wake = wake_ms == next_ms
            if wake or node_id in receivers:
                counts = self._sent_to[node_id]
                grants.append(Grant(node_id, wake, {sender: counts[sender] for sender in self._grown[node_id]}))
                self._grown[node_id].clear()
                self._waiting.add(node_id)
        return Round(next_ms, start, tuple(grants))

    def _last_ms(self) -> int:
        return self._time_limit_ms if self.over_ms is None else self.over_ms + WRAP_UP_MS

    def _count_round(self, now_ms: int) -> None:
        self.rounds += 1
        if now_ms // 1000 != self._second:
            self._second = now_ms // 1000
            self._rounds_in_second = 0
            self._topics_in_second.clear()
        self._rounds_in_second += 1
        for what, count, most in (
            ("rounds", self._rounds_in_second, MOST_ROUNDS_A_SECOND),
            ("messages", self._topics_in_second.total(), MOST_MESSAGES_A_SECOND),
        ):
            if count > most:
                topics = ", ".join(f"{name} {number}" for name, number in self._topics_in_second.most_common(5))
                raise RunawayError(
                    f"more than {most} {what} within simulated second {self._second}; messages in it: {topics}"
                )
