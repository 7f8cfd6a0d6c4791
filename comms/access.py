"""The hub's access rules, made from the topic table: what a process may not write or read, the hub drops."""

from __future__ import annotations

from typing import Any

from comms.control import HostPlan, RunKeys
from comms.routing import Routing


def access_rules(routing: Routing, hosts: tuple[HostPlan, ...], keys: RunKeys) -> dict[str, Any]:
    """Zenoh's `access_control` configuration for these hosts: all that is not allowed here is denied."""
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    for plan in hosts:
        writes = [keys.topic(one) for node in plan.nodes for one in routing.publications(node)]
        reads = [keys.topic(one) for node in plan.nodes for one in routing.subscriptions(node)]
        reads.append(keys.to_host(plan.host))
        host_rules = {
            "writes": (["ingress"], ["put"], [*writes, keys.from_host(plan.host)]),
            "subscribes": (["ingress"], ["declare_subscriber"], reads),
            "reads": (["egress"], ["put"], reads),
            "lives": (["ingress"], ["liveliness_token"], [keys.alive(plan.host)]),
        }
        for name, (flows, messages, key_exprs) in host_rules.items():
            rules.append(
                {
                    "id": f"{plan.host}-{name}",
                    "permission": "allow",
                    "flows": flows,
                    "messages": messages,
                    "key_exprs": sorted(set(key_exprs)),
                }
            )
        policies.append({"rules": [f"{plan.host}-{name}" for name in host_rules], "subjects": [plan.host]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": plan.host, "usernames": [plan.host]} for plan in hosts],
        "policies": policies,
    }
