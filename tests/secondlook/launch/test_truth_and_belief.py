"""Missions in a world that is not what the map takes it for: it misses as many targets as it says where it is right
about them, more or fewer where it is not, and all of it repeats."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from flights import BRIEF
from missions import flown

import secondlook
from comms.said.messages import Look, TruthLook, TruthTargets
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.report import report_page
from secondlook.scenario import load_scenario
from secondlook.testing import Fleet, assert_maps_converged, assert_repeats

ODD = (
    "targets={layout: {kind: lines, heading_deg: 70, rows_apart_m: 30, jitter_m: 2}, correlation: 0.7, aspect_deg: 90,"
    " kinds: mines}",
    "vehicles.primary.sensor.estimate={bias: 0.2, bias_at_reach: 0.3, bias_after_turn: 0.4, turn_m: 40,"
    " blind_to_seabed: true, drift_per_km: 0.3, noise_along_m: 30}",
    "vehicles.helper.sensor.estimate={bias: -0.1, drift_per_km: 0.2}",
    "vehicles.primary.sensor.false_alarms_per_km2=300",
    "mission.rho=0.3",
)
TOLD = (
    "the fleet is wrong on purpose: targets.correlation is 0.7, mission.rho 0.3; from other aspects looks share less, "
    "90 degrees apart nothing; targets are mines, and it takes them for alike; targets.layout is lines, and it takes "
    "them for spread at random; what it is told of P_d errs as sensor.estimate of primary, helper says"
)


A_THIRD_OF_IT = "area.polygon_m=[[0, 0], [400, 0], [400, 400], [0, 400]]"


def sigmas(correlation: float, rho: float) -> float:
    """By how many standard deviations more of 1000 targets are missed than the map at the mission's end says."""
    settings = (A_THIRD_OF_IT, "targets.count=1000", f"targets.correlation={correlation}", f"mission.rho={rho}")
    risk, missed = flown("tellaro", 1, *settings).metrics.targets_met()
    assert missed.size == 1000
    return float((missed.sum() - risk.sum()) / math.sqrt((risk * (1.0 - risk)).sum()))


@pytest.mark.parametrize("correlation", [0.0, 0.5, 1.0])
def test_a_map_that_believes_what_is_true_predicts_what_is_missed(correlation: float) -> None:
    assert abs(sigmas(correlation, correlation)) < 3.0


def test_looks_that_share_all_miss_more_than_a_map_says_that_takes_them_for_independent() -> None:
    assert sigmas(1.0, 0.0) > 5.0


def test_independent_looks_miss_less_than_a_map_says_that_takes_them_for_one() -> None:
    assert sigmas(0.0, 1.0) < -5.0


def test_what_is_true_of_targets_changes_nothing_that_agents_do() -> None:
    plain = flown("tellaro", 1, A_THIRD_OF_IT, "targets.count=1000", "targets.correlation=0.0", "mission.rho=0.0")
    shared = flown("tellaro", 1, A_THIRD_OF_IT, "targets.count=1000", "targets.correlation=1.0", "mission.rho=0.0")
    assert plain.summary["risk"] == shared.summary["risk"]
    assert [one.p_detect.tolist() for _, one in plain.all(Look)] == [
        one.p_detect.tolist() for _, one in shared.all(Look)
    ]
    assert plain.all(TruthTargets)[0][1] == shared.all(TruthTargets)[0][1]
    assert plain.metrics.detected != shared.metrics.detected


def test_both_buses_fly_one_mission_with_all_of_it(tmp_path: Path) -> None:
    fleet = Fleet(load_scenario(str(BRIEF), ODD), folder=tmp_path, bus="zenoh", processes=2)
    flight = assert_repeats(fleet, ("local", "zenoh"))
    assert flight.summary["at_odds"] == TOLD
    assert_maps_converged(replace(flight, inside=None))  # with its looks, as they count by its rho
    own = [p for one in flight.said(TruthLook) for p in one.message.p_detect.tolist()]
    assert len(set(own)) > 10
    again = load_scenario(flight.folder / "scenario.yaml")
    assert Fleet(again, folder=tmp_path).run().digest == flight.digest


def test_the_report_tells_what_the_map_does_not_know(tmp_path: Path) -> None:
    pages = []
    for name, overrides in (("odd", ("targets.kinds=mines",)), ("plain", ())):
        (tmp_path / name).mkdir()
        run_mission(load_scenario(str(BRIEF), overrides), RunOptions(tmp_path / name, bus="local"))
        pages.append(report_page(secondlook.load(tmp_path / name)))
    sentence = "were to be expected. The fleet is wrong on purpose: targets are mines, and it takes them for alike."
    assert sentence in pages[0]
    assert "wrong on purpose" not in pages[1]
    assert "at_odds" not in json.loads((tmp_path / "plain" / "summary.json").read_text())
