"""Ways past ground to keep out of: hand-computed lengths, and what holds of every way."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from zones import MARGIN_M, assert_keeps_radius, assert_stays_out, kept_out, places

from planner.dubins import TIE_M, DubinsPath, Pose, path_lengths_m, shortest_path
from planner.keep_out import NOWHERE, KeepOut, as_line
from planner.ways import Way, _corners, shortest_way, way_length_m, way_lengths_m, way_or_direct

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


@pytest.mark.parametrize("turned_rad", [number * 0.1 for number in range(63)])
def test_however_the_frame_lies_rounding_adds_no_loop(turned_rad: float) -> None:
    sin, cos = math.sin(turned_rad), math.cos(turned_rad)

    def turned(x_m: float, y_m: float) -> tuple[float, float]:
        return x_m * cos + y_m * sin, y_m * cos - x_m * sin

    centre_m = 50 - INWARD_M
    start = Pose(*turned(-centre_m - RADIUS_M, -40), NORTH + turned_rad)
    end = Pose(*turned(40, centre_m + RADIUS_M), EAST + turned_rad)
    way = found(start, end, KeepOut((tuple(turned(*corner) for corner in SQUARE.zones[0]),)))
    assert way_length_m(way) == pytest.approx(2 * (centre_m + 40) + RADIUS_M * math.pi / 2, abs=1e-6)


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


def test_corners_that_point_outward_are_turned_round() -> None:
    # Of a yard to all sides, with a notch of half a metre in the south and one at a corner of the court.
    yard = KeepOut(
        (
            ((0, 0), (20, 0), (20, 0.5), (20.5, 0.5), (20.5, 0), (60, 0), (60, 10), (0, 10)),
            ((0, 10), (10, 10), (10, 40), (0, 40)),
            ((50, 10), (60, 10), (60, 40), (50, 40)),
            ((0, 40), (60, 40), (60, 50), (0, 50)),
            ((10, 10), (10.5, 10), (10.5, 10.5), (10, 10.5)),
        )
    )
    corners, outward = _corners(yard)
    slant = math.sqrt(0.5)
    assert sorted(zip(corners.tolist(), np.sign(outward).tolist(), strict=True)) == [
        ([0, 0], [-1, -1]),
        ([0, 50], [-1, 1]),
        ([10.5, 10.5], [1, 1]),
        ([20, 0], [1, -1]),
        ([20.5, 0], [-1, -1]),
        ([60, 0], [1, -1]),
        ([60, 50], [1, 1]),
    ]
    assert np.abs(outward) == pytest.approx(slant)


def test_it_passes_a_post_however_thin() -> None:
    post = KeepOut((((-0.3, -0.4), (0.3, -0.4), (0.3, 0.4), (-0.3, 0.4)),))
    # The circles that touch its corners lead it by 0.4 + 10 - 7.1 = 3.3 m to the side.
    assert 100.0 < way_length_m(found(Pose(-50, 0, EAST), Pose(50, 0, EAST), post)) < 100.4


def test_round_many_corners_it_turns_a_little_at_each() -> None:
    # Of 24 corners about a place, 12 m off, the circles' centres lie 2 m off, at angles of 15 degrees to each other.
    pillar = KeepOut((tuple((12 * math.cos(n * math.pi / 12), 12 * math.sin(n * math.pi / 12)) for n in range(24)),))
    way = found(Pose(-12, -5, NORTH), Pose(12, -3, SOUTH), pillar)
    assert way_length_m(way) == pytest.approx(8 + 10 * math.pi + 12 * 4 * math.sin(math.pi / 24), abs=1e-6)
    assert way[-1].pose_at(way[-1].length_m) == pytest.approx((12, -3, SOUTH))


@pytest.mark.parametrize(("beside_m", "more_m"), [(10.001, 0), (10, 0), (9, 0.5), (3.5, 0.5)])
def test_past_a_spit_it_comes_back_by_half_a_turn_and_more_where_it_came_from_nearer(
    beside_m: float, more_m: float
) -> None:
    spit = KeepOut((((-3.0, -300.0), (3.0, -300.0), (0.0, 10.0)),))
    way, half_a_turn_m = found(Pose(-beside_m, -100, NORTH), Pose(beside_m, -100, SOUTH), spit), 10 * math.pi
    assert -0.01 <= way_length_m(way) - (100 + half_a_turn_m + 100) <= more_m + 0.01


def test_it_may_end_right_before_a_wall() -> None:
    there, back = (
        found(Pose(100, -20, NORTH), Pose(-50.5, -20, EAST)),
        found(Pose(-50.5, -20, WEST), Pose(100, -20, SOUTH)),
    )
    assert len(there) > 1
    assert way_length_m(there) == pytest.approx(way_length_m(back))


def test_from_one_turn_to_one_to_the_other_side_it_goes_straight_over_where_these_touch() -> None:
    # A quarter to port, a quarter to starboard about the circle at the tip, whose centre lies 20 m to the east.
    diamond = KeepOut((((0, 20), (-5, 0), (0, -20), (5, 0)),))
    way = found(Pose(-20, 0, EAST), Pose(100, 20, EAST), diamond)
    assert way_length_m(way) == pytest.approx(10 * math.pi + 100)


@pytest.mark.parametrize("nearer_m", [-0.01, 0.01, 0.4])
def test_it_does_not_go_from_one_turn_to_one_to_the_other_side_where_these_overlap(nearer_m: float) -> None:
    # The centre of a turn to port, 10 m to the north, lies 2 * 10 m from that of the circle at the corner, or nearer.
    centre_m = 50 - INWARD_M
    east_m = -centre_m - math.sqrt(20**2 - (54 - centre_m) ** 2)
    way = found(Pose(east_m + nearer_m, 44, EAST), Pose(200, 44, EAST))
    assert len(way) > 1
    assert way[-1].pose_at(way[-1].length_m) == pytest.approx((200, 44, EAST))
    assert_keeps_radius(sampled(way, 0.1), RADIUS_M, 0.1)


def test_it_may_begin_right_behind_a_wall_and_turn_a_little() -> None:
    post = ((-250.3, -0.4), (-249.7, -0.4), (-249.7, 0.4), (-250.3, 0.4))
    way = found(Pose(-50.3, 0, WEST), Pose(-450, 0, WEST), KeepOut((*SQUARE.zones, post)))
    assert 399.7 < way_length_m(way) < 399.9


def test_out_of_one_gap_into_another_it_goes_straight_on_as_far_as_each_takes() -> None:
    def walls(mouth: Pose) -> list[tuple[tuple[float, float], ...]]:
        """To both sides, 1 to 30 m off, 60 m long, of who comes out of their mouth."""
        sin, cos = math.sin(mouth.heading_rad), math.cos(mouth.heading_rad)
        return [
            tuple(
                (mouth.x_m + side * off_m * cos - back_m * sin, mouth.y_m - side * off_m * sin - back_m * cos)
                for off_m, back_m in ((1, 0), (1, 60), (30, 60), (30, 0))
            )
            for side in (-1, 1)
        ]

    mouth, other = Pose(20, 30, 1.1), Pose(-10, 140, 1.4)
    start = Pose(20 - 5 * math.sin(1.1), 30 - 5 * math.cos(1.1), 1.1)
    end = Pose(-10 - 15 * math.sin(1.4), 140 - 15 * math.cos(1.4), 1.4 + math.pi)
    first, *_, last = way = found(start, end, KeepOut((*walls(mouth), *walls(other))))
    assert (first.turns, first.lengths_m, last.turns, last.lengths_m) == ((0, 0, 0), (10, 0, 0), (0, 0, 0), (20, 0, 0))
    poses = sampled(way, 0.1)
    assert poses[-1][:2] == pytest.approx(end[:2])
    assert_keeps_radius(poses, RADIUS_M, 0.1)


@pytest.mark.parametrize("turned_rad", [0.0, 1e-6, -1e-6, 1e-4, -1e-4])
def test_of_two_ways_equally_long_that_to_port_is_taken(turned_rad: float) -> None:
    """What is told of a heading is rounded: all who reckon a way must take the same one. A full turn and 89 m it is to
    either side, as a zone lies in the shorter way."""
    zone = KeepOut((((197.38, -4.77), (228.95, -4.77), (228.95, 47.17)),), 1.5)
    start, end = Pose(248.95, 64.0, EAST + turned_rad), Pose(208.95, -15.55, EAST)
    assert not zone.is_clear([shortest_path(start, end, 19.73)])
    (way,) = shortest_way(start, end, 19.73, zone) or ()
    assert way.turns == (-1, 0, -1)
    assert way.length_m == pytest.approx(2 * math.pi * 19.73 + math.dist(start[:2], end[:2]), abs=0.005)


@pytest.mark.parametrize("turned_rad", [0.0, 2e-4, -2e-4])  # by which one of them is some millimetres longer
def test_of_two_paths_as_short_that_turn_thrice_the_one_is_taken_that_stays_out(turned_rad: float) -> None:
    start, end = Pose(7, 0, NORTH), Pose(-16, 19, NORTH + turned_rad)
    to_port, to_starboard = (shortest_path(start, end, RADIUS_M, (side,)) for side in (-1, 1))
    assert abs(to_port.length_m - to_starboard.length_m) <= TIE_M
    assert (to_port.turns, to_starboard.turns) == ((-1, 1, -1), (1, -1, 1))
    for turns, taken in ((to_port, to_starboard), (to_starboard, to_port)):
        x_m, y_m, _ = turns.pose_at(turns.length_m / 2)
        post = ((x_m, y_m), (x_m + 0.1, y_m), (x_m, y_m + 0.1))
        assert shortest_way(start, end, RADIUS_M, KeepOut((post,), 0.5)) == (taken,)


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
# Of two that turn thrice, as short as each other, one leads through the zone.
@example(KeepOut((((15.0, -7.0), (-7.5, 5.99), (-7.5, -19.99)),), MARGIN_M), Pose(7, 0, NORTH), Pose(-16, 19, NORTH))
def test_a_way_back_is_as_long(keep_out: KeepOut, start: Pose, end: Pose) -> None:
    there = shortest_way(start, end, RADIUS_M, keep_out)
    first, last = (Pose(one.x_m, one.y_m, one.heading_rad + math.pi) for one in (end, start))
    back = shortest_way(first, last, RADIUS_M, keep_out)
    assert (there is None) == (back is None)
    if there is not None and back is not None:
        assert way_length_m(back) == pytest.approx(way_length_m(there), abs=1e-3)


class TestShortest:
    # A block, a hook that is open to the west, and an arrowhead.
    ISLES = KeepOut(
        (
            ((-150.0, -60.0), (-90.0, -75.0), (-70.0, 55.0), (-140.0, 40.0)),
            ((20.0, -90.0), (160.0, -100.0), (175.0, 80.0), (10.0, 95.0), (15.0, 70.0), (140.0, 50.0), (130.0, -70.0)),
            ((-40.0, 130.0), (60.0, 150.0), (-30.0, 190.0), (-10.0, 155.0)),
        ),
        1.5,
    )

    def at_corners(self) -> Iterator[tuple[Pose, int]]:
        """Poses past the corners of the zones, and to which side one turns about them."""
        for isle in shapely.get_parts(shapely.orient_polygons(self.ISLES.ground)):
            ring = np.array(isle.exterior.coords[:-1])
            along = np.roll(ring, -1, axis=0) - ring
            leaves = along / np.hypot(*along.T)[:, np.newaxis]
            arrives = np.roll(leaves, 1, axis=0)
            for (x_m, y_m), (from_x, from_y), (to_x, to_y) in zip(ring, arrives, leaves, strict=True):
                if from_x * to_y > from_y * to_x:
                    heading_rad = math.atan2(from_x + to_x, from_y + to_y)
                    yield Pose(x_m, y_m, heading_rad), -1
                    yield Pose(x_m, y_m, heading_rad + math.pi), 1

    def path_m(self, one: tuple[Pose, int | None], other: tuple[Pose, int | None]) -> float:
        """From pose to pose by a turn to the one's side, straight ahead, and by a turn to the other's, where that is
        the shortest path and stays out."""
        path = shortest_path(one[0], other[0], RADIUS_M)
        so_turned = all(
            side in {None, turn} or length_m < 1e-6
            for side, turn, length_m in zip((one[1], 0, other[1]), path.turns, path.lengths_m, strict=True)
        )
        return path.length_m if so_turned and self.ISLES.is_clear([path]) else math.inf

    def test_no_paths_from_corner_to_corner_are_shorter(self) -> None:
        corners = list(self.at_corners())
        between_m = np.array([[self.path_m(one, other) for other in corners] for one in corners])
        for middle in range(len(corners)):
            between_m = np.minimum(between_m, between_m[:, middle, np.newaxis] + between_m[middle])
        rng, as_short = np.random.default_rng(3), 0
        for _ in range(60):
            start, end = (Pose(*pose) for pose in rng.uniform((-220, -150, 0), (220, 230, 6.28), (2, 3)).tolist())
            way = shortest_way(start, end, RADIUS_M, self.ISLES)
            if way is not None and len(way) > 1:
                to_m = np.array([self.path_m((start, None), corner) for corner in corners])
                from_m = np.array([self.path_m(corner, (end, None)) for corner in corners])
                least_m = (to_m[:, np.newaxis] + between_m + from_m).min()
                assert way_length_m(way) <= least_m + 1e-6
                as_short += way_length_m(way) > least_m - 1e-6
        assert as_short > 10


@settings(max_examples=60)
@given(kept_out, places, places)
def test_with_narrow_turns_it_is_about_the_taut_line(keep_out: KeepOut, start: Pose, end: Pose) -> None:
    way = shortest_way(start, end, 0.1, keep_out)
    assume(way is not None)
    assert way is not None
    ((taut_m,),) = way_lengths_m(np.array([start]), np.array([end]), 0.1, keep_out)
    assert way_length_m(way) == pytest.approx(taut_m, abs=0.5)


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

    def test_each_start_and_end_counts_by_what_lies_between_them(self) -> None:
        starts = np.array([[-100.0, 0.0, EAST], [-100.0, 100.0, SOUTH]])
        ends = np.array([[100.0, 20.0, EAST], [110.0, 100.0, NORTH], [-100.0, -90.0, WEST]])
        further_m = np.zeros((2, 3))
        further_m[0, 0] = math.hypot(50, 50) + 100 + math.hypot(50, 30) - math.hypot(200, 20)
        further_m[0, 1] = math.hypot(50, 50) + math.hypot(160, 50) - math.hypot(210, 100)
        further_m[1, 0] = math.hypot(150, 50) + math.hypot(50, 30) - math.hypot(200, 80)
        expected_m = path_lengths_m(starts, ends, RADIUS_M) + further_m
        assert way_lengths_m(starts, ends, RADIUS_M, SQUARE) == pytest.approx(expected_m)

    def test_out_of_a_hook_it_is_the_way_round_every_corner(self) -> None:
        hook = KeepOut((((-50, -60), (60, -60), (60, 50), (-50, 50), (-50, 40), (40, 40), (40, -40), (-50, -40)),))
        starts, ends = np.array([[0.0, 0.0, NORTH]]), np.array([[100.0, 0.0, NORTH]])
        round_m = math.hypot(50, 40) + 10 + 110 + math.hypot(40, 50)
        direct_m = shortest_path(Pose(*starts[0]), Pose(*ends[0]), RADIUS_M).length_m
        assert way_lengths_m(starts, ends, RADIUS_M, hook) == pytest.approx(direct_m - 100 + round_m)

    @settings(max_examples=40)
    @given(kept_out, st.lists(places, min_size=1, max_size=4), st.lists(places, min_size=1, max_size=4))
    def test_without_zones_between_they_are_those_of_shortest_paths(
        self, keep_out: KeepOut, starts: list[Pose], ends: list[Pose]
    ) -> None:
        table = way_lengths_m(np.array(starts), np.array(ends), RADIUS_M, keep_out)
        bare = way_lengths_m(np.array(starts), np.array(ends), RADIUS_M, NOWHERE)
        assert table.shape == (len(starts), len(ends))
        assert (table >= bare - 1e-6).all()
