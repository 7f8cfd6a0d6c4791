"""Which nodes a fleet has, what each is made of, and in which process it runs: one table, by which all go that start a
fleet.

Under `secondlook run` one process is the hub; under `secondlook node` it is the router, and each process is started by
hand. Each child process imports this file: it is to be light.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from comms.errors import NO_FAILURES, NodeError
from comms.keys import HostSpec
from comms.runner import failure_of
from comms.said.announcement import Role
from comms.said.routing import RosterNode, modem_of
from planner.compiled import compile_all

CLOCK, WORLD, COORDINATOR, RECORDER, OBSERVER = (
    role.value for role in (Role.CLOCK, Role.WORLD, Role.COORDINATOR, Role.RECORDER, Role.OBSERVER)
)
HUB = WORLD
"""The host that is the hub of `secondlook run`: the world's process, which holds the clock, too."""
PLAN = ("coordinator.", "vehicle_agent.")
"""Where what plans, and calls what is compiled, is made."""
LONGEST_HOST = 80  # characters; a host names a file and a key too


class Process(enum.Enum):
    """Where a node runs."""

    HUB = "in the process that all others connect to"
    OWN = "in a process of its own"
    LAUNCHER = "in the process that starts the others"
    RECORDER = "in the recorder's process"
    OUTSIDE = "in a program that is not ours"


@dataclass(frozen=True, slots=True)
class Row:
    """One kind of node: where it runs under `secondlook run` and under `secondlook node`, and what makes it, unless the
    scenario names a class of the user's; `module:Class`, empty for what has no configuration."""

    run: Process
    node: Process
    factory: str = ""


NODES: Mapping[Role, Row] = {
    Role.CLOCK: Row(Process.HUB, Process.HUB),
    Role.WORLD: Row(Process.HUB, Process.OWN, "sim_world.world:World"),
    Role.BODY: Row(Process.OUTSIDE, Process.OUTSIDE),
    Role.SURVEY: Row(Process.OWN, Process.OWN, "vehicle_agent.survey:SurveyAgent"),
    Role.REVISIT: Row(Process.OWN, Process.OWN, "vehicle_agent.revisit:RevisitAgent"),
    Role.SURVEY_REVISIT: Row(Process.OWN, Process.OWN, "vehicle_agent.survey_revisit:SurveyRevisitAgent"),
    Role.COORDINATOR: Row(Process.OWN, Process.OWN, "coordinator.coordinator:Coordinator"),
    Role.MODEM: Row(Process.OWN, Process.OWN, "modem.modem:Modem"),
    Role.DRIVER: Row(Process.OUTSIDE, Process.OUTSIDE),
    Role.RECORDER: Row(Process.OWN, Process.RECORDER, "viz.recorder:Recorder"),
    Role.OBSERVER: Row(Process.LAUNCHER, Process.RECORDER),
}


@dataclass(frozen=True)
class NodeSpec:
    """How to make a node in whatever process it is to live: `factory`, `module:Class`, is called with `config`."""

    factory: str
    config: Any

    def make(self) -> Any:
        """The node itself; its module is imported only here. A user's own sets for itself which errors numpy raises."""
        module, name = self.factory.split(":")
        with np.errstate():
            return getattr(import_module(module), name)(self.config)


def node_spec(role: Role, config: Any, own: str | None = None) -> NodeSpec:
    """How to make a node of a role; `own`: the user's class in place of ours."""
    return NodeSpec(own or NODES[role].factory, config)


def make_node(node_id: str, spec: NodeSpec) -> Any:
    """The node itself, with all compiled that one which plans calls; raises NodeError where it cannot be made."""
    try:
        node = spec.make()
        if spec.factory.startswith(PLAN):
            compile_all()
        return node
    except (NodeError, *NO_FAILURES):
        raise
    except BaseException as error:
        raise failure_of(node_id, error) from error


def make_nodes(specs: Mapping[str, NodeSpec]) -> dict[str, Any]:
    """The nodes by their ids; raises NodeError for one that cannot be made."""
    return {node_id: make_node(node_id, spec) for node_id, spec in specs.items()}


def compile_nodes() -> None:
    """Compiles what nodes of ours call: for who sets up a machine, so that nobody waits later."""
    for row in NODES.values():
        if row.factory:
            import_module(row.factory.partition(":")[0])
    compile_all()


def hosts_of_run(
    roster: tuple[RosterNode, ...],
    processes: int | None,
    apart: tuple[HostSpec, ...] = (),
    *,
    modems_in_hub: bool = False,
) -> tuple[list[str], tuple[HostSpec, ...]]:
    """Which nodes live in the hub's process of `secondlook run`, and all other processes, each under a name of its own.

    `processes`: over how many processes the acting nodes are spread, the hub's included; None: one a node. Those that
    only listen have a process each. `apart`: processes of nodes that must be alone (`comms.drive.Drive.hosts_apart`).
    `modems_in_hub`: all other modems are with the world, which has most to do with them; else with the first node of
    their platform.
    """
    alone = {node_id for spec in apart for node_id in spec.nodes}
    acting = [one for one in roster if not one.listens_only]
    own = [one for one in acting if NODES[one.role].run is Process.OWN and one.node_id not in alone]
    here = [one.node_id for one in own if modems_in_hub and one.role is Role.MODEM]
    own = [one for one in own if one.node_id not in here]
    beside = _modems_beside(own)
    others = [one.node_id for one in own if one.node_id not in beside.values()]
    count = len(others) if processes is None else min(processes - 1, len(others))
    groups = [others[index::count] for index in range(count)]
    names = [_name(group) for group in groups]
    groups = [[*group, *(beside[one] for one in group if one in beside)] for group in groups]
    listeners = [one.node_id for one in roster if one.listens_only]
    return [HUB, *here] if groups else [HUB, *here, *others, *beside.values()], (
        *(HostSpec(name, tuple(group)) for name, group in zip(names, groups, strict=True)),
        *apart,
        *(HostSpec(name, (name,)) for name in listeners),
    )


def hosts_when_spread(roster: tuple[RosterNode, ...]) -> tuple[HostSpec, ...]:
    """The processes of `secondlook node` that the mission waits for. A modem is with the first node of its platform."""
    own = [one for one in roster if NODES[one.role].node is Process.OWN]
    beside = _modems_beside(own)
    recorded = any(one.role is Role.RECORDER for one in roster)
    recorder = tuple(one.node_id for one in roster if NODES[one.role].node is Process.RECORDER)
    return (
        *(
            HostSpec(one.node_id, (one.node_id, *([beside[one.node_id]] if one.node_id in beside else [])))
            for one in own
            if one.node_id not in beside.values()
        ),
        *([HostSpec(RECORDER, recorder)] if recorded else []),
    )


def certified_when_spread(roster: tuple[RosterNode, ...]) -> tuple[HostSpec, ...]:
    """Whose certificates the router knows. What is not ours has one of its own, or speaks through a process on its
    platform: a body through that of its agent, a modem's driver through that of the modem."""
    outside = [one for one in roster if NODES[one.role].node is Process.OUTSIDE]
    through = {one.node_id: modem_of(one.platform) if one.role is Role.DRIVER else one.vehicles[0] for one in outside}
    hosts = tuple(
        HostSpec(spec.host, (*spec.nodes, *(name for name, node in through.items() if node in spec.nodes)))
        for spec in hosts_when_spread(roster)
    )
    return (*hosts, *(HostSpec(name, (name,)) for name in through))


def _modems_beside(own: Iterable[RosterNode]) -> dict[str, str]:
    """By the first node of each platform its modem, which is in the same process."""
    modems = {one.platform: one.node_id for one in own if one.role is Role.MODEM}
    first = {one.platform: one.node_id for one in reversed([*own]) if one.role is not Role.MODEM}
    return {first[platform]: modem for platform, modem in modems.items() if platform in first}


def _name(group: list[str]) -> str:
    # No id has a `+`, so that no two groups have one name.
    name = "+".join(group)
    return name if len(name) <= LONGEST_HOST else f"{group[0]}+{len(group) - 1}"
