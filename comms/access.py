"""The hub's access rules, made from the topic table: what a process may not write or read, the hub drops.

Each drive has rules of its own (`comms.lockstep.access`, `comms.wall.access`); here is what both are made of.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Literal

from comms.keys import RunKeys
from comms.said.routing import Routing

Identity = Literal["usernames", "cert_common_names"]
Allowed = tuple[list[str], list[str], list[str]]
"""Flows, kinds of message and key expressions of one rule."""


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
