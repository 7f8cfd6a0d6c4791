"""The local bus: all nodes in one process, a discrete-event loop under the lockstep clock, no sockets."""

from __future__ import annotations

from collections.abc import Mapping

from comms.clock import LockstepClock, Sent
from comms.codec import CLOCK
from comms.kept_listener import KeptListener, close_all
from comms.messages import Message, RunInfo
from comms.node import Listener, Node
from comms.result import BusResult, Ending
from comms.routing import Routing
from comms.runner import Intake, NodeRunner, Outgoing, Stamp, fleet_digest
from comms.topics import RUN


def run_local(
    routing: Routing,
    nodes: Mapping[str, Node],
    listeners: Mapping[str, Listener],
    run_info: RunInfo,
    time_limit_ms: int,
) -> BusResult:
    """Runs the fleet to its end and closes the listeners, also when a node fails.

    `nodes` and `listeners` are keyed by node id and complete for the roster of `routing`. Raises NodeError and
    RunawayError.
    """
    kept = {name: KeptListener(name, listener) for name, listener in listeners.items()}
    try:
        return _Local(routing, nodes, kept, time_limit_ms).run(run_info)
    finally:
        close_all(kept.values())


class _Local:
    def __init__(
        self,
        routing: Routing,
        nodes: Mapping[str, Node],
        listeners: Mapping[str, Listener],
        time_limit_ms: int,
    ) -> None:
        self.clock = LockstepClock(routing, time_limit_ms)
        self.intake = Intake(routing)
        self.runners = {node_id: NodeRunner(node_id, node, routing) for node_id, node in nodes.items()}
        self.listeners = listeners
        self.announcer = Stamp(CLOCK, routing)

    def run(self, run_info: RunInfo) -> BusResult:
        self._carry([self._announce(run_info)])
        while (turn := self.clock.next_round()) is not None:
            sent: list[Outgoing] = []
            for grant in turn.grants:
                wake_ms, outgoing = self.runners[grant.node_id].act(turn.now_ms, start=turn.start)
                self.clock.answer(grant.node_id, wake_ms, [Sent(one.key, len(one.payload)) for one in outgoing])
                sent.extend(outgoing)
            if len(turn.grants) > 1:
                sent.sort(key=lambda one: one.route.writer)  # stable: a sender's own messages stay in order
            self._carry(sent)
        return BusResult(
            ending=ending_of(self.clock),
            mission_ms=self.clock.now_ms if self.clock.over_ms is None else self.clock.over_ms,
            digest=fleet_digest([runner.stamp.digest() for runner in self.runners.values()]),
            rounds=self.clock.rounds,
            messages=dict(self.clock.messages),
            dropped=dict(self.intake.dropped),
        )

    def _announce(self, message: Message) -> Outgoing:
        outgoing = self.announcer(RUN.key(), message, 0)
        self.clock.publish(CLOCK, [Sent(outgoing.key, len(outgoing.payload))])
        return outgoing

    def _carry(self, sent: list[Outgoing]) -> None:
        for one in sent:
            readers = one.route.readers
            watchers = [name for name in one.route.watchers if name in self.listeners]
            if not readers and not watchers:
                continue
            received = self.intake.open(one.key, one.payload)
            for reader in readers:
                runner = self.runners[reader]
                runner.arrived[one.route.writer] += 1
                if received is not None:
                    runner.deliver(received)
            if received is not None:
                for name in watchers:
                    self.listeners[name].on_message(received)


def ending_of(clock: LockstepClock) -> Ending:
    """Why the clock has no next round."""
    if clock.over_ms is not None:
        return Ending.OVER
    return Ending.TIME_LIMIT if clock.timed_out else Ending.IDLE
