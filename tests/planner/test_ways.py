"""Ways past ground to keep out of: hand-computed lengths, and what holds of every way."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from zones import MARGIN_M, assert_keeps_radius, assert_stays_out, kept_out, places

from planner.dubins import DubinsPath, Pose, shortest_path
from planner.keep_out import NOWHERE, KeepOut, as_line
from planner.ways import Way, shortest_way, way_length_m, way_lengths_m, way_or_direct

NORTH, EAST, SOUTH, WEST = (number * math.pi / 2 for number in range(4))
SQUARE = KeepOut((((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)),))
RADIUS_M = 10.0
INWARD_M = RADIUS_M / math.sqrt(2)
"""The circle that touches a corner of the square from within has its centre so far from either side's line."""


def sampled(way: Way, step_m: float) -> list[Pose]:
    return [
        path.pose_at(float(at_m))
        for path in way
        for at_m in np.append(np.arange(0.0, path.length_m, step_m), path.length_m)
    ]


def found(start: Pose, end: Pose, keep_out: KeepOut = SQUARE) -> Way:
    way = shortest_way(start, end, RADIUS_M, keep_out)
    assert way is not None
    return way


def test_with_nothing_in_the_way_it_is_the_shortest_path() -> None:
    start, end = Pose(-100, 100, EAST), Pose(100, 120, NORTH)
    path = shortest_path(start, end, RADIUS_M)
    assert shortest_way(start, end, RADIUS_M, NOWHERE) == (path,)
    assert shortest_way(start, end, RADIUS_M, SQUARE) == (path,)


def test_a_circle_is_judged_by_as_few_chords_as_lie_within_2_cm_of_it_and_to_its_end() -> None:
    # Of a circle of 10 m a chord over an angle lies 10 (1 - cos(angle / 2)) beside it: 2 cm at 2 pi / 49.7.
    circle = as_line(DubinsPath(Pose(-10, 0, NORTH), 10.0, (1, 0, 0), (20 * math.pi, 0, 0)))
    assert len(shapely.get_coordinates(circle)) == 1 + 50 + 2  # the stretches behind it have no length
    assert shapely.hausdorff_distance(circle, shapely.Point(0, 0).buffer(10, quad_segs=500).exterior) < 0.02
    # A post stands right behind, where a circle to either side ends.
    post = KeepOut((((-0.2, -0.7), (0.2, -0.7), (0.2, -0.3), (-0.2, -0.3)),))
    assert post.circling(Pose(0, 0, NORTH), 10.0) is None
    assert post.circling(Pose(0, 1, NORTH), 10.0) is None
    assert post.circling(Pose(3, 0, NORTH), 10.0) == 1


def test_who_is_told_a_way_may_come_nearer_but_not_within_the_zones() -> None:
    assert [KeepOut(SQUARE.zones, margin_m).nearer() for margin_m in (2.0, 0.1)] == [
        KeepOut(SQUARE.zones, margin_m) for margin_m in (1.75, 0.0)
    ]
    assert NOWHERE.nearer() == NOWHERE


def test_past_a_square_it_goes_by_tangents_and_arcs_at_two_corners() -> None:
    # From a turn to port at the start, whose circle is centred at (-100, 10), to a turn to starboard at the corner:
    # between two circles that are turned on in different senses the tangent is sqrt(d^2 - (2 r)^2) long.
    east_m, north_m = 50 + INWARD_M, 40 - INWARD_M
    apart_m = math.hypot(east_m, north_m)
    tangent_m = math.sqrt(apart_m**2 - 4 * RADIUS_M**2)
    turned_rad = math.atan2(north_m, east_m) + math.asin(2 * RADIUS_M / apart_m)
    along_the_side_m = 100 - 2 * INWARD_M
    expected_m = 2 * (RADIUS_M * turned_rad + tangent_m + RADIUS_M * turned_rad) + along_the_side_m
    way = found(Pose(-100, 0, EAST), Pose(100, 0, EAST))
    assert way_length_m(way) == pytest.approx(expected_m, abs=1e-6)
    assert expected_m == pytest.approx(244.688, abs=1e-3)
    # It touches the corner on its way, north or south alike.
    assert min(math.dist((pose.x_m, abs(pose.y_m)), (-50, 50)) for pose in sampled(way, 0.01)) < 0.01


def test_past_two_squares_it_goes_along_both() -> None:
    # As above, from (-200, 0) to the near corner of the first one at (-110, 30).
    east_m, north_m = 90 + INWARD_M, 20 - INWARD_M
    apart_m = math.hypot(east_m, north_m)
    turned_rad = math.atan2(north_m, east_m) + math.asin(2 * RADIUS_M / apart_m)
    up_m = 2 * RADIUS_M * turned_rad + math.sqrt(apart_m**2 - 4 * RADIUS_M**2)
    squares = [[(x_m - 30.0, -30.0), (x_m + 30.0, -30.0), (x_m + 30.0, 30.0), (x_m - 30.0, 30.0)] for x_m in (-80, 80)]
    way = found(Pose(-200, 0, EAST), Pose(200, 0, EAST), KeepOut(tuple(map(tuple, squares))))
    assert way_length_m(way) == pytest.approx(2 * up_m + 220 - 2 * INWARD_M, abs=1e-6)


def test_round_one_corner_it_is_a_quarter_circle_between_straight_lines() -> None:
    centre_m = 50 - INWARD_M
    start, end = Pose(-centre_m - RADIUS_M, -40, NORTH), Pose(40, centre_m + RADIUS_M, EAST)
    way = found(start, end)
    assert way_length_m(way) == pytest.approx((centre_m + 40) + RADIUS_M * math.pi / 2 + (40 + centre_m), abs=1e-6)


def test_the_margin_is_kept_to_the_zone_and_corners_are_turned_at_a_margin() -> None:
    start, end = Pose(-100, 0, EAST), Pose(100, 0, EAST)
    grown = KeepOut((((-48.0, -48.0), (48.0, -48.0), (48.0, 48.0), (-48.0, 48.0)),), 2.0)
    assert way_length_m(found(start, end, grown)) == pytest.approx(way_length_m(found(start, end)), abs=1e-6)


def test_who_has_room_circles_about_a_zone_and_else_so_far_beside_it_as_chords_lie_beside_their_arcs() -> None:
    # A path may lie 5 cm within it: of 6 m by 8 m the least circle is of 5 m.
    block = KeepOut((((-3.05, -4.05), (3.05, -4.05), (3.05, 4.05), (-3.05, 4.05)),))
    assert block.circling(Pose(-5.1, 0, NORTH), 5.1) == 1
    assert block.circling(Pose(-5.0, 0, NORTH), 5.0) == -1
    (just_as_large_m,) = block._part_radii_m.tolist()
    for radius_m in (4.0, just_as_large_m):
        for beside_m, side in ((0.01, -1), (0.03, 1)):
            assert block.circling(Pose(-3 - beside_m - 2 * radius_m, 0, NORTH), radius_m) == side


def test_where_there_is_no_room_to_turn_it_goes_straight_on_first_or_comes_straight_to_its_end() -> None:
    # In a gap of 2 m, 5 m before its end: a turn over 5 m of way leads 1.3 m to the side.
    gap = KeepOut((((-40, -50), (-1, -50), (-1, 50), (-40, 50)), ((1, -50), (40, -50), (40, 50), (1, 50))))
    straight, way = found(Pose(0, 45, NORTH), Pose(50, 55, SOUTH), gap)
    assert straight == DubinsPath(Pose(0, 45, NORTH), RADIUS_M, (0, 0, 0), (10, 0, 0))
    assert (way.start, way.turns) == (Pose(0, 55, NORTH), (1, 0, 1))
    assert way.lengths_m == pytest.approx((5 * math.pi, 30, 5 * math.pi))
    way, straight = found(Pose(50, 55, NORTH), Pose(0, 45, SOUTH), gap)
    assert straight.start == pytest.approx((0, 55, SOUTH))
    assert (straight.turns, straight.lengths_m) == ((0, 0, 0), (10, 0, 0))
    assert (way.start, way.turns) == (Pose(50, 55, NORTH), (-1, 0, -1))
    assert way.lengths_m == pytest.approx((5 * math.pi, 30, 5 * math.pi))
    # 15 m before its end it goes on 20 m, 25 m before it 40 m.
    for north_m, first_m in ((35, 20), (25, 40)):
        straight, way = found(Pose(0, north_m, NORTH), Pose(50, 55, SOUTH), gap)
        assert (straight.lengths_m, way.start) == ((first_m, 0, 0), Pose(0, north_m + first_m, NORTH))
    # Nor does it go straight on through a wall.
    wall = KeepOut((*gap.zones, ((-10, 57), (10, 57), (10, 58), (-10, 58))))
    assert shortest_way(Pose(0, 45, NORTH), Pose(50, 55, SOUTH), RADIUS_M, wall) is None


class TestNoWay:
    RING = KeepOut(
        (
            ((-60.0, -60.0), (60.0, -60.0), (60.0, -50.0), (-60.0, -50.0)),
            ((-60.0, 50.0), (60.0, 50.0), (60.0, 60.0), (-60.0, 60.0)),
            ((-60.0, -60.0), (-50.0, -60.0), (-50.0, 60.0), (-60.0, 60.0)),
            ((50.0, -60.0), (60.0, -60.0), (60.0, 60.0), (50.0, 60.0)),
        )
    )

    def test_out_of_a_ring_there_is_none(self) -> None:
        inside, outside = Pose(0, 0, EAST), Pose(100, 0, EAST)
        assert shortest_way(inside, outside, RADIUS_M, self.RING) is None
        assert shortest_way(inside, Pose(-20, 10, SOUTH), RADIUS_M, self.RING) is not None
        direct = shortest_path(inside, outside, RADIUS_M)
        assert way_or_direct(inside, outside, RADIUS_M, self.RING) == (direct,)
        ends = np.array([outside], dtype=np.float64)
        assert way_lengths_m(np.array([inside], dtype=np.float64), ends, RADIUS_M, self.RING) == np.inf

    def test_to_a_place_in_a_zone_there_is_none(self) -> None:
        assert shortest_way(Pose(-100, 0, EAST), Pose(0, 0, EAST), RADIUS_M, SQUARE) is None

    def test_towards_a_wall_that_is_too_near_there_is_none(self) -> None:
        assert shortest_way(Pose(-55, 0, EAST), Pose(-100, 0, WEST), RADIUS_M, SQUARE) is None
        assert shortest_way(Pose(-61, 0, EAST), Pose(-100, 0, WEST), RADIUS_M, SQUARE) is not None


@settings(max_examples=150)
@given(kept_out, places, places, st.sampled_from((6.0, 15.0, 30.0)))
@example(SQUARE, Pose(-51, 0, NORTH), Pose(51, 0, NORTH), 6.0)
@example(KeepOut((((15.0, 11.0), (-7.5, 23.99), (-7.5, -1.99)),), MARGIN_M), Pose(0, 0, 5e-324), Pose(0, 0, 0), 6.0)
def test_every_way_stays_out_keeps_the_radius_and_arrives(
    keep_out: KeepOut, start: Pose, end: Pose, radius_m: float
) -> None:
    way = shortest_way(start, end, radius_m, keep_out)
    assume(way is not None)
    assert way is not None
    poses = sampled(way, 0.5)
    assert poses[0] == pytest.approx(start)
    assert poses[-1][:2] == pytest.approx(end[:2], abs=1e-6)
    assert math.cos(poses[-1].heading_rad - end.heading_rad) == pytest.approx(1.0, abs=1e-9)
    assert_stays_out(poses, keep_out)
    assert_keeps_radius(poses, radius_m, 0.5)
    assert way_length_m(way) >= shortest_path(start, end, radius_m).length_m - 1e-6


@settings(max_examples=60)
@given(kept_out, places, places)
@example(SQUARE, Pose(-100, 0, EAST), Pose(55, -40, NORTH))  # beside a wall, where the first line found is too steep
def test_a_way_back_is_as_long(keep_out: KeepOut, start: Pose, end: Pose) -> None:
    there = shortest_way(start, end, RADIUS_M, keep_out)
    first, last = (Pose(one.x_m, one.y_m, one.heading_rad + math.pi) for one in (end, start))
    back = shortest_way(first, last, RADIUS_M, keep_out)
    assert (there is None) == (back is None)
    if there is not None and back is not None:
        assert way_length_m(back) == pytest.approx(way_length_m(there), abs=1e-3)


class TestEstimates:
    def test_past_a_square_it_is_the_way_from_corner_to_corner_and_what_turns_add(self) -> None:
        starts, ends = np.array([[-100.0, 0.0, EAST]]), np.array([[100.0, 0.0, EAST], [100.0, 100.0, NORTH]])
        lengths_m = way_lengths_m(starts, ends, RADIUS_M, SQUARE)
        # Straight on there are no turns: two hypotenuses and a side.
        assert lengths_m[0, 0] == pytest.approx(2 * math.hypot(50, 50) + 100)
        # The beeline to the north-east runs along the diagonal of the square's north-west corner: (-50, 25).
        round_m = math.hypot(50, 50) + math.hypot(150, 50)
        direct_m = shortest_path(Pose(*starts[0]), Pose(*ends[1]), RADIUS_M).length_m
        assert lengths_m[0, 1] == pytest.approx(direct_m - math.hypot(200, 100) + round_m)

    @settings(max_examples=40)
    @given(kept_out, st.lists(places, min_size=1, max_size=4), st.lists(places, min_size=1, max_size=4))
    def test_without_zones_between_they_are_those_of_shortest_paths(
        self, keep_out: KeepOut, starts: list[Pose], ends: list[Pose]
    ) -> None:
        table = way_lengths_m(np.array(starts), np.array(ends), RADIUS_M, keep_out)
        bare = way_lengths_m(np.array(starts), np.array(ends), RADIUS_M, NOWHERE)
        assert table.shape == (len(starts), len(ends))
        assert (table >= bare - 1e-6).all()
