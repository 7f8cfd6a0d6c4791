"""Whole missions in which helpers, links and coordinators fail: each ends in a stated outcome, nothing is served twice,
and in the end each strip is accounted for."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bad_helpers
import odd_coordinators
import pytest
import yaml
from flights import BRIEF

from comms.said.messages import (
    MissionOver,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from coordinator.allocate.simple import NearestAllocator
from secondlook.testing import (
    Fleet,
    Flight,
    Heard,
    RunFailedError,
    assert_all_finished,
    assert_maps_converged,
    assert_never_assigned_to_lost,
    assert_no_strip_lost,
    assert_no_strip_served_twice,
    assert_one_strip_at_a_time,
)

MakeFleet = Callable[..., Fleet]
COARSE = {"area.cell_m": 10}  # on fewer cells strips are cut sooner
FAILED, DONE = StripState.FAILED, StripState.DONE


@pytest.fixture
def slow(tmp_path: Path) -> MakeFleet:
    """Makes a fleet of the brief mission at a walking pace, with one helper, or two, of which the first is bad."""

    def make(agent: type | None = None, *, helpers: int = 2, deadline_factor: float = 1.5, **settings: Any) -> Fleet:
        scenario = yaml.safe_load(BRIEF.read_text())
        scenario["mission"]["deadline_factor"] = deadline_factor
        vehicles = scenario["vehicles"]
        vehicles["primary"] |= {"speed_mps": 1.5}
        vehicles["helper"] |= {"speed_mps": 2}
        if helpers > 1:
            vehicles["second"] = {**vehicles["helper"], "start": {"x_m": 310, "y_m": 120}}
        if agent is not None:
            vehicles["helper"]["agent"] = f"{agent.__module__}:{agent.__name__}"
        vehicles["helper"] |= settings
        return Fleet(scenario, folder=tmp_path / "flown")

    return make


def check(flight: Flight, *, but_served_twice: bool = False) -> dict[int, StripStatus]:
    """What holds of every mission; returns the last word on each strip."""
    assert_no_strip_lost(flight)
    assert_one_strip_at_a_time(flight)
    assert_never_assigned_to_lost(flight)
    if not but_served_twice:
        assert_no_strip_served_twice(flight)
    last: dict[int, StripStatus] = {}
    for one in flight.messages("coord/strip/*"):
        assert isinstance(one.message, StripStatus)
        assert one.message.reason
        last[one.number] = one.message
    for status in last.values():
        assert status.state.has_ended or status.reason.startswith("left when the mission was over: ")
    assert any(isinstance(one.message, MissionOver) for one in flight.heard)
    return last


def is_half_way(heard: Heard) -> bool:
    """Whether the helper is over a strip, a third of the time that it expects to be."""
    word = heard.last("agent/helper/task_status/*")
    if word is None or not isinstance(word.message, TaskStatus) or word.message.state is not TaskState.UNDER_WAY:
        return False
    begun_ms = word.header.sent_ms
    return heard.now_ms - begun_ms > (word.message.ends_ms - begun_ms) / 3


def said_of_tasks(flight: Flight, vehicle: str) -> list[TaskState]:
    return [one.message.state for one in flight.heard if isinstance(one.message, TaskStatus) and one.vehicle == vehicle]


def told(flight: Flight, vehicle: str, action: TaskAction) -> list[int]:
    tasks = [one.message for one in flight.messages(f"coord/task/{vehicle}/*")]
    return [one.strip for one in tasks if isinstance(one, Task) and one.action is action]


def served_by(last: dict[int, StripStatus]) -> set[str]:
    return {one.vehicle for one in last.values() if one.state is DONE}


class TestBadHelpers:
    def test_what_one_refuses_another_serves(self, slow: MakeFleet) -> None:
        flight = slow(bad_helpers.RefusesAll).run()
        assert served_by(check(flight)) == {"second"}
        assert set(said_of_tasks(flight, "helper")) == {TaskState.REFUSED}

    def test_one_that_never_moves_is_given_three_strips_and_another_serves(
        self, slow: MakeFleet, caplog: pytest.LogCaptureFixture
    ) -> None:
        flight = slow(bad_helpers.NeverMoves).run()
        assert served_by(check(flight)) == {"second"}
        assert 1 <= len(told(flight, "helper", TaskAction.TAKE)) <= 3
        assert told(flight, "helper", TaskAction.GIVE_BACK)

    def test_one_that_never_moves_nor_gives_back_keeps_nobody_from_its_strip(self, slow: MakeFleet) -> None:
        flight = slow(bad_helpers.NeverGivesBack).run()
        assert served_by(check(flight, but_served_twice=True)) == {"second"}
        assert len(told(flight, "helper", TaskAction.TAKE)) == 1

    def test_one_that_says_done_is_not_believed_and_soon_offered_nothing_more(
        self, slow: MakeFleet, caplog: pytest.LogCaptureFixture
    ) -> None:
        flight = slow(bad_helpers.SaysDone).run()
        last = check(flight)
        assert served_by(last) == {"second"}
        lies = [one for one in last.values() if one.state is FAILED]
        assert {one.reason for one in lies} == {"helper says done, but saw 0% of it"}
        assert len(told(flight, "helper", TaskAction.TAKE)) == len(lies) <= 3
        if len(lies) == 3:
            assert "helper is offered nothing more: it has not served 3 strips in a row" in caplog.messages

    def test_a_battery_too_small_for_the_nearest_strip_gets_none_and_all_are_left(self, slow: MakeFleet) -> None:
        flight = slow(helpers=1, endurance_s=10).run()
        last = check(flight)
        assert told(flight, "helper", TaskAction.TAKE) == []
        assert last
        assert {one.reason for one in last.values() if one.state is StripState.OPEN} == {
            "left when the mission was over: nobody has served it"
        }

    @pytest.mark.parametrize("back_after_s", [5, 60])
    def test_one_that_vanishes_half_way_and_comes_back(self, slow: MakeFleet, back_after_s: float) -> None:
        fleet = slow(helpers=1)
        fleet.run_until(is_half_way, timeout_s=5000)
        fleet.kill("helper")
        fleet.join("helper", at_s=fleet.now_s + back_after_s)
        flight = fleet.run()
        last = check(flight)
        assert served_by(last) == {"helper"}
        reasons = [one.message.reason for one in flight.heard if isinstance(one.message, StripStatus)]
        lost = [reason for reason in reasons if "is lost: nothing" in reason]
        assert bool(lost) is (back_after_s > 30)
        assert_maps_converged(flight)


class TestAHelperThatIsStartedAnew:
    def test_what_it_has_seen_before_counts_on(self, tmp_path: Path) -> None:
        fleet = Fleet("tellaro", folder=tmp_path, overrides=COARSE)

        def first_done(heard: Heard) -> bool:
            last = heard.last("coord/strip/*")
            return last is not None and isinstance(last.message, StripStatus) and last.message.state is DONE

        before = fleet.run_until(first_done, timeout_s=3000)
        fleet.kill("helper")
        fleet.join("helper", at_s=fleet.now_s + 15)
        flight = fleet.run()
        seen = before.risk_map.layers["helper"]
        after = flight.risk_map.layers["helper"]
        assert (after.sum_levels >= seen.sum_levels).all()
        assert (after.largest_levels >= seen.largest_levels).all()
        assert any(len(starts) > 1 for starts in after.versions.values())
        assert flight.summary["risk"]["mean"] < 0.35  # 0.334 where it is not killed
        assert_maps_converged(flight)


class TestStripsThatAreNone:
    def test_a_helper_refuses_them_and_takes_the_next(self, slow: MakeFleet) -> None:
        fleet = slow(helpers=1)
        fleet = Fleet(fleet.scenario, folder=fleet.folder, overrides={"coordinator.node": odd_coordinators.GivesStrips})
        flight = fleet.run()
        answers = [one.message for one in flight.heard if isinstance(one.message, TaskStatus)]
        refused = {one.strip: one.reason for one in answers if one.state is TaskState.REFUSED}
        none, outside = "that is no strip", "it lies outside the area"
        assert refused == {1: none, 2: none, 3: none, 4: outside, 5: none, 6: outside}
        assert {one.strip for one in answers if one.state is TaskState.ACCEPTED} == {7}
        assert_all_finished(flight)

    def test_what_is_no_number_ends_the_mission_with_a_sentence(self, slow: MakeFleet) -> None:
        fleet = slow(helpers=1)
        fleet = Fleet(fleet.scenario, folder=fleet.folder, overrides={"coordinator.node": odd_coordinators.GivesNan})
        with pytest.raises(RunFailedError, match=r"^coordinator has published a message that does not fit: .* nan m"):
            fleet.run()

    @pytest.mark.parametrize("number", [math.nan, 0, -1, 10**9, "1", None])
    def test_an_allocator_that_gives_what_is_no_open_strip_ends_it_with_a_sentence(
        self, slow: MakeFleet, number: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(NearestAllocator, "assign", lambda self, situation: {"helper": number})
        fleet = slow(helpers=1)
        fleet = Fleet(fleet.scenario, folder=fleet.folder, overrides={"coordinator.allocator": "nearest"})
        is_whole = isinstance(number, int)
        told = "must give an open strip, and each once, to a helper that is there" if is_whole else "must be an int"
        with pytest.raises(RunFailedError, match=told):
            fleet.run()


class TestACoordinatorThatIsKilled:
    @pytest.mark.parametrize("away_s", [0.5, 45])
    def test_the_one_that_comes_after_goes_on_with_numbers_of_its_own(self, slow: MakeFleet, away_s: float) -> None:
        fleet = slow()
        fleet.run_until(lambda heard: len(heard.messages("coord/task/**")) >= 3, timeout_s=5000)
        fleet.kill("coordinator")
        fleet.join("coordinator", at_s=fleet.now_s + away_s)
        flight = fleet.run()
        check_of_last(flight)
        assert_no_strip_served_twice(flight)
        numbers: dict[int, set[int]] = {}
        for one in flight.messages("coord/strip/*"):
            numbers.setdefault(one.header.incarnation, set()).add(one.number)
        assert not numbers[0] & numbers[1]
        assert min(numbers[1]) % 1000 == 1
        done = {
            one.message.strip
            for one in flight.heard
            if isinstance(one.message, TaskStatus) and one.message.state is TaskState.DONE
        }
        assert done & numbers[1]
        assert_all_finished(flight)


def check_of_last(flight: Flight) -> None:
    """What holds of the strips of a coordinator that was started anew."""
    assert_no_strip_lost(flight)
    assert_never_assigned_to_lost(flight)
    last: dict[int, StripStatus] = {}
    for one in flight.messages("coord/strip/*"):
        if isinstance(one.message, StripStatus) and one.header.incarnation == 1:
            last[one.number] = one.message
    assert last
    figures = flight.summary["hotspots"]
    assert figures["left"] == sum(status.state is StripState.OPEN for status in last.values())
    assert figures["published"] == sum(figures[one] for one in ("revisited", "left", "withdrawn", "failed"))
    counted = Counter(one.state for one in flight.strips)
    assert counted[StripState.DONE] == figures["revisited"]
    assert counted[StripState.WITHDRAWN] == figures["withdrawn"]
    assert {one.number for one in flight.strips if not one.state.has_ended} <= last.keys()
    for status in last.values():
        assert status.state.has_ended or status.reason.startswith("left when the mission was over: ")


class TestBadLinks:
    def test_whose_answers_come_too_late_has_one_strip_at_a_time(self, tmp_path: Path) -> None:
        fleet = Fleet("two-helpers", folder=tmp_path, overrides=COARSE)
        fleet.delay("coord/task/**", by_s=20)
        flight = fleet.run()
        assert any(one.message.reason.endswith("is at it after all") for one in flight.said(StripStatus))
        assert_one_strip_at_a_time(flight)
        assert_no_strip_lost(flight)
        assert_no_strip_served_twice(flight)

    def test_who_was_cut_off_while_finishing_is_asked_for_what_has_not_arrived(self, tmp_path: Path) -> None:
        fleet = Fleet(BRIEF, overrides={"mission.deadline_factor": 4}, folder=tmp_path)
        fleet.cut_off("primary", from_s=0, for_s=110)
        flight = fleet.run()
        asked = [one for one in flight.said(Task) if one.message.action is TaskAction.TELL_AGAIN]
        assert {one.vehicle for one in asked} == {"primary"}
        assert [round(one.t_s) for one in asked] == [111]
        (over,) = {round(one.t_s) for one in flight.said(MissionOver)}
        assert over == 440  # 4 times the time at which it is heard that the primary has finished
        assert flight.summary["hotspots"]["revisited"] > 10
        assert flight.summary["risk"]["mean"] < 0.1  # 0.553 where the mission ends at once
        check(flight)
        assert_maps_converged(flight)

    @pytest.mark.parametrize("name", ["tellaro", "patchy"])
    def test_of_a_fifth_of_all_words_lost_maps_converge_and_all_finish(self, tmp_path: Path, name: str) -> None:
        fleet = Fleet(name, folder=tmp_path, overrides=COARSE)
        fleet.drop("**", probability=0.2)
        flight = fleet.run()
        assert_maps_converged(flight)
        assert_all_finished(flight)
        check(flight)

    @pytest.mark.parametrize("by_s", [0.2, 8])
    def test_who_hears_late_that_the_mission_is_over_finishes_and_says_so(self, slow: MakeFleet, by_s: float) -> None:
        fleet = slow()
        fleet.delay("coord/mission_over", by_s=by_s, to="helper")
        flight = fleet.run()
        assert_all_finished(flight)
        check(flight)

    def test_who_never_hears_it_is_left_after_10_s(self, slow: MakeFleet) -> None:
        fleet = slow()
        fleet.drop("coord/mission_over", to="helper")
        flight = fleet.run()
        with pytest.raises(AssertionError, match="not everyone has finished:\n  helper was last heard at"):
            assert_all_finished(flight)
        over_ms = flight.messages("coord/mission_over")[0].header.sent_ms
        assert 9000 <= flight.heard.now_ms - over_ms <= 10_000

    def test_a_strip_that_was_swept_while_cut_off_is_not_swept_again(self, slow: MakeFleet) -> None:
        fleet = slow(helpers=1)
        fleet.run_until(is_half_way, timeout_s=5000)
        fleet.cut_off("helper", for_s=100)
        flight = fleet.run()
        check(flight)
        assert_maps_converged(flight)
        done = [one.message.strip for one in flight.heard if isinstance(one.message, TaskStatus)
                and one.message.state is TaskState.DONE]  # fmt: skip
        assert done
