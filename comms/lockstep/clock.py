"""The lockstep clock: who may act next, and at which simulated time. Pure; the buses carry its grants and answers.

A message sent at t is due at t + its topic's delay. The clock grants the earlier of the next wake-up and the next
delivery that is due, to every node that has either then; it goes on when all of them have answered. What is due of a
topic that wakes nobody comes along with the next grant. Nothing happens in between, so there is no tick.

Once the mission is over the run goes on for last words, and until every agent that is there rests: see `_last_ms`.
Planned events of nodes (`comms.lockstep.events`) happen between grants: who is absent or frozen is granted nothing.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

from comms.errors import RunawayError
from comms.lockstep.events import JOINER_DELAY_MS, Change, Happening, NodeEvent, absent_at_start, lasting, timeline
from comms.result import BusResult, Ending, LastWord, summed_up
from comms.runner import fleet_digest
from comms.said.routing import Routing
from comms.said.topics import MISSION_OVER

WRAP_UP_MS = 100  # simulated time in which the fleet's last words are delivered after the mission is over
LATE_WORDS_MS = 10_000  # simulated time in which an agent may still learn that it is over
LATE_WORDS_BY_MODEM_MS = 300_000
MOST_MESSAGES_A_SECOND = 200_000


class Said(Protocol):
    """One message that a node has published in a round, as far as the clock is concerned."""

    @property
    def key(self) -> str:
        """The key below the run id."""

    @property
    def size(self) -> int:
        """The payload's size in bytes."""


class Sent(NamedTuple):
    """One message that a node has published, as its process tells the clock of it."""

    key: str
    size: int


class Grant(NamedTuple):
    """Leave for one node to act, or with `start` to begin.

    `expected`: how many messages of each sender must have arrived since the node is there, for the senders whose count
    has grown since the node's last grant.
    """

    node_id: str
    wake: bool
    expected: dict[str, int]
    start: bool = False


class Round(NamedTuple):
    """What happens at one simulated time: first `happenings`, then grants; either may be empty."""

    now_ms: int
    grants: tuple[Grant, ...]
    happenings: tuple[Happening, ...] = ()


class LockstepClock:
    """The clock of one run. After its last round `over_ms` tells when the mission was over, None if it was not, and
    `timed_out` whether the time limit has ended it.

    Ask for `next_round`, carry out its grants, report each node with `answer`, and so on until there is none.
    `routing` names the nodes; those that only listen are never waited for, but counted (`watched`, `watched_bytes`).
    `lasting`: the nodes that come back with their memory.
    `said_to_joiners` counts by sender all that a node with a planned `Join` may read, also while it is absent.
    Raises ValueError for events that do not fit, see `comms.lockstep.events.timeline`.
    """

    def __init__(self, routing: Routing, time_limit_ms: int, events: Iterable[NodeEvent] = ()) -> None:
        self.now_ms = 0
        self.rounds = 0
        self.messages: Counter[str] = Counter()
        self.over_ms: int | None = None
        self.timed_out = False
        self._routing = routing
        self._time_limit_ms = time_limit_ms
        self._events = tuple(events)
        self._happenings = list(reversed(timeline(self._events, routing)))
        self.lasting = {node_id for node_id, _ in lasting(self._happenings)}
        self._absent = absent_at_start(self._events)
        self._asleep: dict[str, int | None] = {}
        self._frozen: set[str] = set()
        self._held: set[str] = set()
        self.said_to_joiners: dict[str, Counter[str]] = {
            one.node_id: Counter() for one in self._happenings if one.change is Change.JOIN
        }
        acting = [node.node_id for node in routing.roster if not node.listens_only and node.role.value != "clock"]
        self._wakes: dict[str, int | None] = {node: None if node in self._absent else 0 for node in acting}
        self._places = {node: place for place, node in enumerate(acting)}
        # Each wake-up that was ever wanted; those count that a node still wants.
        self._wake_times = [(0, node) for node in acting if node not in self._absent]
        self._agents = [node.node_id for node in routing.roster if node.role.surveys or node.role.revisits]
        by_modem = any(node.platform for node in routing.roster)
        self._late_words_ms = LATE_WORDS_BY_MODEM_MS if by_modem else LATE_WORDS_MS
        self._all_rest_ms: int | None = None  # since when no agent wants to be woken, once the mission is over
        self._to_start = set(acting) - self._absent
        self._waiting: set[str] = set()
        self._due: dict[int, set[str]] = {}
        self._due_times: list[int] = []
        self._sent_to: dict[str, Counter[str]] = {node: Counter() for node in acting}
        self._grown: dict[str, dict[str, int]] = {node: {} for node in acting}  # those of _sent_to that are news
        listening = [node.node_id for node in routing.roster if node.listens_only]
        self.watched: dict[str, Counter[str]] = {node: Counter() for node in listening}
        self.watched_bytes: dict[str, int] = dict.fromkeys(listening, 0)
        self._second = -1
        self._messages_before: dict[str, int] = {}  # by topic, before the present second
        self._messages_in_second = 0

    def present(self) -> list[str]:
        """The acting nodes that are there now."""
        return [node for node in self._wakes if node not in self._absent]

    def publish(self, sender: str, sent: Sequence[Said]) -> None:
        """Takes note of messages published at the present time: by a node that was granted it, or by the clock."""
        for one in sent:
            route = self._routing.route(one.key)
            if route is None or route.writer != sender:
                raise ValueError(f"{sender} has published {one.key}, which it may not write")
            topic = route.topic
            self.messages[topic.name] += 1
            if topic is MISSION_OVER and self.over_ms is None:
                self.over_ms = self.now_ms
            for joiner, counts in self.said_to_joiners.items():
                counts[sender] += joiner in route.readers
            readers = [node for node in route.readers if node not in self._absent] if self._absent else route.readers
            for reader in readers:
                counts = self._sent_to[reader]
                counts[sender] = self._grown[reader][sender] = counts[sender] + 1
            if readers and topic.wakes:
                self._make_due(readers, topic.due_ms(self.now_ms))
            for watcher in route.watchers:
                self.watched[watcher][sender] += 1
                self.watched_bytes[watcher] += one.size
        self._messages_in_second += len(sent)

    def _make_due(self, readers: Iterable[str], due_ms: int) -> None:
        due = self._due.get(due_ms)
        if due is None:
            due = self._due[due_ms] = set()
            heapq.heappush(self._due_times, due_ms)
        due.update(readers)

    def answer(self, node_id: str, wake_ms: int | None, sent: Sequence[Said]) -> None:
        """Takes a granted node's answer: the wake-up it wants next (in the future) and what it has published.

        Raises ValueError for a node that was not granted anything or has answered, for a wake-up that is not in the
        future, and for a key that the node may not write.
        """
        if node_id not in self._waiting:
            raise ValueError(f"{node_id} has answered at {self.now_ms} ms without being asked")
        self._waiting.remove(node_id)
        if wake_ms is not None and wake_ms <= self.now_ms:
            raise ValueError(f"{node_id} asks at {self.now_ms} ms to be woken at {wake_ms} ms, which is not later")
        self._wake(node_id, wake_ms)
        self.publish(node_id, sent)
        if self.over_ms is not None:
            resting = all(self._wakes[agent] is None for agent in self._agents)
            self._all_rest_ms = (self._all_rest_ms or self.now_ms) if resting else None

    def next_round(self) -> Round | None:
        """The next grants, or None when the mission is over, nothing is left to happen, or the time limit has passed.

        Raises RunawayError after more than 200,000 messages within one simulated second.
        """
        if self._waiting:
            raise ValueError(f"the round is not over: no answer from {', '.join(sorted(self._waiting))}")
        while True:
            next_ms = self._next_ms()
            if next_ms is None:
                return None
            if next_ms > self._last_ms():
                self.timed_out = self.over_ms is None
                return None
            happenings = self._happen(next_ms)
            receivers = self._receivers(next_ms)
            woken = self._woken(next_ms)
            acting = woken | receivers
            in_order = sorted(acting, key=self._places.__getitem__) if len(acting) > 1 else acting
            grants = tuple([self._grant(node_id, node_id in woken) for node_id in in_order])
            if grants or happenings:  # else all receivers are frozen or gone
                self._count_round(next_ms)
                self.now_ms = next_ms
                return Round(next_ms, grants, happenings)

    def _next_ms(self) -> int | None:
        """The next time at which anything may happen."""
        next_ms = self._first_wake_ms()
        if self._due_times and (next_ms is None or self._due_times[0] < next_ms):
            next_ms = self._due_times[0]
        if self._happenings and (next_ms is None or self._happenings[-1].at_ms < next_ms):
            next_ms = self._happenings[-1].at_ms
        return next_ms

    def _wake(self, node_id: str, wake_ms: int | None) -> None:
        """From now on this is the wake-up that a node wants."""
        self._wakes[node_id] = wake_ms
        if wake_ms is not None:
            heapq.heappush(self._wake_times, (wake_ms, node_id))

    def _first_wake_ms(self) -> int | None:
        """When the next node is woken; forgets wake-ups that nobody wants any more, and those of who is frozen."""
        while self._wake_times:
            wake_ms, node_id = self._wake_times[0]
            if self._wakes[node_id] == wake_ms and node_id not in self._frozen:
                return wake_ms
            heapq.heappop(self._wake_times)
        return None

    def _woken(self, now_ms: int) -> set[str]:
        """Those who are woken by now."""
        woken: set[str] = set()
        while self._wake_times and self._wake_times[0][0] <= now_ms:
            wake_ms, node_id = heapq.heappop(self._wake_times)
            if self._wakes[node_id] == wake_ms and node_id not in self._frozen:
                woken.add(node_id)
        return woken

    def _happen(self, now_ms: int) -> tuple[Happening, ...]:
        """Takes note of the events of this time."""
        found = []
        while self._happenings and self._happenings[-1].at_ms == now_ms:
            one = self._happenings.pop()
            found.append(one)
            match one.change:
                case Change.KILL:
                    self._absent.add(one.node_id)
                    self._asleep[one.node_id] = self._wakes[one.node_id]
                    self._wakes[one.node_id] = None
                case Change.FREEZE:
                    self._frozen.add(one.node_id)
                case Change.THAW:
                    self._frozen.remove(one.node_id)
                    self._wake(one.node_id, self._wakes[one.node_id])
                case Change.JOIN:
                    self._absent.remove(one.node_id)
                    self._wake(one.node_id, self._wake_of(one))
                    self._sent_to[one.node_id].clear()
                    self._grown[one.node_id].clear()
                    self._make_due([one.node_id], now_ms + JOINER_DELAY_MS)  # what was kept for it
        return tuple(found)

    def _wake_of(self, joiner: Happening) -> int | None:
        """When a node that joins is woken first. One with its memory hears before that what it has missed: it is not
        to find others silent that it has not listened to."""
        if not joiner.memory:
            self._to_start.add(joiner.node_id)
            return joiner.at_ms
        wake_ms = self._asleep[joiner.node_id]
        return None if wake_ms is None else max(wake_ms, joiner.at_ms + JOINER_DELAY_MS)

    def _receivers(self, now_ms: int) -> set[str]:
        """Those who have mail that is due; what is due to one who is frozen is held until it is thawed."""
        receivers: set[str] = set()
        if self._due_times and self._due_times[0] == now_ms:
            receivers = self._due.pop(heapq.heappop(self._due_times))
        if not self._events:
            return receivers
        waiting = (receivers | self._held) - self._absent
        self._held = waiting & self._frozen
        return waiting - self._frozen

    def _grant(self, node_id: str, woken: bool) -> Grant:
        expected, self._grown[node_id] = self._grown[node_id], {}
        start = node_id in self._to_start
        self._to_start.discard(node_id)
        self._waiting.add(node_id)
        return Grant(node_id, woken, expected, start)

    def _last_ms(self) -> int:
        """The last time at which anything happens; an agent that has heard of the end asks for no wake-up any more."""
        if self.over_ms is None:
            return self._time_limit_ms
        latest_ms = self.over_ms + self._late_words_ms
        return latest_ms if self._all_rest_ms is None else min(self._all_rest_ms + WRAP_UP_MS, latest_ms)

    def _count_round(self, now_ms: int) -> None:
        self.rounds += 1
        if now_ms // 1000 != self._second:
            self._second = now_ms // 1000
            self._messages_in_second = 0
            self._messages_before = dict(self.messages)
        if self._messages_in_second > MOST_MESSAGES_A_SECOND:
            in_second = self.messages - Counter(self._messages_before)
            topics = ", ".join(f"{name} {number}" for name, number in in_second.most_common(5))
            raise RunawayError(
                f"more than {MOST_MESSAGES_A_SECOND} messages within simulated second {self._second}; messages in it: "
                f"{topics}"
            )


def result_of(clock: LockstepClock, last_words: Iterable[LastWord]) -> BusResult:
    """The result of a run whose clock has no next round, from the last words of its processes."""
    last = summed_up(last_words)
    ended = Ending.TIME_LIMIT if clock.timed_out else Ending.IDLE
    return BusResult(
        ending=ended if clock.over_ms is None else Ending.OVER,
        mission_ms=clock.now_ms if clock.over_ms is None else clock.over_ms,
        digest=fleet_digest(last.digests),
        rounds=clock.rounds,
        messages=dict(clock.messages),
        dropped=last.dropped,
        latencies_ms=last.latencies_ms,
    )
