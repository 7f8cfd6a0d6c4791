"""What a current makes of a speed, by hand: with it, against it, across it, in turns."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.currents import Current, FlowGrid, Sailing, along_and_across_mps, made_good_mps
from planner.dubins import DubinsPath, Pose
from planner.keep_out import KeepOut
from planner.sweep import pass_over
from planner.types import Point
from planner.way_home import WayHome
from planner.ways import shortest_way

NORTH, EAST, SOUTH, WEST = (quarter * math.pi / 2 for quarter in range(4))
# 2.5 m/s through water that flows east at 1.5 m/s: 4 with it, 1 against it, and 2 across it, as 2^2 + 1.5^2 = 2.5^2.
EASTWARD = Sailing(2.5, 1.5, EAST)
ZERO = np.array(0.0)


@pytest.mark.parametrize(("course_rad", "mps"), [(EAST, 4.0), (WEST, 1.0), (NORTH, 2.0), (SOUTH, 2.0)])
def test_a_leg_of_100_m(course_rad: float, mps: float) -> None:
    assert EASTWARD.straight_s(100, Pose(0, 0, course_rad)) == pytest.approx(100 / mps)
    northward = Sailing(2.5, 1.5)
    assert northward.straight_s(100, Pose(0, 0, course_rad - EAST)) == pytest.approx(100 / mps)
    assert made_good_mps(course_rad, 2.5, Current(1.5, EAST).flow_mps(0)) == pytest.approx(mps)


def test_the_flow_is_told_to_the_east_and_to_the_north_and_along_a_heading_and_to_starboard_of_it() -> None:
    assert Current(2.0, math.pi / 6).flow_mps(0) == pytest.approx((1.0, math.sqrt(3)))
    assert Current(2.0, math.pi / 6, period_s=400.0).flow_mps(100) == pytest.approx((1.0, math.sqrt(3)))
    for heading_rad, mps in ((NORTH, (1.5, 0.5)), (EAST, (0.5, -1.5)), (SOUTH, (-1.5, -0.5)), (WEST, (-0.5, 1.5))):
        assert along_and_across_mps(heading_rad, (0.5, 1.5)) == pytest.approx(mps)
    along_mps, across_mps = along_and_across_mps(math.pi / 6, (2.0, 0.0))
    assert (along_mps, across_mps) == pytest.approx((1.0, math.sqrt(3)))


def test_a_tide_is_reckoned_with_as_it_runs_against() -> None:
    tidal = Sailing(2.5, 1.5, EAST, tidal=True)
    assert [tidal.straight_s(100, Pose(0, 0, course_rad)) for course_rad in (EAST, WEST)] == pytest.approx(
        [100.0, 100.0]
    )
    # Across it as either way; at an angle against it: 60 degrees off 0.75 m/s are lost, and 1.3 m/s crabbed against.
    assert tidal.straight_s(100, Pose(0, 0, NORTH)) == pytest.approx(50.0)
    for course_rad in (math.pi / 6, math.pi * 5 / 6, -math.pi / 6):
        mps = math.sqrt(2.5**2 - (1.5 * math.cos(math.pi / 6)) ** 2) - 0.75
        assert tidal.straight_s(100, Pose(0, 0, course_rad)) == pytest.approx(100 / mps)


def test_many_straights_and_turns_take_as_long_as_each_alone() -> None:
    starts = np.array([[0.0, 10.0, 0.3], [200.0, 50.0, 2.0], [350.0, 90.0, 4.0]])
    lengths_m, by_rad = np.array([10.0, 80.0, 130.0]), np.array([-0.5, 2.0, 3.0])
    for sailing in (Sailing(2.5), Sailing(2.5, 1.5, 0.7), Sailing(2.5, 1.5, grid=SHEAR)):
        straights_s = [
            sailing.straight_s(*one) for one in zip(lengths_m.tolist(), [Pose(*p) for p in starts], strict=True)
        ]
        assert sailing.straights_s(lengths_m, starts) == pytest.approx(straights_s)
        turns_s = [float(sailing.turns_s(12.0, *one)) for one in zip(starts, by_rad, strict=True)]
        assert sailing.turns_s(12.0, starts, by_rad) == pytest.approx(turns_s)
        paths = [
            DubinsPath(Pose(*start), 12.0, (int(math.copysign(1, by)), 0, 0), (12.0 * abs(by), 0.0, 0.0))
            for start, by in zip(starts.tolist(), by_rad.tolist(), strict=True)
        ]
        assert [sailing.path_s(path) for path in paths] == pytest.approx(turns_s, rel=1e-12)


def test_a_turn_is_reckoned_by_sixteen_headings_and_a_straight_by_eight_places() -> None:
    points, weights = np.polynomial.legendre.leggauss(16)
    mps = EASTWARD.made_good_mps(math.pi * (points + 1), ZERO, ZERO)
    circle_s = 10 * math.pi * float((weights / mps).sum())
    assert EASTWARD.turns_s(10, np.array([0, 0, NORTH]), np.array(2 * math.pi)) == pytest.approx(circle_s, rel=1e-12)
    points, weights = np.polynomial.legendre.leggauss(8)
    mps = np.sqrt(2.5**2 - (1.5 * (points + 1) / 2) ** 2)
    straight_s = Sailing(2.5, 1.5, grid=AT_FIRST).straight_s(100, Pose(10, 0, NORTH))
    assert straight_s == pytest.approx(50 * float((weights / mps).sum()), rel=1e-12)


def test_still_water_takes_the_length_over_the_speed() -> None:
    path = DubinsPath(Pose(0, 0, NORTH), 10, (1, 0, -1), (5, 20, 3))
    assert (Sailing(2.0).is_in_still_water, EASTWARD.is_in_still_water) == (True, False)
    assert Sailing(2.0).path_s(path) == 14.0
    assert Sailing(2.0).straight_s(28, Pose(0, 0, 1.0)) == 14.0


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
    assert EASTWARD.passes_s(passes, 10, here=Pose(-140, 0, EAST)) == pytest.approx(440 / 4)
    way = shortest_way(passes[0].end, passes[1].begin, 10, zone)
    assert way is not None
    assert len(way) > 1
    assert EASTWARD.passes_s(passes, 10, keep_out=zone) == pytest.approx(200 / 4 + sum(map(EASTWARD.path_s, way)))
    # At 4 m/s at most it takes longer than the taut line at that, 2 m/s less than the whole of it across the stream.
    taut_m = math.hypot(40, 40) + 20 + math.hypot(140, 40)
    assert 50 + taut_m / 4 < EASTWARD.passes_s(passes, 10, keep_out=zone) < 50 + 1.2 * taut_m / 2


@pytest.mark.parametrize(("time_s", "east_mps"), [(50, 0.0), (150, 1.5), (250, 0.0), (350, -1.5), (83.333333, 0.75)])
def test_a_tide_turns_towards_its_heading_at_slack_water_and_is_as_it_was_a_period_later(
    time_s: float, east_mps: float
) -> None:
    tide = Current(1.5, EAST, period_s=400.0, slack_s=50.0)
    for later_s in (0, 400, 4000):
        assert tide.flow_mps(time_s + later_s) == pytest.approx((east_mps, 0.0), abs=1e-6)


# It flows east, not at all in the south and at 1.5 m/s 100 m further north; an hour later the other way.
SHEAR = FlowGrid(
    np.array([0.0, 400.0]),
    np.array([0.0, 100.0]),
    np.array([0.0, 3600.0]),
    np.array([[[0.0, 0.0], [1.5, 1.5]], [[0.0, 0.0], [-1.5, -1.5]]]),
    np.zeros((2, 2, 2)),
)
AT_FIRST = SHEAR.until(0.0)


def alike(east_mps: float, north_mps: float) -> FlowGrid:
    """The same flow everywhere, on a grid that is not even."""
    places = np.array([-500.0, -20.0, 700.0]), np.array([-300.0, 500.0])
    return FlowGrid(*places, np.array([0.0]), np.full((1, 2, 3), east_mps), np.full((1, 2, 3), north_mps))


def test_what_is_made_good_is_known_where_the_water_always_flows_alike() -> None:
    at_two_times = replace(alike(0.5, 0.0), time_s=np.array([0.0, 60.0]))
    known = [Sailing(2), Sailing(2, 0.5), Sailing(2, 0.5, grid=alike(0.5, 0.0))]
    assert [one.is_known for one in known] == [True] * 3
    assert [one.is_known for one in (Sailing(2, 0.5, tidal=True), Sailing(2, 0.5, grid=at_two_times))] == [False] * 2


class TestFlowsFromPlaceToPlace:
    @pytest.mark.parametrize(
        ("time_s", "place", "east_mps"),
        [
            (0, (0, 50), 0.75),
            (0, (200, 20), 0.3),
            (900, (200, 100), 0.75),
            (1800, (200, 100), 0.0),
            (3600, (400, 100), -1.5),
            (-5, (-80, 170), 1.5),
            (9999, (999, 10), -0.15),
        ],
    )
    def test_between_places_and_times_it_is_linear_and_beyond_as_at_the_edge(
        self, time_s: float, place: tuple[float, float], east_mps: float
    ) -> None:
        current = Current(1.5, 0.0, grid=SHEAR)
        assert current.flow_mps(time_s, place) == pytest.approx((east_mps, 0.0))
        assert current.flow_mps(time_s) == current.flow_mps(time_s, (0.0, 0.0))

    def test_on_a_square_it_is_bilinear(self) -> None:
        corners = np.array([[[1.0, 2.0], [3.0, 5.0]]])
        grid = FlowGrid(np.array([0.0, 10.0]), np.array([0.0, 10.0]), np.array([0.0]), corners, -corners)
        # A quarter east and half north: 1.25 in the south, 3.5 in the north.
        assert grid.flow_mps(0, (2.5, 5)) == pytest.approx((2.375, -2.375))
        about = replace(grid, x_m=grid.x_m - 4.0, y_m=grid.y_m - 5.0)
        assert Current(6.0, 0.0, grid=about).flow_mps(0) == about.flow_mps(0, (0.0, 0.0))  # where the frame begins

    @pytest.mark.parametrize("heading_rad", [0.4, 2.1, 3.9, 5.6])
    @pytest.mark.parametrize("turn", [-1, 0, 1])
    def test_a_way_takes_as_long_as_its_steps_where_they_lead(self, heading_rad: float, turn: int) -> None:
        east_mps, north_mps = np.array([[[0.1, 0.9], [-0.5, 0.3]]]), np.array([[[0.7, -0.2], [0.4, -0.9]]])
        axes = np.array([-60.0, 80.0]), np.array([-90.0, 70.0])
        sailing = Sailing(2.0, 1.1, grid=FlowGrid(*axes, np.array([0.0]), east_mps, north_mps))
        path = DubinsPath(Pose(7.0, -4.0, heading_rad), 15.0, (turn, 0, 0), (40.0, 0.0, 0.0))
        x_m, y_m, courses_rad = path.poses_at((np.arange(2000) + 0.5) * 40 / 2000).T
        took_s = float((40 / 2000 / sailing.made_good_mps(courses_rad, x_m, y_m)).sum())
        assert sailing.path_s(path) == pytest.approx(took_s, rel=1e-6)
        for place in zip(x_m[::500], y_m[::500], courses_rad[::500], strict=True):
            flow_mps = Current(1.1, 0.0, grid=sailing.grid).flow_mps(0, place[:2])
            alone_mps = float(sailing.made_good_mps(*(np.array(one) for one in (place[2], place[0], place[1]))))
            assert alone_mps == pytest.approx(made_good_mps(place[2], 2.0, flow_mps))

    def test_along_an_axis_of_one_place_it_is_the_same_everywhere(self) -> None:
        flows = np.array([[[1.0, 2.0]]])
        row = FlowGrid(np.array([0.0, 10.0]), np.array([3.0]), np.array([0.0]), flows, -flows)
        column = FlowGrid(
            np.array([3.0]), np.array([0.0, 10.0]), np.array([0.0]), flows.reshape(1, 2, 1), np.zeros((1, 2, 1))
        )
        for y_m in (-5.0, 3.0, 50.0):
            assert row.flow_mps(0, (5, y_m)) == pytest.approx((1.5, -1.5))
            assert row.flows_mps(np.array(5.0), np.array(y_m))[:, 0] == pytest.approx([1.5, -1.5])
            assert column.flows_mps(np.array(y_m), np.array(5.0))[:, 0] == pytest.approx([1.5, 0.0])

    def test_along_the_shear_and_across_it(self) -> None:
        sailing = Sailing(2.5, 1.5, grid=AT_FIRST)
        assert sailing.straight_s(130, Pose(0, 50, EAST)) == pytest.approx(130 / 3.25)
        assert sailing.straight_s(140, Pose(350, 50, WEST)) == pytest.approx(140 / 1.75)
        # Northward dy / sqrt(2.5^2 - (1.5 y / 100)^2), summed from 0 to 100 m.
        across_s = 100 / 1.5 * math.asin(1.5 / 2.5)
        assert sailing.straight_s(100, Pose(10, 0, NORTH)) == pytest.approx(across_s, rel=1e-6)
        path = DubinsPath(Pose(10, 0, NORTH), 10, (0, 0, 0), (100, 0, 0))
        assert sailing.path_s(path) == pytest.approx(across_s, rel=1e-6)
        times_s, lengths_m = sailing.knots([path])
        halfway_s = 100 / 1.5 * math.asin(0.75 / 2.5)
        assert np.interp(50, lengths_m, times_s) == pytest.approx(halfway_s, rel=1e-3)

    def test_a_straight_way_home_is_reckoned_where_it_is(self) -> None:
        sailing = Sailing(2.5, 1.5, grid=AT_FIRST)

        def time_s(home: Point, start: Pose) -> float:
            return WayHome(home, sailing, 10.0).from_pose(start)[0]

        # In the south no water flows; from 100 m north on it does so at 1.5 m/s, which leaves 2 m/s across it.
        assert time_s((0, 0), Pose(0, -100, NORTH)) == pytest.approx(100 / 2.5)
        assert time_s((0, 100), Pose(0, 200, SOUTH)) == pytest.approx(100 / 2)
        assert time_s((100, 150), Pose(0, 150, EAST)) == pytest.approx(100 / 4)

    def test_a_turn_is_reckoned_where_it_is(self) -> None:
        sailing = Sailing(2.5, 1.5, grid=AT_FIRST)
        # Half a turn to starboard from (0, 40) northward: a circle about (30, 40), from 40 to 70 m north and back.
        steps = np.linspace(0, math.pi, 200_001)
        angles = (steps[1:] + steps[:-1]) / 2
        along_mps = 1.5 * (40 + 30 * np.sin(angles)) / 100
        mps = along_mps * np.sin(angles) + np.sqrt(2.5**2 - (along_mps * np.cos(angles)) ** 2)
        took_s = float((30 * np.diff(steps) / mps).sum())
        path = DubinsPath(Pose(0, 40, NORTH), 30, (1, 0, 0), (30 * math.pi, 0, 0))
        assert sailing.path_s(path) == pytest.approx(took_s, rel=1e-4)
        # The same with east and north, and so starboard and port, in each other's place.
        flow_mps = AT_FIRST.east_mps.transpose(0, 2, 1)
        turned = FlowGrid(AT_FIRST.y_m, AT_FIRST.x_m, AT_FIRST.time_s, np.zeros_like(flow_mps), flow_mps)
        path = DubinsPath(Pose(40, 0, EAST), 30, (-1, 0, 0), (30 * math.pi, 0, 0))
        assert Sailing(2.5, 1.5, grid=turned).path_s(path) == pytest.approx(took_s, rel=1e-4)

    @pytest.mark.parametrize(
        ("time_s", "until_s", "kept"),
        [
            ((-600, 0, 600, 1200, 1800), 0, (1, 2)),
            ((-600, 0, 600, 1200, 1800), 600, (1, 3)),
            ((-600, 0, 600, 1200, 1800), 601, (1, 4)),
            ((-600, 0, 600, 1200, 1800), 9999, (1, 5)),
            ((-600, -1, 600, 1200, 1800), 0, (1, 3)),
            ((300, 900, 1000, 1100, 1200), 100, (0, 1)),
            ((300, 900, 1000, 1100, 1200), 301, (0, 2)),
            ((-900, -800, -700, -600, -300), 100, (4, 5)),
        ],
    )
    def test_until_a_time_it_is_known_from_the_last_one_before_now_to_the_first_one_behind_that(
        self, time_s: tuple[float, ...], until_s: float, kept: tuple[int, int]
    ) -> None:
        east_mps, north_mps = np.arange(30.0).reshape(5, 2, 3), -np.arange(60.0, 90.0).reshape(5, 2, 3)
        grid = FlowGrid(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]), np.array(time_s), east_mps, north_mps)
        until = grid.until(until_s)
        assert until.time_s.tolist() == list(time_s[slice(*kept)])
        assert until.east_mps.tolist() == east_mps[slice(*kept)].tolist()
        assert until.north_mps.tolist() == north_mps[slice(*kept)].tolist()
        assert until.fastest_mps == pytest.approx(math.hypot(6 * kept[1] - 1, 59 + 6 * kept[1]))

    @pytest.mark.parametrize(("length_m", "pieces"), [(49, 1), (50, 1), (51, 2), (100, 2), (101, 3), (390, 8)])
    def test_a_straight_or_a_turn_is_reckoned_in_pieces_of_up_to_50_m(self, length_m: float, pieces: int) -> None:
        sailing = Sailing(2.5, 1.5, grid=AT_FIRST)
        for turn in (0, 1):
            path = DubinsPath(Pose(0, 20, NORTH), 70, (0, turn, 0), (7, length_m, 0))
            times_s, lengths_m = sailing.knots([path])
            each_m = length_m / pieces
            assert lengths_m == pytest.approx([0.0, *(7 + each_m * n for n in range(pieces + 1)), 7 + length_m])
            assert times_s[-1] == pytest.approx(sailing.path_s(path))
            assert EASTWARD.knots([path])[1].tolist() == [0, 7, 7 + length_m, 7 + length_m]

    def test_of_its_times_the_slowest_counts(self) -> None:
        sailing = Sailing(2.5, 1.5, grid=SHEAR)
        for heading_rad in (EAST, WEST):
            assert sailing.straight_s(100, Pose(300, 100, heading_rad)) == pytest.approx(100.0)
        assert SHEAR.until(1.0).time_s.tolist() == [0, 3600]
        assert AT_FIRST.time_s.tolist() == [0]
        # At first, on the way from what was known before to what is known soon, both bear on it.
        early = replace(SHEAR, time_s=np.array([-600.0, 0.5]))
        assert early.until(0.2).time_s.tolist() == [-600, 0.5]
        assert (SHEAR.fastest_mps, sailing.slowest_mps) == (1.5, 1.0)

    @given(
        st.floats(0, 2 * math.pi),
        st.floats(0, 0.9),
        st.tuples(st.floats(-400, 400), st.floats(-200, 300), st.floats(0, 6.28)),
    )
    def test_one_that_is_alike_everywhere_is_as_set_and_drift(
        self, set_rad: float, share: float, there: tuple[float, float, float]
    ) -> None:
        drift_mps = 2.0 * share
        known = Sailing(2.0, drift_mps, set_rad)
        told = Sailing(2.0, drift_mps, grid=alike(drift_mps * math.sin(set_rad), drift_mps * math.cos(set_rad)))
        way = shortest_way(Pose(0, 0, NORTH), Pose(*there), 12.0, KeepOut())
        assert way is not None
        assert told.way_s(way) == pytest.approx(known.way_s(way), rel=2e-3)  # turns have points of their own
        homes = [WayHome((30.0, -40.0), one, 12.0).from_pose(Pose(*there)) for one in (told, known)]
        assert homes[0] == pytest.approx(homes[1], rel=1e-6)

    @given(
        st.lists(st.floats(-1, 1), min_size=54, max_size=54),
        st.floats(-50, 150),
        st.floats(-50, 150),
        st.floats(-10, 40),
        st.floats(0, 6.28),
    )
    def test_it_is_never_faster_than_at_some_place_and_one_by_one_is_as_many_at_once(
        self, flows: list[float], x_m: float, y_m: float, time_s: float, course_rad: float
    ) -> None:
        east_mps, north_mps = np.array(flows).reshape(2, 3, 3, 3)
        axes = np.array([0.0, 30.0, 100.0]), np.array([0.0, 60.0, 100.0]), np.array([0.0, 10.0, 25.0])
        grid = FlowGrid(*axes, east_mps, north_mps)
        east, north = grid.flow_mps(time_s, (x_m, y_m))
        assert math.hypot(east, north) <= grid.fastest_mps + 1e-9
        many = grid.flows_mps(np.array([x_m]), np.array([y_m]))
        assert (east, north) == pytest.approx([np.interp(time_s, axes[2], one) for one in many[:, :, 0]])
        made_good = Sailing(1.6, grid.fastest_mps, grid=grid).made_good_mps(*map(np.array, (course_rad, x_m, y_m)))
        assert float(made_good) <= made_good_mps(course_rad, 1.6, (east, north)) + 1e-9
