"""Storms: drawn alike from their number, flown with real nodes, and told of where something does not hold."""

from __future__ import annotations

import json
import re
import resource
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from called import Call
from flights import BRIEF
from typer.testing import CliRunner

import secondlook
from comms.said.messages import TaskAction
from secondlook.cli import app_for
from secondlook.errors import UserError
from secondlook.fleet.link import patience_of
from secondlook.scenario import Scenario, load_scenario
from secondlook.scenario.bundled import link_names
from secondlook.storm import campaign
from secondlook.storm.campaign import agreement, flown_again, storm_of, times_reached
from secondlook.storm.canaries import CANARIES, Find, find_canary
from secondlook.storm.fly import Outcome, Truth, fly_storm
from secondlook.storm.invariants import _who_is_sent_may_go
from secondlook.storm.sometimes import DISK_FULL, SOMETIMES
from secondlook.storm.witness import Violation, Witness
from secondlook.testing import Fleet
from secondlook.testing.flight import Flight
from secondlook.testing.plan import KINDS, DiskFull, TroublePlan, load_plan

QUICK = 5
"""A storm that is flown in some tenths of a second."""


def test_a_number_is_one_storm_and_another_number_another() -> None:
    assert storm_of(None, QUICK) == storm_of(None, QUICK)
    assert storm_of(None, QUICK) != storm_of(None, QUICK + 1)


@pytest.fixture(scope="module")
def drawn_storms() -> list[TroublePlan]:
    """Three hundred of them."""
    return [storm_of(None, number) for number in range(300)]


def test_all_kinds_of_trouble_are_drawn_and_the_core_is_left_alone_in_time(drawn_storms: list[TroublePlan]) -> None:
    drawn: set[str] = set()
    calm = 0
    for number, plan in enumerate(drawn_storms):
        calm += not plan.trouble
        for one in plan.trouble:
            drawn.add(one.what)
            ends_s = getattr(one, "at_s", getattr(one, "from_s", 0.0)) + (getattr(one, "for_s", 0.0) or 0.0)
            whom = {getattr(one, key, "") for key in ("node", "vehicle", "to", "platform")}
            if whom & set(plan.core) and one.what != "join":
                assert ends_s <= plan.heals_s + 0.1, (number, one)
        assert plan.heals_s <= patience_of(plan.scenario).given_up_ms / 1000
    assert drawn == set(KINDS)
    assert 15 <= calm <= 50  # a tenth of 300


def test_a_fleet_with_a_hole_that_cuts_a_share_in_two_is_drawn_without_it() -> None:
    assert storm_of(None, 302000039).scenario.area.holes_m == ()


def test_one_whose_notch_cuts_a_share_in_two_is_drawn_without_that() -> None:
    scenario = storm_of(None, 88681).scenario
    assert len(scenario.area.polygon_m) == 4
    assert len(scenario.survey_vehicles) == 3


def test_one_fleet_in_five_talks_by_modems_with_troubles_of_their_own(drawn_storms: list[TroublePlan]) -> None:
    plans = [plan for plan in drawn_storms if plan.scenario.link is not None]
    assert 40 <= len(plans) <= 80  # a fifth of 300
    profiles = {plan.scenario.link.modem.name for plan in plans if plan.scenario.link is not None}
    assert profiles == set(link_names())
    aboard = [plan for plan in plans if plan.scenario.coordinator.platform is not None]
    assert aboard
    # The core is left alone, and with it the modem through which it is heard.
    assert all(plan.scenario.coordinator.platform in plan.core for plan in aboard if plan.core)
    for plan in plans:
        core = {"modem-ship", *(f"modem-{name}" for name in plan.core)}
        struck = [one for one in plan.trouble if getattr(one, "node", "") in core and one.what in ("kill", "freeze")]
        assert all(getattr(one, "at_s", 0.0) + getattr(one, "for_s", 0.0) <= plan.heals_s for one in struck)
        everybody = [one for one in plan.trouble if one.what in ("range_cut", "jammed")]
        assert all(getattr(one, "from_s", 0.0) + getattr(one, "for_s", 0.0) <= plan.heals_s + 0.1 for one in everybody)


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
        return Outcome((), f"{bus} {len(flown)}", 20.0)

    monkeypatch.setattr(campaign, "fly_storm", fly)
    first = Outcome((), "local 1", 20.0)
    differs = ("the same digest over Zenoh", "it is zenoh 2 and was local 1")
    for number, buses, told in ((7, [], []), (4, ["local"], []), (40, ["local", "zenoh"], [differs])):
        flown.clear()
        found = flown_again(plan, number, first, 4)
        assert flown == buses
        assert [(one.invariant, one.what) for one in found.violations] == told
    assert flown_again(plan, 40, first, 0) == first
    (found_again,) = flown_again(plan, 4, replace(first, digest="another"), 4).violations
    assert found_again.invariant == "the same digest again"


def test_a_fleet_that_cannot_be_drawn_is_found_and_does_not_end_the_campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(number: int) -> Scenario:
        raise UserError("area.polygon_m: cuts the share of primary-2 in two")

    monkeypatch.setattr(campaign, "draw_fleet", refuse)
    (found,) = campaign.fly_number(None, 0, 7).violations
    assert str(found).startswith("a fleet is drawn: area.polygon_m: cuts the share of primary-2 in two")


def test_an_error_that_nobody_has_foreseen_is_found_and_does_not_end_the_campaign(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stumble(plan: TroublePlan) -> Outcome:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(campaign, "fly_storm", stumble)
    (found,) = campaign.fly_number(None, 0, QUICK).violations
    assert str(found).startswith("ends: ZeroDivisionError: by nothing (test_storm.py, line ")


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
    assert outcome.reached == {DISK_FULL}
    assert resource.getrlimit(resource.RLIMIT_FSIZE) == before
    last = max(one.t_s for one in secondlook.load(tmp_path / "flight-1").messages())
    assert 0 < last <= outcome.end_s


def test_a_full_disk_that_nobody_tells_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "setrlimit", lambda *_: None)  # as if all writes went well
    assert [one.invariant for one in fly_storm(full_disk(80.0)).violations] == ["a full disk is told"]


@pytest.mark.parametrize(
    ("every_s", "offers", "anew", "found"),
    [
        (5.1, 30, False, []),
        (5.0, 30, False, []),
        (4.9, 30, False, [62.8]),
        (4.9, 2, False, []),
        (4.9, 0, False, []),
        (4.9, 30, True, []),  # a coordinator that was started anew calls back from what one before has offered
    ],
)
def test_who_is_sent_and_called_back_again_and_again_is_found(
    every_s: float, offers: int, anew: bool, found: list[float]
) -> None:
    plan = storm_of(None, QUICK)
    (name, *_) = plan.scenario.vehicles
    told = [
        SimpleNamespace(
            t_s=4 + round(every_s * n, 1),
            header=SimpleNamespace(incarnation=int(anew and not action.is_offer)),
            message=SimpleNamespace(action=action, strip=n % 2),
        )
        for n in range(30)
        for action in (TaskAction.TAKE, TaskAction.GIVE_BACK)
        if n < offers or action is TaskAction.GIVE_BACK
    ]
    flight = SimpleNamespace(said=lambda _, key: told if key == f"coord/task/{name}/*" else [])
    violations = _who_is_sent_may_go(cast(Flight, flight), plan, Witness())
    assert [(one.t_s, one.who) for one in violations] == [(t_s, name) for t_s in found]


@pytest.mark.parametrize(
    ("name", "invariant"),
    [
        ("the map forgets what a vehicle told before it was started anew", "the map is what came"),
        ("a strip is offered to two", "an offer is in the books"),
        ("a helper stays at a strip that it gives back", "who is told to give back does"),
    ],
)
def test_a_planted_bug_is_found(name: str, invariant: str) -> None:
    find = find_canary(name, None, range(QUICK, QUICK + 20))
    assert (find.invariant, find.number) == (invariant, QUICK + find.storms - 1)


def test_what_holds_not_either_without_the_bug_does_not_find_it(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = Outcome((Violation("the mission ends", 1.0, "run", "it does not"),), None, 1.0)
    monkeypatch.setattr("secondlook.storm.canaries.fly_storm", lambda plan: wrong)
    assert find_canary("the deadline is passed over", None, range(3, 5)) == Find(2)


def test_a_planted_bug_is_gone_afterwards() -> None:
    before = {name: vars(one.owner)[one.method] for name, one in CANARIES.items()}
    for name, canary in CANARIES.items():
        with canary.planted():
            assert vars(canary.owner)[canary.method] is not before[name]
        assert vars(canary.owner)[canary.method] is before[name]


def test_a_flight_tells_what_it_has_reached() -> None:
    outcome = fly_storm(storm_of(None, QUICK))
    assert "a strip is offered" in outcome.reached
    counts = times_reached({QUICK: outcome, QUICK + 1: replace(outcome, reached=frozenset())})
    assert counts.keys() == SOMETIMES.keys()
    assert counts["a strip is offered"] == 1


@pytest.mark.parametrize(
    ("missed", "is_exact", "holds"),
    [(80, False, True), (92, False, True), (93, False, False), (68, True, True), (67, True, False), (67, False, True)],
)
def test_targets_missed_agree_with_those_to_be_expected(missed: int, is_exact: bool, holds: bool) -> None:
    # Two flights: 80 are to be expected, with a variance of 16, so that 3 standard deviations are 12.
    first = Truth(80, missed - 40, 40.0, 8.0, is_exact)
    second = Truth(80, 40, 40.0, 8.0, is_exact)
    outcomes = {number: Outcome((), "", 1.0, truth=one) for number, one in enumerate((first, second))}
    assert agreement(outcomes).holds is holds
    assert f"Of 160 targets {missed} were missed, at most 92 were to be expected;" in agreement(outcomes).told


def test_the_truth_of_a_flight_is_that_of_its_summary(tmp_path: Path) -> None:
    plan = next(one for number in range(50) if (one := storm_of(None, number)).scenario.targets.count)
    truth = fly_storm(plan, folder=tmp_path).truth
    told = json.loads((tmp_path / "flight-1" / "summary.json").read_text())["truth"]
    assert truth.targets == told["targets"] > 0
    assert truth.missed / truth.targets == pytest.approx(told["missed_share"])
    assert truth.predicted / truth.targets == pytest.approx(told["predicted_missed_share"])


def test_a_plan_file_is_flown_as_the_storm_it_was_written_from(tmp_path: Path) -> None:
    plan = storm_of(None, QUICK)
    (tmp_path / "plan.yaml").write_text(plan.to_yaml())
    assert load_plan(tmp_path / "plan.yaml") == plan
    flight = Fleet.of_plan(tmp_path / "plan.yaml", folder=tmp_path / "flights").run()
    assert flight.digest == fly_storm(plan).digest
    fleet = Fleet(plan.scenario, folder=tmp_path / "others", fault_seed=plan.fault_seed)
    fleet.plan(tmp_path / "plan.yaml")
    assert fleet.run().digest == flight.digest


def test_the_command_flies_many_and_one(tmp_path: Path) -> None:
    many = CliRunner().invoke(
        app_for(["storm"]), ["storm", "--seeds", f"{QUICK}..{QUICK}", "--jobs", "1", "--out", str(tmp_path / "m")]
    )
    assert many.exit_code == 0, many.output
    assert "1 storms flown; in 0 of them something did not hold." in many.output
    assert "Never tried in these storms: " in many.output
    told = json.loads((tmp_path / "m" / "storm.json").read_text())
    assert told["flown"] == 1
    assert told["reached"].keys() == SOMETIMES.keys()
    one = CliRunner().invoke(app_for(["storm"]), ["storm", "--seed", str(QUICK), "--out", str(tmp_path / "o")])
    assert one.exit_code == 0, one.output
    assert load_plan(tmp_path / "o" / "plan.yaml") == storm_of(None, QUICK)
    assert (tmp_path / "o" / "flight-1" / "mission.rrd").is_file()
    one = CliRunner().invoke(app_for(["storm"]), ["storm", "--seed", str(QUICK), "--out", str(tmp_path / "o")])
    assert one.exit_code == 0, one.output
    assert (tmp_path / "o" / "flight-2").is_dir()


TIRED = """
class Tired:
    def assign(self, situation):
        raise RuntimeError("tired")
"""


def test_the_command_that_is_told_flies_that_storm_again(users_folder: Path, called: Call) -> None:
    (users_folder / "own.py").write_text(TIRED)
    (users_folder / "st orm").mkdir()
    shutil.copy(BRIEF, users_folder / "st orm" / "b.yaml")
    settings = ("--set", "coordinator.allocator=own:Tired")
    code, out, _ = called("storm", "st orm/b.yaml", *settings, "--seeds", "9..9", "--again", "0", "--jobs", "1")
    found = re.search(r"^seed 9: (.*tired.*); again: secondlook (.*)$", out, re.MULTILINE)
    assert code == 1
    assert found, out
    code, out, _ = called(*shlex.split(found[2]), "--out", "of one")
    assert (code, out.splitlines()[0]) == (1, found[1])
    assert "\nThe moment: secondlook view 'of one/flight-1' --at " in out
