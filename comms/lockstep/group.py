"""The nodes that share one process in lockstep, each with its mailbox: mail is opened once and given to those that read
it, and handled in order when the clock grants it. No I/O."""

from __future__ import annotations

import bisect
import contextlib
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

from comms.kept import Kept
from comms.lockstep.arrivals import Arrivals
from comms.lockstep.clock import Grant
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.memory.lasting import LastingNode
from comms.memory.store import Store
from comms.node import Node, Received
from comms.runner import GuardedNode, Intake, Outgoing, SenderDigest
from comms.said.codec import header_of
from comms.said.routing import Route, Routing
from comms.said.wire import WireError

LOST = "lost by a fault"


class LockstepNode:
    """One node with its mailbox: `deliver` its mail, then let it `act` when the clock grants it a time."""

    def __init__(self, node: GuardedNode) -> None:
        self.node_id = node.node_id
        self.node = node
        self.arrived = Arrivals(node.node_id)
        self._mail: dict[int, list[Received]] = {}
        self._late_ms: list[int] = []

    def deliver(self, received: Received, due_ms: int) -> None:
        """Puts a message into the mailbox, to be handled when it is due."""
        self._mail.setdefault(due_ms, []).append(received)

    def deliver_late(self, received: Received, due_ms: int) -> None:
        """The same for a message that is due later than the clock knows: the runner itself asks to act then."""
        self.deliver(received, due_ms)
        if received.topic.wakes:
            bisect.insort(self._late_ms, due_ms)

    def act(self, now_ms: int, *, start: bool) -> tuple[int | None, list[Outgoing]]:
        """Starts the node, or handles its due mail in order and then its wake-up if that is due.

        Returns when to act next and what the node publishes. Raises NodeError.
        """
        node = self.node
        outgoing = node.act(now_ms, () if start else self._due_mail(now_ms), start=start, wake=not start)
        node.check_wake(now_ms)
        next_ms = node.wake_ms
        if self._late_ms:
            del self._late_ms[: bisect.bisect_right(self._late_ms, now_ms)]
            next_ms = min((ms for ms in (next_ms, *self._late_ms[:1]) if ms is not None), default=None)
        return next_ms, outgoing

    def digest(self) -> SenderDigest:
        """What the node has said so far."""
        return self.node.stamp.digest()

    def _due_mail(self, now_ms: int) -> list[Received]:
        times = [due for due in self._mail if due <= now_ms]
        found: list[Received] = []
        for due in times if len(times) < 2 else sorted(times):
            mail = self._mail.pop(due)
            if len(mail) > 1:
                mail.sort(key=lambda one: one.header.order)
            found += mail
        return found


class NodeGroup:
    """Runners for the nodes of one process, keyed by node id. `faults` strike what they are sent. `lasting`: nodes that
    may go on after they were away; `stores`: where such a node keeps its memory, if not in this process."""

    def __init__(
        self,
        nodes: Mapping[str, Node],
        routing: Routing,
        faults: Faults = NO_FAULTS,
        incarnation: int = 0,
        *,
        lasting: Collection[str] = (),
        stores: Mapping[str, Store] = MappingProxyType({}),
    ) -> None:
        self.intake = Intake(routing)
        self.runners: dict[str, LockstepNode] = {}
        self._routing = routing
        self._faults = faults
        self._lasting = {*lasting, *stores}
        self._stores = stores
        self._asleep: dict[str, LastingNode] = {}
        self._departed: list[SenderDigest] = []
        self._gone = Counter[str]()  # what those that have left had dropped
        for node_id, node in nodes.items():
            self.join(node_id, node, incarnation)

    def join(self, node_id: str, node: Node, incarnation: int) -> None:
        """From now on the node is here."""
        guarded = (
            LastingNode(node_id, node, self._routing, incarnation, self._stores.get(node_id))
            if node_id in self._lasting
            else GuardedNode(node_id, node, self._routing, incarnation)
        )
        self.runners[node_id] = LockstepNode(guarded)

    def leave(self, node_id: str) -> None:
        """From now on the node is not here any more, and its mail is lost; what it has said counts."""
        runner = self.runners.pop(node_id)
        self._departed.append(runner.digest())
        self._gone += runner.node.dropped
        if isinstance(runner.node, LastingNode):
            self._asleep[node_id] = runner.node

    def come_back(self, node_id: str) -> None:
        """A lasting node that has left goes on from now on."""
        node = self._asleep.pop(node_id)
        node.go_on()
        self.runners[node_id] = LockstepNode(node)

    def holds(self, node_ids: set[str]) -> bool:
        """Whether one of these nodes is here."""
        return not node_ids.isdisjoint(self.runners)

    def receive(self, key: str, payload: bytes) -> Received | None:
        """Takes one message from the transport: counted before faults strike and before it is validated.

        Returns it as it was sent; None where it is for nobody here or does not fit. Raises NodeError for a flood.
        """
        route = self._routing.route(key)
        if route is None:
            return self.intake.open(key, payload)
        readers = self._readers(route)
        if not readers:
            return None
        for runner in readers:
            runner.arrived.add(route.writer, len(payload))
        received = self.intake.open(key, payload)
        if received is not None:
            self._hand_out(received, readers)
        return received

    def take(self, outgoing: Outgoing) -> Received | None:
        """Takes one message that was said in this process: counted as one from the transport is, and not opened anew.

        Returns it; None where it is for nobody here. Raises NodeError for a flood.
        """
        readers = self._readers(outgoing.route)
        if not readers:
            return None
        for runner in readers:
            runner.arrived.add(outgoing.route.writer, outgoing.size)
        received = outgoing.opened()
        self._hand_out(received, readers)
        return received

    def deliver(self, received: Received, route: Route) -> None:
        """Puts a message that is open already into the mailboxes of those here that read it, as far as faults let."""
        self._hand_out(received, self._readers(route))

    def _readers(self, route: Route) -> list[LockstepNode]:
        return [self.runners[name] for name in route.readers if name in self.runners]

    def _hand_out(self, received: Received, readers: list[LockstepNode]) -> None:
        if self._faults:
            for runner in readers:
                self._deliver_with_faults(runner, received)
            return
        due_ms = received.topic.due_ms(received.header.sent_ms)
        for runner in readers:
            runner.deliver(received, due_ms)

    def give_kept(self, node_id: str, messages: Iterable[tuple[str, bytes]], due_ms: int) -> None:
        """What was kept for a node that joins; one that goes on is given what it has not handled."""
        runner = self.runners[node_id]
        for key, payload in messages:
            received = self.intake.open(key, payload)
            if received is not None and not (
                isinstance(runner.node, LastingNode) and runner.node.handled.has(received)
            ):
                runner.deliver(received, due_ms)

    def has_all(self, grants: list[Grant]) -> bool:
        """Whether all the mail that the clock expects for these grants has arrived."""
        return all(self.runners[grant.node_id].arrived.has_all(grant.expected) for grant in grants)

    def missing(self, grants: list[Grant]) -> str:
        """In words, what has not arrived."""
        arrived = {grant.node_id: self.runners[grant.node_id].arrived.counts for grant in grants}
        return "; ".join(
            f"{grant.node_id} has {arrived[grant.node_id][sender]} of {count} messages from {sender}"
            for grant in grants
            for sender, count in grant.expected.items()
            if arrived[grant.node_id][sender] < count
        )

    def digests(self) -> list[SenderDigest]:
        """What the group's nodes have said so far, those that have left included."""
        return [*self._departed, *(runner.digest() for runner in self.runners.values())]

    def dropped(self) -> dict[str, int]:
        """How much was dropped on the way to these nodes and by them, by reason."""
        return dict(sum((runner.node.dropped for runner in self.runners.values()), self.intake.dropped + self._gone))

    def _deliver_with_faults(self, runner: LockstepNode, received: Received) -> None:
        deliveries = self._faults.deliveries(runner.node_id, received, self._routing)
        if not deliveries:
            self.intake.dropped[LOST] += 1
        for one in deliveries:
            opened = received if one.payload is received.payload else self.intake.open(received.key, one.payload)
            if opened is None:
                continue
            # When it is due depends on when it was sent, whatever a corrupt message says of that.
            due_ms = received.topic.due_ms(received.header.sent_ms) + one.later_ms
            if one.later_ms:
                runner.deliver_late(opened, due_ms)
            else:
                runner.deliver(opened, due_ms)


class JoinerMail:
    """What was said so far of all that a node may read, kept for when it joins; `arrived` counts it by sender."""

    def __init__(self, node_id: str, routing: Routing) -> None:
        self.arrived = Arrivals(node_id)
        self._node_id = node_id
        self._routing = routing
        self._kept = Kept()

    def add(self, key: str, payload: bytes) -> None:
        """Takes note of a message; those of one key come in the order in which they were sent. Raises NodeError for a
        flood."""
        route = self._routing.route(key)
        if route is not None and self._node_id in route.readers:
            self.arrived.add(route.writer, len(payload))
            with contextlib.suppress(WireError):  # what nobody can read nobody needs
                self._kept.add(route.topic, key, payload, header_of(payload).incarnation)

    def messages(self) -> list[tuple[str, bytes]]:
        """Key and payload of each kept message."""
        return self._kept.messages()
