"""What sits in a process of a fleet that the wall clock drives: nodes that act, or listeners. No I/O.

The process's loop tells them messages and the time, and carries out what they want. A message is handled on receipt, a
wake-up when it is due; listeners get messages in the order of sending within a small window.
"""

from __future__ import annotations

import copy
import heapq
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import count
from types import MappingProxyType
from typing import Protocol

from comms.journal import HeardMessages, Journal
from comms.memory.lasting import LastingNode
from comms.memory.store import Store
from comms.node import Listener, Node, Received
from comms.result import STRIP_TO_TASK, LastWord, StripLatency
from comms.runner import GuardedListener, Outgoing, close_all
from comms.said.announcement import Role
from comms.said.routing import Routing
from comms.said.topics import RUN


class OrderWindow:
    """Holds each message until the mission time is `window_ms` beyond its send time. One that comes later than that is
    passed on at once: nothing is lost, but it is out of order."""

    def __init__(self, window_ms: int) -> None:
        self._window_ms = window_ms
        self._held: list[tuple[tuple[int, bool, str, int, int], int, Received]] = []
        self._arrivals = count()

    def add(self, received: Received) -> None:
        """A message has arrived."""
        heapq.heappush(self._held, (received.header.order, next(self._arrivals), received))

    def due(self, now_ms: int | None) -> list[Received]:
        """In order, those that need wait no longer at this mission time; all of them where it is None."""
        found = []
        while self._held and (now_ms is None or self._held[0][2].header.sent_ms + self._window_ms <= now_ms):
            found.append(heapq.heappop(self._held)[2])
        return found

    @property
    def due_ms(self) -> int | None:
        """The mission time at which the next one is due."""
        return self._held[0][2].header.sent_ms + self._window_ms if self._held else None


class WallNode:
    """One node. It is started when the run is announced to it; what came before that is held until then. One that was
    taken up has been started, and is not given again what it has handled."""

    def __init__(self, node: LastingNode) -> None:
        self.node = node
        self._held: list[Received] = []
        self._started = node.is_taken_up

    def hear(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Handles a message; returns what the node publishes. Raises NodeError."""
        if self._started:
            if self.node.is_taken_up and self.node.handled.has(received):
                return []
            return self.node.act(now_ms, [received])
        self._held.append(received)
        if received.topic is not RUN:
            return []
        self._started = True
        held = sorted(self._held, key=lambda one: one.header.order)
        self._held.clear()
        return self.node.act(now_ms, held, start=True)

    def wake(self, now_ms: int) -> list[Outgoing]:
        """Wakes the node if that is due; returns what it publishes. Raises NodeError."""
        return self.node.act(now_ms, wake=True) if self.node.is_due(now_ms) else []


WINDOW_S = 0.5  # of wall time, within which listeners get messages in the order of their sending


class Seat(Protocol):
    """See the module. Mission times are in milliseconds. Raises NodeError where a node or a listener fails."""

    reads: tuple[str, ...]
    keeps: tuple[str, ...]
    listens: bool
    taken_up_at_ms: int | None
    """The mission time at which a node here goes on; None where none does, as all begin."""

    def begin(self, incarnation: int, factor: float) -> None:
        """The mission's time is known; nothing else is called before."""

    def hear(self, received: Received, now_ms: int) -> Iterable[Outgoing]:
        """A message has arrived; returns what is to be published."""

    def act(self, now_ms: int) -> Iterable[Outgoing]:
        """Time has passed."""

    @property
    def next_ms(self) -> int | None:
        """When time is to be told next, None for any time."""

    def late_ms(self) -> int:
        """By how much a wake-up or a message here was late since this was last asked, at most."""

    @property
    def kept(self) -> Mapping[str, Journal]:
        """By node id, what is kept for others."""

    def handled(self) -> HeardMessages:
        """Which messages need not come again."""

    def end(self) -> None:
        """The mission is over for those here: nobody is to take them up. Raises NodeError."""

    def close(self) -> None:
        """The run is over for this process, in whatever way."""

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """What is told at the end."""


class NodeSeat:
    """Seats nodes, keyed by node id. `stores`: where nodes keep their memory, if not in this process; raises
    StoreRefusedError for one by which a node cannot go on."""

    listens = False

    def __init__(
        self, nodes: Mapping[str, Node], routing: Routing, stores: Mapping[str, Store] = MappingProxyType({})
    ) -> None:
        self.reads = tuple(one for node_id in nodes for one in routing.subscriptions(node_id))
        self.keeps = tuple(one for node_id in nodes for one in routing.publications(node_id))
        self.kept: dict[str, Journal] = {}
        self._routing = routing
        self._stores = stores
        self._nodes = {
            node_id: WallNode(LastingNode(node_id, node, routing, store=stores.get(node_id)))
            for node_id, node in nodes.items()
        }
        times_ms = [one.node.now_ms for one in self._nodes.values() if one.node.is_taken_up]
        self.taken_up_at_ms = max(times_ms, default=None)
        self._late_ms = 0
        self._latency = StripLatency()
        self._is_coordinators = any(routing.nodes[node_id].role is Role.COORDINATOR for node_id in nodes)

    def begin(self, incarnation: int, factor: float) -> None:
        """Tells the nodes which start this is; they are started when the run is announced to them."""
        for one in self._nodes.values():
            one.node.begin(incarnation)
        self.kept = {node_id: one.node.said for node_id, one in self._nodes.items()}

    def hear(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Lets those nodes handle a message that read it."""
        if self._is_coordinators:
            self._latency.arrived(received, time.perf_counter())
        route = self._routing.route(received.key)
        readers = [] if route is None else [self._nodes[name] for name in route.readers if name in self._nodes]
        if readers:
            self._late_ms = max(self._late_ms, now_ms - received.header.sent_ms)
        return self._noted([one for node in readers for one in node.hear(received, now_ms)])

    def act(self, now_ms: int) -> list[Outgoing]:
        """Wakes the nodes for whom it is time."""
        for one in self._nodes.values():
            if one.node.is_due(now_ms):
                self._late_ms = max(self._late_ms, now_ms - (one.node.wake_ms or 0))
        return self._noted([one for node in self._nodes.values() for one in node.wake(now_ms)])

    @property
    def next_ms(self) -> int | None:
        """When the next wake-up is due."""
        wakes_ms = (one.node.wake_ms for one in self._nodes.values())
        return min((wake_ms for wake_ms in wakes_ms if wake_ms is not None), default=None)

    def late_ms(self) -> int:
        """See `Seat`."""
        late_ms, self._late_ms = self._late_ms, 0
        return late_ms

    def handled(self) -> HeardMessages:
        """Where there is one node, all that it has handled; one of several may have been the only one to handle it."""
        nodes = list(self._nodes.values())
        return copy.deepcopy(nodes[0].node.handled) if len(nodes) == 1 else HeardMessages()

    def end(self) -> None:
        """Tells the nodes' memories."""
        for one in self._nodes.values():
            one.node.end()

    def close(self) -> None:
        """Closes the nodes' memories."""
        for store in self._stores.values():
            store.close()

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """What the nodes have said, and the latencies measured here."""
        latencies = {STRIP_TO_TASK: self._latency.milliseconds}
        said = sum((one.node.said.said for one in self._nodes.values()), Counter[str]())
        lost = sum((one.node.dropped for one in self._nodes.values()), Counter(dropped))
        return LastWord(messages=dict(said), dropped=dict(lost), latencies_ms=latencies)

    def _noted(self, outgoing: list[Outgoing]) -> list[Outgoing]:
        if self._is_coordinators:
            self._latency.sending(outgoing, time.perf_counter())
        return outgoing


class ListenerSeat:
    """Seats listeners, keyed by node id. Each gets what it reads, in the order of sending within half a second of wall
    time."""

    listens = True
    keeps: tuple[str, ...] = ()
    kept: Mapping[str, Journal] = {}
    taken_up_at_ms: int | None = None

    def __init__(self, listeners: Mapping[str, Listener], routing: Routing) -> None:
        self.reads = tuple(one for node_id in listeners for one in routing.subscriptions(node_id))
        self._listeners = {node_id: GuardedListener(node_id, one) for node_id, one in listeners.items()}
        self._routing = routing
        self._window = OrderWindow(0)

    def begin(self, incarnation: int, factor: float) -> None:
        """Sets the window."""
        self._window = OrderWindow(round(WINDOW_S * 1000 * factor))

    def hear(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Takes a message."""
        self._window.add(received)
        return []

    def act(self, now_ms: int) -> list[Outgoing]:
        """Passes on what need not wait any longer."""
        self._pass_on(self._window.due(now_ms))
        return []

    @property
    def next_ms(self) -> int | None:
        """When the next message is due."""
        return self._window.due_ms

    def late_ms(self) -> int:
        """Listeners may be late: nobody waits for them."""
        return 0

    def handled(self) -> HeardMessages:
        """Nothing: all that is kept is to come."""
        return HeardMessages()

    def end(self) -> None:
        """Listeners are not taken up."""

    def close(self) -> None:
        """Passes on all there is, and closes the listeners."""
        try:
            self._pass_on(self._window.due(None))
        finally:
            close_all(self._listeners.values())

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """Listeners say nothing, but may have dropped something."""
        return LastWord(dropped=dict(dropped))

    def _pass_on(self, messages: list[Received]) -> None:
        for received in messages:
            route = self._routing.route(received.key)
            for node_id, listener in self._listeners.items():
                if route is not None and node_id in route.watchers:
                    listener.on_message(received)
