"""Whole missions in which platforms talk by modems."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import BRIEF

from comms.drive import Drive
from comms.lockstep.drive import Lockstep
from comms.lockstep.faults import CutOff, Faults
from secondlook.launch.mission import Bus, RunOptions, run_mission
from secondlook.scenario import load_scenario
from secondlook.testing import Fleet


def fly(
    folder: Path,
    *settings: str,
    bus: Bus = "local",
    processes: int | None = None,
    drive: Drive | None = None,
    scenario: str = str(BRIEF),
) -> dict[str, Any]:
    """The summary of a mission, the brief one if none is named."""
    folder.mkdir(exist_ok=True)
    options = RunOptions(folder, bus=bus, processes=processes, record=False, drive=drive or Lockstep())
    summary = run_mission(load_scenario(scenario, settings), options)
    assert json.loads((folder / "summary.json").read_text()) == summary
    return summary


LONG = "mission.deadline_factor=3"  # so that there is time to wait for slots


@pytest.mark.parametrize("platform", ["ship", "primary"])
@pytest.mark.parametrize("profile", ["radio", "micromodem-6", "micromodem-1", "micromodem-0", "unet-data"])
def test_second_looks_are_had_by_any_modem(tmp_path: Path, profile: str, platform: str) -> None:
    summary = fly(tmp_path, f"link.profile={profile}", f"coordinator.platform={platform}", LONG)
    assert summary["ending"] == "over"
    assert summary["dropped"] == {}
    assert summary["hotspots"]["revisited"] > 0
    assert summary["risk"]["mean"] < summary["risk_primary_alone"]["mean"] - 0.05
    link = summary["link"]
    assert link["profile"] == profile
    platforms = {platform, "primary", "helper"}
    assert {*link["packets"]} == platforms
    assert 0 < link["bytes_per_s"] < 200
    assert link["frames_sent"] >= sum(link["packets"].values())
    assert link["age"]["helper"]["largest_s"] > link["age"]["helper"]["mean_s"] > 0


@pytest.mark.parametrize(
    ("profile", "access", "maps", "processes"),
    [
        ("micromodem-6", "slots", "stretches", None),
        ("micromodem-6", "slots", "corrected", 2),
        ("janus", "slots", "stretches", 2),
        ("micromodem-6", "polled", "stretches", 2),
    ],
)
def test_it_is_one_mission_on_either_bus_in_any_number_of_processes(
    tmp_path: Path, profile: str, access: str, maps: str, processes: int | None
) -> None:
    settings = (f"link.profile={profile}", f"link.access={access}", f"link.maps={maps}", "link.loss=0.2")
    local = fly(tmp_path / "local", *settings)
    zenoh = fly(tmp_path / "zenoh", *settings, bus="zenoh", processes=processes)
    assert zenoh["digest"] == local["digest"]
    assert local["link"]["frames_lost"] > 0
    assert fly(tmp_path / "again", *settings, "link.loss=0.21")["digest"] != local["digest"]


def test_the_ideal_link_is_no_link(tmp_path: Path) -> None:
    without, ideal = fly(tmp_path / "without"), fly(tmp_path / "ideal", "link.profile=ideal")
    assert ideal["digest"] == without["digest"]
    assert ideal["link"]["profile"] == without["link"]["profile"] == "ideal"
    assert ideal["link"]["packets"] == {}


def test_who_is_cut_off_is_neither_heard_nor_hears(tmp_path: Path) -> None:
    cut = Lockstep(faults=Faults(0, cut_offs=(CutOff("helper", 0, 10_000_000),)))
    summary = fly(tmp_path, "link.profile=micromodem-6", drive=cut)
    assert summary["ending"] == "over"
    assert summary["hotspots"]["revisited"] == 0
    assert summary["link"]["age"]["helper"]["largest_s"] == pytest.approx(summary["time"]["mission_s"], abs=0.1)


def test_an_outage_makes_what_is_known_old_and_ends(tmp_path: Path) -> None:
    outage = "link.outages=[{platform: helper, from_s: 20, for_s: 60}]"
    calm, out = (
        fly(tmp_path / name, "link.profile=micromodem-6", *more, LONG)
        for name, more in (("calm", ()), ("out", (outage,)))
    )
    assert out["link"]["age"]["helper"]["largest_s"] >= 60 > calm["link"]["age"]["helper"]["largest_s"]
    assert out["hotspots"]["revisited"] > 0


def test_corrected_the_coordinators_map_is_nearer_to_the_vehicles_own(tmp_path: Path) -> None:
    off = []
    for maps in ("stretches", "corrected"):
        overrides = {"link.profile": "radio", "link.maps": maps, "mission.deadline_factor": 3}
        flight = Fleet(BRIEF, folder=tmp_path / maps, overrides=overrides).run()
        assert flight.inside is not None
        known, seen = flight.inside.fleet_map("coordinator"), flight.risk_map
        assert known is not None
        assert seen is not None
        off.append(float(np.abs(known.risk - seen.risk).mean()))
    assert off[1] < 0.7 * off[0]


def test_a_primary_that_is_hardly_heard_is_waited_for_to_the_end_of_its_survey(tmp_path: Path) -> None:
    settings = ("link.profile=micromodem-0", "link.loss=0.8", "link.access=polled")
    summary = fly(tmp_path, *settings, scenario="tellaro")
    assert summary["time"]["mission_s"] > 1.05 * summary["time"]["primary_s"] > 3000
    lines = map(json.loads, (tmp_path / "events.jsonl").read_text().splitlines())
    (reason,) = {one["reason"] for one in lines if one["key"] == "coord/mission_over"}
    assert reason.startswith("1.05 times the last primary's end is reached, ")
