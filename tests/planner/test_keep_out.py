"""Ground to keep out of: how it is grown, and what stays clear of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from planner.dubins import DubinsPath, Pose
from planner.keep_out import NOWHERE, KeepOut, as_line
from planner.types import Point


def saw(teeth: int, depth_m: float, *more: Point) -> tuple[Point, ...]:
    """A coast that begins at the origin, with so many teeth of 100 m to the north, and `more` corners to the south."""
    return ((0.0, 0.0), *more, *((50.0 * n, 200.0 + depth_m * (n % 2)) for n in range(2 * teeth, -1, -1)))


class TestGrown:
    def test_corners_are_kept_and_sharp_ones_cut_at_twice_the_margin(self) -> None:
        # Its sides rise 0.6 a metre: the corner is moved by 2 / sin(atan(0.6)).
        blunt = KeepOut((((0, 0), (10, -6), (10, 6)),), 2.0).ground
        assert blunt.bounds[0] == pytest.approx(-2 * math.hypot(1, 0.6) / 0.6)
        sharp = KeepOut((((0, 0), (100, -10), (100, 10)),), 2.0).ground
        assert sharp.bounds == pytest.approx(
            (-4, -10 - 0.2 - 2 * math.hypot(1, 0.1), 102, 10.2 + 2 * math.hypot(1, 0.1))
        )

    @pytest.mark.parametrize(
        ("depth_m", "simpler_m"),
        [(0.3, 0.5), (0.6, 1.0), (1.5, 2.0), (4.5, 5.0), (10.0, 10.0), (12.0, 20.0), (22.0, 20.0), (40.0, 50.0)],
    )
    def test_where_it_has_many_corners_it_is_grown_until_it_has_120(self, depth_m: float, simpler_m: float) -> None:
        zone = saw(70, depth_m, (7000.0, 0.0))
        keep_out = KeepOut((zone,), 2.0)
        west_m, south_m, east_m, _ = keep_out.ground.bounds
        grown_m = 2.0 + simpler_m
        assert (west_m, south_m, east_m) == pytest.approx((-grown_m, -grown_m, 7000 + grown_m))
        assert shapely.get_num_coordinates(keep_out.ground) <= 120
        assert keep_out.ground.buffer(1e-6).contains(shapely.Polygon(zone).buffer(2.0))

    def test_as_far_as_that_goes(self) -> None:
        keep_out = KeepOut((saw(70, 60.0, (7000.0, 0.0)),), 2.0)
        assert keep_out.ground.bounds[:3] == pytest.approx((-52, -52, 7052))
        assert shapely.get_num_coordinates(keep_out.ground) > 120

    def test_up_to_120_corners_are_left_as_they_are(self) -> None:
        # With the first one again at the end: 2 at the south, 117 at the teeth.
        keep_out = KeepOut((saw(58, 30.0, (5800.0, 0.0)),), 2.0)
        assert shapely.get_num_coordinates(keep_out.ground) == 120
        assert keep_out.ground.bounds[0] == pytest.approx(-2)
        with_one_more = KeepOut((saw(58, 30.0, (3000.0, -10.0), (5800.0, 0.0)),), 2.0)
        assert shapely.get_num_coordinates(with_one_more.ground) < 120
        assert with_one_more.ground.bounds[0] < -10


class TestStayingOut:
    # Its grown side lies at x = 98 m.
    ZONE = KeepOut((((100.0, -50.0), (200.0, -50.0), (200.0, 50.0), (100.0, 50.0)),), 2.0)

    def test_who_is_told_a_way_may_come_a_quarter_of_a_metre_nearer(self) -> None:
        assert self.ZONE.nearer() == KeepOut(self.ZONE.zones, 1.75)
        assert KeepOut(self.ZONE.zones, 0.1).nearer() == KeepOut(self.ZONE.zones)
        assert KeepOut((), 2.0).nearer() == KeepOut((), 2.0)

    def test_its_side_may_be_touched(self) -> None:
        places = [97.0, 98.04, 98.06, 150.0]
        assert self.ZONE.are_clear(shapely.points([(x_m, 0.0) for x_m in places])).tolist() == [
            True,
            True,
            False,
            False,
        ]
        north = [shapely.LineString([(x_m, -80.0), (x_m, 80.0)]) for x_m in places]
        assert self.ZONE.are_clear(north).tolist() == [True, True, False, False]
        assert KeepOut(self.ZONE.zones).are_clear(shapely.points([(100.04, 0), (100.06, 0)])).tolist() == [True, False]

    def test_paths_are_clear_if_all_are(self) -> None:
        beside, across = (DubinsPath(Pose(x_m, -80, 0), 6.0, (0, 0, 0), (160, 0, 0)) for x_m in (97.0, 99.0))
        assert self.ZONE.is_clear([beside])
        assert not self.ZONE.is_clear([beside, across])
        assert NOWHERE.is_clear([across])

    def test_a_lagoon_is_parted_from_the_sea_and_from_another_one(self) -> None:
        bars = [((0.0, y_m), (200.0, y_m), (200.0, y_m + 10), (0.0, y_m + 10)) for y_m in (0.0, 90.0)]
        piers = [((x_m, 0.0), (x_m + 10, 0.0), (x_m + 10, 100.0), (x_m, 100.0)) for x_m in (0.0, 90.0, 190.0)]
        atoll = KeepOut((*bars, *piers))
        sea, far, west, east = (-20.0, 50.0), (300.0, 50.0), (50.0, 50.0), (150.0, 50.0)
        parted = [atoll.are_parted(*two) for two in ((sea, west), (west, east), (east, far))]
        assert parted == [True, True, True]
        assert [atoll.are_parted(*two) for two in ((sea, far), (west, (20.0, 20.0)))] == [False, False]


class TestRoom:
    # Passed to the north along its west side, with turns of 6 m: there is room to starboard before it and behind it.
    BLOCK = KeepOut((((1.0, -30.0), (20.0, -30.0), (20.0, 30.0), (1.0, 30.0)),))

    def test_where_there_is_nothing_to_keep_out_of_it_is_everywhere(self) -> None:
        assert NOWHERE.circling(Pose(0, 0, 0), 6.0) == 1
        assert NOWHERE.is_room(Pose(0, 0, 0), Pose(0, 10, 0), 6.0)

    def test_one_turns_to_starboard_or_where_there_is_no_room_to_port(self) -> None:
        places = [(0, -37), (0, 0), (0, 37)]
        assert [self.BLOCK.circling(Pose(*place, 0.0), 6.0) for place in places] == [1, -1, 1]
        wall = ((-20.0, -30.0), (-1.0, -30.0), (-1.0, 30.0), (-20.0, 30.0))
        gap = KeepOut((*self.BLOCK.zones, wall))
        assert [gap.circling(Pose(*place, 0.0), 6.0) for place in places] == [1, None, 1]

    @pytest.mark.parametrize("heading_rad", [0.4, 2.0, 3.7, 5.5])
    @pytest.mark.parametrize(("from_m", "side"), [(9.96, -1), (9.98, 1)])
    def test_a_turn_may_come_within_a_few_centimetres_of_a_zone(
        self, heading_rad: float, from_m: float, side: int
    ) -> None:
        # A coast that is as far from the middle of a turn to starboard as its radius, a little more or less: to the
        # north or south, or to the east or west, on the side that is farther from the middle of one to port.
        middle = 10 * math.cos(heading_rad), -10 * math.sin(heading_rad)
        away = [math.copysign(1.0, part_m) for part_m in middle]
        near, far = ([part_m + way * off_m for part_m, way in zip(middle, away, strict=True)] for off_m in (from_m, 90))
        coasts = [
            ((near[0], -90.0), (far[0], -90.0), (far[0], 90.0), (near[0], 90.0)),
            ((-90.0, near[1]), (-90.0, far[1]), (90.0, far[1]), (90.0, near[1])),
        ]
        assert [KeepOut((coast,)).circling(Pose(0, 0, heading_rad), 10.0) for coast in coasts] == [side, side]

    @pytest.mark.parametrize(
        ("at_m", "half_m", "side"), [(10, 2, 1), (10, 6.9, 1), (10, 7.2, -1), (17, 2, 1), (18, 2, -1)]
    )
    def test_one_circles_about_what_is_small_enough(self, at_m: float, half_m: float, side: int) -> None:
        # The corners of a rock lie half_m to either side; the circle to starboard is about (10, 0).
        west_m, east_m = at_m - half_m, at_m + half_m
        rock = KeepOut((((west_m, -half_m), (east_m, -half_m), (east_m, half_m), (west_m, half_m)),))
        assert rock.circling(Pose(0, 0, 0), 10.0) == side
        assert rock.circling(Pose(20, 0, math.pi), 10.0) == side

    def test_about_a_rock_or_not_one_does_not_circle_over_another(self) -> None:
        rocks = [((x_m, -1.0), (x_m + 2, -1.0), (x_m + 2, 1.0), (x_m, 1.0)) for x_m in (9.0, 19.0, -11.0, -21.0)]
        assert KeepOut(tuple(rocks[:1])).circling(Pose(0, 0, 0), 10.0) == 1
        coast = ((90.0, -90.0), (190.0, -90.0), (190.0, 90.0), (90.0, 90.0))
        assert KeepOut((rocks[0], coast)).circling(Pose(0, 0, 0), 10.0) == 1
        assert KeepOut(tuple(rocks[:3])).circling(Pose(0, 0, 0), 10.0) == -1
        assert KeepOut(tuple(rocks)).circling(Pose(0, 0, 0), 10.0) is None

    def test_for_a_pass_there_must_be_room_on_the_way_and_to_turn_before_and_behind(self) -> None:
        wall = ((-20.0, -30.0), (-1.0, -30.0), (-1.0, 30.0), (-20.0, 30.0))
        gap = KeepOut((*self.BLOCK.zones, wall))
        low, high, inside = Pose(0, -37, 0), Pose(0, 37, 0), Pose(0, 0, 0)
        assert gap.is_room(low, high, 6.0)
        assert not gap.is_room(inside, high, 6.0)
        assert not gap.is_room(low, inside, 6.0)
        right_across = Pose(10, -37, 0), Pose(10, 37, 0)
        assert not gap.is_room(*right_across, 6.0)


class TestChords:
    def test_a_path_without_length_is_a_point_and_one_without_turns_a_line(self) -> None:
        point = as_line(DubinsPath(Pose(1, 2, 0.3), 10.0, (1, 0, -1), (0, 0, 0)))
        assert point.equals_exact(shapely.Point(1, 2))
        line = as_line(DubinsPath(Pose(1, 2, math.pi / 2), 10.0, (1, 0, -1), (0, 30, 0)))
        assert shapely.get_coordinates(line) == pytest.approx(np.array([(1, 2), (31, 2)]))

    def test_a_turn_is_as_many_chords_as_it_takes_and_what_is_straight_one(self) -> None:
        # A chord of 10 m about an angle lies 2 cm beside its arc at 1.265 m: a quarter, 15.7 m, takes 13.
        line = as_line(DubinsPath(Pose(0, 0, 0), 10.0, (1, 0, -1), (5 * math.pi, 30, 1.2)))
        corners = shapely.get_coordinates(line)
        assert len(corners) == 1 + 13 + 1 + 1
        assert corners[[0, 13, 14]] == pytest.approx(np.array([(0, 0), (10, 10), (40, 10)]))
        # To port at last: it ends 1.2^2 / 20 m to the north of its line, but for a little.
        assert corners[15] == pytest.approx((40 + 10 * math.sin(0.12), 10 + 10 * (1 - math.cos(0.12))))

    def test_of_a_turn_that_is_tighter_than_that_each_is_a_third_of_a_circle_at_most(self) -> None:
        for turned_rad, chords in ((4.1, 2), (4.3, 3)):  # a third is 2.094
            line = as_line(DubinsPath(Pose(0, 0, 0), 0.02, (1, 0, 0), (0.02 * turned_rad, 0, 0)))
            assert len(shapely.get_coordinates(line)) == 1 + chords + 2
