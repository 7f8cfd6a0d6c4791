"""A simulated vehicle and ground that it may not enter."""

from __future__ import annotations

import math
from contextlib import suppress

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from zones import assert_keeps_radius, assert_stays_out, kept_out, places

from planner.dubins import Pose
from planner.keep_out import KeepOut
from sim_world.motion import Motion, NoWayError

WALL = KeepOut((((100.0, -500.0), (120.0, -500.0), (120.0, 500.0), (100.0, 500.0)),))
RADIUS_M = 20.0


def motion(start: Pose, keep_out: KeepOut = WALL) -> Motion:
    return Motion(start, speed_mps=2.0, turn_radius_m=RADIUS_M, keep_out=keep_out)


def test_it_circles_to_port_where_there_is_no_room_to_starboard() -> None:
    beside = motion(Pose(90.0, 0.0, 0.0))
    beside.hold(0)
    half_ms = round(math.pi * RADIUS_M / 2.0 * 1000)
    assert beside.pose_at(half_ms) == pytest.approx((50.0, 0.0, math.pi), abs=2e-3)
    away = motion(Pose(50.0, 0.0, 0.0))
    away.hold(0)
    assert away.pose_at(half_ms) == pytest.approx((90.0, 0.0, math.pi), abs=2e-3)


def test_it_sails_on_until_there_is_room_to_circle() -> None:
    bay = KeepOut((((30.0, -40.0), (60.0, -40.0), (60.0, 40.0), (30.0, 40.0)), ((-60.0, -40.0), (-30.0, -40.0), (-30.0, 40.0), (-60.0, 40.0))))  # fmt: skip # noqa: E501
    sailing = motion(Pose(0.0, -300.0, 0.0), bay)
    sailing.follow((0.0, -200.0), (0.0, 200.0), 20.0, 0)
    sailing.hold(150_000)  # it is at the beginning of the gap, 60 m wide: no circle of 40 m beside its way fits
    poses = [sailing.pose_at(time_ms) for time_ms in range(150_000, 400_000, 250)]
    assert max(pose.y_m for pose in poses) > 40.0
    assert_stays_out(poses, bay)
    assert_keeps_radius(poses, RADIUS_M, 0.5)


class TestRefused:
    def test_a_track_that_enters_a_zone(self) -> None:
        with pytest.raises(NoWayError, match="enters ground to keep out of"):
            motion(Pose(0.0, 0.0, 0.0)).follow((0.0, 0.0), (110.0, 0.0), 0.0, 0)

    def test_a_track_behind_which_is_no_room_to_turn(self) -> None:
        with pytest.raises(NoWayError, match="enters ground"):
            motion(Pose(0.0, 0.0, 0.0)).follow((0.0, 0.0), (80.0, 0.0), 10.0, 0)
        motion(Pose(0.0, 0.0, 0.0)).follow((0.0, 0.0), (69.0, 0.0), 10.0, 0)

    def test_a_place_in_a_zone_and_what_was_under_way_goes_on(self) -> None:
        sailing = motion(Pose(0.0, 0.0, 0.0))
        sailing.go_to((0.0, 200.0), None, 0)
        with pytest.raises(NoWayError, match="to circle there"):
            sailing.go_to((110.0, 0.0), None, 10_000)
        assert sailing.pose_at(100_000) == pytest.approx((0.0, 200.0, 0.0))


commands = st.lists(
    st.tuples(st.sampled_from(("follow", "go", "hold")), places, places, st.integers(1, 200)), min_size=1, max_size=8
)


@settings(max_examples=80)
@given(kept_out, places, commands)
def test_whatever_it_is_told_and_whenever_it_stays_out(
    keep_out: KeepOut, start: Pose, told: list[tuple[str, Pose, Pose, int]]
) -> None:
    assume(keep_out.circling(start, RADIUS_M) is not None)
    sailing, now_ms, poses = motion(start, keep_out), 0, list[Pose]()
    for word, one, other, for_s in told:
        with suppress(NoWayError):
            if word == "hold":
                sailing.hold(now_ms)
            elif word == "go":
                sailing.go_to(one[:2], None, now_ms)
            elif one[:2] != other[:2]:
                sailing.follow(one[:2], other[:2], 20.0, now_ms)
        poses += [sailing.pose_at(time_ms) for time_ms in range(now_ms, now_ms + 1000 * for_s, 250)]
        now_ms += 1000 * for_s
    assert_stays_out(poses, keep_out)
    assert_keeps_radius(poses, RADIUS_M, 0.5)
