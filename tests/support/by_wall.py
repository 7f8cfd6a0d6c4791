"""The toy fleet driven by the wall clock, at a hundred times its pace, on either bus."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from fleets import EACH_ALONE, ROSTER, RUN_INFO, filled, password

from comms.errors import NodeError
from comms.keys import HostSpec, RunKeys
from comms.node import Listener, Node
from comms.result import BusResult
from comms.said.announcement import ClockMode
from comms.said.routing import Routing
from comms.session import open_client, open_hub
from comms.wall.access import access_rules
from comms.wall.host import WallHost
from comms.wall.hub import WallHub
from comms.wall.local_bus import run_local_by_wall
from comms.wall.seats import ListenerSeat, NodeSeat

FACTOR = 100.0
WALL_RUN = replace(RUN_INFO, mode=ClockMode.WALL)
WALL_KEYS = RunKeys("toy")
ROUTING = Routing(ROSTER)


def _itself(node: Node) -> Node:
    return node


def on_local_by_wall(nodes: Mapping[str, Node], listener: Listener, *, time_limit_ms: int = 60_000) -> BusResult:
    """Runs the toy fleet in this thread."""
    makers = {node_id: partial(_itself, node) for node_id, node in filled(nodes).items()}
    return run_local_by_wall(ROUTING, makers, {"observer": listener}, WALL_RUN, time_limit_ms, FACTOR)


def on_zenoh_by_wall(
    nodes: Mapping[str, Node],
    listener: Listener,
    *,
    time_limit_ms: int = 60_000,
    plans: tuple[HostSpec, ...] = EACH_ALONE,
    before: Callable[[str], None] = lambda endpoint: None,
) -> BusResult:
    """Runs the toy fleet over Zenoh on loopback, the world at the hub, each host of `plans` behind a session.

    `before` is told the hub's endpoint before any of them is started.
    """
    seated = filled(nodes)
    users = {plan.host: password(plan.host) for plan in plans}
    session, endpoint = open_hub(users, access_rules(ROUTING, plans, WALL_KEYS))

    def serve(plan: HostSpec) -> None:
        with contextlib.suppress(NodeError), open_client(endpoint, plan.host, password(plan.host)) as own:
            seat = (
                ListenerSeat({"observer": listener}, ROUTING)
                if plan.host == "observer"
                else NodeSeat({name: seated[name] for name in plan.nodes}, ROUTING)
            )
            sha256 = WALL_RUN.scenario_sha256
            hosts.append(WallHost(own, WALL_KEYS, plan.host, seat, ROUTING, sha256, time_limit_ms))
            hosts[-1].run()

    hosts: list[WallHost] = []
    threads = [threading.Thread(target=serve, args=(plan,), name=plan.host, daemon=True) for plan in plans]
    with session:
        before(endpoint)
        seat = NodeSeat({"world": seated["world"]}, ROUTING)
        hub = WallHub(
            session, WALL_KEYS, ROUTING, plans, seat, WALL_RUN, time_limit_ms, FACTOR, strict=True, patience_s=10.0
        )
        for thread in threads:
            thread.start()
        try:
            return hub.run()
        finally:
            for host in hosts:
                host.interrupt()
            for thread in threads:
                thread.join(timeout=20)
                assert not thread.is_alive(), f"{thread.name} has not ended"


def on_zenoh_by_wall_grouped(
    nodes: Mapping[str, Node], listener: Listener, *, time_limit_ms: int = 60_000
) -> BusResult:
    """The same with coordinator and one agent behind one session."""
    plans = (
        HostSpec("alpha", ("alpha",)),
        HostSpec("both", ("beta", "coordinator")),
        HostSpec("observer", ("observer",)),
    )
    return on_zenoh_by_wall(nodes, listener, plans=plans, time_limit_ms=time_limit_ms)


WALL_BUSES: dict[str, Callable[..., BusResult]] = {
    "local": on_local_by_wall,
    "zenoh": on_zenoh_by_wall,
    "zenoh-grouped": on_zenoh_by_wall_grouped,
}
