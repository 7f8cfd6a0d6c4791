"""Storms: drawn alike from their number, flown with real nodes, and told of where something does not hold."""

from __future__ import annotations

import resource
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

import secondlook
from coordinator.fleet import GIVEN_UP_AFTER
from planner.fleet_map import VehicleLayer
from secondlook.cli import app
from secondlook.errors import UserError
from secondlook.scenario import load_scenario
from secondlook.storm import campaign
from secondlook.storm.campaign import flown_again, storm_of
from secondlook.storm.fly import Outcome, fly_storm
from secondlook.testing import Fleet
from secondlook.testing.plan import DiskFull, TroublePlan, load_plan

QUICK = 5
"""A storm that is flown in some tenths of a second."""


def test_a_number_is_one_storm_and_another_number_another() -> None:
    assert storm_of(None, QUICK) == storm_of(None, QUICK)
    assert storm_of(None, QUICK) != storm_of(None, QUICK + 1)


def test_all_kinds_of_trouble_are_drawn_and_the_core_is_left_alone_in_time() -> None:
    drawn: set[str] = set()
    calm = 0
    for number in range(300):
        plan = storm_of(None, number)
        calm += not plan.trouble
        for one in plan.trouble:
            drawn.add(one.what)
            ends_s = getattr(one, "at_s", getattr(one, "from_s", 0.0)) + (getattr(one, "for_s", 0.0) or 0.0)
            whom = {getattr(one, "node", ""), getattr(one, "vehicle", ""), getattr(one, "to", "")}
            if whom & set(plan.core) and one.what != "join":
                assert ends_s <= plan.heals_s + 0.1, (number, one)
        assert plan.heals_s <= GIVEN_UP_AFTER * plan.scenario.coordinator.lost_after_s
    assert drawn == {"kill", "join", "disk_full", "freeze", "cut_off", "drop", "corrupt", "repeat", "delay", "reorder"}
    assert 15 <= calm <= 50  # a tenth of 300


def test_a_storm_of_a_given_scenario_keeps_its_fleet() -> None:
    brief = load_scenario(Path(__file__).parents[2] / "support" / "brief.yaml")
    plan = storm_of(brief, 4)
    assert plan.scenario.vehicles == brief.vehicles
    assert plan.scenario.seed == 4


@pytest.mark.parametrize("number", [2, QUICK, 7])
def test_what_must_hold_does(number: int) -> None:
    first, again = (fly_storm(storm_of(None, number)) for _ in range(2))
    assert not first.violations
    assert first.digest == again.digest is not None


def test_each_so_many_th_storm_is_flown_twice_and_over_zenoh(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, flown = storm_of(None, QUICK), []

    def fly(plan: TroublePlan, *, bus: str = "local") -> Outcome:
        flown.append(bus)
        return Outcome((), f"{bus} {len(flown)}", 20.0, 0.1)

    monkeypatch.setattr(campaign, "fly_storm", fly)
    first = Outcome((), "local 1", 20.0, 0.1)
    differs = ("the same digest over Zenoh", "it is zenoh 2 and was local 1")
    for number, buses, told in ((7, [], []), (4, ["local"], []), (40, ["local", "zenoh"], [differs])):
        flown.clear()
        found = flown_again(plan, number, first, 4)
        assert flown == buses
        assert [(one.invariant, one.what) for one in found.violations] == told
    assert flown_again(plan, 40, first, 0) == first
    (found_again,) = flown_again(plan, 4, replace(first, digest="another"), 4).violations
    assert found_again.invariant == "the same digest again"


def test_a_storm_is_the_same_over_zenoh() -> None:
    plan = storm_of(None, QUICK)
    outcome = fly_storm(plan)
    assert flown_again(plan, 10, outcome, 1) == outcome


def full_disk(at_s: float) -> TroublePlan:
    """A quick storm whose disk is full from a moment on."""
    plan = storm_of(None, QUICK)
    return plan.model_copy(update={"trouble": (*plan.trouble, DiskFull(what="disk_full", at_s=at_s))})


def test_a_full_disk_is_told_and_what_is_on_it_is_read_back(tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    outcome = fly_storm(full_disk(80.0), folder=tmp_path)
    assert (outcome.violations, outcome.digest) == ((), None)
    assert outcome.end_s >= 80
    assert resource.getrlimit(resource.RLIMIT_FSIZE) == before
    last = max(one.t_s for one in secondlook.load(tmp_path / "flight-1").messages())
    assert 0 < last <= outcome.end_s


def test_a_full_disk_that_nobody_tells_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "setrlimit", lambda *_: None)  # as if all writes went well
    assert [one.invariant for one in fly_storm(full_disk(80.0)).violations] == ["a full disk is told"]


def test_a_map_that_forgets_what_was_told_before_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def forget(layer: VehicleLayer, place: object, window: object, incarnation: int, told: object) -> object:
        return told

    monkeypatch.setattr(VehicleLayer, "_with_other_starts", forget)
    found = (violation for number in range(40) for violation in fly_storm(storm_of(None, number)).violations)
    assert any(violation.invariant == "the map is what came" for violation in found)


def test_a_plan_file_is_flown_as_the_storm_it_was_written_from(tmp_path: Path) -> None:
    plan = storm_of(None, QUICK)
    (tmp_path / "plan.yaml").write_text(plan.to_yaml())
    assert load_plan(tmp_path / "plan.yaml") == plan
    flight = Fleet.of_plan(tmp_path / "plan.yaml", folder=tmp_path / "flights").run()
    assert flight.digest == fly_storm(plan).digest
    fleet = Fleet(plan.scenario, folder=tmp_path / "others", fault_seed=plan.fault_seed)
    fleet.plan(tmp_path / "plan.yaml")
    assert fleet.run().digest == flight.digest


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ("{what: kill, node: primary}", r"plan.yaml:4: trouble\[0\].at_s: missing; must be given"),
        ("{what: drown, node: primary}", r"plan.yaml:4: trouble\[0\].what: \"drown\" is not allowed; must be .*"),
        ("{what: kill, node: primary, at_s: 5, for_s: 3}", r"plan.yaml:4: trouble\[0\].for_s: 3 is not allowed; .*"),
        ("{what: disk_full}", r"plan.yaml:4: trouble\[0\].at_s: missing; must be given"),
        ("{what: kill, node: nobody, at_s: 5}", r"trouble\[0\]: 'nobody' cannot be killed, .*"),
    ],
)
def test_a_plan_that_cannot_be_flown_is_refused_in_a_sentence(tmp_path: Path, entry: str, sentence: str) -> None:
    brief = load_scenario(Path(__file__).parents[2] / "support" / "brief.yaml")
    text = "".join(f"  {line}\n" for line in brief.to_yaml().splitlines())
    (tmp_path / "plan.yaml").write_text(f"fault_seed: 1\ncore: []\ntrouble:\n- {entry}\nscenario:\n{text}")
    with pytest.raises(UserError, match=f"(?s)^.*{sentence}$"):
        Fleet.of_plan(tmp_path / "plan.yaml", folder=tmp_path)


def test_the_command_flies_many_and_one(tmp_path: Path) -> None:
    many = CliRunner().invoke(
        app, ["storm", "--seeds", f"{QUICK}..{QUICK}", "--jobs", "1", "--out", str(tmp_path / "m")]
    )
    assert many.exit_code == 0, many.output
    assert "1 storms flown; in 0 of them something did not hold." in many.output
    assert (tmp_path / "m" / "storm.json").is_file()
    one = CliRunner().invoke(app, ["storm", "--seed", str(QUICK), "--out", str(tmp_path / "o")])
    assert one.exit_code == 0, one.output
    assert load_plan(tmp_path / "o" / "plan.yaml") == storm_of(None, QUICK)
    assert (tmp_path / "o" / "flight-1" / "mission.rrd").is_file()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--seeds", "5..3"], "--seeds: 5..3 is not allowed; must be A..B, at most 1000000 whole numbers"),
        (["--set", "seed=3"], "--set: not allowed without a scenario, as fleets are drawn then"),
    ],
)
def test_wrong_use_is_refused_in_a_sentence(arguments: list[str], sentence: str) -> None:
    refused = CliRunner().invoke(app, ["storm", *arguments])
    assert isinstance(refused.exception, UserError)
    assert str(refused.exception) == sentence
