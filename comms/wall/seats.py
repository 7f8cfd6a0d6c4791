"""What sits in a process of a fleet that the wall clock drives: nodes that act, or listeners. The process's loop tells
them messages and the time, and carries out what they want."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Protocol

from comms.kept_listener import KeptListener, close_all
from comms.latency import STRIP_TO_TASK, StripLatency
from comms.node import Listener, Node, Received
from comms.runner import Outgoing
from comms.said.messages import Role
from comms.said.routing import Routing
from comms.wall.journal import Journal
from comms.wall.nodes import WallNodes
from comms.wall.order_window import OrderWindow
from comms.wall.words import LastWord

WINDOW_S = 0.5  # of wall time, within which listeners get messages in the order of their sending


class Seat(Protocol):
    """See the module. Mission times are in milliseconds. Raises NodeError where a node or a listener fails."""

    reads: tuple[str, ...]
    keeps: tuple[str, ...]
    listens: bool

    def begin(self, incarnation: int, factor: float) -> None:
        """The mission's time is known; nothing else is called before."""

    def take(self, received: Received, now_ms: int) -> Iterable[Outgoing]:
        """A message has arrived; returns what is to be published."""

    def act(self, now_ms: int) -> Iterable[Outgoing]:
        """Time has passed."""

    @property
    def next_ms(self) -> int | None:
        """When time is to be told next, None for any time."""

    @property
    def kept(self) -> Mapping[str, Journal]:
        """By node id, what is kept for others."""

    def close(self) -> None:
        """The run is over for this process, in whatever way."""

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """What is told at the end."""


class NodeSeat:
    """Seats nodes, keyed by node id."""

    listens = False

    def __init__(self, nodes: Mapping[str, Node], routing: Routing) -> None:
        self.reads = tuple(one for node_id in nodes for one in routing.subscriptions(node_id))
        self.keeps = tuple(one for node_id in nodes for one in routing.publications(node_id))
        self._raw = nodes
        self._routing = routing
        self._nodes = WallNodes({}, routing)
        self._latency = StripLatency()
        self._is_coordinators = any(routing.nodes[node_id].role is Role.COORDINATOR for node_id in nodes)

    def begin(self, incarnation: int, factor: float) -> None:
        """Seats the nodes; they are started when the run is announced to them."""
        self._nodes = WallNodes(self._raw, self._routing, incarnation)

    def take(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Lets the nodes handle a message."""
        if self._is_coordinators:
            self._latency.arrived(received, time.perf_counter())
        return self._time(self._nodes.take(received, now_ms))

    def act(self, now_ms: int) -> list[Outgoing]:
        """Wakes the nodes for whom it is time."""
        return self._time(self._nodes.wake(now_ms))

    @property
    def next_ms(self) -> int | None:
        """When the next wake-up is due."""
        return self._nodes.wake_ms

    @property
    def kept(self) -> Mapping[str, Journal]:
        """What the nodes keep."""
        return {node_id: node.kept for node_id, node in self._nodes.nodes.items()}

    def close(self) -> None:
        """Nodes have nothing to close."""

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """What the nodes have said, and the latencies measured here."""
        return LastWord(dict(self._nodes.said), dict(dropped), {STRIP_TO_TASK: self._latency.milliseconds})

    def _time(self, outgoing: list[Outgoing]) -> list[Outgoing]:
        if self._is_coordinators:
            self._latency.sending(outgoing, time.perf_counter())
        return outgoing


class ListenerSeat:
    """Seats listeners, keyed by node id. Each gets what it reads, in the order of sending within half a second of wall
    time."""

    listens = True
    keeps: tuple[str, ...] = ()
    kept: Mapping[str, Journal] = {}

    def __init__(self, listeners: Mapping[str, Listener], routing: Routing) -> None:
        self.reads = tuple(one for node_id in listeners for one in routing.subscriptions(node_id))
        self._listeners = {node_id: KeptListener(node_id, one) for node_id, one in listeners.items()}
        self._routing = routing
        self._window = OrderWindow(0)

    def begin(self, incarnation: int, factor: float) -> None:
        """Sets the window."""
        self._window = OrderWindow(round(WINDOW_S * 1000 * factor))

    def take(self, received: Received, now_ms: int) -> list[Outgoing]:
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

    def close(self) -> None:
        """Passes on all there is, and closes the listeners."""
        try:
            self._pass_on(self._window.due(None))
        finally:
            close_all(self._listeners.values())

    def last_word(self, dropped: Mapping[str, int]) -> LastWord:
        """Listeners say nothing, but may have dropped something."""
        return LastWord({}, dict(dropped), {})

    def _pass_on(self, messages: list[Received]) -> None:
        for received in messages:
            route = self._routing.route(received.key)
            for node_id, listener in self._listeners.items():
                if route is not None and node_id in route.watchers:
                    listener.on_message(received)
