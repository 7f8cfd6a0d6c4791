"""What a process of `secondlook run --real-time` holds: the hub, nodes, or a listener, driven by the wall clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from comms.node import Node
from comms.result import BusResult
from comms.said.routing import Routing
from comms.session import open_client, open_hub
from comms.wall.access import wall_access_rules
from comms.wall.host import WallHost
from comms.wall.hub import WallHub
from comms.wall.seats import NodeSeat, Seat
from comms.wall.words import WallKeys
from secondlook.launch.child_process import ChildOrder


def run_hub(order: ChildOrder, nodes: Mapping[str, Node], tell: Callable[..., None]) -> BusResult:
    """Runs the fleet from its hub; whoever is lost ends the run. `tell`: words for the launcher."""
    assert order.run_info is not None
    assert order.factor is not None
    routing, keys = Routing(order.roster), WallKeys(order.run)
    rules = wall_access_rules(routing, order.hosts, keys)
    session, endpoint = open_hub(order.passwords, rules, patience_s=order.patience_s)
    with session:
        hub = WallHub(
            session,
            keys,
            routing,
            order.hosts,
            NodeSeat(nodes, routing),
            order.run_info,
            order.time_limit_ms,
            order.factor,
            strict=True,
            patience_s=order.patience_s,
            alive=lambda now_ms: tell(alive_ms=now_ms),
        )
        tell(endpoint=endpoint)  # now that the hub hears whoever connects
        return hub.run()


def run_host(order: ChildOrder, endpoint: str, seat: Seat, made: Callable[[WallHost], Any] = lambda host: None) -> None:
    """Runs what sits in this process; `made` is given the host before it begins."""
    assert order.run_info is not None
    with open_client(endpoint, order.host, order.password, patience_s=order.patience_s) as session:
        host = WallHost(
            session,
            WallKeys(order.run),
            order.host,
            seat,
            Routing(order.roster),
            order.run_info.scenario_sha256,
            order.time_limit_ms,
        )
        made(host)
        host.run()
