"""What is news of a vehicle, and what is not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from by_hand import PRIMARY, vehicle
from life_by_hand import IN_THE_EAST, IN_THE_WEST, Lives

from comms.said.announcement import Role
from comms.said.codec import Header
from comms.said.messages import AgentState, Curve, Mode, Plan, PlannedTrack
from comms.said.tally import tally
from coordinator.vehicles import KnownVehicle, expected_end_ms, pass_of, sailing_of, way_home_of
from planner.currents import FlowGrid
from planner.dubins import Pose


def curve(track: int, p_detect: float, points: int = 2) -> Curve:
    return Curve(track, 10.0, np.full(points, p_detect), 0)


def test_of_a_track_s_curves_the_newest_is_news_and_counts() -> None:
    primary = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
    told = [
        (5, curve(1, 0.5), True),
        (4, curve(1, 0.4), False),
        (5, curve(1, 0.5), False),
        (4, curve(2, 0.3), True),
        (6, curve(1, 0.6), True),
        (7, curve(1, 0.7, points=1), False),  # no curve at all
    ]
    assert [primary.hear_survey(Header(PRIMARY, 0, number, 0), one) for number, one, _ in told] == [
        is_news for _, _, is_news in told
    ]
    assert {track: one.p_detect.tolist() for track, one in primary.curves.items()} == {1: [0.6, 0.6], 2: [0.3, 0.3]}


def test_of_plans_that_of_the_latest_revision_is_news_and_counts() -> None:
    primary = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
    plans = [Plan(one, (PlannedTrack(one, 0, 0, 0, 0, 400, False),), (), (), "") for one in (2, 1, 2, 3)]
    news = [primary.hear_survey(Header(PRIMARY, 0, number, 0), one) for number, one in enumerate(plans)]
    assert news == [True, False, False, True]
    assert primary.plan == plans[3]


@pytest.mark.parametrize(("drift_mps", "takes_s"), [(0.0, 240), (0.5, 180)])
def test_a_survey_ends_when_its_last_track_does_by_the_speed_over_the_ground(drift_mps: float, takes_s: float) -> None:
    # 40 m of way, 20 m of run-in and 300 m of track, all northwards at 1.5 m/s through the water.
    entry = replace(vehicle(PRIMARY, Role.SURVEY), drift_mps=drift_mps)
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, False),), (), (), "")
    state = AgentState(Mode.TRANSIT, 1, 1, 0, 0, -60, 0)
    assert expected_end_ms(entry, state, plan, 10_000) == 10_000 + takes_s * 1000


NORTHWARDS = PlannedTrack(1, 0, 0, 0, 0, 300, False)
BESIDE = PlannedTrack(2, 0, 40, 300, 40, 0, False)  # southwards; two turns of 20 m apart
FLOWN = PlannedTrack(7, 0, -40, 0, -40, 300, True)


def state(mode: Mode = Mode.IDLE, works_on: int = 0, x_m: float = 0, y_m: float = 0, ends_ms: int = 0) -> AgentState:
    return AgentState(mode, works_on, 1, ends_ms, x_m, y_m, 0)


def heard(
    one: KnownVehicle, told: AgentState, now_ms: int = 0, *, sent_ms: int = 0, sequence: int = 0, incarnation: int = 0
) -> bool:
    return one.hear_state(Header(one.entry.vehicle, incarnation, sequence, sent_ms), told, now_ms)


class TestWhenASurveyEnds:
    """At 1.5 m/s, with 20 m of run-in and of run-out."""

    ENTRY = vehicle(PRIMARY, Role.SURVEY)

    def ends_ms(self, told: AgentState | None, *tracks: PlannedTrack, heard_ms: int = 10_000) -> int | None:
        return expected_end_ms(self.ENTRY, told, Plan(1, tracks, (), (), ""), heard_ms)

    def test_nobody_can_tell_before_both_are_known_and_when_it_has_ended(self) -> None:
        assert self.ends_ms(None, NORTHWARDS) is None
        assert expected_end_ms(self.ENTRY, state(Mode.SURVEY, 1), None, 10_000) is None
        for mode in (Mode.FINISHED, Mode.HOME, Mode.EMPTY):
            assert self.ends_ms(state(mode), NORTHWARDS) is None

    @pytest.mark.parametrize(("says_ms", "ends_ms"), [(90_000, 90_000), (9_000, 10_000)])
    def test_on_its_way_home_when_it_is_there(self, says_ms: int, ends_ms: int) -> None:
        assert self.ends_ms(state(Mode.RETURNING, ends_ms=says_ms), NORTHWARDS) == ends_ms

    @pytest.mark.parametrize(("says_ms", "ends_ms"), [(90_000, 90_000), (9_000, 10_000), (1, 10_000)])
    def test_on_its_last_track_when_that_ends(self, says_ms: int, ends_ms: int) -> None:
        assert self.ends_ms(state(Mode.SURVEY, 1, ends_ms=says_ms), FLOWN, NORTHWARDS) == ends_ms

    def test_where_no_track_is_left_it_has_ended(self) -> None:
        assert self.ends_ms(state(Mode.SURVEY, 7, ends_ms=90_000), FLOWN) == 10_000
        assert self.ends_ms(state(Mode.TRANSIT)) == 10_000

    def test_before_its_last_track_after_the_run_out_the_turn_the_run_in_and_the_track(self) -> None:
        takes_s = (20 + math.pi * 20 + 20 + 300) / 1.5
        found = self.ends_ms(state(Mode.SURVEY, 1, ends_ms=90_000), FLOWN, NORTHWARDS, BESIDE)
        assert found == pytest.approx(90_000 + takes_s * 1000, abs=1.5)

    @pytest.mark.parametrize(("works_on", "says_ms"), [(1, 0), (7, 90_000)])
    def test_else_from_where_it_was_heard(self, works_on: int, says_ms: int) -> None:
        # 40 m before the run-in's beginning.
        told = state(Mode.TRANSIT, works_on, y_m=-60, ends_ms=says_ms)
        assert self.ends_ms(told, NORTHWARDS) == 10_000 + 240_000
        takes_s = (40 + 340 + math.pi * 20 + 320) / 1.5
        assert self.ends_ms(told, NORTHWARDS, BESIDE) == pytest.approx(10_000 + takes_s * 1000, abs=1.5)

    def test_who_is_at_the_second_track_has_flown_the_first_whatever_its_plan_tells_yet(self) -> None:
        assert self.ends_ms(state(Mode.TRANSIT, 2, ends_ms=90_000), NORTHWARDS, BESIDE) == 90_000
        # From where the run-in to the second one begins; until it says when it ends.
        takes_s = (20 + 300) / 1.5
        told = AgentState(Mode.TRANSIT, 2, 1, 0, 40, 320, math.pi)
        assert self.ends_ms(told, NORTHWARDS, BESIDE) == pytest.approx(10_000 + takes_s * 1000, abs=1.5)

    def test_in_a_current_run_out_and_turns_are_by_what_it_makes_good(self) -> None:
        # 0.5 m/s to the north: 2 m/s over the run-out, and 1 m/s from the run-in on; with a third track 2 m/s again.
        entry = replace(self.ENTRY, drift_mps=0.5)
        tracks = (
            *(NORTHWARDS, replace(BESIDE, start_x_m=400.0, end_x_m=400.0)),
            replace(NORTHWARDS, number=3, start_x_m=800.0, end_x_m=800.0),
        )
        sailing = sailing_of(entry)
        for count, last_run_out_s in ((2, 20), (3, 10)):
            plan = Plan(1, tracks[:count], (), (), "")
            found = expected_end_ms(entry, state(Mode.SURVEY, 1, ends_ms=90_000), plan, 10_000)
            passes = [pass_of(one, entry) for one in plan.tracks]
            takes_s = 10 + sailing.passes_s(passes[1:], 20, passes[0].end) - last_run_out_s
            assert found == pytest.approx(90_000 + takes_s * 1000, abs=1.5)

    def test_flows_count_only_where_there_is_a_current(self) -> None:
        axis = np.zeros(1)
        flows = FlowGrid(axis, axis, axis, np.zeros((1, 1, 1)), np.ones((1, 1, 1)))
        assert sailing_of(self.ENTRY, flows).grid is None
        assert sailing_of(replace(self.ENTRY, drift_mps=0.5), flows).grid is flows
        assert KnownVehicle(replace(self.ENTRY, drift_mps=0.5), 0, flows=flows).sailing.grid is flows

    def test_a_vehicle_tells_it_of_itself_until_it_has_surveyed_all(self) -> None:
        one = KnownVehicle(self.ENTRY, 0, plan=Plan(1, (NORTHWARDS,), (), (), ""))
        heard(one, state(Mode.SURVEY, 1, ends_ms=90_000), sent_ms=10_000)
        assert one.expected_end_ms == 90_000
        one.finished_ms = 70_000
        assert one.expected_end_ms == 70_000


class TestWhatItDoes:
    @pytest.mark.parametrize(
        ("role", "mode", "idle", "at_a_strip", "on_its_way"),
        [
            (Role.REVISIT, None, False, False, False),
            (Role.REVISIT, Mode.IDLE, True, False, False),
            (Role.REVISIT, Mode.FINISHED, False, False, False),
            (Role.REVISIT, Mode.TRANSIT, False, True, True),
            (Role.REVISIT, Mode.REVISIT, False, True, False),
            (Role.SURVEY, Mode.TRANSIT, False, False, False),
            (Role.SURVEY, Mode.REVISIT, False, False, False),
            (Role.SURVEY_REVISIT, Mode.IDLE, True, False, False),
            (Role.SURVEY_REVISIT, Mode.FINISHED, True, False, False),
            (Role.SURVEY_REVISIT, Mode.TRANSIT, False, False, False),
            (Role.SURVEY_REVISIT, Mode.REVISIT, False, True, False),
        ],
    )
    def test_whether_it_is_free_or_at_a_strip_or_on_its_way_to_one(
        self, role: Role, mode: Mode | None, idle: bool, at_a_strip: bool, on_its_way: bool
    ) -> None:
        one = KnownVehicle(vehicle("one", role), 0, None if mode is None else state(mode))
        assert (one.is_idle, one.is_at_a_strip, one.is_on_its_way) == (idle, at_a_strip, on_its_way)
        one.silent = True
        assert (one.is_idle, one.is_at_a_strip, one.is_on_its_way) == (False, at_a_strip, on_its_way)
        one.finished_ms = 0
        sets_out = role is Role.SURVEY_REVISIT and mode is Mode.TRANSIT
        assert (one.is_at_a_strip, one.is_on_its_way) == (at_a_strip or sets_out, on_its_way or sets_out)

    @pytest.mark.parametrize("mode", Mode)
    def test_whether_it_has_finished_or_returns(self, mode: Mode) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        assert not one.is_finished
        assert not one.is_returning
        one.state = state(mode)
        assert one.is_finished is (mode in (Mode.FINISHED, Mode.RETURNING, Mode.HOME, Mode.EMPTY))
        assert one.is_returning is (mode is Mode.RETURNING)
        one.lost = True
        assert not one.is_returning


class TestStates:
    def test_of_one_that_was_never_heard_nothing_is_held_against_it(self) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        assert (one.silent, one.lost, one.ended_early, one.finished_ms, one.expected_end_ms) == (
            *[False] * 3,
            None,
            None,
        )
        assert (one.asked_back, one.agreed_next, one.failures, one.unanswered) == (0, 0, 0, 0)
        assert one.is_trusted
        assert heard(one, state())  # its first message of all, by start and number

    def test_the_newest_counts_and_tells_when_it_was_heard(self) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0, silent=True, lost=True)
        assert heard(one, state(), sent_ms=1000, sequence=3)
        assert (one.heard_ms, one.silent, one.lost) == (1000, False, False)
        one.silent = one.lost = True
        for sequence in (2, 3):
            assert not heard(one, state(Mode.TRANSIT, 1), sent_ms=2000, sequence=sequence)
        assert (one.state, one.heard_ms, one.silent, one.lost) == (state(), 1000, True, True)
        assert heard(one, state(Mode.TRANSIT, 1), sent_ms=3000, sequence=0, incarnation=1)
        assert (one.state, one.heard_ms) == (state(Mode.TRANSIT, 1), 3000)

    def test_who_is_started_anew_may_do_better(self) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        heard(one, state())
        one.failures, one.unanswered = 2, 3
        heard(one, state(), sequence=1)
        assert (one.failures, one.unanswered) == (2, 3)
        heard(one, state(), incarnation=1)
        assert (one.failures, one.unanswered) == (0, 0)

    @pytest.mark.parametrize(
        ("told", "incarnation", "stirs"),
        [
            (state(Mode.TRANSIT, 1, 3, 4), 0, False),
            (state(Mode.TRANSIT, 1, 3, 4, ends_ms=9), 0, False),
            (state(Mode.REVISIT, 1, 3, 4), 0, True),
            (state(Mode.TRANSIT, 2, 3, 4), 0, True),
            (state(Mode.TRANSIT, 1, 3.5, 4), 0, True),
            (state(Mode.TRANSIT, 1, 3, 4.5), 0, True),
            (state(Mode.TRANSIT, 1, 3, 4), 1, True),
        ],
    )
    def test_it_stirs_if_it_is_elsewhere_at_something_else_or_started_anew(
        self, told: AgentState, incarnation: int, stirs: bool
    ) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        heard(one, state(Mode.TRANSIT, 1, 3, 4), sent_ms=1000, sequence=5)
        assert one.stirred_ms == 1000
        heard(one, told, sent_ms=2000, sequence=6, incarnation=incarnation)
        assert one.stirred_ms == (2000 if stirs else 1000)

    def test_it_has_surveyed_all_when_it_first_says_so(self) -> None:
        one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
        heard(one, state(Mode.SURVEY, 1), 1000)
        assert (one.finished_ms, one.ended_early) == (None, False)
        heard(one, state(Mode.FINISHED), 2000, sequence=1)
        heard(one, state(Mode.FINISHED), 3000, sequence=2)
        heard(one, state(Mode.RETURNING), 4000, sequence=3)
        heard(one, state(Mode.HOME), 5000, sequence=4)
        assert (one.finished_ms, one.ended_early) == (2000, False)

    def test_who_goes_home_before_has_ended_early_when_it_is_there(self) -> None:
        one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
        heard(one, state(Mode.RETURNING), 2000)
        assert (one.finished_ms, one.ended_early) == (None, True)
        heard(one, state(Mode.HOME), 3000, sequence=1)
        assert one.finished_ms == 3000

    def test_who_is_given_up_has_not_surveyed_all_if_it_stirs_and_has_when_it_says_so(self) -> None:
        for stirs, finished_ms in ((False, 2000), (True, None)):
            one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
            heard(one, state(Mode.SURVEY, 1), 1000)
            one.give_up(2000)
            assert one.finished_ms == 2000
            heard(one, state(Mode.SURVEY, 1, 1.0 if stirs else 0.0), 3000, sequence=1)
            assert one.finished_ms == finished_ms
            heard(one, state(Mode.FINISHED), 4000, sequence=2)
            assert one.finished_ms == 4000

    def test_who_is_given_up_after_it_had_finished_may_be_at_it_again(self) -> None:
        one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
        heard(one, state(Mode.FINISHED), 1000)
        heard(one, state(Mode.SURVEY, 2), 2000, sequence=1)  # of that start it is over
        assert one.finished_ms == 1000
        heard(one, state(Mode.SURVEY, 1), 3000, incarnation=1)
        assert one.finished_ms is None
        heard(one, state(Mode.FINISHED), 4000, sequence=1, incarnation=1)
        assert one.finished_ms == 4000

    def test_of_what_it_has_told_something_is_missing_until_it_has_come(self) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        assert not one.lacks
        heard(one, state())
        assert not one.lacks
        told = replace(state(), tiles_told=tally([4]))
        heard(one, told, sequence=1)
        assert one.lacks
        one.arrivals.note_tile(0, "a", 4)
        assert not one.lacks
        heard(one, told, incarnation=1)
        assert one.lacks
        one.arrivals.note_tile(1, "a", 4)
        assert not one.lacks

    def test_plans_and_curves_of_a_later_start_are_news(self) -> None:
        one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
        plan = Plan(3, (NORTHWARDS,), (), (), "")
        for incarnation, revision, is_news in ((0, 3, True), (0, 3, False), (1, 1, True), (0, 4, False), (1, 2, True)):
            assert one.hear_survey(Header(PRIMARY, incarnation, 0, 0), replace(plan, revision=revision)) is is_news
        for incarnation, sequence, is_news in ((0, 0, True), (1, 0, True), (0, 5, False), (1, 1, True)):
            assert one.hear_survey(Header(PRIMARY, incarnation, sequence, 0), curve(0, 0.5)) is is_news


class TestTrust:
    def test_three_failures_or_ten_silences_in_a_row_are_too_many(self, caplog: pytest.LogCaptureFixture) -> None:
        caplog.set_level("WARNING", "secondlook.coordinator")
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        for times in range(1, 5):
            one.note_failure()
            assert one.is_trusted is (times < 3)
        assert (one.failures, one.failed_at) == (4, [])
        assert [told.getMessage() for told in caplog.records] == [
            "one is offered nothing more: it has not served 3 strips in a row"
        ]
        caplog.clear()
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        for times in range(1, 12):
            one.note_silence()
            assert one.is_trusted is (times < 10)
        assert [told.getMessage() for told in caplog.records] == [
            "one is offered nothing more: 10 offers in a row are not answered"
        ]

    def test_where_it_has_failed_and_what_it_has_refused_is_not_for_it(self) -> None:
        one, lives = KnownVehicle(vehicle("one", Role.REVISIT), 0), Lives()
        first, second = lives.open(IN_THE_WEST), lives.open(IN_THE_EAST)
        one.note_failure(IN_THE_EAST)
        assert one.failed_at == [IN_THE_EAST]
        assert (one.is_not_for_it(first), one.is_not_for_it(second)) == (False, True)
        one.refused.add(1)
        assert one.is_not_for_it(first)
        one.gave_way.add(1)  # it was told to give it back to let another pass
        assert not one.is_not_for_it(first)
        one.note_refusal(1)
        one.note_refusal(5)
        assert (one.refused, one.gave_way) == ({1, 5}, set())
        assert one.is_not_for_it(first)

    def test_of_a_strip_only_what_is_newer_than_all_that_it_has_told_is_news(self) -> None:
        one = KnownVehicle(vehicle("one", Role.REVISIT), 0)
        headers = {(start, number): Header("one", start, number, 0) for start in (0, 1) for number in range(3)}
        assert not one.has_told_since(headers[0, 0], 7)
        news = [one.hear_word_of(7, headers[at]) for at in ((0, 0), (0, 0), (0, 2), (0, 1), (1, 0), (0, 2))]
        assert news == [True, False, True, False, True, False]
        assert one.hear_word_of(8, headers[0, 0])
        assert [one.has_told_since(headers[at], 7) for at in ((0, 2), (1, 0), (1, 1))] == [True, False, False]
        assert [one.has_told_since(headers[at], 8) for at in ((0, 0), (0, 1))] == [False, False]


def test_who_looks_ahead_flies_its_track_so_much_earlier() -> None:
    shape = {"footprint": "wedge", "near_m": 3.0, "far_m": 50.0, "half_angle_rad": math.pi / 4, "look_m": 10.0}
    entry = replace(vehicle(PRIMARY, Role.SURVEY), **shape)  # type: ignore[arg-type]
    assert pass_of(NORTHWARDS, entry).begin[:2] == pytest.approx((0, -50))  # by 30 m, and 20 m of run-in
    assert pass_of(NORTHWARDS, entry).end[:2] == pytest.approx((0, 290))


def test_a_way_home_leads_to_where_it_set_out_by_what_it_makes_good() -> None:
    entry = replace(vehicle("one", Role.REVISIT), home_x_m=30.0, home_y_m=40.0)
    way = way_home_of(entry).way(Pose(30, 140, math.pi))
    assert sum(one.length_m for one in way) == pytest.approx(100)
