"""Every acting node in one process, each process under a name of its own."""

from pathlib import Path
from typing import Any

import pytest
from flights import BRIEF
from hypothesis import given
from hypothesis import strategies as st

from comms.keys import HostSpec
from comms.said.announcement import Role
from comms.said.routing import RosterNode
from secondlook.fleet.build import Fleet, build_fleet
from secondlook.fleet.nodes import LONGEST_HOST, NodeSpec, hosts_of_run
from secondlook.scenario import load_scenario

ids = st.from_regex(r"[a-z0-9_-]{1,40}", fullmatch=True)


def fleet_of(vehicles: list[str]) -> Fleet:
    """A fleet of these vehicles, of which nothing is made."""
    run_info: Any = None
    roster = (
        RosterNode("world", Role.WORLD, tuple(vehicles)),
        *(RosterNode(name, Role.REVISIT, (name,)) for name in vehicles),
        RosterNode("coordinator", Role.COORDINATOR),
        RosterNode("recorder", Role.RECORDER),
        RosterNode("observer", Role.OBSERVER),
    )
    acting = ["world", *vehicles, "coordinator"]
    return Fleet(run_info, roster, {name: NodeSpec("none:None", None) for name in acting}, 0)


@pytest.mark.parametrize(
    ("processes", "in_hub", "hosts"),
    [
        (None, ["world"], {"primary": ("primary",), "helper": ("helper",), "coordinator": ("coordinator",)}),
        (9, ["world"], {"primary": ("primary",), "helper": ("helper",), "coordinator": ("coordinator",)}),
        (3, ["world"], {"primary+coordinator": ("primary", "coordinator"), "helper": ("helper",)}),
        (2, ["world"], {"primary+helper+coordinator": ("primary", "helper", "coordinator")}),
        (1, ["world", "primary", "helper", "coordinator"], {}),
    ],
)
def test_nodes_are_spread_over_so_many_processes(
    processes: int | None, in_hub: list[str], hosts: dict[str, tuple[str, ...]]
) -> None:
    fleet = build_fleet(load_scenario(str(BRIEF)), record=True)
    here, plans = hosts_of_run(fleet.roster, processes)
    assert here == in_hub
    assert {plan.host: plan.nodes for plan in plans} == {**hosts, "recorder": ("recorder",), "observer": ("observer",)}


@pytest.mark.parametrize(
    ("processes", "in_hub", "hosts"),
    [
        (None, ["world", "modem-helper"], {"coordinator", "primary", "helper", "modem-ship", "modem-primary"}),
        (2, ["world", "modem-helper"], {"primary+helper+coordinator", "modem-ship", "modem-primary"}),
        (
            1,
            ["world", "modem-helper", "coordinator", "primary", "helper"],
            {"modem-ship", "modem-primary"},
        ),
    ],
)
def test_modems_are_with_the_world_but_for_those_to_which_something_happens(
    processes: int | None, in_hub: list[str], hosts: set[str]
) -> None:
    fleet = build_fleet(load_scenario(str(BRIEF), ["link.profile=micromodem-1"]), record=True)
    apart = tuple(HostSpec(name, (name,)) for name in ("modem-ship", "modem-primary"))
    here, plans = hosts_of_run(fleet.roster, processes, apart, modems_in_hub=True)
    assert sorted(here) == sorted(in_hub)
    assert {plan.host for plan in plans} - {"recorder", "observer"} == hosts


@given(st.lists(ids, unique=True, max_size=8), st.integers(1, 12))
def test_every_node_has_one_place_and_every_host_a_name_of_its_own(vehicles: list[str], processes: int) -> None:
    taken = {"world", "coordinator", "recorder", "observer", "clock"}
    fleet = fleet_of([name for name in vehicles if name not in taken])
    here, plans = hosts_of_run(fleet.roster, processes)
    placed = [*here, *(node for plan in plans for node in plan.nodes)]
    assert sorted(placed) == sorted([*fleet.specs, "recorder", "observer"])
    names = [plan.host for plan in plans]
    assert len({"world", *names}) == 1 + len(names) <= processes + 2
    assert all(len(name) <= LONGEST_HOST and Path(name).name == name for name in names)


def test_groups_that_could_be_spelled_alike_have_different_names() -> None:
    # Two processes: `a-b` with `c`, and `a` with `b-c`.
    _, plans = hosts_of_run(fleet_of(["a-b", "a", "c", "b-c"]).roster, 3)
    assert {plan.host for plan in plans} >= {"a-b+c+coordinator", "a+b-c"}
