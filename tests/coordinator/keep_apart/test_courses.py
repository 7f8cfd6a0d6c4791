"""Where vehicles are expected to be, and whether two come too close."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from by_hand import vehicle
from hypothesis import given
from hypothesis import strategies as st
from situations import helper, strip

from comms.said.announcement import Role
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.allocate.service import expected_service, sweeps
from coordinator.allocate.situation import OpenStrip
from coordinator.keep_apart.courses import (
    STEP_S,
    Course,
    _nearest_m,
    course,
    lying_still,
    run_out_left_m,
    straight,
    survey_course,
    survey_run_out_left_m,
    sweep_course,
    too_close,
)
from coordinator.vehicles import tracks_of
from planner.currents import Sailing
from planner.dubins import DubinsPath, Pose
from planner.keep_out import KeepOut
from planner.sweep import shortest_sweep

EAST, NORTH, SOUTH = math.pi / 2, 0.0, math.pi


def ahead(x_m: float, y_m: float, heading_rad: float, speed_mps: float, length_m: float = 2000) -> Course:
    """Straight on from time 0."""
    start = Pose(x_m, y_m, heading_rad)
    return course(start, 0, Sailing(speed_mps), 10, [straight(start, length_m, 10)])


class TestCourses:
    def test_it_is_where_its_speed_takes_it_and_then_circles(self) -> None:
        laid = course(Pose(0, 0, EAST), 5, Sailing(2), 10, [straight(Pose(0, 0, EAST), 100, 10)])
        assert laid.at(25) == pytest.approx((40, 0, EAST))  # 20 s at 2 m/s
        assert laid.at(0) == (0, 0, EAST)
        assert laid.later(2).at(25) == pytest.approx((32, 0, EAST))
        assert laid.arrives_s == 55
        later = laid.poses[(np.arange(len(laid.poses)) + laid.first) * STEP_S >= 55]
        assert np.hypot(later[:, 0] - 100, later[:, 1] + 10) == pytest.approx(10)  # to starboard
        # All the time: 4 m on the circle from each step to the next.
        assert np.hypot(*np.diff(later[:, :2], axis=0).T) == pytest.approx(2 * 10 * math.sin(0.2))

    def test_it_is_laid_for_900_s_beyond_its_paths_and_where_it_lies_still(self) -> None:
        laid = course(Pose(0, 0, EAST), 5, Sailing(2), 10, [straight(Pose(0, 0, EAST), 100, 10)])
        assert (laid.first, laid.end) == (3, 3 + (50 + 900) / STEP_S)
        longer = course(Pose(0, 0, EAST), 5, Sailing(2), 10, [straight(Pose(0, 0, EAST), 102, 10)])
        assert longer.end == 3 + 476  # 951 s
        still = lying_still(Pose(7, 8, EAST), 5)
        assert (still.first, still.end) == (3, 3 + 900 / STEP_S)
        assert set(map(tuple, still.poses.tolist())) == {(7, 8, EAST)}

    @pytest.mark.parametrize("sailing", [Sailing(2), Sailing(2, 0.7, 2.5)])
    def test_between_its_steps_it_is_where_they_let_expect_and_after_the_last_as_then(self, sailing: Sailing) -> None:
        start = Pose(3, -4, 0.4)
        turn = DubinsPath(start, 10, (1, 0, -1), (13.0, 21.0, 9.0))
        then = straight(turn.pose_at(turn.length_m), 77, 10)
        laid = course(start, 7.3, sailing, 10, [turn, straight(turn.pose_at(turn.length_m), 0, 10), then])
        assert laid.first == 4
        for step in (0, 1, 5, 17, 30, 40, 60, len(laid.poses) - 1):
            assert laid.at((laid.first + step) * STEP_S) == pytest.approx(laid.poses[step].tolist(), abs=1e-6)
        assert laid.at(laid.arrives_s)[:2] == pytest.approx(then.pose_at(77)[:2], abs=1e-6)
        end = laid.at((laid.end - 1) * STEP_S)
        assert laid.at(laid.end * STEP_S) == laid.at(1e9) == end
        assert len(laid._asked) == 1  # what was asked for last
        # It circles at its speed, whatever the current.
        circle_s = math.tau * 10 / 2
        assert laid.at(laid.arrives_s + circle_s)[:2] == pytest.approx(laid.at(laid.arrives_s)[:2], abs=1e-6)

    def test_one_that_waits_does_all_so_much_later(self) -> None:
        laid = course(Pose(0, 0, EAST), 5, Sailing(2), 10, [straight(Pose(0, 0, EAST), 100, 10)])
        later = laid.later(3)
        assert (later.first, later.end, later.arrives_s) == (laid.first, laid.end + 3, laid.arrives_s + 6)
        assert later.poses[:4].tolist() == [laid.poses[0].tolist()] * 4
        assert (later.poses[3:] == laid.poses).all()
        assert later.at(8) == laid.at(5) == (0, 0, EAST)
        assert laid.at(31) == pytest.approx(later.at(37))

    def test_where_there_is_room_to_neither_side_it_is_expected_to_starboard_all_the_same(self) -> None:
        walls = KeepOut(
            tuple(((x_m, -500.0), (x_m + 32, -500.0), (x_m + 32, 900.0), (x_m, 900.0)) for x_m in (-40.0, 8.0))
        )
        start = Pose(0, 0, NORTH)
        laid = course(start, 0, Sailing(2), 10, [straight(start, 100, 10)], walls)
        circling = laid.poses[(np.arange(len(laid.poses)) + laid.first) * STEP_S >= 50]
        assert np.hypot(circling[:, 0] - 10, circling[:, 1] - 100) == pytest.approx(10)

    @pytest.mark.parametrize("lengths_m", [(300.0, 0.0, 0.0), (100.0, 0.0, 200.0)])
    def test_in_a_current_it_is_where_what_it_makes_good_takes_it(self, lengths_m: tuple[float, float, float]) -> None:
        path = DubinsPath(Pose(0, 0, EAST), 10, (0, 0, 0), lengths_m)
        with_it = course(Pose(0, 0, EAST), 5, Sailing(2, 1, EAST), 10, [path])
        assert with_it.at(25) == pytest.approx((60, 0, EAST))  # 20 s at 3 m/s
        assert with_it.arrives_s == pytest.approx(105)

    def test_a_sweep_ends_when_and_where_its_service_does(self) -> None:
        one, free = strip(1, 300, 100), helper(x_m=-50, heading_rad=2.0)
        sweep, _ = shortest_sweep(sweeps(one, free), free.pose, free.turn_radius_m)
        laid = sweep_course(free.pose, 0, free.sailing, free.turn_radius_m, sweep.passes)
        served = expected_service(OpenStrip(one, 1), free)
        assert laid.arrives_s == pytest.approx(served.free_s)
        assert laid.at(served.free_s) == pytest.approx(served.free_at, abs=1e-6)

    def test_a_run_out_is_sailed_before_the_way_to_the_next_strip(self) -> None:
        free = helper(heading_rad=EAST)
        sweep, _ = shortest_sweep(sweeps(strip(1, 300, 100), free), free.pose, free.turn_radius_m)
        at_once = sweep_course(free.pose, 0, Sailing(2), 6, sweep.passes)
        later = sweep_course(free.pose, 0, Sailing(2), 6, sweep.passes, run_out_m=20)
        assert later.at(10) == pytest.approx((20, 0, EAST))
        assert at_once.at(10).y_m > 1
        assert later.arrives_s == pytest.approx(at_once.arrives_s, abs=2)

    @pytest.mark.parametrize("swath_m", [50, 30])
    def test_who_is_on_the_first_leg_goes_on_over_it_and_then_over_the_others(self, swath_m: float) -> None:
        free = helper(swath_m=swath_m)
        sweep, _ = shortest_sweep(sweeps(strip(1), free), free.pose, free.turn_radius_m)
        begin = sweep.passes[0].begin
        whole = sweep_course(begin, 0, Sailing(2), 6, sweep.passes)
        on_it = whole.at(40)
        assert on_it.y_m == pytest.approx(begin.y_m + 80)
        laid = sweep_course(on_it, 40, Sailing(2), 6, sweep.passes, entered=True)
        assert laid.arrives_s == pytest.approx(whole.arrives_s)
        assert laid.at(90)[:2] == pytest.approx(whole.at(90)[:2])

    def test_a_strip_that_takes_longer_than_half_an_hour_is_laid_to_its_end(self) -> None:
        one, free = strip(1, 0, 0, length_m=4000), helper(x_m=0, y_m=-100)
        sweep, _ = shortest_sweep(sweeps(one, free), free.pose, free.turn_radius_m)
        laid = sweep_course(free.pose, 0, free.sailing, free.turn_radius_m, sweep.passes)
        crosses_s = laid.arrives_s - 60
        assert crosses_s > 1800
        meets = laid.at(crosses_s)
        crossing = ahead(meets.x_m - 2 * crosses_s, meets.y_m, EAST, 2, 2 * crosses_s + 200)
        found = too_close(laid, crossing, 10, 0, crosses_s + 100)
        assert found is not None
        assert found.time_s == pytest.approx(crosses_s, abs=20)

    @pytest.mark.parametrize(
        ("pose", "left_m"),
        [
            (Pose(0, 90, NORTH), 10),
            (Pose(0, 99.5, NORTH), 0.5),
            (Pose(0, 100, NORTH), 0),
            (Pose(0, 101, NORTH), 0),
            (Pose(0, 90, 0.2), 0),  # it has turned
            (Pose(60, 90, NORTH), 0),
            (Pose(0, -100, NORTH), 0),
        ],
    )
    def test_what_is_left_of_a_run_out(self, pose: Pose, left_m: float) -> None:
        assert run_out_left_m(Pose(0, 100, NORTH), pose, 20) == pytest.approx(left_m)

    @pytest.mark.parametrize(
        ("ahead_m", "beside_m", "turned_rad", "left_m"),
        [
            *((22, 0, 0, 22), (22.1, 0, 0, 0), (1, 1.9, 0, 1), (1, -1.9, 0, 1), (1, 2.1, 0, 0), (1, -2.1, 0, 0)),
            *((7, 0, 0.14, 7), (7, 0, -0.14, 7), (7, 0, 0.142, 0), (7, 0, -0.142, 0), (7, 0, math.pi, 0)),
            *((0.5, 0, 0, 0.5), (-0.5, 0, 0, 0)),
        ],
    )
    def test_up_to_2_m_before_it_and_to_either_side_it_is_on_a_run_out(
        self, ahead_m: float, beside_m: float, turned_rad: float, left_m: float
    ) -> None:
        sin, cos = math.sin(0.7), math.cos(0.7)
        x_m, y_m = 30 - ahead_m * sin + beside_m * cos, -40 - ahead_m * cos - beside_m * sin
        # A nanometre nearer: 22 m is the most, and sums of sines are not exact.
        found = run_out_left_m(Pose(30, -40, 0.7), Pose(x_m + 1e-9 * sin, y_m + 1e-9 * cos, 0.7 + turned_rad), 20)
        assert found == pytest.approx(left_m)

    @pytest.mark.parametrize(("beside_m", "left_m"), [(2.0, 5.0), (-2.0, 5.0)])
    def test_just_2_m_beside_it_still_is(self, beside_m: float, left_m: float) -> None:
        assert run_out_left_m(Pose(0, 100, NORTH), Pose(beside_m, 95, NORTH), 20) == left_m
        assert run_out_left_m(Pose(0, 100, NORTH), Pose(beside_m, 78, NORTH), 20) == 22

    def test_a_run_out_is_that_of_the_last_track_that_was_flown(self) -> None:
        entry = vehicle("primary", Role.SURVEY)
        tracks = (PlannedTrack(1, 0, 0, 0, 0, 300, True), PlannedTrack(2, 0, 80, 300, 80, 0, True))
        plan = Plan(1, (*tracks, PlannedTrack(3, 0, 160, 0, 160, 300, False)), (), (), "")
        state = AgentState(Mode.TRANSIT, 3, 1, 0, 80, -8, SOUTH)

        def left_m(plan: Plan | None, pose: Pose) -> float:
            return survey_run_out_left_m(entry, tracks_of(plan, state)[0], pose)

        assert left_m(plan, Pose(80, -8, SOUTH)) == pytest.approx(12)
        assert left_m(plan, Pose(80, -14, SOUTH)) == pytest.approx(6)
        assert left_m(plan, Pose(0, 308, NORTH)) == 0
        assert left_m(replace(plan, tracks=plan.tracks[2:]), Pose(80, -8, SOUTH)) == 0
        assert left_m(None, Pose(80, -8, SOUTH)) == 0

    @pytest.mark.parametrize("told", [False, True])
    def test_who_is_at_the_next_track_has_flown_the_last_whether_its_plan_tells_it_yet_or_not(self, told: bool) -> None:
        entry = vehicle("primary", Role.SURVEY)
        tracks = (PlannedTrack(1, 0, 0, 0, 0, 300, told), PlannedTrack(2, 0, 80, 300, 80, 0, False))
        state = AgentState(Mode.TRANSIT, 2, 1, 0, 0, 300, NORTH)
        laid = survey_course(entry, state, Plan(1, tracks, (), (), ""), 0)
        assert laid.poses[:, 1].min() < -entry.run_in_m + 2  # by the second track alone
        assert laid.at(entry.run_in_m / 1.5)[:2] == pytest.approx((0, 300 + entry.run_in_m))
        assert laid.arrives_s == pytest.approx((2 * 20 + 300 + 20 + math.pi * 20 + 40) / 1.5, abs=1)

    def test_where_no_plan_was_told_a_primary_circles_where_it_was_heard(self) -> None:
        laid = survey_course(vehicle("primary", Role.SURVEY), AgentState(Mode.TRANSIT, 1, 1, 0, 5, 6, NORTH), None, 9)
        assert (laid.start_s, laid.arrives_s) == (9, 9)
        assert laid.at(9 + math.pi * 20 / 1.5) == pytest.approx((45, 6, SOUTH))

    @pytest.mark.parametrize(
        ("state", "begins", "arrives_s"),
        [
            # 20 m of run-in and of run-out; the track itself takes 200 s.
            (AgentState(Mode.SURVEY, 1, 1, 100_000, 0, 7, 0), (0, 300 - 1.5 * 90, NORTH), 100 + 20 / 1.5),
            (AgentState(Mode.SURVEY, 1, 1, 1, 0, 310, 0), (0, 300, NORTH), 10 + 20 / 1.5),  # that is past
            (AgentState(Mode.SURVEY, 1, 1, 0, 0, -20, 0), (0, -20, NORTH), 10 + 340 / 1.5),
            (AgentState(Mode.SURVEY, 2, 1, 100_000, 0, -20, 0), (0, -20, NORTH), 10 + 340 / 1.5),
            (AgentState(Mode.TRANSIT, 1, 1, 100_000, 0, -20, 0), (0, -20, NORTH), 10 + 340 / 1.5),
            (AgentState(Mode.FINISHED, 1, 1, 100_000, 0, -20, 0), (0, -20, NORTH), 10),
        ],
    )
    def test_where_a_primary_is_on_its_track(
        self, state: AgentState, begins: tuple[float, float, float], arrives_s: float
    ) -> None:
        plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, False),), (), (), "")
        laid = survey_course(vehicle("primary", Role.SURVEY), state, plan, 10)
        assert laid.at(10) == pytest.approx(begins)
        assert laid.arrives_s == pytest.approx(arrives_s)

    def test_a_track_under_way_ends_when_the_primary_says(self) -> None:
        entry = vehicle("primary", Role.SURVEY)
        tracks = (PlannedTrack(1, 0, 0, 0, 0, 400, False), PlannedTrack(2, 100, 100, 400, 100, 0, False))
        state = AgentState(Mode.SURVEY, 1, 1, 100_000, 0, 7, 0)
        laid = survey_course(entry, state, Plan(1, tracks, (), (), ""), 0)
        assert laid.at(100)[:2] == pytest.approx((0, 400))
        on_second = laid.poses[np.abs(laid.poses[:, 2] - SOUTH) < 1e-6]
        assert on_second[:, 0] == pytest.approx(100)
        assert on_second[:, 1].min() < 10

    def test_all_tracks_of_a_long_survey_are_laid(self) -> None:
        # 6 tracks of 2000 m at 2 m/s: 6000 s and their turns; the last is flown southward at x = 250.
        entry = replace(vehicle("primary", Role.SURVEY), speed_mps=2.0)
        lines = [(50.0 * track, *((2000.0, 0.0) if track % 2 else (0.0, 2000.0))) for track in range(6)]
        tracks = tuple(
            PlannedTrack(number, x_m, x_m, begin_m, x_m, end_m, False)
            for number, (x_m, begin_m, end_m) in enumerate(lines, 1)
        )
        laid = survey_course(entry, AgentState(Mode.TRANSIT, 1, 1, 0, 0, 0, 0), Plan(1, tracks, (), (), ""), 0)
        assert laid.arrives_s > 6000
        surveys_last = laid.poses[(np.abs(laid.poses[:, 0] - 250) < 1e-6) & (np.abs(laid.poses[:, 2] - SOUTH) < 1e-6)]
        assert len(surveys_last) * STEP_S == pytest.approx(1000, abs=2 * STEP_S + entry.run_in_m)

    def test_nothing_is_laid_beyond_a_day_whatever_a_primary_says(self) -> None:
        tracks = (PlannedTrack(1, 0, 0, 0, 0, 1e7, False), PlannedTrack(2, 0, 1e7, 1e7, -1e7, -1e7, False))
        for says_ms in (0, 2**53):
            state = AgentState(Mode.SURVEY, 1, 1, says_ms, 0, 0, 0)
            laid = survey_course(vehicle("primary", Role.SURVEY), state, Plan(1, tracks, (), (), ""), 10)
            assert len(laid.poses) == 86_400 / STEP_S
            assert laid.arrives_s > 86_400
            assert np.isfinite(laid.poses).all()

    def test_a_primary_that_looks_ahead_is_where_its_track_is_flown_earlier(self) -> None:
        # Its swath begins 30 m ahead of it, see tests/planner/footprints/test_wedge.py.
        shape = {"footprint": "wedge", "near_m": 3.0, "far_m": 50.0, "half_angle_rad": math.pi / 4, "look_m": 10.0}
        entry = replace(vehicle("primary", Role.SURVEY), **shape)  # type: ignore[arg-type]
        track = PlannedTrack(1, 0, 0, 0, 0, 400, False)
        state = AgentState(Mode.SURVEY, 1, 1, 100_000, 0, 7, 0)
        laid = survey_course(entry, state, Plan(1, (track,), (), (), ""), 0)
        assert laid.at(100)[:2] == pytest.approx((0, 370))

    def test_a_run_out_is_sailed_to_its_end(self) -> None:
        entry = vehicle("primary", Role.SURVEY)
        plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 400, True),), (), (), "")
        laid = survey_course(entry, AgentState(Mode.FINISHED, 0, 1, 0, 0, 401, 0), plan, 0)
        assert laid.poses[:, 1].max() == pytest.approx(400 + entry.run_in_m + entry.turn_radius_m, abs=1)

    @given(
        st.tuples(st.floats(-200, 200), st.floats(-200, 200), st.floats(0, 6.3)),
        st.tuples(st.floats(0.5, 3), st.floats(3, 20), st.floats(0, 100)),
    )
    def test_no_step_is_longer_than_the_vehicle_goes(
        self, place: tuple[float, float, float], moves: tuple[float, float, float]
    ) -> None:
        speed_mps, radius_m, start_s = moves
        free = helper(x_m=place[0], y_m=place[1], heading_rad=place[2], speed_mps=speed_mps, turn_radius_m=radius_m)
        sweep, _ = shortest_sweep(sweeps(strip(1), free), free.pose, radius_m)
        laid = sweep_course(free.pose, start_s, Sailing(speed_mps), radius_m, sweep.passes)
        steps = [math.dist(one[:2], other[:2]) for one, other in pairwise(laid.poses.tolist())]
        assert max(steps) <= speed_mps * STEP_S + 1e-6


class TestTooClose:
    def test_between_two_steps_both_go_straight(self) -> None:
        apart = np.array([[3.0, 4.0], [3.0, 4.0], [6.0, 8.0], [3.0, 4.0], [-3.0, 4.0], [0.4, -0.3], [-0.4, -0.3]])
        assert _nearest_m(apart) == pytest.approx([5, 5, 5, 4, 0.7 / math.hypot(3.4, 4.3), 0.3])

    def test_in_less_than_a_step_too(self) -> None:
        one, other = ahead(0, 0, NORTH, 2), ahead(3, 40, SOUTH, 2)
        assert too_close(one, other, 20, 8.2, 8.4) == too_close(one, other, 20, 8.2, 10.1)
        assert too_close(one, other, 20, 8.2, 8.4) is not None
        assert too_close(one, other, 20, 5000, 5001) is None  # of then nothing is known

    def test_to_the_first_step_behind_the_time_that_is_asked_for(self) -> None:
        one, other = ahead(0, 0, NORTH, 2), ahead(3, 48, SOUTH, 2)  # 24 m apart at 6 s, 16 m at 8 s
        assert too_close(one, other, 20, 4.5, 5.9) is None
        found = too_close(one, other, 20, 4.5, 6.0)
        assert found is not None
        assert found.time_s == 6

    def test_two_that_meet_head_on(self) -> None:
        north, south = ahead(0, 0, NORTH, 2), ahead(5, 400, SOUTH, 2)
        found = too_close(north, south, 20, 0, 600)
        assert found is not None
        assert found.distance_m == pytest.approx(5)  # between two samples, too
        # 4 m/s closing: nearer than 20 m from (400 - sqrt(400 - 25)) / 4 = 95.2 s on.
        assert found.time_s == 94

    def test_between_two_steps(self) -> None:
        # Both pass the crossing at 5 s, half way between two samples.
        found = too_close(ahead(0, -25, NORTH, 5), ahead(-25, 0, EAST, 5), 1, 0, 60)
        assert found is not None
        assert found.distance_m == pytest.approx(0, abs=1e-6)

    def test_before_the_first_whole_step(self) -> None:
        # Told at 0.5 s, it overtakes the other at 1.9 s, 5 m beside it; from the first sample on it draws away.
        start = Pose(0, 0, NORTH)
        told = course(start, 0.5, Sailing(9), 10, [straight(start, 2000, 10)])
        found = too_close(told, ahead(5, 9, NORTH, 2), 8, 0.5, 60)
        assert found is not None
        assert found.distance_m == pytest.approx(5)
        assert found.time_s == 0.5

    def test_two_that_were_told_at_different_times(self) -> None:
        later = course(Pose(5, 384, SOUTH), 8, Sailing(2), 10, [straight(Pose(5, 384, SOUTH), 2000, 10)])
        assert later.first == 4
        for one, other in ((ahead(0, 0, NORTH, 2), later), (later, ahead(0, 0, NORTH, 2))):
            found = too_close(one, other, 20, 0, 600)
            assert found is not None
            assert [found.distance_m, found.time_s] == pytest.approx([5, 94])  # as from 400 m at 0 s

    def test_just_as_near_as_they_may_they_are_not_too_close(self) -> None:
        assert too_close(ahead(0, 0, NORTH, 2), ahead(20, 0, NORTH, 2), 20, 0, 300) is None
        # From 25 m to 24 m, after 3.5 s or 14 s.
        still = lying_still(Pose(24, 7, NORTH), 0)
        for speed_mps in (2.0, 0.5):
            assert too_close(ahead(0, 0, NORTH, speed_mps), still, 30, 0, 30) is None

    def test_two_that_begin_just_as_near_as_they_may_come_no_nearer(self) -> None:
        found = too_close(ahead(0, 0, NORTH, 2), lying_still(Pose(19.2, 5.6, NORTH), 0), math.hypot(19.2, 5.6), 0, 30)
        assert found is not None
        assert found.distance_m == pytest.approx(19.2)

    def test_two_that_begin_near_may_stay_so(self) -> None:
        assert too_close(ahead(0, 0, NORTH, 2), ahead(10, 0, NORTH, 2), 20, 0, 300) is None

    def test_one_that_passes_later(self) -> None:
        assert too_close(ahead(0, -100, NORTH, 2), ahead(-400, 0, EAST, 2), 20, 0, 600) is None

    def test_only_as_long_as_it_is_asked_for(self) -> None:
        north, south = ahead(0, 0, NORTH, 2), ahead(5, 400, SOUTH, 2)
        assert too_close(north, south, 20, 0, 90) is None
        assert too_close(north, south, 20, 120, 600) is None

    @pytest.mark.parametrize(
        ("sailing", "begin_m", "last_m"),
        [(Sailing(2.0), 400, 16), (Sailing(2.0, drift_mps=1.0, set_rad=NORTH), 492, 12)],
    )
    def test_they_are_found_as_soon_as_they_can_be(self, sailing: Sailing, begin_m: float, last_m: float) -> None:
        # They close at 4 m/s, with the current at 5 m/s; `last_m` is ahead of each after 96 s, and 5 m beside it.
        north = course(Pose(0, 0, NORTH), 0, sailing, 10, [straight(Pose(0, 0, NORTH), 2000, 10)])
        south = ahead(5, begin_m, SOUTH, 2)
        assert too_close(north, south, 20, 0, 92) is None
        found = too_close(north, south, 20, 0, 94)
        assert found is not None
        assert [found.time_s, found.distance_m] == pytest.approx([94, math.hypot(last_m, 5)])

    def test_two_that_begin_near_may_part(self) -> None:
        assert too_close(ahead(0, 0, NORTH, 2), ahead(10, 0, SOUTH, 2), 20, 0, 300) is None

    def test_but_come_no_nearer(self) -> None:
        found = too_close(ahead(0, 0, NORTH, 2), ahead(4, 15, SOUTH, 2), 20, 0, 300)
        assert found is not None
        assert found.distance_m == pytest.approx(4)

    def test_at_once_they_may_as_near_as_they_are_told(self) -> None:
        # 12 cm nearer a second: by 1 m at 8.3 s, to 8 m at 16.7 s. For six steps, 12 s, 8 m count, and then 9 m.
        one, other = ahead(0, 0, NORTH, 2), ahead(10, 0, -math.asin(0.12 / 2), 2)
        found = too_close(one, other, 20, 0, 30)
        assert found is not None
        assert found.time_s == 8
        found = too_close(one, other, 20, 0, 30, soon_m=8)
        assert found is not None
        assert found.time_s == 12
        assert too_close(one, other, 20, 0, 10, soon_m=8) is None
        found = too_close(one, other, 20, 0, 30, soon_m=9.9)  # more than that is no matter
        assert found is not None
        assert found.time_s == 8

    def test_nor_meet_again(self) -> None:
        # One sails away and circles back past where the other lies still.
        away = course(Pose(0, 0, NORTH), 0, Sailing(2), 40, [])
        still = course(Pose(-10, 0, NORTH), 0, Sailing(1e-9), 10, [])
        found = too_close(away, still, 20, 0, 300)
        assert found is not None
        assert found.time_s == pytest.approx(2 * math.pi * 40 / 2, abs=15)

    @given(*[st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(0, 6.3), st.floats(1, 3))] * 2)
    def test_as_a_fine_search_finds(
        self, one: tuple[float, float, float, float], other: tuple[float, float, float, float]
    ) -> None:
        first, second = ahead(*one), ahead(*other)
        times_s = np.arange(0, 120, 0.05)[:, np.newaxis]
        at = [
            np.array([[x_m, y_m]]) + times_s * speed_mps * np.array([[math.sin(heading), math.cos(heading)]])
            for x_m, y_m, heading, speed_mps in (one, other)
        ]
        apart_m = np.hypot(*(at[0] - at[1]).T)
        found = too_close(first, second, 20, 0, 118)
        if apart_m[0] >= 20 and apart_m.min() < 19.5:
            assert found is not None
            assert found.distance_m == pytest.approx(apart_m.min(), abs=0.5)
            assert found.time_s == pytest.approx(times_s[int((apart_m < 20).argmax()), 0], abs=STEP_S + 0.2)
        elif apart_m.min() > 20.5:
            assert found is None
