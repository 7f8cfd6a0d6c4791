"""A fleet on hosts of its own, over TLS: one is cut off in mid-mission, taken for lost, and joins again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from certificates import make_certificates, options
from flights import events, until
from namespaces import namespaces
from required import missing_for_namespaces, require
from spread import lost_of_what_is_kept, spread_fleet

EXAMPLE = Path(__file__).parents[3] / "examples" / "vehicle"
NAMES = ("router", "world", "primary", "helper", "coordinator", "recorder")
OWN = "tcp/127.0.0.1:7448"  # of the helper's host: its vehicle speaks through its agent
BODY = ("--start", "-10", "-20", "--speed", "12", "--range", "15", "--run", "bay", "--connect", OWN)


def test_a_vehicle_that_is_cut_off_is_lost_for_a_while_and_its_map_is_whole_in_the_end(tmp_path: Path) -> None:
    require(missing_for_namespaces())
    # The helper is to have time for strips however slow it goes, and is lost when it is silent for some 3 s.
    longer = ("--set", "mission.deadline_factor=2.5", "--set", "coordinator.lost_after_s=50")
    with (
        namespaces("ship", "helper") as hosts,
        spread_fleet(tmp_path, f"tls/{hosts.address}:7447", *longer, scenario=EXAMPLE / "bay.yaml") as fleet,
    ):
        certificates = make_certificates(tmp_path / "certificates", NAMES, hosts.address)
        made = {name: options(one) for name, one in certificates.items()}
        fleet.router(16, *made["router"], before=hosts.within("hub"))
        ship, helper = hosts.within("ship"), hosts.within("helper")
        fleet.node("world", more=made["world"], before=ship)
        fleet.node("agent", "primary", more=made["primary"], before=ship)
        fleet.node("coordinator", more=made["coordinator"], before=ship)
        fleet.node("agent", "helper", more=[*made["helper"], "--listen", OWN], before=helper)
        assert fleet.started["router"].says("helper is here")
        body_log = tmp_path / "body.txt"
        with body_log.open("wb") as log:
            body = subprocess.Popen([*helper, sys.executable, str(EXAMPLE / "vehicle.py"), "helper", *BODY], stdout=log)
        try:
            fleet.node("recorder", more=made["recorder"], before=ship)
            assert until(lambda: "on_track" in body_log.read_text(), 90.0)
            hosts.cut_off("helper")
            before = body_log.read_text()
            assert fleet.started["coordinator"].says("helper is lost")
            assert fleet.started["router"].says("helper is gone")
            assert until(lambda: body_log.read_text() != before)  # on its own host the work goes on
            hosts.join("helper")
            assert fleet.started["coordinator"].says("helper is heard again")
            assert {name: one.ends() for name, one in fleet.started.items()} == dict.fromkeys(fleet.started, 0)
            assert body.poll() is None
        finally:
            body.kill()
            body.wait()
        assert lost_of_what_is_kept(fleet.record) == {}
        summary = fleet.summary
        reasons = [one["reason"] for one in events(fleet.record) if one["key"].startswith("coord/strip/")]
    assert "helper is lost: nothing heard of it" in reasons
    assert summary["ending"] == "over"
    assert summary["vehicles"]["primary"]["tracks"] == 4
    assert summary["hotspots"]["revisited"] > 0
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"]
