"""What is remarked of many missions before the first is flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from flights import BRIEF

from secondlook.commands import remarks
from secondlook.commands.remarks import MOST_LOOKED_AT, remark_on
from secondlook.commands.run import expected_of
from secondlook.preflight import MissionExpectation
from secondlook.scenario import Scenario
from secondlook.sweeps.plan import SweepPlan

ENDURANCE = "vehicles.primary.endurance_s"


def told(
    capsys: pytest.CaptureFixture[str], vary: Mapping[str, Sequence[Any]], settings: tuple[str, ...] = ()
) -> list[str]:
    combinations = SweepPlan(str(BRIEF), range(1, 2), settings, vary).combinations
    remark_on([(one.scenario, one.settings) for one in combinations])
    out, err = capsys.readouterr()
    assert out == ""
    return err.splitlines()


def test_a_reason_is_told_once_with_what_is_varied_where_it_holds(capsys: pytest.CaptureFixture[str]) -> None:
    (remark,) = told(capsys, {ENDURANCE: [60, 36000], "coordinator.allocator": ["plan", "none"]})
    assert remark.startswith(f"--vary {ENDURANCE}=60: {ENDURANCE}: 60 s ends its survey after about 1 of 4 tracks")
    assert remark.endswith(" s, but is flown all the same")


def test_one_that_holds_for_all_names_nothing_that_is_varied(capsys: pytest.CaptureFixture[str]) -> None:
    (remark,) = told(capsys, {"coordinator.allocator": ["plan", "none"]}, (f"{ENDURANCE}=60",))
    assert remark.startswith(f"{ENDURANCE}: 60 s ends its survey")


def test_the_first_three_are_told_and_how_many_more_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    *first, more = told(capsys, {ENDURANCE: [40, 50, 60, 70, 80]})
    assert [one.split(": ")[0] for one in first] == [f"--vary {ENDURANCE}={value}" for value in (40, 50, 60)]
    assert more == "and 2 more"


def test_missions_within_their_limits_are_not_remarked_on(capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, {"mission.rho": [0, 0.5]}) == []


def test_of_very_many_some_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    (one,) = SweepPlan(str(BRIEF), range(1, 2)).combinations
    expected, looked_at = expected_of(one.scenario), list[Scenario]()

    def look_at(scenario: Scenario) -> MissionExpectation:
        looked_at.append(scenario)
        return expected

    monkeypatch.setattr(remarks, "expected_of", look_at)
    remark_on([(one.scenario, ())] * 1000)
    assert len(looked_at) == MOST_LOOKED_AT


def test_a_spacing_planner_that_fails_is_for_its_missions_to_tell(capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, {"vehicles.primary.spacing": ["stubborn_spacing:Stubborn"]}) == []
