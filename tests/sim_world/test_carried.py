"""A vehicle in a current that keeps its speed through the water: when it is where, and what it sees from there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from zones import assert_keeps_radius, assert_stays_out

from comms.said.messages import Look, Nav
from planner.currents import Current, FlowGrid, Sailing
from planner.dubins import Pose, shortest_path
from planner.keep_out import KeepOut
from planner.ways import shortest_way
from sim_world.config import CurrentConfig
from sim_world.motion import CarriedPath, Motion, NoWayError
from tests.sim_world.test_world import QUIET, A, Sea, follow

EAST, WEST = math.pi / 2, 1.5 * math.pi
# 2.5 m/s through water that flows east at 1.5 m/s: 4 m/s with it, 1 against it, 2 across it.
SWIMMER = replace(A, speed_mps=2.5, start_heading_rad=EAST)
EASTWARD = CurrentConfig(1.5, EAST)


def sea(current: CurrentConfig | None = EASTWARD, heading_rad: float = EAST) -> Sea:
    vehicle = replace(SWIMMER, start_x_m=0.0, start_y_m=0.0, start_heading_rad=heading_rad)
    return Sea(replace(QUIET, vehicles=(vehicle,), current=current))


def speeds(told: Sea) -> set[float]:
    return {round(nav.speed_mps, 6) for at_ms, nav in told.said(Nav) if at_ms and isinstance(nav, Nav)}


@pytest.mark.parametrize(
    ("heading_rad", "end", "ends_ms"),
    [(EAST, (400.0, 0.0), 100_000), (WEST, (-400.0, 0.0), 400_000), (0.0, (0.0, 400.0), 200_000)],
)
def test_with_against_and_across_it_400_m_take_100_400_and_200_s(
    heading_rad: float, end: tuple[float, float], ends_ms: int
) -> None:
    told = sea(heading_rad=heading_rad).order("a", follow(1, (0.0, 0.0), end, run_in_m=0.0)).until(ends_ms - 500)
    accepted, on_track = told.statuses()
    assert accepted[2] == pytest.approx(ends_ms, abs=1)
    assert on_track[0] == 0
    assert len(speeds(told)) == 1
    assert next(iter(speeds(told))) == pytest.approx(400_000 / ends_ms)


def test_the_look_of_each_20_m_comes_when_they_are_passed() -> None:
    told = sea().order("a", follow(1, (0.0, 0.0), (100.0, 0.0), run_in_m=0.0)).until(60_000)
    looks_ms = [at_ms for at_ms, _ in told.said(Look)]
    assert looks_ms == pytest.approx([5_000, 10_000, 15_000, 20_000, 25_000], abs=1)


def test_a_way_with_turns_takes_what_is_reckoned() -> None:
    told = sea().order("a", follow(1, (200.0, 300.0), (-200.0, 300.0), run_in_m=0.0))
    way = shortest_path(Pose(0, 0, EAST), Pose(200, 300, WEST), SWIMMER.turn_radius_m)
    reckoned_s = Sailing(2.5, 1.5, EAST).path_s(way) + 400 / 1.0
    assert told.statuses()[0][2] / 1000 == pytest.approx(reckoned_s, rel=2e-3)


def test_a_way_of_a_thousand_kilometres_is_summed_up_in_no_time_and_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, made_good_mps = [], CarriedPath.made_good_mps

    def counted(path: CarriedPath, distance_m: float, time_s: float) -> float:
        asked.append(distance_m)
        return made_good_mps(path, distance_m, time_s)

    monkeypatch.setattr(CarriedPath, "made_good_mps", counted)
    told = sea().order("a", follow(1, (0.0, 0.0), (900_000.0, 0.0), run_in_m=0.0))
    assert told.statuses()[0][2] == pytest.approx(900_000 / 4.0 * 1000, abs=1)
    assert len(asked) < 50_000
    # And back again: the turn lies far ahead, and is summed up as any.
    told = sea().order("a", follow(1, (900_000.0, 300.0), (899_000.0, 300.0), run_in_m=0.0))
    way = shortest_path(Pose(0, 0, EAST), Pose(900_000, 300, WEST), SWIMMER.turn_radius_m)
    reckoned_s = Sailing(2.5, 1.5, EAST).path_s(way) + 1000 / 1.0
    assert told.statuses()[0][2] / 1000 == pytest.approx(reckoned_s, rel=1e-5)


def test_a_tide_that_turns_gives_back_what_it_takes() -> None:
    # To and fro within the track: it takes longer than in still water, less than against the stream.
    tide = replace(EASTWARD, period_s=100.0)
    ends_ms = sea(tide).order("a", follow(1, (0.0, 0.0), (1000.0, 0.0), run_in_m=0.0)).statuses()[0][2]
    assert 1000 / 2.5 * 1000 - 60_000 < ends_ms < 1_000_000
    told = sea(tide).order("a", follow(1, (0.0, 0.0), (1000.0, 0.0), run_in_m=0.0)).until(200_000)
    assert min(speeds(told)) < 1.1
    assert max(speeds(told)) > 3.9


def test_one_that_keeps_its_speed_over_the_ground_is_as_in_still_water() -> None:
    order = follow(1, (200.0, 300.0), (-200.0, 300.0))
    kept, still = (
        sea(current).order("a", order).until(300_000) for current in (replace(EASTWARD, over_ground=True), None)
    )
    assert kept.statuses() == still.statuses()


def test_across_the_stream_the_swath_lies_askew() -> None:
    # Northward, the bow points to the west of north by arcsin(1.5 / 2.5) = 36.87 degrees, tan = 3/4, cos = 4/5: abeam
    # to starboard lies ahead. What is y m to starboard is passed 0.75 y m earlier, y / 0.8 m away.
    order = follow(1, (0.0, 0.0), (0.0, 400.0), run_in_m=0.0)
    askew = sea(heading_rad=0.0).order("a", order).until(300_000).looks()
    straight = sea(None, heading_rad=0.0).order("a", order).until(300_000).looks()
    assert len(askew) == len(straight) == 20
    for look, plain in zip(askew, straight, strict=True):
        along_m = look.first_along_m + 5.0 * (np.arange(4) + 0.5)
        for side, sign in ((0, -1.0), (1, 1.0)):
            for number in range(look.p_detect.shape[2]):
                lateral_m = 5.0 * number
                seen = (along_m - sign * 0.75 * lateral_m >= 0) & (along_m - sign * 0.75 * lateral_m <= 400)
                at_range = SWIMMER.sensor.curve.at(np.array([lateral_m / 0.8]))[0]
                assert look.p_detect[side, :, number] == pytest.approx(np.where(seen, at_range, 0.0), abs=2e-4)
        assert plain.p_detect.shape == look.p_detect.shape


# It flows east, not at all along y = 0 and at 1.5 m/s from 100 m further north on.
SHEAR = CurrentConfig(
    1.5,
    0.0,
    grid=FlowGrid(
        np.array([0.0, 1.0]),
        np.array([0.0, 100.0]),
        np.array([0.0]),
        np.array([[[0.0, 0.0], [1.5, 1.5]]]),
        np.zeros((1, 2, 2)),
    ),
)


def test_across_a_shear_it_makes_good_what_the_stream_leaves_it_at_each_place() -> None:
    told = sea(SHEAR, heading_rad=0.0).order("a", follow(1, (0.0, 0.0), (0.0, 100.0), run_in_m=0.0)).until(60_000)
    # dy / sqrt(2.5^2 - (1.5 y / 100)^2), summed from 0.
    passed_ms = [1000 * 100 / 1.5 * math.asin(1.5 * y_m / 100 / 2.5) for y_m in (20, 40, 60, 80, 100)]
    assert told.statuses()[0][2] == pytest.approx(passed_ms[-1], abs=2)
    assert [at_ms for at_ms, _ in told.said(Look)] == pytest.approx(passed_ms, abs=2)


def test_in_a_shear_each_look_is_askew_by_the_stream_where_it_ends() -> None:
    order = follow(1, (0.0, 0.0), (0.0, 100.0), run_in_m=0.0)
    looks = sea(SHEAR, heading_rad=0.0).order("a", order).until(60_000).looks()
    assert len(looks) == 5
    for number, look in enumerate(looks[1:4], start=2):
        cos = math.sqrt(1 - (1.5 * number / 5 / 2.5) ** 2)
        for place in range(9):  # up to 40 m: farther off one side lies beyond the track's ends
            at_range = SWIMMER.sensor.curve.at(np.array([5.0 * place / cos]))[0]
            assert look.p_detect[:, :, place].max() == pytest.approx(at_range, abs=2e-4)


class TestPastAZone:
    ROCK = KeepOut((((180.0, -60.0), (220.0, -60.0), (220.0, 60.0), (180.0, 60.0)),), 2.0)

    def motion(self, start: Pose) -> Motion:
        return Motion(start, speed_mps=2.5, turn_radius_m=20.0, keep_out=self.ROCK, current=Current(1.5, EAST))

    def test_it_sails_the_way_round_in_the_time_that_is_reckoned(self) -> None:
        sailing = self.motion(Pose(0.0, 0.0, EAST))
        ends_ms = sailing.go_to((400.0, 0.0), EAST, 0)
        way = shortest_way(Pose(0.0, 0.0, EAST), Pose(400.0, 0.0, EAST), 20.0, self.ROCK)
        assert way is not None
        assert len(way) > 1
        assert ends_ms / 1000 == pytest.approx(Sailing(2.5, 1.5, EAST).way_s(way), rel=2e-3)
        assert sailing.pose_at(ends_ms) == pytest.approx((400.0, 0.0, EAST), abs=0.01)
        poses = [sailing.pose_at(at_ms) for at_ms in range(0, ends_ms + 60_000, 250)]
        assert_stays_out(poses, self.ROCK)
        assert_keeps_radius(poses, 20.0, 4.0 * 0.25)

    def test_it_goes_on_as_it_was_told_until_there_is_a_way_off(self) -> None:
        # Northward it makes 2 m/s past the rock's west side, where no circle of 40 m fits between it and a wall.
        gap = KeepOut((((30.0, -40.0), (60.0, -40.0), (60.0, 40.0), (30.0, 40.0)), ((-60.0, -40.0), (-30.0, -40.0), (-30.0, 40.0), (-60.0, 40.0))))  # fmt: skip # noqa: E501
        sailing = Motion(
            Pose(0.0, -300.0, 0.0), speed_mps=2.5, turn_radius_m=20.0, keep_out=gap, current=Current(1.5, EAST)
        )
        sailing.follow((0.0, -200.0), (0.0, 200.0), 20.0, 0)
        at_ms = 140_000  # at 2 m/s it is 280 m on its way, at the beginning of the gap
        assert sailing.pose_at(at_ms) == pytest.approx((0.0, -20.0, 0.0), abs=0.1)
        before = sailing.pose_at(at_ms)
        sailing.hold(at_ms)
        assert sailing.pose_at(at_ms) == pytest.approx(before, abs=1e-6)
        poses = [sailing.pose_at(time_ms) for time_ms in range(at_ms, at_ms + 250_000, 250)]
        assert max(pose.y_m for pose in poses) > 40.0
        assert_stays_out(poses, gap)
        assert_keeps_radius(poses, 20.0, 4.0 * 0.25)

    def test_home_it_comes_where_there_is_no_room_to_circle(self) -> None:
        # Of a basin of 30 m, open to the south, no circle of 40 m keeps clear.
        basin = KeepOut((((-25.0, 0.0), (-15.0, 0.0), (-15.0, 60.0), (-25.0, 60.0)), ((15.0, 0.0), (25.0, 0.0), (25.0, 60.0), (15.0, 60.0))))  # fmt: skip # noqa: E501
        sailing = Motion(Pose(0.0, -100.0, 0.0), speed_mps=2.5, turn_radius_m=20.0, keep_out=basin)
        with pytest.raises(NoWayError, match="to circle there"):
            sailing.go_to((0.0, 30.0), 0.0, 0)
        assert sailing.go_to((0.0, 30.0), 0.0, 0, loiters=False) == 52_000
