"""Lockstep as a drive: what `comms.drive.Drive` asks, with whatever is to go wrong on purpose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import zenoh

from comms.drive import Host, ListeningHost, Setup
from comms.keys import HostSpec
from comms.lockstep.access import access_rules
from comms.lockstep.events import Change, NodeEvent, lasting, timeline
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.host import ListenerHost, NodeHost
from comms.lockstep.hub import Hub
from comms.lockstep.local_bus import run_local
from comms.node import Listener, Node
from comms.result import BusResult
from comms.said.announcement import ClockMode
from comms.said.routing import Routing


@dataclass(frozen=True)
class Lockstep:
    """See `comms.drive.Drive`. `faults` strike messages; `events` are planned changes of nodes, at simulated times."""

    faults: Faults = NO_FAULTS
    events: tuple[NodeEvent, ...] = ()

    mode = ClockMode.LOCKSTEP
    factor = None
    keeps_going = False
    modems_in_hub = True

    def hosts_apart(self, routing: Routing) -> tuple[HostSpec, ...]:
        """One for each node to which something is to happen, and one more for each time that it joins."""
        happenings = timeline(self.events, routing)
        joins = {(one.node_id, one.start, one.incarnation) for one in happenings if one.change is Change.JOIN}
        there = sorted({one.node_id for one in happenings if (one.node_id, 0, 0) not in joins})
        lasts = lasting(happenings)
        return (
            *(HostSpec(node_id, (node_id,), lasts=(node_id, 0) in lasts) for node_id in there),
            *(
                HostSpec(
                    _numbered(node_id, start),
                    (node_id,),
                    incarnation,
                    joins=True,
                    lasts=(node_id, incarnation) in lasts,
                )
                for node_id, start, incarnation in sorted(joins)
            ),
        )

    def run_local(
        self, setup: Setup, nodes: Mapping[str, Callable[[], Node]], listeners: Mapping[str, Listener]
    ) -> BusResult:
        """See `comms.drive.Drive`."""
        return run_local(
            setup.routing(),
            nodes,
            listeners,
            setup.run_info,
            setup.time_limit_ms,
            faults=self.faults,
            events=self.events,
        )

    def access_rules(self, setup: Setup, hosts: tuple[HostSpec, ...]) -> dict[str, Any]:
        """See `comms.drive.Drive`."""
        return access_rules(setup.routing(), hosts, setup.keys)

    def hub(
        self,
        session: zenoh.Session,
        setup: Setup,
        hosts: tuple[HostSpec, ...],
        nodes: Mapping[str, Node],
        *,
        carry_out: Callable[[str, str], None],
        alive: Callable[[int], None],
        held: Callable[[], bool] = lambda: False,
    ) -> Callable[[], BusResult]:
        """See `comms.drive.Drive`."""
        hub = Hub(
            session,
            setup.keys,
            setup.routing(),
            hosts,
            nodes,
            setup.time_limit_ms,
            faults=self.faults,
            events=self.events,
            carry_out=lambda change, host: carry_out(change.value, host),
            patience_s=setup.patience_s,
            alive=alive,
            held=held,
        )
        return partial(hub.run, setup.run_info)

    def acting(self, session: zenoh.Session, setup: Setup, spec: HostSpec, nodes: Mapping[str, Node]) -> Host:
        """See `comms.drive.Drive`."""
        stores = {}
        if spec.lasts:
            stores = {node_id: setup.store_of(node_id, _numbered(node_id, spec.incarnation)) for node_id in nodes}
        return NodeHost(session, setup.keys, spec, nodes, setup.routing(), self.faults, stores)

    def listening(
        self, session: zenoh.Session, setup: Setup, host: str, node_id: str, listener: Listener
    ) -> ListeningHost:
        """See `comms.drive.Drive`."""
        return ListenerHost(session, setup.keys, host, node_id, listener, setup.routing())


def _numbered(node_id: str, number: int) -> str:
    """No id has a `.`, so that no two hosts, and no two files, have one name."""
    return f"{node_id}.{number}" if number else node_id
