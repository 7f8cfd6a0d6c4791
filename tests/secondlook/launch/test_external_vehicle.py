"""A vehicle whose body is a program of its own: the example flies a mission, and its parts do what they say."""

from __future__ import annotations

import importlib.util
import math
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from spread import PATIENT, loopback_endpoint, lost_of_what_is_kept, refusal_of_run, spread_fleet

from comms.said.announcement import ClockMode, Role
from comms.said.codec import Header, decode, encode
from comms.said.messages import Look, Maneuver, ManeuverKind, ManeuverState, ManeuverStatus, Message, Nav
from comms.said.topics import topic_of
from secondlook.fleet.build import build_fleet
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import ScenarioError, load_scenario

EXAMPLE = Path(__file__).parents[3] / "examples" / "vehicle"
BAY = EXAMPLE / "bay.yaml"
START = ("--start", "-10", "-20", "--speed", "12", "--range", "15")


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("example_vehicle", EXAMPLE / "vehicle.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def sail(vehicle: Any, until_ms: int, step_ms: int) -> list[tuple[int, str, Message]]:
    """All it says until then, with the time and the topic."""
    return [(now, *said) for now in range(0, until_ms + 1, step_ms) for said in vehicle.advance(now)]


@pytest.mark.parametrize("step_ms", [20, 700, 9_000])
def test_the_examples_vehicle_follows_a_track_and_looks_at_all_of_it(example: ModuleType, step_ms: int) -> None:
    vehicle = example.Vehicle(0.0, -30.0, 10.0, 15.0, 0.7)
    vehicle.advance(0)
    # 25 m to the run-in's start at (0, -5), 5 m of run-in, 50 m of track: 8 s.
    ((_, accepted),) = vehicle.command(Maneuver(3, ManeuverKind.FOLLOW, 0, 0, 0, 50, 5), 0)
    assert accepted == ManeuverStatus(3, ManeuverState.ACCEPTED, 8_000, "")
    said = sail(vehicle, 9_000, step_ms)
    states = [(now, message.state) for now, _, message in said if isinstance(message, ManeuverStatus)]
    reached = {state: now for now, state in reversed(states)}
    assert 3_000 <= reached[ManeuverState.ON_TRACK] < 3_000 + step_ms + 1
    assert 8_000 <= reached[ManeuverState.DONE] < 8_000 + step_ms + 1
    looks = [message for _, _, message in said if isinstance(message, Look)]
    assert [(one.number, one.first_along_m, one.p_detect.shape) for one in looks] == [
        (1, 0.0, (2, 4, 16)), (2, 20.0, (2, 4, 16)), (3, 40.0, (2, 2, 16)),
    ]  # fmt: skip
    assert {(one.maneuver, one.heading_rad, one.origin_y_m) for one in looks} == {(3, 0.0, 0.0)}
    assert (vehicle.x_m, vehicle.y_m) == (0.0, 50.0)
    for one in looks:
        assert isinstance(decode(encode(Header("helper-body", 0, 0, 0), one), Look)[1], Look)


def test_the_examples_vehicle_goes_to_a_place_and_holds_when_told(example: ModuleType) -> None:
    vehicle = example.Vehicle(0.0, 0.0, 10.0, 15.0, 0.7)
    (at_once, _) = vehicle.command(Maneuver(1, ManeuverKind.GOTO, 0, 0, 100, 0, 0), 0)
    assert at_once == ("nav", Nav(0, 0, 0, 0, 5, 0))
    said = sail(vehicle, 4_000, 100)
    assert [message.x_m for now, _, message in said if isinstance(message, Nav)] == pytest.approx([10, 20, 30, 40])
    assert vehicle.heading_rad == pytest.approx(math.pi / 2)
    vehicle.command(Maneuver(2, ManeuverKind.HOLD, 0, 0, 0, 0, 0), 4_500)
    vehicle.advance(60_000)
    assert (vehicle.x_m, vehicle.y_m) == pytest.approx((45, 0))
    assert not any(isinstance(message, Look) for _, _, message in said)


def test_of_a_manoeuvre_that_is_asked_for_again_it_says_how_far_it_got(example: ModuleType) -> None:
    vehicle = example.Vehicle(0.0, 0.0, 10.0, 15.0, 0.7)
    track = Maneuver(1, ManeuverKind.FOLLOW, 0, 0, 0, 50, 0)
    vehicle.command(track, 0)
    sail(vehicle, 2_000, 100)
    assert vehicle.command(track, 2_000)[-1] == (
        "maneuver_status",
        ManeuverStatus(1, ManeuverState.ON_TRACK, 5_000, ""),
    )
    assert vehicle.y_m == pytest.approx(20)
    vehicle.advance(5_000)
    assert vehicle.command(track, 9_000)[-1] == ("maneuver_status", ManeuverStatus(1, ManeuverState.DONE, 5_000, ""))
    assert vehicle.command(Maneuver(2, ManeuverKind.HOLD, 0, 0, 0, 0, 0), 9_000)[-1] == (
        "maneuver_status",
        ManeuverStatus(2, ManeuverState.ACCEPTED, 0, ""),
    )


def test_an_external_body_has_its_vehicles_topics_and_the_world_has_not() -> None:
    fleet = build_fleet(load_scenario(str(BAY)), record=False, mode=ClockMode.WALL)
    roster = {node.node_id: (node.role, node.vehicles) for node in fleet.roster}
    assert roster["world"] == (Role.WORLD, ("primary",))
    assert roster["helper-body"] == (Role.BODY, ("helper",))
    assert sorted(fleet.specs) == ["coordinator", "helper", "primary", "world"]
    assert [one.vehicle for one in fleet.specs["world"].config.vehicles] == ["primary"]


def test_without_a_simulated_vehicle_there_is_no_world() -> None:
    scenario = load_scenario(str(BAY), ["vehicles.primary.body=external"])
    fleet = build_fleet(scenario, record=False, mode=ClockMode.WALL)
    assert sorted(fleet.specs) == ["coordinator", "helper", "primary"]
    assert "world" not in {node.node_id for node in fleet.roster}


def test_no_vehicle_may_have_the_bodys_name(tmp_path: Path) -> None:
    scenario = tmp_path / "bay.yaml"
    scenario.write_text(BAY.read_text().replace("  primary:", "  helper-body:"))
    told = r"vehicles\.helper-body: .* must have another id, as the external body of helper is called so$"
    with pytest.raises(ScenarioError, match=told):
        load_scenario(str(scenario))


@pytest.mark.parametrize("options", [(), ("--real-time",), ("--bus", "local")])
def test_a_run_that_starts_all_itself_refuses_an_external_body(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusal_of_run(BAY, options, tmp_path / "out", monkeypatch, capsys) == (
        "vehicles.helper.body: external is a program of its own, which secondlook run cannot start; must be simulated "
        "here, or the fleet started with secondlook node\n"
    )


def test_the_example_flies_a_mission_through_its_own_agent(tmp_path: Path) -> None:
    """The vehicle speaks through the agent's process, and so goes on talking with it whatever becomes of the router."""
    with spread_fleet(tmp_path, loopback_endpoint(), *PATIENT, scenario=BAY) as fleet:
        own = loopback_endpoint()
        fleet.router(30)
        for role, more in ((("world",), ()), (("agent", "primary"), ()), (("agent", "helper"), ("--listen", own))):
            fleet.node(*role, more=more)
        fleet.node("coordinator")
        assert fleet.started["router"].says("helper is here")
        body = subprocess.Popen(
            [sys.executable, str(EXAMPLE / "vehicle.py"), "helper", "--run", "bay", "--connect", own, *START]
        )
        try:
            fleet.node("recorder")
            assert {name: one.ends() for name, one in fleet.started.items()} == dict.fromkeys(fleet.started, 0)
            assert body.poll() is None
        finally:
            body.kill()
            body.wait()
        assert lost_of_what_is_kept(fleet.record) == {}
        summary = fleet.summary
    assert summary["hotspots"]["revisited"] > 0
    assert summary["vehicles"]["helper"]["path_m"] > 100
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"]
    by_body = Counter[str]()
    for key, payload in read_messages(fleet.record / "messages.mpk"):
        found = topic_of(key)
        assert found is not None
        header, _ = decode(payload, found[0].message)
        if header.sender == "helper-body":
            by_body[found[0].name] += 1
    assert by_body.keys() == {"nav", "look", "maneuver_status"}
