"""Dead reckoning: hand-computed courses, what holds on every course, and the places that courses make."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dubins import Pose
from planner.reckoning import BELIEVED_MS, Course, Trace

NORTH = Pose(10.0, -5.0, 0.0)
QUARTER_MS = 5_000
"""A quarter of a circle at 2 m/s takes so long; its radius is then 20/pi m."""
TURN = math.pi / 10
RADIUS_M = 2.0 / TURN

poses = st.builds(Pose, st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(0.0, 6.28))
turns = st.integers(-2_000_000, 2_000_000).map(lambda steps: steps / 1e6)  # as they come from the wire
courses = st.builds(Course, st.integers(0, 10**7), poses, st.floats(0.0, 5.0), turns)
times_ms = st.integers(0, BELIEVED_MS)


@pytest.mark.parametrize(
    ("speed_mps", "turn_radps", "after_ms", "there"),
    [
        (2.0, 0.0, 7_500, (10.0, 10.0, 0.0)),
        (2.0, TURN, QUARTER_MS, (10.0 + RADIUS_M, -5.0 + RADIUS_M, math.pi / 2)),
        (2.0, -TURN, QUARTER_MS, (10.0 - RADIUS_M, -5.0 + RADIUS_M, 1.5 * math.pi)),
        (2.0, TURN, 2 * QUARTER_MS, (10.0 + 2 * RADIUS_M, -5.0, math.pi)),
        (2.0, TURN, 4 * QUARTER_MS, NORTH),
        (0.0, 0.0, 9_000, NORTH),
        (0.0, TURN, QUARTER_MS, (10.0, -5.0, math.pi / 2)),  # it turns on the spot
        (2.0, TURN, 0, NORTH),
        (2.0, TURN, -3_000, NORTH),  # a clock may be a little behind
        (1.0, 0.0, BELIEVED_MS + 60_000, (10.0, -5.0 + BELIEVED_MS / 1000, 0.0)),
    ],
)
def test_hand_computed(speed_mps: float, turn_radps: float, after_ms: int, there: tuple[float, float, float]) -> None:
    x_m, y_m, heading_rad = Course(70_000, NORTH, speed_mps, turn_radps).pose_at(70_000 + after_ms)
    assert (x_m, y_m) == pytest.approx(there[:2])
    assert math.remainder(heading_rad - there[2], math.tau) == pytest.approx(0.0, abs=1e-9)


@given(courses, times_ms, times_ms)
def test_whoever_tells_it_again_on_the_way_leads_to_the_same_place(course: Course, one_ms: int, other_ms: int) -> None:
    on_the_way, end_ms = sorted((course.begun_ms + one_ms, course.begun_ms + other_ms))
    again = Course(on_the_way, course.pose_at(on_the_way), course.speed_mps, course.turn_radps)
    x_m, y_m, heading_rad = again.pose_at(end_ms)
    there = course.pose_at(end_ms)
    assert math.dist((x_m, y_m), there[:2]) < 1e-6
    assert abs(math.remainder(heading_rad - there.heading_rad, math.tau)) < 1e-9
    assert 0.0 <= heading_rad < math.tau


@given(courses.filter(lambda one: one.turn_radps != 0), times_ms)
def test_a_turn_stays_on_its_circle(course: Course, after_ms: int) -> None:
    radius_m = course.speed_mps / course.turn_radps  # below 0 to port
    x_m, y_m, heading_rad = course.start
    centre = (x_m + radius_m * math.cos(heading_rad), y_m - radius_m * math.sin(heading_rad))
    there = course.pose_at(course.begun_ms + after_ms)
    assert math.dist(there[:2], centre) == pytest.approx(abs(radius_m), rel=1e-6, abs=1e-6)


class TestATrace:
    def test_a_turn_has_a_place_each_second_and_where_the_next_course_begins(self) -> None:
        trace, turn = Trace(), Course(400, NORTH, 2.0, TURN)
        assert trace.hear(turn) == [(400, NORTH)]
        found = trace.hear(Course(3_950, Pose(1, 2, 3), 2.0))
        assert found == [(1_400, turn.pose_at(1_400)), (2_400, turn.pose_at(2_400)), (3_400, turn.pose_at(3_400)),
                         (3_950, (1, 2, 3))]  # fmt: skip

    @pytest.mark.parametrize(
        ("speed_mps", "told"), [(0.0, []), (0.5, [(5_000, (10.0, -2.5, 0.0))]), (1.0, [(5_000, (10.0, 0.0, 0.0))])]
    )
    def test_it_ends_where_the_vehicle_is_by_then_unless_it_lies(
        self, speed_mps: float, told: list[tuple[int, Pose]]
    ) -> None:
        trace = Trace()
        trace.hear(Course(0, NORTH, speed_mps))
        assert trace.end(5_000) == told

    def test_there_it_stays_until_another_course_is_told(self) -> None:
        trace = Trace()
        trace.hear(Course(0, NORTH, 2.0))
        assert trace.end(5_000) == [(5_000, (10.0, 5.0, 0.0))]
        assert trace.end(9_000) == trace.until(9_000) == []
        assert trace.hear(Course(4_000, NORTH, 2.0)) == []  # it comes late
        assert trace.hear(Course(10_000, NORTH, 1.0)) == [(10_000, NORTH)]
        assert trace.end(11_000) == [(11_000, (10.0, -4.0, 0.0))]

    def test_what_comes_about_a_second_later_is_waited_for(self) -> None:
        trace = Trace()
        trace.hear(Course(0, NORTH, 2.0, TURN))
        assert [trace.until(now_ms) for now_ms in (1_000, 1_249)] == [[], []]
        assert [at_ms for at_ms, _ in trace.until(1_250)] == [1_000]
        assert [at_ms for at_ms, _ in trace.until(3_001)] == [2_000, 3_000]
        assert trace.until(4_000) == []

    def test_who_tells_its_position_each_second_has_no_others(self) -> None:
        trace = Trace(all_along=True)
        told_ms = [0, 1_000, 2_020, 2_990, 4_030]
        found = [place for at_ms in told_ms for place in trace.hear(Course(at_ms, NORTH, 2.0, TURN))]
        assert [at_ms for at_ms, _ in found] == told_ms

    @pytest.mark.parametrize(("all_along", "between"), [(False, []), (True, [1_000, 2_000, 3_000, 4_000])])
    def test_a_straight_line_needs_none(self, all_along: bool, between: list[int]) -> None:
        trace = Trace(all_along=all_along)
        trace.hear(Course(0, NORTH, 2.0))
        found = trace.hear(Course(5_000, Pose(10.0, 5.0, 0.0), 0.0))
        assert [at_ms for at_ms, _ in found] == [*between, 5_000]
        assert trace.hear(Course(9_000, Pose(10.0, 5.0, 0.0), 0.0)) == [(9_000, (10.0, 5.0, 0.0))]  # it lay there

    def test_one_that_comes_late_counts_no_more(self) -> None:
        trace = Trace()
        trace.hear(Course(5_000, NORTH, 2.0))
        assert trace.hear(Course(4_000, NORTH, 1.0)) == []
        assert trace.end(10_000) == [(10_000, (10.0, 5.0, 0.0))]

    def test_who_is_silent_goes_on_for_so_long_and_not_for_ever(self) -> None:
        trace = Trace(all_along=True)
        trace.hear(Course(0, NORTH, 2.0))
        assert [at_ms for at_ms, _ in trace.until(BELIEVED_MS * 9)] == list(range(1_000, BELIEVED_MS + 1, 1_000))
        assert trace.end(BELIEVED_MS * 9)[-1] == (BELIEVED_MS, (10.0, -5.0 + 2.0 * BELIEVED_MS / 1000, 0.0))
        assert trace.hear(Course(BELIEVED_MS * 9, NORTH, 2.0)) == [(BELIEVED_MS * 9, NORTH)]

    def test_before_anything_is_told_there_is_nothing(self) -> None:
        assert Trace().until(10_000) == Trace().end(10_000) == []

    @given(st.lists(courses, min_size=1, max_size=8), st.lists(st.integers(0, 10**7), max_size=8))
    def test_places_are_in_the_order_of_time_and_all_that_hear_gives_however_often_it_is_asked(
        self, told: list[Course], asked_ms: list[int]
    ) -> None:
        one, other = Trace(), Trace()
        told = sorted(told, key=lambda course: course.begun_ms)
        at_once = [place for course in told for place in one.hear(course)]
        by_and_by = []
        for course in told:
            for now_ms in sorted(now_ms for now_ms in asked_ms if now_ms <= course.begun_ms):
                by_and_by += other.until(now_ms)
            by_and_by += other.hear(course)
        assert by_and_by == at_once
        assert [at_ms for at_ms, _ in at_once] == sorted(at_ms for at_ms, _ in at_once)
