"""Modems whose frames are carried by programs of their own: the example flies a mission, and a run of ours refuses."""

from __future__ import annotations

import re
import socket
import subprocess
import sys
from collections import Counter
from pathlib import Path

import msgpack
import pytest
from flights import until
from spread import PATIENT, loopback_endpoint, refusal_of_run, spread_fleet

from comms.said.announcement import ClockMode, Role
from comms.said.codec import decode
from comms.said.messages import Heard, Packet
from comms.said.topics import MODEM_RX, MODEM_TX, topic_of
from secondlook.fleet.build import build_fleet
from secondlook.fleet.nodes import certified_when_spread, hosts_when_spread
from secondlook.recorded.mission_files import read_messages
from secondlook.scenario import load_scenario

EXAMPLE = Path(__file__).parents[3] / "examples" / "modem_driver"
BAY = EXAMPLE / "bay.yaml"
PLATFORMS = ("ship", "primary", "helper")


def test_drivers_have_what_the_world_has_else() -> None:
    fleet = build_fleet(load_scenario(str(BAY)), record=False, mode=ClockMode.WALL)
    routing = fleet.routing()
    assert {node.node_id: node.platform for node in fleet.roster if node.role is Role.DRIVER} == {
        f"driver-{platform}": platform for platform in PLATFORMS
    }
    for platform in PLATFORMS:
        sent, come = (routing.route(topic.key(vehicle=platform)) for topic in (MODEM_TX, MODEM_RX))
        assert sent is not None
        assert come is not None
        assert (sent.writer, sent.readers) == (f"modem-{platform}", (f"driver-{platform}",))
        assert (come.writer, come.readers) == (f"driver-{platform}", (f"modem-{platform}",))
    assert not {one for one in routing.subscriptions("world") if one.startswith("modem")}
    assert routing.subscriptions("driver-ship") == ("run", "modem/ship/tx")
    assert routing.publications("driver-ship") == ("modem/ship/rx",)
    assert fleet.specs["world"].config.channel is None


def test_a_modem_is_in_the_process_of_its_platform_and_its_driver_may_speak_through_that() -> None:
    roster = build_fleet(load_scenario(str(BAY)), record=False, mode=ClockMode.WALL).roster
    hosts = {"world": ("world",), "primary": ("primary", "modem-primary"), "helper": ("helper", "modem-helper"),
             "coordinator": ("coordinator", "modem-ship")}  # fmt: skip
    assert {spec.host: spec.nodes for spec in hosts_when_spread(roster)} == hosts
    certified = {spec.host: spec.nodes for spec in certified_when_spread(roster)}
    assert certified["helper"] == ("helper", "modem-helper", "driver-helper")
    assert certified["coordinator"] == ("coordinator", "modem-ship", "driver-ship")
    assert certified["driver-primary"] == ("driver-primary",)


def test_with_drivers_no_body_need_be_simulated() -> None:
    bodies = [f"vehicles.{name}.body=external" for name in ("primary", "helper")]
    roster = build_fleet(load_scenario(str(BAY), bodies), record=False, mode=ClockMode.WALL).roster
    assert "world" not in {node.node_id for node in roster}
    certified = {spec.host: spec.nodes for spec in certified_when_spread(roster)}
    assert certified["helper"] == ("helper", "modem-helper", "helper-body", "driver-helper")


@pytest.mark.parametrize("options", [(), ("--real-time", "20"), ("--bus", "local")])
def test_a_run_that_starts_all_itself_refuses_drivers(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusal_of_run(BAY, options, tmp_path / "out", monkeypatch, capsys) == (
        "link.carried_by: drivers are programs of their own, by the wall clock, which secondlook run cannot start; "
        "must be world here, or the fleet started with secondlook node\n"
    )


def port_told_in(said: Path) -> str:
    """The port of UDP that a driver tells in a file."""
    assert until(lambda: bool(re.search(r"on port \d+\n", said.read_text())), 60), said.read_text()
    return said.read_text().split()[-1]


def test_second_looks_are_had_by_what_drivers_carry_between_processes(tmp_path: Path) -> None:
    drivers: list[subprocess.Popen[str]] = []
    with spread_fleet(tmp_path, loopback_endpoint(), *PATIENT, scenario=BAY) as fleet:
        fleet.router(30)
        for role in (("world",), ("agent", "primary"), ("agent", "helper"), ("coordinator",)):
            fleet.node(*role)
        assert fleet.started["router"].says("listens on")
        ports: list[str] = []
        try:
            for platform in PLATFORMS:
                said = tmp_path / f"driver-{platform}.txt"
                command = [sys.executable, str(EXAMPLE / "driver.py"), platform, "--run", "bay", "--lost", "0.1",
                           "--delay", "1", "--connect", fleet.endpoint, "--to", *ports]  # fmt: skip
                with said.open("w") as out:
                    drivers.append(subprocess.Popen(command, stdout=out, stderr=out, text=True))
                ports.append(port_told_in(said))
            fleet.node("recorder")
            assert until(lambda: "under way" in (tmp_path / "driver-ship.txt").read_text(), 60)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
                for place in range(20):
                    stranger.sendto(msgpack.packb(("", [bytes([place] * 32)])), ("127.0.0.1", int(ports[0])))
            assert {name: one.ends() for name, one in fleet.started.items()} == dict.fromkeys(fleet.started, 0)
            assert [driver.poll() for driver in drivers] == [None] * len(PLATFORMS)
        finally:
            for driver in drivers:
                driver.kill()
                driver.wait()
        summary = fleet.summary
    assert summary["dropped"] == summary["link"]["dropped"]
    assert summary["dropped"].keys() == {"no frame of this run"}  # of a stranger's frames
    assert 0 < summary["dropped"]["no frame of this run"] <= 20
    assert summary["hotspots"]["revisited"] > 0
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"]
    link = summary["link"]
    assert {*link["packets"]} == {*PLATFORMS}
    assert 0 < link["frames_lost"] < link["frames_expected"] / 2
    assert link["frames_sent"] < link["frames_expected"] < 2 * link["frames_sent"]  # the ship's are for two
    senders, tasks = Counter[str](), 0
    for key, payload in read_messages(fleet.record / "messages.mpk"):
        found = topic_of(key)
        assert found is not None
        topic, platform = found
        header, message = decode(payload, topic.message)
        if topic is MODEM_RX:
            assert isinstance(message, Packet)
            senders[header.sender] += len(message.frames)
        if isinstance(message, Heard) and platform == "helper":
            tasks += message.key.startswith("coord/task/helper/")
    assert senders.keys() == {f"driver-{platform}" for platform in PLATFORMS}
    assert tasks > 0
