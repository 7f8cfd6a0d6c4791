"""A mission that is flown for a goal: it ends with it, on both buses alike, and says how far it is."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from called import Call
from flights import BRIEF

import secondlook
from comms.said.messages import MissionOver
from planner.clearance import CAUTIOUS_MINES, PRIOR_MINES
from planner.goal import Goal, Lane
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.recorded.metrics import Metrics
from secondlook.report import report_page
from secondlook.scenario import load_scenario
from secondlook.testing import Fleet, assert_no_strip_lost, assert_repeats

SOME = "mission.goal={kind: cleared, clearance: 0.3}"
ALL = "mission.goal={kind: none_left, chance: 0.99}"
LANE = "mission.goal={kind: lane, lane_m: [[50, 10], [50, 90]], width_m: 20, risk: 0.5}"


def test_it_ends_with_its_goal_on_both_buses_alike(tmp_path: Path) -> None:
    fleet = Fleet(load_scenario(str(BRIEF), [SOME]), folder=tmp_path, bus="zenoh", processes=2)
    flight = assert_repeats(fleet, ("local", "zenoh"))
    (over,) = {one.message.reason for one in flight.said(MissionOver)}
    assert over.startswith("the goal is reached: a clearance of 0.3 with a chance of 0.9; the chance is ")
    assert flight.summary["time"]["mission_s"] < 100.0  # the whole one takes 111 s
    goal = flight.summary["goal"]
    assert (goal["reached"], goal["wanted_chance"]) == (True, 0.9)
    # It is the chance that those found are 30 % of all.
    metrics = Metrics()
    for one in flight.messages():
        metrics.hear(one)
    left = metrics.mines_left(prior_mines=CAUTIOUS_MINES)
    assert left is not None
    assert goal["chance"] == pytest.approx(left.chance_of_clearance(0.3))
    assert goal["chance"] >= 0.9
    assert goal["true"] == (flight.summary["truth"]["missed_share"] <= 0.7)


def test_it_ends_by_what_the_coordinator_has_heard_and_one_mine_more(tmp_path: Path) -> None:
    scenario = load_scenario(str(BRIEF), ["mission.goal={kind: cleared, clearance: 0.37}"])
    flight = Fleet(scenario, folder=tmp_path).run()
    over = flight.said(MissionOver)[0]
    metrics = Metrics()
    for one in flight.messages():
        if one.topic.due_ms(one.header.sent_ms) <= over.header.sent_ms:
            metrics.hear(one)
    assert scenario.mission.goal is not None
    goal = scenario.mission.goal.goal
    told, without = (goal.words_now(metrics.mines_left(prior_mines=mines)) for mines in (CAUTIOUS_MINES, PRIOR_MINES))
    assert f"; {told}, " in over.message.reason
    assert without not in over.message.reason


def test_one_that_is_missed_says_by_how_much(tmp_path: Path) -> None:
    summary = run_mission(load_scenario(str(BRIEF), [ALL]), RunOptions(tmp_path, bus="local"))
    assert summary["time"]["mission_s"] > 100.0
    assert summary["goal"]["reached"] is False
    assert 0.0 < summary["goal"]["chance"] < summary["mines"]["none_left"] < 0.99
    assert (summary["goal"]["true"], summary["truth"]["missed_share"] > 0.0) == (False, True)
    page = report_page(secondlook.load(tmp_path))
    assert "for no mine left with a chance of 0.99. <b>That is missed</b>: the chance is 0.0" in page


def test_without_one_nothing_is_said_of_it(tmp_path: Path) -> None:
    run_mission(load_scenario(str(BRIEF)), RunOptions(tmp_path, bus="local"))
    assert "goal" not in json.loads((tmp_path / "summary.json").read_text())
    assert "was flown for" not in report_page(secondlook.load(tmp_path))


@pytest.mark.parametrize(
    ("targets", "true"), [("count: 0", None), ("layout: {kind: places, places_m: [[200, 50]]}", True)]
)
def test_of_a_lane_the_truth_is_that_of_the_targets_in_it(tmp_path: Path, targets: str, true: bool | None) -> None:
    scenario = load_scenario(str(BRIEF), [LANE.replace("0.5", "0.001"), f"targets={{{targets}}}"])
    summary = run_mission(scenario, RunOptions(tmp_path, bus="local", record=False))
    assert (summary["goal"]["reached"], summary["goal"]["true"]) == (False, true)


def test_second_looks_go_to_the_lane_first() -> None:
    config = build_fleet(load_scenario(str(BRIEF), [LANE]), record=False).specs["coordinator"].config
    assert config.goal == Goal(1.0, 0.5, Lane(((50.0, 10.0), (50.0, 90.0)), 20.0))
    (priority,) = config.priorities
    assert {*priority.outlines_m[0]} == {(40.0, 10.0), (60.0, 10.0), (40.0, 90.0), (60.0, 90.0)}
    own = "area.priorities=[{polygon_m: [[0, 50], [300, 50], [300, 100], [0, 100]], weight: 2}]"
    config = build_fleet(load_scenario(str(BRIEF), [LANE, own]), record=False).specs["coordinator"].config
    assert [one.weight for one in config.priorities] == [2.0]


def test_a_lane_in_degrees_or_utm_metres_is_where_it_is_in_metres() -> None:
    at = ("origin={easting_m: 583900, northing_m: 6638600, epsg: 32632}",)
    in_metres = load_scenario(str(BRIEF), [*at, LANE])
    assert in_metres.origin is not None
    told = "lane_utm_m: [[583950, 6638610], [583950, 6638690]], epsg: 32632"
    utm = load_scenario(str(BRIEF), [*at, LANE.replace("lane_m: [[50, 10], [50, 90]]", told)])
    assert utm.mission.goal is not None
    lane = utm.mission.goal.goal.lane
    assert lane is not None
    # Grid north is not true north, some 1.3 degrees off here, and a UTM metre is 0.9997 m.
    for place, (x_m, y_m) in zip(lane.way, ((50.0, 10.0), (50.0, 90.0)), strict=True):
        assert place == pytest.approx((x_m, y_m), abs=0.03 * max(x_m, y_m))
        assert place != (x_m, y_m)


def test_check_flies_it_to_see_whether_it_is_reached(called: Call) -> None:
    code, out, err = called("check", str(BRIEF), "--set", SOME)
    assert (code, err) == (0, "")
    *_, told = out.splitlines()
    assert told.startswith(
        "mission.goal: a clearance of 0.3 with a chance of 0.9 is reached in 3 of 3 missions flown to try it, after "
    )
    code, out, err = called("check", str(BRIEF), "--set", SOME, "--no-trial")
    assert (code, "mission.goal" in out, err) == (0, False, "")
    code, out, err = called("check", str(BRIEF), "--set", ALL)
    assert (code, "mission.goal" in out) == (0, False)
    assert err.startswith(
        "mission.goal: no mine left with a chance of 0.99 is reached in 0 of 3 missions flown to try it; missed: the "
    )


OWN = """
import os, signal

class Clueless:
    def assign(self, situation):
        raise RuntimeError("no idea")

class Hit:
    def assign(self, situation):
        os.kill(os.getpid(), signal.SIGTERM)
        return {}
"""


@pytest.mark.parametrize(
    ("allocator", "code", "told"),
    [
        ("own:Clueless", 1, r"mission\.goal: .* is not known: coordinator has failed at .* RuntimeError: no idea .*\n"),
        ("own:Hit", 130, ""),
    ],
    ids=["failed", "interrupted"],
)
def test_a_trial_that_fails_or_is_interrupted_is_no_success(
    called: Call, users_folder: Path, allocator: str, code: int, told: str
) -> None:
    (users_folder / "own.py").write_text(OWN)
    ended = called("check", str(BRIEF), "--set", ALL, "--set", f"coordinator.allocator={allocator}")
    assert ended.code == code
    assert re.fullmatch(told, ended.err)


def test_strips_that_are_open_when_the_goal_is_reached_are_not_lost(tmp_path: Path) -> None:
    long = "mission.deadline_factor=3"
    flight = Fleet(load_scenario(str(BRIEF), [long, SOME.replace("0.3", "0.6")]), folder=tmp_path).run()
    assert flight.summary["time"]["primary_s"] < flight.end_s < 200.0
    assert flight.summary["hotspots"]["left"] > 0
    assert_no_strip_lost(flight)
    early = replace(flight, scenario=load_scenario(str(BRIEF), [long]))  # without a goal they would be
    with pytest.raises(AssertionError, match="before its deadline"):
        assert_no_strip_lost(early)
