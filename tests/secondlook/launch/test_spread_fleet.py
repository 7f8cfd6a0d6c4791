"""Fleets started one by one with `secondlook node`: the mission is flown, also when the router is restarted or a node
comes anew; what does not fit is refused in one sentence."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from spread import PATIENT, SpreadFleet, interrupt, kill, loopback_endpoint, lost_of_what_is_kept, spread_fleet

from secondlook.launch.spread_fleet import nothing_in

FACTOR = 25.0
NODES = (("world",), ("agent", "primary"), ("agent", "helper"), ("coordinator",))


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[SpreadFleet]:
    with spread_fleet(tmp_path, loopback_endpoint(), *PATIENT) as started:
        yield started


def test_a_mission_goes_on_while_router_and_helper_are_started_anew_and_nothing_kept_is_lost(
    fleet: SpreadFleet,
) -> None:
    fleet.router(FACTOR)
    for role in NODES:
        fleet.node(*role)
    coordinator = fleet.started["coordinator"]
    assert fleet.started["router"].says("coordinator is here")
    second = fleet.node("coordinator", name="second")
    assert second.ends() == 2
    assert second.said == "refused by the router: another coordinator takes part already\n"
    fleet.node("recorder")
    assert all(fleet.started[name].says("the mission begins") for name in ("world", "primary", "recorder", "helper"))
    kill(fleet.started["router"])
    kill(fleet.started["helper"])
    fleet.router(FACTOR)
    again = fleet.node("agent", "helper", name="helper again")
    assert fleet.started["router"].says("the mission is under way")
    assert again.says("helper: the mission is at ")
    going = [one for name, one in fleet.started.items() if name not in ("second", "helper")]
    assert {one.name: one.ends() for one in going} == {one.name: 0 for one in going}
    assert lost_of_what_is_kept(fleet.record) == {}
    summary = fleet.summary
    assert (summary["ending"], summary["factor"], summary["digest"]) == ("over", FACTOR, None)
    assert summary["vehicles"]["primary"]["tracks"] == 4
    assert summary["hotspots"]["revisited"] > 0
    assert summary["dropped"].keys() <= {"lost on the way to the observer"}
    assert {path.name for path in fleet.record.iterdir()} == {
        "events.jsonl", "messages.mpk", "mission.rrd", "report.html", "risk.npz", "scenario.yaml", "summary.json",
    }  # fmt: skip
    assert re.fullmatch(
        r"coordinator: the mission begins\n(coordinator: the router is (not heard|heard again)\n)*"
        r"coordinator: the mission is over at \d+\.\d s\n",
        coordinator.said,
    )


def test_ctrl_c_ends_one_process_alone(fleet: SpreadFleet) -> None:
    router, recorder, world = fleet.router(1), fleet.node("recorder"), fleet.node("world")
    assert router.says("recorder is here")
    assert router.says("world is here")
    interrupt(recorder)
    assert recorder.ends() == 1
    assert recorder.said == "recorder: interrupted at 0 s of the mission; what was recorded is in record\n"
    assert fleet.summary["ending"] == "interrupted"
    assert router.says("recorder is gone"), router.said
    interrupt(router)
    assert router.ends() == 1
    assert router.said.endswith("interrupted; the others go on, and connect again when it is back\n")
    assert world.says("world: the router is not heard")
    interrupt(world)
    assert (world.ends(), world.said.endswith("world: interrupted at 0 s of the mission\n")) == (1, True)


def test_another_scenario_is_refused_and_another_run_not_answered(fleet: SpreadFleet) -> None:
    assert fleet.router(1).says("listens on")
    other = fleet.node("world", more=["--seed", "9"])
    elsewhere = fleet.node("coordinator", more=["--run", "elsewhere", "--wait", "2"])
    assert elsewhere.ends() == 2
    assert elsewhere.said == (
        "no answer from the router to coordinator in run elsewhere: the run there may be another, or the name in the "
        "certificate\n"
    )
    assert other.ends() == 2
    assert re.fullmatch(
        r"refused by the router: the router has another scenario than world, \w{12} and not \w{12}: file, --seed and "
        r"--set must be the same everywhere\n",
        other.said,
    )


def test_a_port_in_use_is_told_in_one_sentence(fleet: SpreadFleet) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        fleet.endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        router = fleet.router(1)
        assert router.ends() == 2
    assert router.said.splitlines()[-1] == f"cannot listen on {fleet.endpoint}: address already in use"


def test_an_endpoint_where_nobody_listens_is_told_in_one_sentence(fleet: SpreadFleet) -> None:
    world = fleet.node("world", more=["--wait", "0.3"])
    assert world.ends() == 2
    assert world.said == f"no connection to {fleet.endpoint} within 0.3 s: nobody listens there\n"
    for name in ("recorder", "again"):  # the same command: nothing is left in its folder
        recorder = fleet.node("recorder", name=name, more=["--wait", "0.3"])
        assert recorder.ends() == 2
        assert recorder.said == world.said


def test_a_recorder_that_has_heard_nothing_tells_where_to_look() -> None:
    assert nothing_in(Path("record"), 0) == "record holds nothing of it"
    before = "what was recorded before it was started again is in the folder before it"
    assert nothing_in(Path("record-2"), 1) == f"record-2 holds nothing of it; {before}"
