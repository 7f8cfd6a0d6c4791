"""What a current makes of a speed, by hand: with it, against it, across it, in turns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.currents import Current, Sailing, made_good_mps
from planner.dubins import DubinsPath, Pose
from planner.keep_out import KeepOut
from planner.sweep import pass_over
from planner.way_home import WayHome
from planner.ways import shortest_way

NORTH, EAST, SOUTH, WEST = (quarter * math.pi / 2 for quarter in range(4))
# 2.5 m/s through water that flows east at 1.5 m/s: 4 with it, 1 against it, and 2 across it, as 2^2 + 1.5^2 = 2.5^2.
EASTWARD = Sailing(2.5, 1.5, EAST)
ZERO = np.array(0.0)


@pytest.mark.parametrize(("course_rad", "mps"), [(EAST, 4.0), (WEST, 1.0), (NORTH, 2.0), (SOUTH, 2.0)])
def test_a_leg_of_100_m(course_rad: float, mps: float) -> None:
    assert EASTWARD.straight_s(100, Pose(0, 0, course_rad)) == pytest.approx(100 / mps)
    assert made_good_mps(course_rad, 2.5, Current(1.5, EAST).flow_mps(0)) == pytest.approx(mps)


def test_a_tide_is_reckoned_with_as_it_runs_against() -> None:
    tidal = Sailing(2.5, 1.5, EAST, tidal=True)
    assert [tidal.straight_s(100, Pose(0, 0, course_rad)) for course_rad in (EAST, WEST)] == pytest.approx(
        [100.0, 100.0]
    )


def test_still_water_takes_the_length_over_the_speed() -> None:
    path = DubinsPath(Pose(0, 0, NORTH), 10, (1, 0, -1), (5, 20, 3))
    assert Sailing(2.0).path_s(path) == 14.0


def test_a_whole_circle_takes_as_long_as_its_steps() -> None:
    steps = np.linspace(0, 2 * math.pi, 200_001)
    headings = (steps[1:] + steps[:-1]) / 2
    took_s = float((10 * np.diff(steps) / EASTWARD.made_good_mps(headings, ZERO, ZERO)).sum())
    circle = DubinsPath(Pose(0, 0, NORTH), 10, (1, 0, 0), (20 * math.pi, 0, 0))
    assert EASTWARD.path_s(circle) == pytest.approx(took_s, rel=2e-3)
    assert took_s > 20 * math.pi / 2.5


def test_a_turn_and_a_straight_follow_each_other() -> None:
    # A quarter to starboard, from north to east, and 40 m with the stream.
    path = DubinsPath(Pose(0, 0, NORTH), 10, (1, 0, 0), (5 * math.pi, 40, 0))
    turn_s = float(EASTWARD.turns_s(10, np.array([0, 0, NORTH]), np.array(math.pi / 2)))
    assert 5 * math.pi / 4 < turn_s < 5 * math.pi / 2
    assert EASTWARD.path_s(path) == pytest.approx(turn_s + 10)
    times_s, lengths_m = EASTWARD.knots([path])
    assert times_s.tolist() == pytest.approx([0, turn_s, turn_s + 10, turn_s + 10])
    assert lengths_m.tolist() == pytest.approx([0, 5 * math.pi, 5 * math.pi + 40, 5 * math.pi + 40])


def test_the_way_home_is_longer_against_the_stream_and_so_is_what_is_kept_for_it() -> None:
    home = WayHome((0, 0), EASTWARD, turn_radius_m=10)
    assert home.from_pose(Pose(-100, 0, EAST))[0] == pytest.approx(25)
    assert home.from_pose(Pose(100, 0, WEST))[0] == pytest.approx(100)
    # 40 m on to the east take 10 s, the way back from there a turn and some 140 m at 1 m/s.
    away = [pass_over((100, 0), (140, 0), 0.0)]
    back_s = home.from_pose(away[0].end)[0]
    assert back_s > 140
    assert home.passes_within(Pose(100, 0, EAST), away, 10 + back_s + 0.1) == 1
    assert home.passes_within(Pose(100, 0, EAST), away, 10 + back_s - 0.1) == 0


@given(st.floats(0, 2 * math.pi), st.floats(0, 2 * math.pi), st.floats(0.5, 5), st.floats(0, 0.95))
def test_what_is_made_good_less_the_flow_is_what_is_swum(
    course_rad: float, set_rad: float, speed_mps: float, share: float
) -> None:
    flow_mps = Current(share * speed_mps, set_rad).flow_mps(0)
    mps = made_good_mps(course_rad, speed_mps, flow_mps)
    swum_mps = math.hypot(mps * math.sin(course_rad) - flow_mps[0], mps * math.cos(course_rad) - flow_mps[1])
    assert mps > 0
    assert swum_mps == pytest.approx(speed_mps)
    reckoned = Sailing(speed_mps, share * speed_mps, set_rad).made_good_mps(np.array(course_rad), ZERO, ZERO)
    assert float(reckoned) == pytest.approx(mps)


def test_a_way_takes_what_its_paths_take_one_after_the_other() -> None:
    # 80 m with the stream and 30 m across it.
    way = (
        DubinsPath(Pose(0, 0, EAST), 10, (0, 0, 0), (80, 0, 0)),
        DubinsPath(Pose(80, 0, NORTH), 10, (0, 0, 0), (30, 0, 0)),
    )
    assert EASTWARD.way_s(way) == pytest.approx(80 / 4 + 30 / 2)
    assert Sailing(2.0).way_s(way) == 55.0


def test_passes_past_a_zone_take_the_way_round_it() -> None:
    # The zone lies on the beeline between the two, from which it reaches 40 m to either side.
    zone = KeepOut((((40, -40), (60, -40), (60, 40), (40, 40)),))
    passes = [pass_over((-100, 0), (0, 0), 0.0), pass_over((200, 0), (300, 0), 0.0)]
    assert EASTWARD.passes_s(passes, 10) == pytest.approx(400 / 4)
    way = shortest_way(passes[0].end, passes[1].begin, 10, zone)
    assert way is not None
    assert len(way) > 1
    assert EASTWARD.passes_s(passes, 10, keep_out=zone) == pytest.approx(200 / 4 + sum(map(EASTWARD.path_s, way)))
    # At 4 m/s at most it takes longer than the taut line at that, 2 m/s less than the whole of it across the stream.
    taut_m = math.hypot(40, 40) + 20 + math.hypot(140, 40)
    assert 50 + taut_m / 4 < EASTWARD.passes_s(passes, 10, keep_out=zone) < 50 + 1.2 * taut_m / 2
