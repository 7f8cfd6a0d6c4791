"""How often the truth lies where missions say that it does, from rows by hand."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.calibration import (
    Held,
    contact_table,
    goal_or_time_table,
    goal_table,
    main,
    plain_intervals,
    share_interval,
    table,
)


def row(left: int, low: int, high: int, **varied: Any) -> dict[str, Any]:
    truth = {"truth.targets": 200, "truth.left": left}
    told = {"risk.mean": 0.5, "mines.found": 60.0, "mines.left": 60.0, "mines.left_low": low, "mines.left_high": high}
    return {"failure": None, **truth, **told, **varied}


def test_a_line_for_each_combination_tells_how_often_the_interval_holds() -> None:
    rows = [row(60, 50, 70, rho=0.0), row(70, 50, 70, rho=0.0), row(71, 50, 70, rho=0.0), row(49, 50, 70, rho=0.0)]
    rows += [row(99, 50, 70, rho=1.0), {**row(1, 0, 9, rho=1.0), "failure": "node died"}]
    head, _, right, wrong = table(rows, ["rho"])
    assert head == "| `rho` | missions | left | told | within 90 % | 95 % of that | more left | fewer | plainly |"
    assert right == "| `0.0` | 4 | 62.5 | 60.0 | 50% | 15% to 85% | 1 | 1 | 100% |"
    assert wrong == "| `1.0` | 1 | 99.0 | 60.0 | 0% | 0% to 79% | 1 | 0 | 0% |"


def test_of_many_missions_the_share_is_told_to_a_tenth_of_a_per_cent() -> None:
    held = Held.of([row(60, 50, 70)] * 897 + [row(71, 50, 70)] * 60 + [row(49, 50, 70)] * 43)
    assert held.figures() == ["1000", "60.2", "60.0", "89.7%", "87.7% to 91.4%", "60", "43", "100.0%"]


def test_the_plain_interval_is_that_of_those_missed_for_each_one_found() -> None:
    (low, none), (high, no_more) = plain_intervals(np.array([10_000.0, 3.0]), np.array([1 / 3, 0.0]))
    # Of a third that is missed half a one for each one found, with a variance of a half over two thirds of them.
    assert (low + high) / 2 == pytest.approx(5_000, abs=2)
    assert high - low == pytest.approx(2 * 1.645 * (10_000 * 0.5 / (2 / 3)) ** 0.5, rel=0.01)
    assert (none, no_more) == (0, 0)


def test_missions_without_targets_or_without_a_look_tell_nothing() -> None:
    none = {**row(0, 0, 0), "truth.targets": 0}
    assert len(table([none, {**row(1, 0, 9), "mines.left": None}], [])) == 2


def test_the_interval_of_a_share_is_wilsons() -> None:
    assert share_interval(9, 10) == pytest.approx((0.5958, 0.9821), abs=1e-4)


def test_what_is_no_sweep_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 2
    assert "is not the folder of a sweep" in capsys.readouterr().err


def test_of_a_scenario_it_is_drawn_which_share_was_missed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "diagram.png"
    area, count = "area.polygon_m=[[0, 0], [300, 0], [300, 100], [0, 100]]", "targets.count=300"
    assert main(["--diagram", str(picture), "--missions", "2", "tellaro", area, count]) == 0
    told = re.fullmatch(r"missed (0\.\d+), predicted (0\.\d+), calibration error 0\.\d+; .*\n", capsys.readouterr().out)
    assert told is not None
    missed, predicted = map(float, told.groups())
    assert missed == pytest.approx(predicted, abs=0.1)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["--diagram", str(picture), "--missions", "2", "tellaro", "targets.count=-1"]) == 2
    assert "targets.count: -1 is not allowed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--diagram", "d.png", "--missions", "0", "tellaro"], "--missions: 0 is not allowed; must be at least 1\n"),
        (
            ["--diagram", "d.xyz", "tellaro"],
            "--diagram: d.xyz is not allowed; must end in .png, in a folder that is there\n",
        ),
        (
            ["--diagram", "no/d.png", "tellaro"],
            "--diagram: no/d.png is not allowed; must end in .png, in a folder that is there\n",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_anything_is_flown(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err == told


def test_of_goals_it_is_told_how_often_they_are_reached_and_are_so() -> None:
    goal: dict[str, Any] = {
        "failure": None,
        "goal.reached": True,
        "goal.true": True,
        "time.mission_s": 1000.0,
        "scenario": "tellaro",
    }
    rows = [goal, {**goal, "time.mission_s": 2000.0}, {**goal, "goal.true": False, "time.mission_s": 3000.0}]
    rows += [{**goal, "goal.reached": False, "overrides": ["a=1", "b=2"]}, {**goal, "goal.reached": None}]
    head, _, flown, other = goal_table(rows, ["scenario", "overrides"])
    assert head == "| `scenario` | `overrides` | missions | reached it | after, s | true | 95 % of that |"
    assert flown == "| `tellaro` | `-` | 3 | 3 | 2000 | 66.7% | 20.8% to 93.9% |"
    assert other == "| `tellaro` | `a=1` `b=2` | 1 | 0 | - | - | - |"
    assert goal_table([{**goal, "goal.reached": None}], ["scenario"]) == []


def test_missions_that_end_at_a_time_are_told_beside_those_that_end_with_their_goal() -> None:
    goal: dict[str, Any] = {"failure": None, "goal.reached": True, "goal.true": True, "time.mission_s": 1000.0}
    missed = {**goal, "goal.reached": False, "goal.true": False, "time.mission_s": 9000.0}
    at = {"overrides": ["mission.deadline_s=5000"], "goal.reached": False, "time.mission_s": 5000.0}
    rows = [goal, missed, {**goal, **at}, {**missed, **at}]
    head, _, with_goal, at_a_time = goal_or_time_table(rows, ["x"])
    assert head == "| `x` | `mission.deadline_s` | missions | after, s | true | 95 % of that |"
    assert with_goal == "| `-` | `-` | 1 | 1000 | 100.0% | 20.7% to 100.0% |"
    assert at_a_time == "| `-` | `5000` | 2 | 5000 | 50.0% | 9.5% to 90.5% |"


def test_of_contacts_it_is_told_how_right_the_list_of_mines_is() -> None:
    one: dict[str, Any] = {"failure": None, "risk.mean": 0.1, "truth.missed_share": 0.2, "truth.listed_share": 0.9}
    one |= {"truth.false_listed_per_km2": 1.0, "scenario": "clear", "overrides": ["x=1", "coordinator.contacts=true"]}
    other = {**one, "risk.mean": 0.2, "truth.listed_share": 0.8, "truth.false_listed_per_km2": 2.0}
    rows = [one, other, {**one, "truth.listed_share": None}]
    *_, line = contact_table(rows, ["scenario", "coordinator.contacts"])
    assert line == "| `clear` | `true` | 2 | 0.150 | 0.80 | 0.85 | 1.50 |"
