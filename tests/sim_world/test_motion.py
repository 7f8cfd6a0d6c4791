"""How a simulated vehicle moves: hand-computed courses, and the bounds that hold on every course."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dubins import Pose, compass_rad
from sim_world.motion import Motion, bearing_rad

NORTH = Pose(0.0, 0.0, 0.0)
QUARTER_M = 20.0 * math.pi / 2
"""A quarter circle of the turn radius that the hand-computed courses use."""


def motion(start: Pose = NORTH) -> Motion:
    return Motion(start, speed_mps=2.0, turn_radius_m=20.0)


def test_it_waits_at_its_start_pose_until_the_first_manoeuvre() -> None:
    waiting = motion(Pose(3.0, 4.0, -math.pi / 2))
    assert waiting.pose_at(1_000_000) == Pose(3.0, 4.0, 1.5 * math.pi)
    assert waiting.speed_mps(0) == 0.0


def test_a_track_dead_ahead_takes_its_run_in_its_length_and_its_run_out() -> None:
    sailing = motion()
    track = sailing.follow((0.0, 100.0), (0.0, 500.0), 50.0, 10_000)
    assert sailing.speed_mps(10_000) == 2.0
    assert [track.time_ms(along_m) for along_m in (0.0, 20.0, 400.0)] == [60_000, 70_000, 260_000]
    assert sailing.pose_at(60_000) == pytest.approx((0.0, 100.0, 0.0))
    assert sailing.pose_at(285_000) == pytest.approx((0.0, 550.0, 0.0))  # the end of the run-out
    a_quarter_on_ms = 285_000 + round(QUARTER_M / 2.0 * 1000)
    assert sailing.pose_at(a_quarter_on_ms) == pytest.approx((20.0, 570.0, math.pi / 2), abs=2e-3)  # to starboard


def test_the_next_track_starts_from_the_end_of_the_run_out() -> None:
    sailing = motion()
    ends_ms = sailing.follow((0.0, 100.0), (0.0, 500.0), 50.0, 0).time_ms(400.0)
    track = sailing.follow((200.0, 500.0), (200.0, 100.0), 50.0, ends_ms)
    assert ends_ms == 250_000
    # 50 m of run-out, a quarter circle, 160 m east, a quarter circle, 50 m of run-in; then 400 m south.
    to_the_start_m = 50.0 + QUARTER_M + 160.0 + QUARTER_M + 50.0
    assert track.start_m == pytest.approx(to_the_start_m)
    assert sailing.pose_at(275_000) == pytest.approx((0.0, 550.0, 0.0))
    assert sailing.pose_at(275_000 + round((QUARTER_M + 80.0) * 500)) == pytest.approx(
        (100.0, 570.0, math.pi / 2), abs=2e-3
    )
    assert sailing.pose_at(track.time_ms(400.0)) == pytest.approx((200.0, 100.0, math.pi), abs=2e-3)


def test_the_run_out_is_sailed_whatever_arrives_on_it_and_however_often() -> None:
    sailing = motion()
    sailing.follow((0.0, 100.0), (0.0, 500.0), 50.0, 0)
    sailing.hold(255_000)
    sailing.go_to((500.0, 0.0), None, 260_000)
    sailing.hold(270_000)
    assert sailing.pose_at(275_000) == pytest.approx((0.0, 550.0, 0.0))
    assert sailing.pose_at(275_000 + round(QUARTER_M * 500)) == pytest.approx((20.0, 570.0, math.pi / 2), abs=2e-3)


def test_a_manoeuvre_that_arrives_on_the_track_or_after_the_run_out_begins_at_once() -> None:
    for now_ms in (100_000, 275_000):
        sailing = motion()
        sailing.follow((0.0, 100.0), (0.0, 500.0), 50.0, 0)
        before = sailing.pose_at(now_ms)
        sailing.hold(now_ms)
        assert sailing.pose_at(now_ms) == pytest.approx(before)
        after = sailing.pose_at(now_ms + round(QUARTER_M * 500))
        assert after == pytest.approx((before.x_m + 20.0, before.y_m + 20.0, math.pi / 2), abs=2e-3)


def test_it_goes_to_a_point_with_the_heading_asked_for_and_loiters_there() -> None:
    sailing = motion()
    arrives_ms = sailing.go_to((40.0, 0.0), math.pi, 0)  # a half circle to starboard
    assert arrives_ms == math.ceil(2 * QUARTER_M * 500)
    assert sailing.pose_at(arrives_ms) == pytest.approx((40.0, 0.0, math.pi), abs=2e-3)
    assert sailing.pose_at(arrives_ms + round(2 * QUARTER_M * 500)) == pytest.approx((0.0, 0.0, 0.0), abs=4e-3)


def test_without_a_heading_it_goes_straight_to_a_point_ahead_and_stays_about_where_it_is() -> None:
    sailing = motion(Pose(10.0, 10.0, math.pi / 4))
    assert sailing.go_to((10.0 + 30.0, 10.0 + 40.0), math.atan2(30.0, 40.0), 0) > 25_000
    straight = motion(Pose(10.0, 10.0, math.atan2(30.0, 40.0)))
    assert straight.go_to((40.0, 50.0), None, 0) == 25_000
    there = motion(Pose(0.0, 0.0, 1.0))
    assert there.go_to((0.0, 0.0), None, 7) == 7


STEP_MS = 100
coordinates = st.floats(-300.0, 300.0).map(lambda metres: round(metres, 2))
points = st.tuples(coordinates, coordinates)


@st.composite
def manoeuvres(draw: st.DrawFn) -> tuple[str, tuple[float, float], tuple[float, float], float]:
    start, end = draw(st.lists(points, min_size=2, max_size=2, unique=True))
    return draw(st.sampled_from(["follow", "go_to", "hold"])), start, end, draw(st.floats(0.0, 60.0))


@given(
    start=st.builds(Pose, coordinates, coordinates, st.floats(0.0, 6.28)),
    speed_mps=st.floats(0.5, 5.0),
    turn_radius_m=st.floats(5.0, 40.0),
    orders=st.lists(st.tuples(manoeuvres(), st.integers(1, 3000)), min_size=1, max_size=6),
)
def test_speed_and_turn_radius_hold_along_every_sequence_of_manoeuvres(
    start: Pose,
    speed_mps: float,
    turn_radius_m: float,
    orders: list[tuple[tuple[str, tuple[float, float], tuple[float, float], float], int]],
) -> None:
    sailing = Motion(start, speed_mps=speed_mps, turn_radius_m=turn_radius_m)
    now_ms = 0
    for (kind, first, second, run_in_m), steps in orders:
        before = sailing.pose_at(now_ms)
        if kind == "follow":
            sailing.follow(first, second, run_in_m, now_ms)
        elif kind == "go_to":
            sailing.go_to(second, bearing_rad(first, second), now_ms)
        else:
            sailing.hold(now_ms)
        assert sailing.pose_at(now_ms) == pytest.approx(before, abs=1e-6)
        for begin, end in ((0, min(150, steps)), (max(0, steps - 150), steps)):
            poses = [sailing.pose_at(now_ms + step * STEP_MS) for step in range(begin, end + 1)]
            check_bounds(poses, speed_mps, turn_radius_m)
        now_ms += steps * STEP_MS


def check_bounds(poses: list[Pose], speed_mps: float, turn_radius_m: float) -> None:
    distance_m = speed_mps * STEP_MS / 1000.0
    turn_rad = distance_m / turn_radius_m
    for before, after in itertools.pairwise(poses):
        chord_m = math.dist(before[:2], after[:2])
        assert distance_m * (1.0 - turn_rad**2 / 6.0) - 1e-6 <= chord_m <= distance_m + 1e-6
        turned = math.remainder(after.heading_rad - before.heading_rad, 2 * math.pi)
        assert abs(turned) <= turn_rad + 1e-6
        # It moves where it points.
        course = bearing_rad(before[:2], after[:2])
        assert abs(math.remainder(course - before.heading_rad, 2 * math.pi)) <= turn_rad + 1e-5
        assert 0.0 <= after.heading_rad < 2 * math.pi


@given(st.floats(-100.0, 100.0))
def test_headings_are_wrapped_to_a_full_turn(angle_rad: float) -> None:
    heading_rad = compass_rad(angle_rad)
    assert 0.0 <= heading_rad < 2 * math.pi
    assert math.cos(heading_rad - angle_rad) == pytest.approx(1.0)


def test_the_smallest_turn_to_port_of_north_is_north() -> None:
    assert compass_rad(-1e-20) == 0.0
