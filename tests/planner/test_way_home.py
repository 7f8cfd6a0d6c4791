"""The way home against ways that are measured by hand, and against Dubins' shortest path to the pose of arrival."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planner.currents import FlowGrid, Sailing
from planner.dubins import TIE_M, Pose, shortest_path
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import pass_over
from planner.types import Point
from planner.way_home import WayHome
from planner.ways import shortest_way

NORTH, EAST, SOUTH = 0.0, math.pi / 2, math.pi
# Between them there is a gap of 40 m, and home lies in the bay to the north of it.
HEADLANDS = KeepOut((((-300, 20), (-20, 20), (-20, 60), (-300, 60)), ((20, 20), (300, 20), (300, 60), (20, 60))), 1.5)
SHARES = st.floats(0.8, 1.2).filter(lambda share: abs(share - 1) > 1e-9)  # of a limit that is rounded itself
# How the water flows differs from corner to corner.
EDDY = FlowGrid(
    np.array([-150.0, 200.0]),
    np.array([-150.0, 150.0]),
    np.array([0.0]),
    np.array([[[-0.7, 0.6], [0.3, 0.9]]]),
    np.array([[[0.2, -0.8], [1.0, 0.5]]]),
)
WAY = WayHome((0.0, 0.0), Sailing(2.0), turn_radius_m=10.0)


class TestByHand:
    def test_straight_ahead(self) -> None:
        assert WAY.from_pose(Pose(0, -100, NORTH)) == pytest.approx((50.0, NORTH))

    def test_right_behind_it_turns_until_it_heads_there(self) -> None:
        # The circle's centre lies 10 m beside it, and 100 m from the line's end: the tangent is sqrt(100^2 + 10^2 -
        # 10^2) = 100 m long, and lies atan(10 / 100) twice beyond half a turn.
        turn_rad = math.pi + 2 * math.atan(10 / 100)
        time_s, heading_rad = WAY.from_pose(Pose(0, -100, SOUTH))
        assert time_s == pytest.approx((10 * turn_rad + 100) / 2)
        assert min(heading_rad, 2 * math.pi - heading_rad) == pytest.approx(2 * math.atan(10 / 100))

    def test_abeam_to_either_side_it_turns_there(self) -> None:
        # Of 40 m the centre is 30 m short of home, the tangent sqrt(30^2 - 10^2) long.
        for beside_m in (40.0, 25.0):
            tangent_m = math.sqrt((beside_m - 10) ** 2 - 10**2)
            way_m = 10 * (math.pi / 2 + math.atan(10 / tangent_m)) + tangent_m
            for x_m in (beside_m, -beside_m):
                assert WAY.from_pose(Pose(x_m, 0, NORTH))[0] == pytest.approx(way_m / 2)

    def test_of_two_ways_as_long_it_takes_the_one_to_starboard(self) -> None:
        for stream in (Sailing(2.0), Sailing(2.0, 0.5, NORTH)):
            _, heading_rad = replace(WAY, sailing=stream).from_pose(Pose(0, 100, NORTH))
            assert heading_rad == pytest.approx(math.pi + 2 * math.atan(10 / 100))

    def test_home_on_the_circle_that_it_turns_on_it_needs_no_more_than_the_turn(self) -> None:
        for x_m in (20.0, -20.0):
            time_s, heading_rad = WAY.from_pose(Pose(x_m, 0, NORTH))
            assert time_s == pytest.approx(10 * math.pi / 2, abs=1e-3)
            assert math.cos(heading_rad - SOUTH) == pytest.approx(1.0)
        a_quarter_s, _ = WAY.from_pose(Pose(-10, -10, NORTH))
        assert a_quarter_s == pytest.approx(10 * math.pi / 2 / 2, abs=1e-3)

    def test_who_is_there_has_no_way(self) -> None:
        assert WAY.from_pose(Pose(0.01, 0, SOUTH))[0] == 0.0
        assert WAY.from_pose(Pose(0.05, 0, SOUTH))[0] == 0.0
        assert WAY.from_pose(Pose(0.0501, 0, SOUTH))[0] > 0.0
        # Nor where a wall is in the way of turning back.
        wall = KeepOut((((5, -40), (9, -40), (9, 40), (5, 40)),))
        assert replace(WAY, keep_out=wall).from_pose(Pose(0.03, 0, NORTH))[0] == 0.0
        elsewhere = replace(WAY, home=(30.0, -40.0))
        assert elsewhere.from_pose(Pose(30.01, -40, SOUTH))[0] == 0.0
        assert elsewhere.from_pose(Pose(30, 40, SOUTH))[0] == pytest.approx(40.0)
        assert elsewhere.from_pose(Pose(30.03, -40.04, SOUTH))[0] == 0.0
        assert elsewhere.from_pose(Pose(30.03, -40.05, NORTH))[0] > 0.0

    def test_within_the_circle_that_it_would_turn_on_it_turns_to_the_other_side(self) -> None:
        # Home lies 5 m to port. The circle to starboard has its centre 15 m off, the tangent is sqrt(15^2 - 10^2) long.
        tangent_m = math.sqrt(125)
        turn_rad = 3 * math.pi / 2 + math.atan(10 / tangent_m)
        for x_m, sign in ((5.0, 1), (-5.0, -1)):
            time_s, heading_rad = WAY.from_pose(Pose(x_m, 0, NORTH))
            assert time_s == pytest.approx((10 * turn_rad + tangent_m) / 2)
            assert heading_rad == pytest.approx((sign * turn_rad) % (2 * math.pi))

    @pytest.mark.parametrize(
        "sailing",
        [Sailing(2.0), Sailing(2.0, 0.9, 0.6), Sailing(2.0, 0.9, 4.0, tidal=True), Sailing(2.0, 1.5, grid=EDDY)],
    )
    def test_it_takes_as_long_as_the_path_that_is_sailed(self, sailing: Sailing) -> None:
        home = WayHome((35.0, -20.0), sailing, 12.0)
        for number in range(24):
            pose = Pose(35 + 90 * math.sin(number * 2.4), -20 + 70 * math.cos(number * 2.4), number * 1.1)
            time_s, arrival_rad = home.from_pose(pose)
            path = shortest_path(pose, Pose(*home.home, arrival_rad), 12.0)
            assert time_s == pytest.approx(sailing.path_s(path), rel=1e-6)
            assert sum(map(sailing.path_s, home.way(pose))) == pytest.approx(time_s, rel=1e-6)
            assert 0.0 <= arrival_rad < 2 * math.pi

    def test_well_within_is_what_leaves_eight_turn_radii_or_past_zones_three_times_all_and_circles_beside(self) -> None:
        sailing, pose = Sailing(2.0, 0.5, EAST), Pose(30, 40, 2.0)  # against the stream 1.5 m/s
        in_open_water = replace(WAY, sailing=sailing)
        assert not in_open_water.is_well_within(pose, (50 + 80) / 1.5 - 0.01)
        assert in_open_water.is_well_within(pose, (50 + 80) / 1.5 + 0.01)
        assert not WAY.is_well_within(pose, 65.0)
        assert WAY.is_well_within(pose, 65.0001)
        past_zones = WayHome((0.0, 100.0), sailing, 10.0, HEADLANDS)
        about_s = float(past_zones.times_s(np.array([pose]))[0])
        time_s = 3 * (about_s + 3 * 20 * math.pi / 1.5)
        assert not past_zones.is_well_within(pose, time_s)
        assert past_zones.is_well_within(pose, time_s + 0.01)

    @given(st.floats(-250, 250), st.floats(-100, 15), st.floats(0, 6.28), st.floats(0.5, 3), SHARES)
    @example(250, 15, 0, 0.5, 0.95)
    def test_what_is_well_within_past_zones_goes_by_about_how_long_it_takes(
        self, x_m: float, y_m: float, heading_rad: float, radius_m: float, share: float
    ) -> None:
        home = WayHome((0.0, 100.0), Sailing(2.0, 0.8, EAST), radius_m, HEADLANDS)
        about_s = float(home.times_s(np.array([[x_m, y_m, heading_rad]]))[0])
        circle_s = 2 * math.pi * radius_m / home.sailing.slowest_mps
        enough_s = 3 * (about_s + 3 * circle_s)
        assert home.is_well_within(Pose(x_m, y_m, heading_rad), share * enough_s) == (share > 1)

    def test_many_at_once_are_as_one_by_one(self) -> None:
        poses = np.array([[40.0, 0.0, NORTH], [0.0, -100.0, SOUTH], [0.0, 0.0, EAST], [3.0, 4.0, EAST]])
        assert WAY.times_s(poses).tolist() == [WAY.from_pose(Pose(*pose))[0] for pose in poses.tolist()]


@given(st.floats(-250, 250), st.floats(-200, 15), st.floats(0, 6.28), st.floats(1, 20), st.floats(10, 4000))
def test_what_is_well_within_a_time_takes_no_longer(
    x_m: float, y_m: float, heading_rad: float, radius_m: float, time_s: float
) -> None:
    home = WayHome((0.0, 100.0), Sailing(2.0, 0.8, EAST), radius_m, HEADLANDS)
    pose = Pose(x_m, y_m, heading_rad)
    assert not (home.is_well_within(pose, time_s) and home.from_pose(pose)[0] > time_s)
    assert home.is_well_within(pose, 100_000.0)
    assert not home.is_well_within(pose, home.from_pose(pose)[0])
    in_open_water = replace(home, keep_out=NOWHERE)
    assert not (in_open_water.is_well_within(pose, time_s) and in_open_water.from_pose(pose)[0] > time_s)
    assert in_open_water.is_well_within(pose, 100_000.0)
    assert not in_open_water.is_well_within(pose, in_open_water.from_pose(pose)[0])


@given(st.floats(-200, 200), st.floats(-200, 200), st.floats(0, 6.28))
def test_a_vehicle_sent_to_the_pose_of_arrival_takes_as_long(x_m: float, y_m: float, heading_rad: float) -> None:
    pose = Pose(x_m, y_m, heading_rad)
    time_s, arrival_rad = WAY.from_pose(pose)
    if math.hypot(x_m, y_m) > 1:
        there = shortest_path(pose, Pose(0, 0, arrival_rad), 10.0)
        assert there.length_m <= 2 * time_s + 1e-3 + TIE_M
        assert math.hypot(x_m, y_m) <= 2 * time_s + 1e-9
        if math.hypot(x_m, y_m) > 40:  # nearer by, three turns may be shorter than a turn and a straight
            assert there.length_m == pytest.approx(2 * time_s, abs=1e-3 + TIE_M)


class TestPassesWithin:
    # Tracks of 100 m along the meridian, 40 m apart, flown there and back: a pass takes 50 s, a turn between two
    # pi * 10 m + 20 m, 25.7 s.
    PASSES = (
        pass_over((0, 0), (0, 100), 0.0),
        pass_over((40, 100), (40, 0), 0.0),
        pass_over((80, 0), (80, 100), 0.0),
    )
    TURN_S = (math.pi * 10 + 20) / 2

    @pytest.mark.parametrize("short_s", [-0.1, 0.1])
    @pytest.mark.parametrize("count", [1, 2, 3])
    def test_as_many_as_leave_time_to_come_home(self, count: int, short_s: float) -> None:
        way_s = 50 * count + self.TURN_S * (count - 1)
        time_s = way_s + WAY.from_pose(self.PASSES[count - 1].end)[0]
        within = WAY.passes_within(Pose(0, 0, NORTH), self.PASSES, time_s - short_s)
        assert within == (count if short_s < 0 else count - 1)

    def test_who_comes_home_right_in_time_comes_home_in_time(self) -> None:
        time_s = WAY.sailing.passes_s(self.PASSES[:2], 10.0, Pose(3, -20, EAST)) + WAY.from_pose(self.PASSES[1].end)[0]
        assert WAY.passes_within(Pose(3, -20, EAST), self.PASSES, time_s) == 2
        assert WAY.passes_within(Pose(3, -20, EAST), self.PASSES, math.nextafter(time_s, 0.0)) == 1

    def test_of_none_none(self) -> None:
        assert WAY.passes_within(Pose(0, 0, NORTH), (), 0.0) == 0


class TestRoundAZone:
    # It lies across the way from the south, 20 m to either side.
    ZONE = KeepOut((((-20, -120), (20, -120), (20, -80), (-20, -80)),))
    ROUND = replace(WAY, keep_out=ZONE)
    TAUT_M = 2 * math.hypot(20, 80) + 40

    def test_where_nothing_is_in_the_way_it_is_the_way_without_zones(self) -> None:
        for pose in (Pose(0, -60, NORTH), Pose(100, 50, EAST), Pose(60, -200, NORTH), Pose(0, 0, EAST)):
            assert self.ROUND.from_pose(pose) == WAY.from_pose(pose)

    def test_else_it_leads_round_by_hardly_more_than_a_taut_line(self) -> None:
        time_s, heading_rad = self.ROUND.from_pose(Pose(0, -200, NORTH))
        assert self.TAUT_M / 2 < time_s < self.TAUT_M / 2 + 3
        way = self.ROUND.way(Pose(0, -200, NORTH))
        assert self.ZONE.is_clear(way)
        assert sum(path.length_m for path in way) == pytest.approx(2 * time_s)
        assert way[-1].pose_at(way[-1].length_m) == pytest.approx((0, 0, heading_rad), abs=1e-6)

    def test_many_at_once_take_the_way_from_corner_to_corner(self) -> None:
        poses = np.array([[0.0, -200.0, NORTH], [0.0, -60.0, NORTH]])
        assert self.ROUND.times_s(poses) == pytest.approx([self.TAUT_M / 2, 30.0], abs=0.1)

    def test_of_no_poses_there_are_no_times(self) -> None:
        assert self.ROUND.times_s(np.empty((0, 3))).shape == WAY.times_s(np.empty((0, 3))).shape == (0,)

    def test_in_a_current_what_is_longer_about_it_counts_right_against_the_stream(self) -> None:
        against = replace(self.ROUND, home=(7.0, 4.0), sailing=Sailing(2.0, 0.5, EAST))
        poses = np.array([[3.0, -200.0, 1.0], [7.0, -60.0, NORTH], [-90.0, -30.0, 2.0]])
        further_m = math.hypot(17, 80) + 40 + math.hypot(13, 84) - math.hypot(4, 204)
        straight_s = replace(against, keep_out=NOWHERE).times_s(poses)
        assert against.times_s(poses) == pytest.approx(straight_s + np.array([further_m / 1.5, 0.0, 0.0]), abs=1e-6)

    @pytest.mark.parametrize("at", [(6.0, 3.0), (10.0, -70.0)])
    def test_it_arrives_by_whichever_of_sixteen_headings_or_the_direct_one_takes_least(self, at: Point) -> None:
        sailing = Sailing(2.0, 0.7, 1.0)
        home = WayHome(at, sailing, 10.0, self.ZONE)
        for pose in (Pose(4, -170, 0.3), Pose(-40, -135, 2.0), Pose(15, -190, 5.0)):
            direct_rad = WayHome(at, sailing, 10.0).from_pose(pose)[1]
            took_s = {}
            for heading_rad in (direct_rad, *(math.pi / 8 * number for number in range(16))):
                way = shortest_way(pose, Pose(*at, heading_rad), 10.0, self.ZONE)
                assert way is not None
                took_s[heading_rad] = sailing.way_s(way)
            time_s, heading_rad = home.from_pose(pose)
            assert time_s == pytest.approx(min(took_s.values()))
            assert took_s[heading_rad] == pytest.approx(time_s)

    def test_it_leads_round_where_the_direct_path_to_its_own_arrival_is_not_clear(self) -> None:
        home, direct = replace(self.ROUND, home=(10.0, -70.0)), replace(WAY, home=(10.0, -70.0))
        clear = 0
        for number in range(16):
            pose = Pose(10 + 70 * math.sin(number), -75 + 90 * math.cos(number), number * 2.0)
            time_s, heading_rad = direct.from_pose(pose)
            if self.ZONE.is_clear([shortest_path(pose, Pose(10.0, -70.0, heading_rad), 10.0)]):
                clear += 1
                assert home.from_pose(pose) == (time_s, heading_rad)
            else:
                assert home.from_pose(pose)[0] > time_s + 0.1
        assert 4 < clear < 12

    def test_in_a_current_each_path_of_it_counts_by_its_own(self) -> None:
        northward = replace(self.ROUND, sailing=Sailing(2.0, 1.0, NORTH))
        pose = Pose(0, -200, NORTH)
        assert northward.from_pose(pose)[0] == pytest.approx(sum(map(northward.sailing.path_s, northward.way(pose))))
        assert self.TAUT_M / 3 < northward.from_pose(pose)[0] < self.TAUT_M / 2

    def test_fewer_passes_leave_time_to_come_home(self) -> None:
        # To the south, where it turns round, and past the corners: that is a little farther than straight home.
        passes = [pass_over((0, -140), (0, -240), 0.0)]
        spent_s = 50 + self.ROUND.from_pose(passes[0].end)[0]
        assert spent_s > 50 + WAY.from_pose(passes[0].end)[0] + 1
        for time_s, count in ((spent_s + 0.1, 1), (spent_s - 0.1, 0)):
            assert self.ROUND.passes_within(Pose(0, -140, SOUTH), passes, time_s) == count

    def test_where_no_way_leads_the_direct_one_counts(self) -> None:
        walled = replace(WAY, keep_out=KeepOut((((-20, 20), (20, 20), (20, 24), (-20, 24)), ((-20, -24), (20, -24), (20, -20), (-20, -20)), ((-24, -24), (-20, -24), (-20, 24), (-24, 24)), ((20, -24), (24, -24), (24, 24), (20, 24)))))  # fmt: skip # noqa: E501
        pose = Pose(0, -200, NORTH)
        assert walled.from_pose(pose) == WAY.from_pose(pose)
        assert walled.times_s(np.array([pose])) == pytest.approx(WAY.times_s(np.array([pose])))
