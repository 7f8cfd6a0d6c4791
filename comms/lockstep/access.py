"""Who may write and read what at the hub in lockstep.

Whether what is in a parcel is its sender's to say, and for this listener, the listener checks itself.
"""

from __future__ import annotations

from typing import Any

from comms.access import access_control, topic_keys
from comms.keys import HostSpec, RunKeys
from comms.said.routing import Routing


def access_rules(routing: Routing, hosts: tuple[HostSpec, ...], keys: RunKeys) -> dict[str, Any]:
    """Zenoh's `access_control` configuration for these hosts in lockstep: all that is not allowed here is denied."""
    allowed = {}
    for spec in hosts:
        listening = [node for node in spec.nodes if routing.nodes[node].listens_only]
        acting = [node for node in spec.nodes if node not in listening]
        writes, reads = topic_keys(routing, acting, keys)
        writes += [keys.parcel(watchers, node) for watchers in routing.audiences if watchers for node in acting]
        reads += [keys.parcel(watchers, "*") for watchers in routing.audiences if {*watchers} & {*listening}]
        reads.append(keys.to_host(spec.host))
        allowed[spec.host] = {
            "writes": (["ingress"], ["put"], [*writes, keys.from_host(spec.host)]),
            "subscribes": (["ingress"], ["declare_subscriber"], reads),
            "reads": (["egress"], ["put"], reads),
            "lives": (["ingress"], ["liveliness_token"], [keys.alive(spec.host)]),
        }
    return access_control(allowed, "usernames")
