"""Whole missions of vehicles whose batteries do not last for all they were to do."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from flights import BRIEF, TWO_PRIMARIES

from comms.said.messages import AgentState, MissionOver, Mode, Plan, StripState, Task, TaskAction
from secondlook.cli import app_for
from secondlook.commands.planned_survey import planned_surveys
from secondlook.scenario.text import Value
from secondlook.testing import Fleet, assert_all_finished, assert_home_before_empty, assert_kept_apart
from secondlook.testing.flight import Flight


def flown(folder: Path, **changes: Value) -> Flight:
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    return Fleet(BRIEF, folder=folder, overrides=overrides).run()


def modes(flight: Flight, vehicle: str) -> list[Mode]:
    """In which a vehicle was, one after the other."""
    said = [one.message.mode for one in flight.said(AgentState, f"agent/{vehicle}/state")]
    return [mode for mode, before in zip(said, [None, *said], strict=False) if mode is not before]


class TestAPrimary:
    def test_it_comes_home_before_its_battery_is_empty_and_all_tell_it(
        self, tmp_path: Path, caplog: pytest.LogCaptureFixture
    ) -> None:
        flight = flown(tmp_path, vehicles__primary__endurance_s=80)
        assert_home_before_empty(flight, "primary")
        assert_all_finished(flight)
        assert modes(flight, "primary") == [Mode.TRANSIT, Mode.SURVEY, Mode.RETURNING, Mode.HOME]
        told = flight.summary["vehicles"]["primary"]
        assert (told["ended"], told["survey_cut_short"], told["tracks"]) == ("home", True, 1)
        # Its reserve is a tenth of 80 s.
        assert told["ended_s"] <= 72
        assert told["battery_left"] == pytest.approx(1 - told["ended_s"] / 80, abs=1e-4)
        home = flight.said(AgentState, "agent/primary/state")[-1].message
        assert (home.x_m, home.y_m) == pytest.approx((-20, -20), abs=10)  # told a second ago at most, at 8 m/s
        assert flight.paths["primary"].line.coords[-1] == pytest.approx((-20, -20), abs=0.01)
        plan = flight.said(Plan, "agent/primary/plan")[-1].message
        assert [track.flown for track in plan.tracks] == [True]
        assert plan.note.startswith("the battery lasts for no further track and the way home: the survey ends, ")
        over = flight.said(MissionOver)[-1].message.reason
        assert "1.05 times the last primary's end is reached" in over
        assert [one.message for one in caplog.records if one.name == "secondlook.mission"] == [
            f"primary: home at {told['ended_s']:.0f} s with {told['battery_left']:.0%} of its battery, "
            "its survey is not finished"
        ]

    def test_one_whose_battery_lasts_flies_as_if_there_were_none(self, tmp_path: Path) -> None:
        short, long = (
            flown(tmp_path / str(endurance_s), vehicles__primary__endurance_s=endurance_s).said(Plan)[-1].message
            for endurance_s in (400, 36_000)
        )
        assert short == long
        assert all(track.flown for track in long.tracks)

    def test_where_it_is_waited_for_it_goes(self, tmp_path: Path) -> None:
        home: dict[str, Value] = {"x_m": 150, "y_m": 130}
        flight = flown(tmp_path, vehicles__primary__endurance_s=60, vehicles__primary__home=home)
        assert_home_before_empty(flight, "primary")
        assert flight.paths["primary"].line.coords[-1] == pytest.approx((150, 130), abs=0.01)

    def test_what_it_leaves_another_takes_that_revisits(self, tmp_path: Path) -> None:
        flight = Fleet(TWO_PRIMARIES, folder=tmp_path / "run").run()
        assert_home_before_empty(flight, "west")
        assert flight.summary["risk_primary_alone"]["uncovered_share"] > 0.2
        assert flight.summary["risk"]["uncovered_share"] == 0.0
        assert {one.vehicle for one in flight.strips if one.state is StripState.DONE} == {"east"}

    def test_one_that_cannot_come_home_is_told(self, tmp_path: Path) -> None:
        flight = flown(tmp_path, vehicles__primary__endurance_s=60, vehicles__primary__home={"x_m": 5000, "y_m": 0})
        with pytest.raises(AssertionError, match="primary: its battery was empty at 60 s, not home"):
            assert_home_before_empty(flight)
        assert modes(flight, "primary")[-2:] == [Mode.RETURNING, Mode.EMPTY]
        path = flight.paths["primary"]
        assert len({(x_m, y_m) for t_s, x_m, y_m in zip(path.t_s, path.x_m, path.y_m, strict=True) if t_s >= 60}) == 1

    def test_one_without_an_agent_circles_until_it_is_empty(self, tmp_path: Path) -> None:
        fleet = Fleet(BRIEF, folder=tmp_path, overrides={"vehicles.helper.endurance_s": 90, "mission.deadline_s": 120})
        fleet.kill("helper", at_s=40)
        flight = fleet.run()
        assert flight.summary["vehicles"]["helper"]["ended"] == "empty"
        assert flight.summary["vehicles"]["helper"]["ended_s"] == 90.0


class TestAHelper:
    @pytest.mark.parametrize("allocator", ["plan", "auction", "cbba", "greedy"])
    def test_it_comes_home_and_is_offered_nothing_more(self, tmp_path: Path, allocator: str) -> None:
        flight = flown(
            tmp_path,
            vehicles__helper__endurance_s=70,
            mission__deadline_s=150,
            coordinator__allocator=allocator,
        )
        assert_home_before_empty(flight, "helper")
        assert_all_finished(flight)
        assert_kept_apart(flight)
        ended_s = flight.summary["vehicles"]["helper"]["ended_s"]
        assert 20 < ended_s <= 63
        turned_s = next(one.begun_s for one in flight.activities if one.mode is Mode.RETURNING)
        asked = flight.said(Task, "coord/task/helper/*")
        assert [one for one in asked if one.message.action is TaskAction.TAKE and one.t_s > turned_s] == []
        assert not flight.summary["vehicles"]["primary"]["survey_cut_short"]


def test_the_command_has_exit_code_1_where_a_battery_runs_empty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = ("vehicles.primary.endurance_s=60", "vehicles.primary.home={x_m: 5000, y_m: 0}")
    sets = [word for one in changed for word in ("--set", one)]
    with pytest.raises(SystemExit) as ended:
        app_for(["run"])(
            ["run", str(BRIEF), "--bus", "local", "--no-record", "--out", str(tmp_path), "--anyway", *sets]
        )
    assert ended.value.code == 1
    told = capsys.readouterr()
    assert told.err.splitlines()[-1] == "primary: the battery was empty before it was home"
    assert "its battery was empty at 60 s, not home, its survey is not finished" in told.out
    assert json.loads((tmp_path / "summary.json").read_text())["vehicles"]["primary"]["battery_left"] == 0.0


def test_a_helper_that_has_never_left_home_rests_there(tmp_path: Path) -> None:
    fleet = Fleet(BRIEF, folder=tmp_path, overrides={"vehicles.helper.endurance_s": 20})
    flight = fleet.run()
    assert_home_before_empty(flight, "helper")
    assert modes(flight, "helper") == [Mode.IDLE, Mode.HOME]
    assert flight.paths["helper"].length_m == 0.0


@pytest.mark.parametrize("period_s", [None, 120])
@pytest.mark.parametrize("set_deg", [0, 135, 270])
def test_in_a_current_all_come_home_as_well(tmp_path: Path, set_deg: int, period_s: int | None) -> None:
    current: dict[str, Value] = {"set_deg": set_deg, "drift_mps": 3}
    if period_s is not None:
        current["period_s"] = period_s
    flight = flown(
        tmp_path,
        current=current,
        vehicles__primary__endurance_s=110,
        vehicles__helper__endurance_s=100,
        mission__deadline_s=200,
    )
    assert_home_before_empty(flight, "primary", "helper")
    if period_s is None:
        assert_kept_apart(flight)
    for name, endurance_s in (("primary", 110), ("helper", 100)):
        assert flight.summary["vehicles"][name]["ended_s"] <= 0.9 * endurance_s


def test_in_a_current_a_plan_tells_when_the_survey_ends(tmp_path: Path) -> None:
    # Tracks run north and south, 8 m/s through water that flows north at 4 m/s: 12 m/s and 4 m/s over the ground.
    flight = flown(tmp_path, current={"set_deg": 0, "drift_mps": 4})
    on_tracks = [one for one in flight.activities if one.vehicle == "primary" and one.mode is Mode.SURVEY]
    assert [one.ended_s - one.begun_s for one in on_tracks[:2]] == pytest.approx([100 / 12, 100 / 4], abs=0.01)
    (survey,) = planned_surveys(flight.scenario)
    assert survey.takes_s == pytest.approx(flight.summary["time"]["primary_s"], rel=0.01)
