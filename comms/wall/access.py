"""Who may write, read, and ask for what is kept at the hub of a fleet that the wall clock drives."""

from __future__ import annotations

from typing import Any

from comms.access import Identity, access_control, topic_keys
from comms.keys import HostSpec, RunKeys
from comms.said.routing import Routing


def access_rules(
    routing: Routing, hosts: tuple[HostSpec, ...], keys: RunKeys, identity: Identity = "usernames"
) -> dict[str, Any]:
    """Zenoh's `access_control` configuration for these hosts: all that is not allowed here is denied.

    What a host may read it may ask for; what it may write it may answer. Everyone may know what is subscribed to and
    what is kept: a host that routes for others on its side passes on only what it knows to be wanted.
    """
    allowed = {}
    for spec in hosts:
        writes, reads = topic_keys(routing, spec.nodes, keys)
        says = [keys.from_host(spec.host), *(keys.beat(node) for node in spec.nodes)]
        hears = [keys.to_host(spec.host), keys.time, keys.beat("*")]
        allowed[spec.host] = {
            "writes": (["ingress"], ["put"], [*writes, *says]),
            "subscribes": (["ingress"], ["declare_subscriber"], [*reads, *hears]),
            "reads": (["egress"], ["put"], [*reads, *hears]),
            "lives": (["ingress"], ["liveliness_token"], [keys.life(spec.host, "*")]),
            "asks": (["ingress"], ["query"], reads),
            "is-answered": (["egress"], ["reply"], reads),
            "knows": (["egress"], ["declare_subscriber", "declare_queryable"], [keys.topic("**")]),
        }
        if writes:
            allowed[spec.host] |= {
                "keeps": (["ingress"], ["declare_queryable"], writes),
                "is-asked": (["egress"], ["query"], writes),
                "answers": (["ingress"], ["reply"], writes),
            }
    return access_control(allowed, identity)
