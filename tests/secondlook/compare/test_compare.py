"""`secondlook compare`: who is compared, what the missions come to, and the command as a user calls it."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from called import Call
from flights import BRIEF, until
from results import result
from rich.console import Console

from secondlook.compare.flights import (
    BASELINES,
    Baseline,
    Contender,
    Failure,
    Flown,
    Result,
    Risk,
    contenders,
    equal_vehicle_seconds,
    fly,
)
from secondlook.compare.plot import _lines
from secondlook.compare.standings import Standing, failures, standings, table
from secondlook.engine.engine import EngineError
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario
from secondlook.scenario.plug_ins import ALLOCATOR


class TestWhoIsCompared:
    def test_without_names_the_scenarios_own_allocator_comes_first_and_the_baselines_last(self) -> None:
        names = [one.name for one in contenders(load_scenario("tellaro", ["coordinator.allocator=none"]))]
        assert names[0] == "none"
        assert names[-len(BASELINES) :] == list(BASELINES)
        assert set(names) == {*ALLOCATOR.ours, *BASELINES}

    @pytest.mark.parametrize(
        ("name", "strips"), [("lawnmower", "lanes"), ("across", "lanes_across"), ("beforehand", "beforehand")]
    )
    def test_those_that_are_told_nothing_have_the_same_fleet_and_time(self, name: str, strips: str) -> None:
        scenario = load_scenario("two-helpers")
        (blind,) = contenders(scenario, [name])
        coordinator = scenario.coordinator.model_copy(update={"strips": strips})
        assert blind.told_nothing
        assert blind.scenario == scenario.model_copy(update={"coordinator": coordinator})

    def test_a_second_survey_is_flown_by_the_primaries_across_their_tracks(self) -> None:
        (second,) = contenders(load_scenario("two-helpers"), ["second_survey"])
        assert not second.told_nothing  # its mission ends later
        assert second.scenario.survey_vehicles["primary"].revisits
        assert not second.scenario.revisit_vehicles
        assert second.scenario.coordinator.strips == "lanes_across"
        assert second.scenario.mission.deadline_factor == pytest.approx(3.1)

    def test_an_allocator_changes_nothing_else(self) -> None:
        scenario = load_scenario("tellaro")
        (none,) = contenders(scenario, ["none"])
        coordinator = scenario.coordinator.model_copy(update={"allocator": "none"})
        assert none.with_seed(5) == scenario.model_copy(update={"coordinator": coordinator, "seed": 5})

    def test_the_baselines_have_no_helper_and_primaries_that_revisit(self) -> None:
        scenario = load_scenario("two-helpers", ["coordinator.allocator=none"])
        equal_end, longer = contenders(scenario, ["self", "self-longer"])
        for one in (equal_end.scenario, longer.scenario):
            assert {name: vehicle.role for name, vehicle in one.vehicles.items()} == {"primary": "survey"}
            assert one.survey_vehicles["primary"].revisits
            assert one.coordinator.allocator == "greedy"  # none would let them do nothing
        assert equal_end.scenario.mission.deadline_factor == 1.05
        # A primary for T and two helpers for 1.05 T each are 3.1 T of one primary.
        assert longer.scenario.mission.deadline_factor == pytest.approx(3.1)
        limits_s = [one.scenario.mission.time_limit_s for one in (equal_end, longer)]
        assert limits_s[1] == pytest.approx(limits_s[0] * 3.1 / 1.05)  # else the limit would end what takes longer

    def test_vehicle_seconds_are_shared_by_all_primaries(self) -> None:
        assert equal_vehicle_seconds(load_scenario("wide")) == pytest.approx(1 + 1.05 * 8 / 3)

    def test_by_the_clock_primaries_alone_have_the_fleets_time_until_the_deadline(self) -> None:
        settings = ["mission.deadline_factor=null", "mission.deadline_s=8000"]
        (longer,) = contenders(load_scenario("two-helpers", settings), ["self-longer"])
        mission = longer.scenario.mission
        assert (mission.deadline_s, mission.deadline_factor, mission.time_limit_s) == (24_000, None, 24_000)

    def test_an_unknown_name_is_told_with_those_that_are_known(self) -> None:
        with pytest.raises(
            UserError, match=r"^--allocators: nobody is not allowed; must be .*greedy.* or second_survey$"
        ):
            contenders(load_scenario("tellaro"), ["nobody"])

    def test_a_name_given_twice_is_told(self) -> None:
        with pytest.raises(UserError, match=r"^--allocators: greedy is not allowed twice$"):
            contenders(load_scenario("tellaro"), ["greedy", "none", "greedy"])

    @pytest.mark.parametrize("strips", ["lanes", "lanes_across", "beforehand"])
    def test_a_scenario_in_which_allocators_decide_nothing_is_refused(self, strips: str) -> None:
        scenario = load_scenario("tellaro", [f"coordinator.strips={strips}"])
        for names in ([], ["none"], ["lawnmower"], ["plan", "self"]):
            with pytest.raises(UserError, match=rf"^coordinator\.strips: {strips} is not allowed in a comparison, .*"):
                contenders(scenario, names)

    def test_a_coordinator_that_would_decide_for_all_contenders_is_refused(self) -> None:
        node = "coordinator.coordinator:Coordinator"
        with pytest.raises(UserError, match=rf"^coordinator\.node: {node} is not allowed in a comparison, .*"):
            contenders(load_scenario("tellaro", [f"coordinator.node={node}"]), ["plan", "none"])

    @pytest.mark.parametrize("goal", ["{kind: cleared, clearance: 0.5}", "{kind: none_left}"])
    def test_a_mission_that_ends_when_its_goal_is_reached_is_refused(self, goal: str) -> None:
        with pytest.raises(UserError, match=r"^mission\.goal: is not allowed in a comparison, .*goal=null$"):
            contenders(load_scenario("tellaro", [f"mission.goal={goal}"]))
        contenders(load_scenario("tellaro", [f"mission.goal={goal}", "mission.goal=null"]))


FLOWN: Flown = {
    "first": {1: result(1, 0.40), 2: result(2, 0.50), 3: result(3, 0.30)},
    "other": {1: result(1, 0.42, worse=0.1), 2: result(2, 0.46), 3: Failure(3, "it failed")},
    "equal": {1: result(1, 0.40)},
    "nothing yet": {},
}


class TestStandings:
    def test_mean_and_deviation_by_hand(self) -> None:
        first, other, equal = standings(FLOWN)
        assert (first.name, first.flown, first.failed) == ("first", 3, 0)
        assert (first.mean_105.mean, first.mean_105.deviation) == pytest.approx((0.4, 0.1))
        assert first.worst30_mean.mean == pytest.approx(0.6)
        assert first.removed_m2.mean == pytest.approx(30)
        assert (other.mean_end.mean, other.mean_end.deviation) == pytest.approx((0.44, 0.04 / math.sqrt(2)))
        assert equal.mean.deviation == 0

    def test_each_is_compared_with_the_first_by_every_objective(self) -> None:
        first, other, equal = standings(FLOWN)
        assert first.against_first == {}
        assert set(other.against_first) == {"mean", "worst30", "both", "targets"}
        assert (other.against_first["mean"].better, other.against_first["mean"].worse) == (1, 1)
        assert (other.against_first["worst30"].better, other.against_first["worst30"].worse) == (2, 0)
        assert equal.against_first["mean"].difference == 0

    def test_targets_are_told_where_there_are_any(self) -> None:
        flown: Flown = {"first": {1: result(1, 0.4, found=0.5), 2: result(2, 0.4, found=0.7)}}
        (one,) = standings(flown)
        assert one.targets_found is not None
        assert one.targets_expected is not None
        assert (one.targets_found.mean, one.targets_expected.mean) == pytest.approx((0.6, 0.5))
        (none,) = standings({"first": {1: result(1, 0.4, found=None, expected=None)}})
        assert (none.targets_found, none.targets_expected) == (None, None)

    def test_the_risk_within_each_priority_is_told(self) -> None:
        flown: Flown = {
            "first": {
                1: replace(result(1, 0.4), in_priorities=(0.2, None)),
                2: replace(result(2, 0.4), in_priorities=(0.3, None)),
            }
        }
        stood = standings(flown)
        spread, none = stood[0].in_priorities
        assert none is None
        assert spread is not None
        assert (spread.mean, spread.deviation) == pytest.approx((0.25, 0.1 / math.sqrt(2)))
        assert columns(stood)[3:5] == ["priority 1", "priority 2"]
        told = table(stood, "", "mean")
        assert [list(column.cells) for column in told.columns[3:5]] == [["0.250"], [""]]

    def test_what_failed_is_counted_and_told(self) -> None:
        assert standings(FLOWN)[1].failed == 1
        assert failures(FLOWN) == ["other, seed 3: it failed"]

    def test_columns_that_say_nothing_are_left_out(self) -> None:
        alone = standings({"first": FLOWN["first"]})
        assert columns(alone) == [
            "",
            "mean risk",
            "worst 30 %",
            "targets expected",
            "targets found",
            "seen again",
        ]
        assert columns(standings({"first": {1: result(1, 0.4, found=None, expected=None)}})) == [
            "", "mean risk", "worst 30 %", "seen again",
        ]  # fmt: skip
        assert columns(standings(FLOWN))[6:] == [
            "mean: above the first's", "worst 30 %: above the first's", "better, worse", " failed",
        ]  # fmt: skip
        longer = standings({"first": {1: result(1, 0.4)}, "other": {1: result(1, 0.4, ends_at=2)}})
        assert "ends at" in columns(longer)

    def test_a_row_by_hand(self) -> None:
        flown: Flown = {
            "first": {seed: result(seed, 0.4) for seed in range(1, 7)},
            "other": {seed: result(seed, 0.44, worse=0.1) for seed in range(1, 7)},
        }
        stood = standings(flown)
        assert cells(stood, "mean") == [
            "other", "0.440", "0.540", "0.500", "0.600", "3.0",
            "+0.040 (+0.040, +0.040)", "-0.060 (-0.060, -0.060)", "0, 6",
        ]  # fmt: skip
        assert cells(stood, "worst30")[-1] == "6, 0"
        assert cells(stood, "targets")[-2:] == ["+0.000 (+0.000, +0.000)", "0, 0"]

    def test_a_table_of_all_that_are_bundled_is_no_wider_than_120_characters(self) -> None:
        names = [one.name for one in contenders(load_scenario("tellaro"))]
        flown: Flown = {
            name: {seed: result(seed, 0.4 + 0.1 * place, ends_at=1.05 + place) for seed in range(1, 51)}
            for place, name in enumerate(names)
        }
        assert Console(width=500).measure(table(standings(flown), "", "mean")).maximum <= 120
        assert Console(width=500).measure(table(standings(flown), "", "both")).maximum <= 120


def columns(stood: list[Standing]) -> list[str]:
    return [str(column.header).replace("\n", " ") for column in table(stood, "", "mean").columns]


def cells(stood: list[Standing], objective: str) -> list[str]:
    """Of the last line."""
    return [str(list(column.cells)[-1]) for column in table(stood, "", objective).columns]


def test_a_mission_is_flown_as_by_run(tmp_path: Path) -> None:
    scenario = load_scenario(BRIEF)
    summary = run_mission(scenario, RunOptions(tmp_path, bus="local", record=False))
    flown = fly(scenario)
    assert isinstance(flown, Result)
    assert flown.digest == summary["digest"]
    assert (flown.at_end.mean, flown.served) == (summary["risk"]["mean"], summary["hotspots"]["revisited"])
    assert flown.targets_found == 1 - summary["truth"]["missed_share"]
    assert flown.targets_expected == 1 - summary["truth"]["predicted_missed_share"]
    removed = summary["risk_primary_alone"]["mean"] - summary["risk"]["mean"]
    assert flown.removed_m2 == pytest.approx(removed * summary["risk"]["cells"] * 25)
    assert [risk.t_s for risk in flown.over_time] == sorted(risk.t_s for risk in flown.over_time)


@pytest.fixture
def command(called: Call) -> Call:
    """`secondlook compare` in this process."""
    return partial(called, "compare")


@pytest.fixture
def by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missions by hand in place of flown ones."""

    def fly_all(chosen: object, seeds: object, engine: object, flown: Flown, progress: Callable[[Flown], None]) -> None:
        flown.update(FLOWN)
        progress(flown)

    monkeypatch.setattr("secondlook.commands.compare.fly_all", fly_all)


class TestCommand:
    def test_missions_are_flown_in_processes_and_written(self, command: Call, tmp_path: Path) -> None:
        arguments = ("--allocators", "greedy,none", "--seeds", "2", "--jobs", "2", "--out", str(tmp_path / "out"))
        code, out, err = command(str(BRIEF), *arguments)
        assert (code, err) == (0, "")  # and no progress in a pipe
        assert "brief, seeds 1 to 2" in out
        written = json.loads((tmp_path / "out" / "compare.json").read_text())
        assert [(one["contender"], one["seed"]) for one in written["missions"]] == [
            ("greedy", 1), ("greedy", 2), ("none", 1), ("none", 2),
        ]  # fmt: skip
        greedy, none = written["contenders"]
        assert greedy["removed_m2"]["mean"] > none["removed_m2"]["mean"] == 0
        assert none["against_first"]["mean"]["worse"] == 2
        assert (written["objective"], written["reacting"]) == ("both", None)
        assert (tmp_path / "out" / "risk.png").read_bytes().startswith(b"\x89PNG")

    def test_json_alone_is_printed(self, command: Call, by_hand: None) -> None:
        code, out, _ = command("--json")
        assert code == 1  # a mission failed
        assert [one["name"] for one in json.loads(out)["contenders"]] == ["first", "other", "equal"]

    def test_a_mission_that_run_refuses_is_compared_with_a_remark(self, command: Call, by_hand: None) -> None:
        _, out, err = command("--json", "--set", "vehicles.primary.endurance_s=1000")
        assert json.loads(out)["contenders"]
        remark, *failed = err.splitlines()
        assert remark.startswith("vehicles.primary.endurance_s: 1000 s ends its survey after about 1 of 8 tracks")
        assert failed == ["other, seed 3: it failed"]

    def test_a_mission_that_fails_is_told_and_counted_and_the_others_are_compared(
        self, command: Call, by_hand: None
    ) -> None:
        code, out, err = command()
        assert (code, err) == (1, "other, seed 3: it failed\n")
        judged = "0.7 times the mean residual risk and 0.3 times the worst 30 %'s"
        assert out.startswith(f"tellaro, seeds 1 to 10, judged by {judged} when the mission ends\n")
        assert out.splitlines()[1] == "It ends at 1.05 times the survey's duration at the latest."
        assert "failed" in out
        assert "0.440" in out

    @pytest.mark.parametrize(
        ("objective", "what", "better"),
        [("mean", "the mean residual risk", "2, 4"), ("targets", "the share of targets expected to be found", "5, 1")],
    )
    def test_they_are_judged_by_the_objective_that_was_chosen(
        self, command: Call, monkeypatch: pytest.MonkeyPatch, objective: str, what: str, better: str
    ) -> None:
        # The other leaves less on 2 of 6 seeds, and is expected to find more on 5.
        def fly_all(chosen: object, seeds: range, engine: object, flown: Flown, progress: object) -> None:
            flown["plan"] = {seed: result(seed, 0.4, expected=0.5) for seed in seeds}
            flown["greedy"] = {
                seed: result(seed, 0.3 if seed <= 2 else 0.5, expected=0.6 if seed <= 5 else 0.4) for seed in seeds
            }

        monkeypatch.setattr("secondlook.commands.compare.fly_all", fly_all)
        arguments = ("--allocators", "plan,greedy", "--seeds", "6", "--set", f"coordinator.objective={objective}")
        _, out, _ = command(*arguments)
        assert f"judged by {what} when the mission ends\n" in out
        assert next(line for line in out.splitlines() if line.startswith("greedy")).endswith(better)
        _, out, _ = command(*arguments, "--json")
        assert json.loads(out)["objective"] == objective

    def test_the_deadline_is_told_as_the_scenario_has_it(self, command: Call, by_hand: None) -> None:
        _, out, _ = command("--set", "mission.deadline_factor=null", "--set", "mission.deadline_s=3000")
        assert out.splitlines()[1] == "It ends at 3000 s at the latest."

    def test_seeds_are_flown_from_the_first_one(self, command: Call, monkeypatch: pytest.MonkeyPatch) -> None:
        told: list[int] = []

        def fly_all(chosen: object, seeds: range, engine: object, flown: Flown, progress: object) -> None:
            told.extend(seeds)
            flown["none"] = {seed: result(seed, 0.4) for seed in seeds}

        monkeypatch.setattr("secondlook.commands.compare.fly_all", fly_all)
        code, out, err = command("--allocators", "none", "--seeds", "3", "--first-seed", "1001")
        assert (code, err, told) == (0, "", [1001, 1002, 1003])
        assert "seeds 1001 to 1003" in out

    def test_a_line_under_the_table_says_whether_reacting_was_worth_it(
        self, command: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fly_all(chosen: list[Contender], seeds: range, engine: object, flown: Flown, progress: object) -> None:
            ends = {"plan": 0.3, "greedy": 0.2, "blind": 0.4}
            flown.update({one.name: {seed: result(seed, ends[one.name]) for seed in seeds} for one in chosen})

        blind = Baseline(lambda scenario, data: None, told_nothing=True)
        monkeypatch.setattr("secondlook.compare.flights.BASELINES", {**BASELINES, "blind": blind})
        monkeypatch.setattr("secondlook.commands.compare.fly_all", fly_all)
        _, out, _ = command("--allocators", "plan,greedy,blind", "--seeds", "6")
        assert out.splitlines()[-1].startswith(
            "reacting was worth it: plan leaves 0.360, 0.100 less than blind (95 %: "
        )
        _, out, _ = command("--allocators", "plan,greedy,blind", "--seeds", "6", "--json")
        assert json.loads(out)["reacting"]["worth"] is True
        _, out, _ = command("--allocators", "plan,greedy", "--seeds", "6")
        assert "reacting" not in out

    @pytest.mark.parametrize(
        ("raised", "told"),
        [
            (KeyboardInterrupt(), "interrupted after 1 of 2 missions\n"),
            (EngineError("the scheduler is gone"), "the scheduler is gone, after 1 of 2 missions\n"),
        ],
        ids=["interrupted", "lost"],
    )
    def test_what_was_flown_before_an_end_too_early_is_told(
        self, command: Call, monkeypatch: pytest.MonkeyPatch, raised: BaseException, told: str
    ) -> None:
        def fail(chosen: object, seeds: object, jobs: object, flown: Flown, progress: Callable[[Flown], None]) -> None:
            flown["greedy"] = {1: result(1, 0.4)}
            progress(flown)
            raise raised

        monkeypatch.setattr("secondlook.commands.compare.fly_all", fail)
        code, out, err = command("--allocators", "greedy,none", "--seeds", "1")
        assert (code, err) == (1, told)
        assert "0.400" in out

    def test_a_part_that_raises_fails_its_missions_alone(self, command: Call, users_folder: Path) -> None:
        part = "class Fails:\n    def assign(self, situation):\n        raise ValueError\n"
        (users_folder / "mine.py").write_text(part)
        code, out, err = command(str(BRIEF), "--allocators", "none,mine:Fails", "--seeds", "1", "--jobs", "1")
        assert code == 1
        assert err.startswith("mine:Fails, seed 1: coordinator")
        assert "none" in out

    def test_without_matplotlib_one_sentence_says_what_is_missing(
        self, command: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        find = importlib.util.find_spec
        monkeypatch.setattr(
            "secondlook.commands.compare.find_spec", lambda name: None if name == "matplotlib" else find(name)
        )
        code, out, err = command("--out", str(tmp_path / "out"))
        assert (code, out) == (2, "")
        assert err == "--out: the plot needs matplotlib, not installed here; the extra secondlook[plots] has it\n"


def test_of_two_at_once_into_one_folder_the_second_is_refused(command: Call, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = subprocess.Popen(
        [Path(sys.executable).with_name("secondlook"), "compare", BRIEF, "--seeds", "500", "--jobs", "1", "--out", out],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    try:
        assert until(lambda: any(tmp_path.glob("*/secondlook-*/scenario.yaml")), 60)
        code, printed, err = command(str(BRIEF), "--seeds", "1", "--out", str(out))
    finally:
        first.send_signal(signal.SIGINT)
        assert first.wait(30) == 1
    assert (code, printed) == (2, "")
    assert err == f"--out {out}: another process writes to it already; must be another folder\n"


def test_ctrl_c_ends_it_with_a_sentence_and_leaves_no_process_and_no_file(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [Path(sys.executable).with_name("secondlook"), "compare", BRIEF, "--seeds", "500", "--jobs", "2"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
        start_new_session=True,
    )
    try:
        assert until(lambda: any(tmp_path.glob("*/secondlook-*/scenario.yaml")), 60)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == 1
    assert err.startswith("interrupted after ")
    assert err.endswith(" missions\n")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
    assert until(lambda: not _processes_with(f"TMPDIR={tmp_path}"))


def _processes_with(setting: str) -> list[Path]:
    """Those whose environment begins an entry so."""
    found = []
    for environment in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            if f"\0{setting}" in environment.read_text(errors="replace"):
                found.append(environment.parent)
    return found


def test_lines_of_missions_that_ended_earlier_stay_as_they_were() -> None:
    shares, lines = _lines([result(1, 0.4, ends_at=1.05), replace(result(2, 0.3), at_end=Risk(2000, 0.3, 0.5))], "mean")
    assert (shares[0], shares[-1]) == (0, 2)
    assert lines[:, 0].tolist() == [1, 1]
    assert lines[:, -1].tolist() == [0.4, 0.3]
