"""Storms made small: what is not needed for the same not to hold goes, and what is needed stays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from planner.fleet_map import VehicleLayer
from secondlook.cli import app_for
from secondlook.errors import UserError
from secondlook.scenario import load_scenario
from secondlook.storm.campaign import storm_of
from secondlook.storm.fly import fly_storm
from secondlook.storm.plan_edits import edited, leave_out_vehicle, plain, without_keys
from secondlook.storm.shrink import broken_rules, fewest, is_alike, shrink, violations_of
from secondlook.storm.witness import Violation
from secondlook.testing.plan import TroublePlan, load_plan, make_plan

BRIEF = load_scenario(Path(__file__).parents[2] / "support" / "brief.yaml")


def losses(count: int) -> TroublePlan:
    """The brief mission with so many faults, none like another."""
    trouble = [{"what": "drop", "keys": "**", "from_s": float(place), "for_s": 50.0} for place in range(count)]
    return make_plan({"scenario": BRIEF, "trouble": trouble})


@given(st.lists(st.integers(), unique=True, max_size=40), st.data())
def test_of_items_those_without_which_it_does_not_fail_are_left(items: list[int], data: st.DataObject) -> None:
    needed = data.draw(st.sets(st.sampled_from(items)) if items else st.just(set()))
    assert fewest(items, lambda left: needed <= set(left)) == [one for one in items if one in needed]


@given(st.integers(2, 30), st.data())
@settings(max_examples=5, deadline=None)
def test_two_faults_that_are_needed_are_left_and_no_other(count: int, data: st.DataObject) -> None:
    plan = losses(count)
    needed = set(data.draw(st.lists(st.sampled_from(plan.trouble), min_size=2, max_size=2, unique=True)))
    asked: list[TroublePlan] = []

    def fails(tried: TroublePlan) -> bool:
        asked.append(tried)
        return needed <= set(tried.trouble)

    found = shrink(plan, fails, most_flights=1000)
    assert set(found.trouble) == needed
    assert len(found.trouble) == 2
    assert list(found.scenario.vehicles) == ["primary"]
    assert len(asked) == len({tried.to_yaml() for tried in asked})
    assert found == shrink(plan, lambda tried: needed <= set(tried.trouble), most_flights=1000)


@given(st.integers(1, 60))
@settings(max_examples=10, deadline=None)
def test_it_is_flown_no_more_often_than_told_and_the_smallest_is_told_at_once(most: int) -> None:
    plan = losses(20)
    asked: list[TroublePlan] = []
    told: list[TroublePlan] = []

    def fails(tried: TroublePlan) -> bool:
        asked.append(tried)
        return plan.trouble[7] in tried.trouble

    found = shrink(plan, fails, most_flights=most, found=told.append)
    assert len(asked) <= most
    assert found == (told[-1] if told else plan)
    assert plan.trouble[7] in found.trouble


def test_what_a_scenario_need_not_say_goes_with_all_vehicles_but_one() -> None:
    def damages_all(plan: TroublePlan) -> bool:
        return any("'corrupt' '**' ''" in words(one) for one in plan.trouble)

    drawn = (storm_of(None, number) for number in range(1000))
    plan = next(one for one in drawn if len(one.scenario.vehicles) > 5 and len(one.trouble) > 30 and damages_all(one))
    found = shrink(plan, damages_all, most_flights=1000)
    (entry,) = found.trouble
    assert "'corrupt' '**' '' 1.0" in words(entry)  # what struck by chance strikes always
    assert len(found.scenario.vehicles) == 1
    assert found.scenario.coordinator == BRIEF.coordinator  # all defaults
    assert found.scenario.seabed.kind == "uniform"
    assert found.scenario.targets.count == found.fault_seed == found.scenario.seed == 0
    across_m, along_m = found.scenario.area.extent_m
    assert 40 <= across_m < 60
    assert 40 <= along_m < 60
    assert not broken_rules(found)


def words(entry: object) -> str:
    """An entry of a plan, as `'kill' 'helper' 3.0` and so on."""
    return " ".join(repr(value) for key, value in entry if key != "memory")  # type: ignore[attr-defined]


def test_who_of_the_core_was_killed_is_still_started_again() -> None:
    trouble = [
        {"what": "kill", "node": "coordinator", "at_s": 5.0},
        {"what": "join", "node": "coordinator", "at_s": 9.0},
        {"what": "kill", "node": "helper", "at_s": 3.0},
    ]
    plan = make_plan({"scenario": BRIEF, "core": ["coordinator", "primary"], "heals_s": 9.0, "trouble": trouble})

    def left_for(needed: str) -> list[str]:
        return [words(one) for one in shrink(plan, lambda tried: needed in " ".join(map(words, tried.trouble))).trouble]

    assert left_for("'kill'") == ["'kill' 'coordinator' 5.0", "'join' 'coordinator' 9.0"]
    assert left_for("'coordinator'") == ["'join' 'coordinator' 9.0"]  # it comes late
    assert left_for("'kill' 'helper'") == ["'kill' 'helper' 3.0"]


@pytest.mark.parametrize(
    ("change", "rules"),
    [
        ({}, set()),
        ({"heals_s": 8.0}, {"over"}),
        ({"heals_s": 0.5}, {"over"}),
        ({"heals_s": 1e4}, {"early"}),
        ({"core": ["coordinator", "primary", "helper"]}, {"started again"}),
        ({"core": []}, {"started again"}),
    ],
)
def test_rules_that_a_plan_breaks_are_told(change: dict[str, object], rules: set[str]) -> None:
    trouble = [{"what": "cut_off", "vehicle": "primary", "from_s": 1, "for_s": 9}]
    trouble += [{"what": "kill", "node": "helper", "at_s": 3}]
    drawn = {"scenario": BRIEF, "core": ["coordinator", "primary"], "heals_s": 10.0, "trouble": trouble}
    assert broken_rules(make_plan(drawn | change)) == rules


def test_runs_that_fail_alike_begin_with_the_same_words() -> None:
    late = Violation("the mission ends", 20, "run", "the mission is not over at its time limit, 20.5")
    later = Violation("the mission ends", 30, "run", "the mission is not over at its time limit, 30")
    raised = Violation("the mission ends", 3, "run", "coordinator failed: ValueError")
    told = Violation("the mission ends", 30, "coordinator", "it was to be over by 20 s")
    assert is_alike(late, later)
    assert not any(is_alike(late, one) for one in (raised, told))
    assert is_alike(told, Violation("the mission ends", 31, "coordinator", "it was never said"))
    assert not is_alike(told, Violation("no strip is lost", 30, "coordinator", "strip 3"))


def test_a_map_that_forgets_what_was_told_before_is_found_with_a_start_or_two(monkeypatch: pytest.MonkeyPatch) -> None:
    def forget(layer: VehicleLayer, place: object, window: object, incarnation: int, told: object) -> object:
        return told

    monkeypatch.setattr(VehicleLayer, "_with_other_starts", forget)
    storms = (storm_of(None, number) for number in range(31, 60))
    plan = next(one for one in storms if len(one.scenario.vehicles) == 2 and violations_of(one))  # soon flown
    first = violations_of(plan)[0]
    assert first.invariant == "risk never rises"
    found = shrink(plan, lambda tried: any(is_alike(one, first) for one in violations_of(tried)), most_flights=60)
    assert 1 <= len(found.trouble) <= 3 < len(plan.trouble)
    assert "join" in {one.what for one in found.trouble}
    assert any(is_alike(one, first) for one in fly_storm(found).violations)


class Tired:
    """An allocator that fails when it is first asked."""

    def assign(self, situation: object) -> dict[str, int]:
        raise RuntimeError("tired")


def test_the_command_writes_the_smallest_and_flies_it(tmp_path: Path) -> None:
    plan = losses(6)
    allocator = f"{Tired.__module__}:{Tired.__name__}"
    changed = plan.scenario.model_copy(
        update={"coordinator": plan.scenario.coordinator.model_copy(update={"allocator": allocator})}
    )
    mild = [one.model_copy(update={"keys": "agent/helper/coverage/*"}) for one in plan.trouble]
    plan = plan.model_copy(update={"scenario": changed, "trouble": tuple(mild)})
    (tmp_path / "six.yaml").write_text(plan.to_yaml())
    arguments = ["storm", "--plan", str(tmp_path / "six.yaml"), "--shrink", "--out", str(tmp_path / "o")]
    done = CliRunner().invoke(app_for(["storm"]), [*arguments, "--flights", "8"])
    assert done.exit_code == 1, done.output
    assert "Left are 0 of 6 faults and 2 of 2 vehicles, in an area of " in done.output
    assert "tired" in done.output
    assert f"The moment: secondlook view {tmp_path / 'o' / 'flight-1'} --at " in done.output
    smallest = load_plan(tmp_path / "o" / "plan.yaml")
    assert smallest.scenario.coordinator.allocator == allocator
    assert (tmp_path / "o" / "flight-1" / "mission.rrd").is_file()


def test_ctrl_c_keeps_the_smallest_until_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = losses(2)
    (tmp_path / "two.yaml").write_text(plan.to_yaml())
    smaller = plan.model_copy(update={"trouble": plan.trouble[:1]})

    def broken_off(
        plan: TroublePlan, fails: object, *, most_flights: int, found: Callable[[TroublePlan], None]
    ) -> TroublePlan:
        found(smaller)
        raise KeyboardInterrupt

    monkeypatch.setattr("secondlook.commands.storm.make_smaller", broken_off)
    monkeypatch.setattr("secondlook.commands.storm.violations_of", always_late)
    done = CliRunner().invoke(
        app_for(["storm"]), ["storm", "--plan", str(tmp_path / "two.yaml"), "--shrink", "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == 1
    assert "Left are 1 of 2 faults and 2 of 2 vehicles, in an area of 300 x 100 m" in done.output
    told = f"interrupted after 0 of 300 flights; the smallest until then is {tmp_path / 'o' / 'plan.yaml'}\n"
    assert done.output.endswith(told)
    assert load_plan(tmp_path / "o" / "plan.yaml") == smaller


def always_late(plan: TroublePlan, bus: str) -> tuple[Violation, ...]:
    """Nobody comes to the end, whatever the plan."""
    return (Violation("the mission ends", 20, "run", "it does not"),)


def test_where_all_holds_there_is_nothing_to_shrink(tmp_path: Path) -> None:
    done = CliRunner().invoke(app_for(["storm"]), ["storm", "--seed", "5", "--shrink", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("All that must hold does; the mission was over at ")
    assert load_plan(tmp_path / "plan.yaml") == storm_of(None, 5)


def test_many_storms_are_not_shrunk() -> None:
    refused = CliRunner().invoke(app_for(["storm"]), ["storm", "--shrink"])
    assert isinstance(refused.exception, UserError)
    assert str(refused.exception) == "--shrink: not allowed without --seed or --plan; it shrinks a single storm"


def test_a_link_goes_whole_or_key_by_key_and_modems_with_their_vehicles() -> None:
    link = {"profile": "radio", "loss": 0.1, "slot_frames": 1}
    trouble = [
        {"what": "blackout", "platform": "helper", "from_s": 1, "for_s": 9},
        {"what": "kill", "node": "modem-helper", "at_s": 3},
        {"what": "blackout", "from_s": 1, "for_s": 9},
    ]
    scenario = BRIEF.model_dump(mode="json", exclude_none=True) | {"link": link}
    data = plain(make_plan({"scenario": scenario, "trouble": trouble}))
    edits = list(without_keys(data))
    assert "link" not in edited(data, edits)["scenario"]
    links = [edited(data, [edit])["scenario"].get("link") for edit in edits]
    assert None in links
    assert any(one is not None and "loss" not in one for one in links)
    leave_out_vehicle("helper", data)
    assert [one["what"] for one in data["trouble"]] == ["blackout"]
