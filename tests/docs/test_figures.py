"""The tables of the docs that missions were flown for: they tell what is kept, and a mission of each still leaves
that."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import pytest

from bench import clearance_tables, figures, flown
from bench.calibration import UNTIL
from bench.clearance_tables import reliability_lines
from bench.figures import TABLES, compared_kept, written
from bench.flown import ROOT, Case, Mission, Table, kept
from bench.link_tables import linked_kept
from bench.rows import by
from secondlook.compare.paired import interval_of_mean
from secondlook.launch.run_display import mines_left_words
from secondlook.sweeps.rows import flat
from secondlook.testing import Fleet


@pytest.mark.parametrize("name", TABLES)
def test_a_page_has_the_table_that_what_is_kept_makes(name: str) -> None:
    page = ROOT / TABLES[name].page
    assert written(name) == page.read_text(), f"{TABLES[name].page} is stale: python -m bench.figures"


@pytest.mark.parametrize("name", TABLES)
def test_a_mission_of_it_still_leaves_what_is_kept(name: str, tmp_path: Path) -> None:
    mission = TABLES[name].first(kept(name))
    fleet = Fleet(mission.scenario, overrides=mission.overrides, seed=mission.seed, folder=tmp_path, record=False)
    row = flat(fleet.run().summary)
    left = {name: round(row[name], 3) for name in mission.left}
    kept_of_it = {name: round(value, 3) for name, value in mission.left.items()}
    assert left == kept_of_it, f"stale: python -m bench.figures --fly {name}"


def test_what_is_declared_to_be_flown_is_what_is_kept() -> None:
    declared = {
        "clearance": Counter(dict.fromkeys(clearance_tables.CALIBRATED, 40)),
        "few-mines": Counter(dict.fromkeys(clearance_tables.FEW, clearance_tables.FEW_MISSIONS)),
        "goals": Counter(dict(clearance_tables.GOALS)),
        "goals-by": Counter(dict.fromkeys(clearance_tables.GOALS_BY, 20)),
        "goal-or-time": Counter(dict.fromkeys(clearance_tables.GOAL_OR_TIME, 40)),
        "intervals": Counter(dict.fromkeys((case for case, _ in clearance_tables.MANY_TIMES), 1)),
        "reliability": Counter(
            {(one, (clearance_tables.RELIABLE_TARGETS, *told.split())): 1 for one, told in clearance_tables.RELIABLE}
        ),
    }
    for name, cases in declared.items():
        assert Counter(case_of(row) for row in kept(name)["rows"]) == cases, name
    missions = {case_of(row): row["held"]["missions"] for row in kept("intervals")["rows"]}
    assert missions == dict(clearance_tables.MANY_TIMES)


def case_of(row: dict[str, Any]) -> Case:
    """What a row's mission was flown with."""
    return row["scenario"], tuple(row["overrides"])


def test_what_pages_say_beside_tables_is_what_is_kept() -> None:
    missions = by(kept("helpers")["rows"], ("p_detect",), "risk.mean")
    alone, left = (fmean(row[name] for row in missions["0.7",]) for name in ("risk_primary_alone.mean", "risk.mean"))
    assert f"a chance of {alone:.2f} where the primary is alone, and of {left:.2f} where" in words_of("README.md")
    better, worse = (np.array([row["risk.worst30_mean"] for row in missions[p,]]) for p in ("0.485", "0.7"))
    low, high = interval_of_mean(worse - better)
    less = f"it is {(worse - better).mean():.3f} less (95 % {low:.3f} to {high:.3f})"
    assert less in words_of("docs/scenarios.md")
    _, scenario, _, missed, predicted, *_ = (
        cell.strip() for cell in reliability_lines(kept("reliability"))[2].split("|")
    )
    assert scenario == "`tellaro`"
    assert f"missed {missed}, predicted {predicted}" in words_of("docs/paper.md")
    errors = by(kept("position-errors")["rows"], ("position_error_m",), "true.mean")["20",]
    too_little = fmean(row["true.mean"] - row["risk.mean"] for row in errors)
    assert f"at 20 m it tells {too_little:.3f} too little" in words_of("docs/faults.md")


def test_what_a_page_says_beside_the_table_of_contacts_is_what_is_kept() -> None:
    page = words_of("docs/clearance.md")
    missions = by(kept("contacts")["rows"], clearance_tables.CONTACT_COLUMNS, "truth.listed_share")
    alone, asked = missions["clear", "false", "-", "-"], missions["clear", "true", "-", "-"]
    means = {
        name: [fmean(row[name] for row in rows) for rows in (asked, alone)]
        for name in ("truth.listed_share", "truth.false_listed_per_km2", "risk.mean")
    }
    (listed, not_so), (false, more), (risk, less) = means.values()
    assert false < more
    told = f"{listed:.2f} are listed and not {not_so:.2f}, and less falsely; they cost {risk - less:.3f} of residual"
    assert told in page
    for name, words, at in (
        ("truth.listed_share", "shares are known to within {:.2f}", 100),
        ("truth.false_listed_per_km2", "false ones to within {:.1f} a km²", 10),
    ):
        ends = [interval_of_mean(np.array([row[name] for row in rows])) for rows in missions.values()]
        assert words.format(math.ceil(max(high - low for low, high in ends) / 2 * at) / at) in page


def test_intervals_hold_what_pages_say_that_they_do() -> None:
    held = [row["held"] for row in kept("intervals")["rows"]]
    ours = [1 - (one["more"] + one["fewer"]) / one["missions"] for one in held]
    plain = [one["plainly"] / one["missions"] for one in held]
    assert all(abs(share - 0.9) <= 0.02 for share in (*ours[:2], *plain[:3]))
    many = f"it holds {100 * plain[0]:.1f} % of 10,000 missions and ours {100 * ours[0]:.1f} %"
    told_wrong = f"the plain one holds {100 * plain[3]:.0f} % and ours {100 * ours[3]:.0f} %"
    small = f"{100 * ours[2]:.0f} % are held for 90, where the plain one holds {100 * plain[2]:.0f}."
    decision = words_of("docs/decisions/0041-not-knowing-p-of-y-widens-the-interval.md")
    assert [words for words in (many, told_wrong, small) if words not in decision] == []
    assert f"Of 10,000 missions {100 * ours[0]:.1f} % have" in words_of("CHANGELOG.md")


def test_goals_are_as_often_true_as_a_page_says_beside_their_table() -> None:
    reached = [row for row in kept("goals")["rows"] if row["goal.reached"]]
    asked = [row["goal.true"] for row in reached if not any("chance: 0.8" in one for one in row["overrides"])]
    lanes = [row["goal.true"] for row in reached if any("kind: lane" in one for one in row["overrides"])]
    told = f"Of the {len(asked)} missions that told 90 %, {100 * fmean(asked):.1f} % were right"
    assert f"{told}, of those with a lane {100 * fmean(lanes):.1f} %." in words_of("docs/clearance.md")
    assert fmean(asked) >= 0.9


def test_goals_are_reached_as_soon_as_a_page_says_beside_those_who_decide_otherwise() -> None:
    soonest = 0
    for scenario, overrides in clearance_tables.REACHED:
        ours, *others = (
            clearance_tables.goal_s(kept("goals-by"), (scenario, (*overrides, *deciding)))
            for deciding in clearance_tables.DECIDING.values()
        )
        soonest += ours <= min(others)
        assert ours < 1.01 * min(others)
    assert soonest == 3
    assert "It is the soonest on three of the five" in words_of("docs/clearance.md")


def test_a_time_is_as_right_as_a_page_says_where_it_was_found_and_less_elsewhere() -> None:
    missions = by(kept("goal-or-time")["rows"], ("p_detect", "targets.count", UNTIL), "goal.true")
    cleared = "mission.deadline_factor=2", "mission.goal={kind: cleared, clearance: 0.9}"
    found_s = [row["time.mission_s"] for row in kept("goals")["rows"] if case_of(row) == ("two-helpers", cleared)]
    assert round(fmean(found_s)) == 4914
    found, few, blind = ("-", "-"), ("-", "20"), ("0.5", "-")
    true_with, true_at = (
        {water: fmean(row["goal.true"] for row in missions[*water, until]) for water in (found, few, blind)}
        for until in ("-", "4915")
    )
    assert (true_at[few], true_at[blind]) == (0.85, 0.0)
    often = f"is so in {40 * true_at[found]:.0f} of 40 missions, and in {40 * true_with[found]:.0f} with the goal"
    assert often in words_of("docs/clearance.md")
    assert min(true_with.values()) >= 0.9
    later_s = [fmean(row["time.mission_s"] for row in missions[*water, "-"]) - 4915 for water in (found, few, blind)]
    assert [round(one, -2) for one in later_s] == [0, 900, 3200]
    assert "as there is more chance in few; with helpers that see less, in none" in words_of("docs/clearance.md")


def test_what_a_mission_is_shown_to_say_of_the_mines_left_is_what_it_says(tmp_path: Path) -> None:
    summary = Fleet("tellaro", folder=tmp_path, record=False).run().summary
    page = (ROOT / "docs/clearance.md").read_text()
    assert f"`secondlook run tellaro --bus local`:\n\n    mines left     {mines_left_words(summary['mines'])}\n" in page


def words_of(page: str) -> str:
    """A page's text without line breaks."""
    return " ".join((ROOT / page).read_text().split())


def test_a_table_is_put_in_the_place_of_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(flown, "KEPT", tmp_path)
    mission = Mission("toy", (), 1, {"risk.mean": 0.5})
    table = Table("page.md", lambda _: {}, lambda document: ["| a |", f"| {document['a']} |"], lambda _: mission)
    monkeypatch.setitem(figures.TABLES, "toy", table)
    (tmp_path / "toy.json").write_text('{"a": 2}')
    (tmp_path / "page.md").write_text("Before.\n\n<!-- figures: toy -->\n\n| a |\n| 1 |\n| 3 |\n\nAfter.\n")
    assert written("toy") == "Before.\n\n<!-- figures: toy -->\n\n| a |\n| 2 |\n\nAfter.\n"
    (tmp_path / "page.md").write_text("No place.\n")
    with pytest.raises(ValueError, match=r"page\.md: there is no line <!-- figures: toy -->"):
        written("toy")


def test_broken_off_it_goes_on_with_what_was_flown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "UNDER_WAY", tmp_path / "under way")
    monkeypatch.setattr(flown, "KEPT", tmp_path / "kept")
    found = []

    def fly(folder: Path) -> dict[str, int]:
        found.append([one.name for one in folder.iterdir()])
        (folder / "a sweep").mkdir(exist_ok=True)
        if len(found) == 1:
            raise KeyboardInterrupt
        return {"a": 2}

    table = Table("page.md", fly, lambda document: ["| a |", f"| {document['a']} |"], lambda _: Mission("", (), 1, {}))
    monkeypatch.setattr(figures, "TABLES", {"toy": table})
    (tmp_path / "page.md").write_text("<!-- figures: toy -->\n\n| a |\n| 1 |\n")
    with pytest.raises(KeyboardInterrupt):
        figures.main(["--fly", "toy"])
    figures.main(["--fly", "toy"])
    assert found == [[], ["a sweep"]]
    assert "| 2 |" in (tmp_path / "page.md").read_text()
    assert list((tmp_path / "under way").iterdir()) == []


def test_a_comparison_that_was_broken_off_is_flown_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mission = {"contender": "plan", "seed": 1001, "at_end": {"mean": 0.5, "worst30_mean": 0.5}}
    told = {"scenario": "toy", "objective": "both", "contenders": [], "missions": [mission]}

    def compare(*words: str) -> None:
        out = Path(words[-1])
        out.mkdir()  # the command takes a new folder alone, or an empty one
        (out / "compare.json").write_text(json.dumps(told))

    monkeypatch.setattr(figures, "COMPARED", ("toy",))
    monkeypatch.setattr(figures, "call_secondlook", compare)
    assert [figures._fly_compared(tmp_path) for _ in range(2)] == [{"comparisons": [compared_kept(told)]}] * 2


def test_what_is_kept_is_rounded_and_no_more_than_tables_need() -> None:
    pair = {"both": {"difference": 0.123456789, "better": 1}}
    contender: dict[str, Any] = {"name": "plan", "mean_end": {"mean": 1 / 3}, "worst30_mean_end": {"mean": 2 / 3}}
    contender |= {"against_first": pair, "served": {"mean": 1.0}}
    mission = {"contender": "plan", "seed": 1001, "at_end": {"mean": 1 / 3, "worst30_mean": 0.5}, "digest": "ab"}
    told = {"scenario": "toy", "objective": "both", "contenders": [contender], "missions": [mission, mission]}
    found = compared_kept(told)
    assert found["contenders"][0]["against_first"] == {"both": {"difference": 0.123457, "better": 1}}
    assert "served" not in found["contenders"][0]
    assert found["first"] == {"contender": "plan", "seed": 1001, "at_end": {"mean": 0.333333, "worst30_mean": 0.5}}


def test_of_a_sweep_the_figures_that_shares_are_reckoned_from() -> None:
    row = {"seed": 1, "failure": None, "link.profile": "janus", "coordinator.platform": "ship", "digest": "ab"}
    row |= {"link.also": "-"}
    figures_of_it = {"risk.mean": 1 / 3, "link.bytes_per_s": 1.0, "link.age.helper.mean_s": None, "time.wall_s": 3.0}
    (found,) = linked_kept("toy", [row | figures_of_it])
    assert found == {
        "scenario": "toy", "seed": 1, "failure": None, "link.profile": "janus", "link.also": "-",
        "coordinator.platform": "ship", "link.bytes_per_s": 1.0, "risk.mean": 0.333333, "link.age.helper.mean_s": None,
    }  # fmt: skip
