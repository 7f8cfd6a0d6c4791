"""The hub's access rules, made from the topic table: what a process may not write or read, the hub drops.

Whether what is in a parcel is its sender's to say, and for this listener, the listener looks itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Literal

from comms.control import HostPlan, RunKeys
from comms.said.routing import Routing

Identity = Literal["usernames", "cert_common_names"]
Allowed = tuple[list[str], list[str], list[str]]
"""Flows, kinds of message and key expressions of one rule."""


def access_rules(routing: Routing, hosts: tuple[HostPlan, ...], keys: RunKeys) -> dict[str, Any]:
    """Zenoh's `access_control` configuration for these hosts in lockstep: all that is not allowed here is denied."""
    allowed = {}
    for plan in hosts:
        listening = [node for node in plan.nodes if routing.nodes[node].listens_only]
        acting = [node for node in plan.nodes if node not in listening]
        writes, reads = topic_keys(routing, acting, keys)
        writes += [keys.parcel(watchers, node) for watchers in routing.audiences if watchers for node in acting]
        reads += [keys.parcel(watchers, "*") for watchers in routing.audiences if {*watchers} & {*listening}]
        reads.append(keys.to_host(plan.host))
        allowed[plan.host] = {
            "writes": (["ingress"], ["put"], [*writes, keys.from_host(plan.host)]),
            "subscribes": (["ingress"], ["declare_subscriber"], reads),
            "reads": (["egress"], ["put"], reads),
            "lives": (["ingress"], ["liveliness_token"], [keys.alive(plan.host)]),
        }
    return access_control(allowed, "usernames")


def topic_keys(routing: Routing, nodes: Collection[str], keys: RunKeys) -> tuple[list[str], list[str]]:
    """Full key expressions of what these nodes may write, and may read."""
    writes = [keys.topic(one) for node in nodes for one in routing.publications(node)]
    reads = [keys.topic(one) for node in nodes for one in routing.subscriptions(node)]
    return writes, reads


def access_control(allowed: Mapping[str, Mapping[str, Allowed]], identity: Identity) -> dict[str, Any]:
    """Zenoh's `access_control` configuration from named rules for each host; `identity`: what proves who it is."""
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [
            {
                "id": f"{host}-{name}",
                "permission": "allow",
                "flows": flows,
                "messages": messages,
                "key_exprs": sorted(set(key_exprs)),
            }
            for host, its in allowed.items()
            for name, (flows, messages, key_exprs) in its.items()
        ],
        "subjects": [{"id": host, identity: [host]} for host in allowed],
        "policies": [
            {"rules": [f"{host}-{name}" for name in its], "subjects": [host]} for host, its in allowed.items()
        ],
    }
