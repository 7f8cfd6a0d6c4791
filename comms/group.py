"""The nodes that share one process: mail is opened once and given to those that read it. No I/O."""

from __future__ import annotations

from collections.abc import Mapping

from comms.clock import Grant
from comms.node import Node, Received
from comms.routing import Routing
from comms.runner import Intake, NodeRunner, Outgoing, SenderDigest


class NodeGroup:
    """Runners for the nodes of one process, keyed by node id."""

    def __init__(self, nodes: Mapping[str, Node], routing: Routing) -> None:
        self.intake = Intake(routing)
        self.runners = {node_id: NodeRunner(node_id, node, routing) for node_id, node in nodes.items()}
        self._routing = routing

    def holds(self, node_ids: set[str]) -> bool:
        """Whether one of these nodes is here."""
        return not node_ids.isdisjoint(self.runners)

    def receive(self, key: str, payload: bytes) -> Received | None:
        """Takes one message from the transport: counted before it is validated, dropped if it does not fit."""
        route = self._routing.route(key)
        readers = [] if route is None else [self.runners[name] for name in route.readers if name in self.runners]
        if route is not None:
            for runner in readers:
                runner.arrived[route.writer] += 1
        received = self.intake.open(key, payload)
        if received is not None:
            for runner in readers:
                runner.deliver(received)
        return received

    def has_all(self, grants: list[Grant]) -> bool:
        """Whether all the mail that the clock expects for these grants has arrived."""
        return all(self.runners[grant.node_id].has_all(grant.expected) for grant in grants)

    def missing(self, grants: list[Grant]) -> str:
        """In words, what has not arrived."""
        return "; ".join(
            f"{grant.node_id} has {self.runners[grant.node_id].arrived[sender]} of {count} messages from {sender}"
            for grant in grants
            for sender, count in grant.expected.items()
            if self.runners[grant.node_id].arrived[sender] < count
        )

    def digests(self) -> list[SenderDigest]:
        """What the group's nodes have said so far."""
        return [runner.stamp.digest() for runner in self.runners.values()]

    def act(self, grant: Grant, now_ms: int, *, start: bool) -> tuple[int | None, list[Outgoing]]:
        """Lets one node act; see `NodeRunner.act`."""
        return self.runners[grant.node_id].act(now_ms, start=start)
