"""The local bus: all nodes in one process, a discrete-event loop under the lockstep clock, no sockets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from comms.lockstep.clock import LockstepClock, result_of
from comms.lockstep.events import JOINER_DELAY_MS, Change, Happening, NodeEvent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.group import JoinerMail, NodeGroup
from comms.node import Listener, Node
from comms.result import BusResult, LastWord
from comms.runner import GuardedListener, Outgoing, Stamp, close_all
from comms.said.announcement import RunInfo
from comms.said.codec import CLOCK
from comms.said.messages import Message
from comms.said.routing import Routing
from comms.said.topics import RUN


def run_local(
    routing: Routing,
    nodes: Mapping[str, Callable[[], Node]],
    listeners: Mapping[str, Listener],
    run_info: RunInfo,
    time_limit_ms: int,
    *,
    faults: Faults = NO_FAULTS,
    events: Iterable[NodeEvent] = (),
) -> BusResult:
    """Runs the fleet to its end and closes the listeners, also when a node fails.

    `nodes` holds what makes each node, `listeners` each listener, keyed by node id and complete for the roster of
    `routing`. Raises NodeError and RunawayError, and ValueError for events that do not fit.
    """
    kept = {name: GuardedListener(name, listener) for name, listener in listeners.items()}
    try:
        return _Local(routing, nodes, kept, LockstepClock(routing, time_limit_ms, events), faults).run(run_info)
    finally:
        close_all(kept.values())


class _Local:
    def __init__(
        self,
        routing: Routing,
        makers: Mapping[str, Callable[[], Node]],
        listeners: Mapping[str, Listener],
        clock: LockstepClock,
        faults: Faults,
    ) -> None:
        self.clock = clock
        self.makers = makers
        nodes = {name: makers[name]() for name in clock.present()}
        self.group = NodeGroup(nodes, routing, faults, lasting=clock.lasting)
        self.listeners = listeners
        self.announcer = Stamp(CLOCK, routing)
        self.kept = {node_id: JoinerMail(node_id, routing) for node_id in clock.said_to_joiners}

    def run(self, run_info: RunInfo) -> BusResult:
        self._carry([self._announce(run_info)])
        while (turn := self.clock.next_round()) is not None:
            for happening in turn.happenings:
                self._happen(happening)
            sent: list[Outgoing] = []
            for grant in turn.grants:
                wake_ms, outgoing = self.group.runners[grant.node_id].act(turn.now_ms, start=grant.start)
                self.clock.answer(grant.node_id, wake_ms, outgoing)
                sent.extend(outgoing)
            if len(turn.grants) > 1:
                sent.sort(key=lambda one: one.route.writer)  # stable: a sender's own messages stay in order
            self._carry(sent)
        return result_of(self.clock, [LastWord(self.group.digests(), dropped=self.group.dropped())])

    def _announce(self, message: Message) -> Outgoing:
        outgoing = self.announcer(RUN.key(), message, 0)
        self.clock.publish(CLOCK, [outgoing])
        return outgoing

    def _happen(self, happening: Happening) -> None:
        node_id = happening.node_id
        match happening.change:
            case Change.KILL:
                self.group.leave(node_id)
            case Change.JOIN:
                if happening.memory:
                    self.group.come_back(node_id)
                else:
                    self.group.join(node_id, self.makers[node_id](), happening.incarnation)
                self.group.give_kept(node_id, self.kept[node_id].messages(), happening.at_ms + JOINER_DELAY_MS)
            case Change.FREEZE | Change.THAW:
                pass  # the clock alone knows

    def _carry(self, sent: list[Outgoing]) -> None:
        for one in sent:
            received = one.opened()
            self.group.deliver(received, one.route)
            for kept in self.kept.values():
                kept.add(one.key, one.payload)
            for name in one.route.watchers:
                listener = self.listeners.get(name)
                if listener is not None:
                    listener.on_message(received)
