"""Which process holds which nodes."""

from __future__ import annotations

from collections.abc import Iterable

from comms.control import HostPlan
from comms.lockstep.events import Change, Happening
from comms.said.messages import Role
from secondlook.fleet.build import Fleet

HUB = "world"  # the world's process is the hub and holds the clock
OBSERVER = "observer"
RECORDER = "recorder"
LONGEST_HOST = 80  # characters; a host names a file and a key too


def plan_hosts(
    fleet: Fleet, processes: int | None, happenings: Iterable[Happening] = ()
) -> tuple[list[str], tuple[HostPlan, ...]]:
    """Which nodes live in the hub's process, and the plans of all other processes, each under a name of its own.

    `processes`: over how many processes the acting nodes are spread, the hub's included; None: one a node. Those that
    only listen have a process each, and so has every node to which something is to happen, one for each of its starts.
    """
    happenings = tuple(happenings)
    apart = {one.node_id for one in happenings}
    others = [node_id for node_id in fleet.specs if node_id != HUB and node_id not in apart]
    count = len(others) if processes is None else min(processes - 1, len(others))
    groups = [others[index::count] for index in range(count)]
    in_hub = [HUB] if groups else [HUB, *others]
    plans = [HostPlan(_name(group), tuple(group)) for group in groups]
    joins = {(one.node_id, one.incarnation) for one in happenings if one.change is Change.JOIN}
    plans += [HostPlan(node_id, (node_id,)) for node_id in sorted(apart) if (node_id, 0) not in joins]
    plans += [
        # No id has a `.` either.
        HostPlan(f"{node_id}.{incarnation}" if incarnation else node_id, (node_id,), incarnation, joins=True)
        for node_id, incarnation in sorted(joins)
    ]
    listeners = [node.node_id for node in fleet.roster if node.role in (Role.RECORDER, Role.OBSERVER)]
    return in_hub, (*plans, *(HostPlan(name, (name,)) for name in listeners))


def _name(group: list[str]) -> str:
    # No id has a `+`, so that no two groups have one name.
    name = "+".join(group)
    return name if len(name) <= LONGEST_HOST else f"{group[0]}+{len(group) - 1}"
