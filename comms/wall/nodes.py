"""The nodes of one process when the wall clock drives them: a message is handled on receipt, a wake-up when it is due.

No I/O: the mission time is an argument."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from comms.node import Node, Publication, Received, Step
from comms.runner import NodeError, Outgoing, Stamp, failure_of
from comms.said.routing import Routing
from comms.said.topics import RUN
from comms.wall.journal import Journal


class WallNode:
    """One node. It is started when the run is announced to it; what came before that is held until then.

    `wake_ms`: the wake-up it has asked for. `kept`: what it has said and keeps for others.
    """

    def __init__(self, node_id: str, node: Node, routing: Routing, incarnation: int = 0) -> None:
        self.node_id = node_id
        self.wake_ms: int | None = None
        self.kept = Journal()
        self._node = node
        self._stamp = Stamp(node_id, routing, incarnation)
        self._held: list[Received] = []
        self._started = False

    def take(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Handles a message; returns what the node publishes. Raises NodeError."""
        if self._started:
            return self._act(now_ms, [received], start=False)
        self._held.append(received)
        if received.topic is not RUN:
            return []
        self._started = True
        held = sorted(self._held, key=lambda one: one.header.order)
        self._held.clear()
        return self._act(now_ms, held, start=True)

    def wake(self, now_ms: int) -> list[Outgoing]:
        """Wakes the node if that is due; returns what it publishes. Raises NodeError."""
        if not self._is_due(now_ms):
            return []
        published = self._act(now_ms, [], start=False)
        if self._is_due(now_ms):
            raise NodeError(f"{self.node_id} asks at {now_ms} ms to be woken at {self.wake_ms} ms, which is not later")
        return published

    def _is_due(self, now_ms: int) -> bool:
        return self.wake_ms is not None and self.wake_ms <= now_ms

    def _act(self, now_ms: int, mail: list[Received], *, start: bool) -> list[Outgoing]:
        published: list[Publication] = []
        try:
            if start:
                self._note(self._node.start(now_ms), published)
            for received in mail:
                self._note(self._node.on_message(received, now_ms), published)
            if not mail:
                self._note(self._node.on_wake(now_ms), published)
        except NodeError:
            raise
        except Exception as error:
            raise failure_of(self.node_id, error, at_ms=now_ms) from error
        return [self._send(one, now_ms) for one in published]

    def _note(self, step: Step, published: list[Publication]) -> None:
        self.wake_ms = step.wake_ms
        published.extend(step.publish)

    def _send(self, publication: Publication, now_ms: int) -> Outgoing:
        outgoing = self._stamp(publication.key, publication.message, now_ms)
        self.kept.add(outgoing)
        return outgoing


class WallNodes:
    """All nodes of a process, keyed by node id. `said` counts their messages by topic."""

    def __init__(self, nodes: Mapping[str, Node], routing: Routing, incarnation: int = 0) -> None:
        self.incarnation = incarnation
        self.said: Counter[str] = Counter()
        self.nodes = {node_id: WallNode(node_id, node, routing, incarnation) for node_id, node in nodes.items()}
        self._routing = routing

    def take(self, received: Received, now_ms: int) -> list[Outgoing]:
        """Gives a message to those here that read it; returns what they publish. Raises NodeError."""
        route = self._routing.route(received.key)
        readers = () if route is None else route.readers
        return self._count(
            [one for name in readers if name in self.nodes for one in self.nodes[name].take(received, now_ms)]
        )

    def wake(self, now_ms: int) -> list[Outgoing]:
        """Wakes those for whom it is time; returns what they publish. Raises NodeError."""
        return self._count([one for node in self.nodes.values() for one in node.wake(now_ms)])

    @property
    def wake_ms(self) -> int | None:
        """When the next wake-up is due."""
        return min((node.wake_ms for node in self.nodes.values() if node.wake_ms is not None), default=None)

    def _count(self, published: list[Outgoing]) -> list[Outgoing]:
        self.said.update(one.route.topic.name for one in published)
        return published
