"""The wall clock as a drive: what `comms.drive.Drive` asks, for a fleet of which everyone is there from the start."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import zenoh

from comms.awake_clock import AwakeClock
from comms.drive import Host, ListeningHost, Setup
from comms.keys import HostSpec
from comms.node import Listener, Node
from comms.result import BusResult
from comms.said.announcement import ClockMode
from comms.said.routing import Routing
from comms.wall.access import access_rules
from comms.wall.host import WallHost
from comms.wall.hub import WallHub
from comms.wall.local_bus import run_local_by_wall
from comms.wall.seats import ListenerSeat, NodeSeat, Seat


@dataclass(frozen=True)
class ByWallClock:
    """See `comms.drive.Drive`. `factor`: > 0. Whoever is lost ends the run, unless with `keeps_going` it is started
    again: then nodes keep their memories in files, and go on by what is in them. `may_be_late_s`: so late, of the
    mission, nodes may be: of a fleet that is later nothing is believed, and the run fails."""

    factor: float
    keeps_going: bool = False
    may_be_late_s: float = math.inf

    mode = ClockMode.WALL
    modems_in_hub = False

    def hosts_apart(self, routing: Routing) -> tuple[HostSpec, ...]:
        """None: nothing is planned to happen to anyone."""
        return ()

    def run_local(
        self, setup: Setup, nodes: Mapping[str, Callable[[], Node]], listeners: Mapping[str, Listener]
    ) -> BusResult:
        """See `comms.drive.Drive`."""
        limit_ms, late_ms = setup.time_limit_ms, self.may_be_late_s * 1000
        return run_local_by_wall(setup.routing(), nodes, listeners, setup.run_info, limit_ms, self.factor, late_ms)

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
        """See `comms.drive.Drive`; nothing is to be carried out."""
        routing = setup.routing()
        hub = WallHub(
            session,
            setup.keys,
            routing,
            hosts,
            NodeSeat(nodes, routing),
            setup.run_info,
            setup.time_limit_ms,
            self.factor,
            strict=True,
            forgiving=self.keeps_going,
            may_be_late_ms=self.may_be_late_s * 1000,
            patience_s=setup.patience_s,
            alive=alive,
            now=AwakeClock(held=held),
        )
        return hub.run

    def acting(self, session: zenoh.Session, setup: Setup, spec: HostSpec, nodes: Mapping[str, Node]) -> Host:
        """See `comms.drive.Drive`."""
        routing = setup.routing()
        stores = {node_id: setup.store_of(node_id, node_id) for node_id in nodes} if self.keeps_going else {}
        return _host(session, setup, spec.host, NodeSeat(nodes, routing, stores), routing)

    def listening(
        self, session: zenoh.Session, setup: Setup, host: str, node_id: str, listener: Listener
    ) -> ListeningHost:
        """See `comms.drive.Drive`."""
        routing = setup.routing()
        return _host(session, setup, host, ListenerSeat({node_id: listener}, routing), routing)


def _host(session: zenoh.Session, setup: Setup, host: str, seat: Seat, routing: Routing) -> WallHost:
    sha256, limit_ms = setup.run_info.scenario_sha256, setup.time_limit_ms
    return WallHost(session, setup.keys, host, seat, routing, sha256, limit_ms, now=AwakeClock())
