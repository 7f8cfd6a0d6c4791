"""Sweeps over strips: where their legs lie, and which way of flying them is the shortest."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from planner.dubins import TIE_M, Pose, shortest_path
from planner.keep_out import KeepOut
from planner.sweep import NoSweepError, Sweep, distance_over, legs_over_strip, pass_over, shortest_sweep, sweeps_over
from planner.types import Strip, Track
from planner.ways import shortest_way, way_length_m

NORTH, EAST, SOUTH, WEST = (k * math.pi / 2 for k in range(4))

strips = st.builds(
    Strip,
    number=st.just(1),
    start=st.tuples(st.integers(-500, 500), st.integers(-500, 500)),
    heading_rad=st.integers(-40, 40).map(lambda n: n / 10),
    length_m=st.integers(20, 400).map(float),
    width_m=st.integers(5, 200).map(float),
)
poses = st.builds(Pose, st.integers(-800, 800), st.integers(-800, 800), st.integers(-40, 40).map(lambda n: n / 10))


class TestLegsOverStrip:
    def test_by_hand_to_the_north(self) -> None:
        legs = legs_over_strip(Strip(7, (100, 50), NORTH, 200, 60), 25)
        assert [(leg.number, leg.across_m) for leg in legs] == [(1, 10), (2, 30), (3, 50)]
        assert np.array([leg.start for leg in legs]) == pytest.approx(np.array([(80, 50), (100, 250), (120, 50)]))
        assert np.array([leg.end for leg in legs]) == pytest.approx(np.array([(80, 250), (100, 50), (120, 250)]))

    def test_for_a_sensor_that_looks_to_the_side_they_lie_beside_the_strip(self) -> None:
        strip = Strip(7, (100, 50), NORTH, 200, 60)
        (right,) = legs_over_strip(strip, 60, beside_m=85)
        assert (*right.start, *right.end) == pytest.approx((185, 50, 185, 250))
        (left,) = legs_over_strip(strip, 60, beside_m=-85)
        assert left.start == pytest.approx((15, 50))

    def test_by_hand_to_the_east(self) -> None:
        legs = legs_over_strip(Strip(7, (0, 0), EAST, 100, 40), 20)
        # Port is north.
        assert np.array([leg.start for leg in legs]) == pytest.approx(np.array([(0, 10), (100, -10)]))
        assert np.array([leg.end for leg in legs]) == pytest.approx(np.array([(100, 10), (0, -10)]))

    @pytest.mark.parametrize(
        ("width_m", "count"), [(5e-7, 1), (1, 1), (20, 1), (20 + 1e-9, 1), (20.1, 2), (60, 3), (60 - 1e-9, 3), (61, 4)]
    )
    def test_no_more_than_needed(self, width_m: float, count: int) -> None:
        assert len(legs_over_strip(Strip(1, (0, 0), 1.0, 50, width_m), 20)) == count

    @given(strips, st.floats(5, 100))
    def test_cover_the_strip(self, strip: Strip, swath_m: float) -> None:
        legs = legs_over_strip(strip, swath_m)
        seen = shapely.union_all(
            [shapely.LineString([leg.start, leg.end]).buffer(swath_m / 2 + 1e-6, cap_style="flat") for leg in legs]
        )
        centre_line = shapely.LineString([strip.start, strip.end])
        area = centre_line.buffer(strip.width_m / 2, cap_style="flat")
        assert area.difference(seen).area < 1e-2
        assert len(legs) == 1 or (len(legs) - 1) * swath_m < strip.width_m

    @given(strips, st.floats(5, 100))
    def test_lie_evenly_and_alternate(self, strip: Strip, swath_m: float) -> None:
        legs = legs_over_strip(strip, swath_m)
        assert all(leg.length_m == pytest.approx(strip.length_m) for leg in legs)
        edge_m = strip.width_m / len(legs) / 2
        assert [leg.across_m for leg in legs] == pytest.approx([edge_m * (2 * k + 1) for k in range(len(legs))])
        for first, second in itertools.pairwise(legs):
            assert math.dist(first.end, second.start) == pytest.approx(2 * edge_m)

    @pytest.mark.parametrize(
        ("length_m", "width_m", "swath_m"),
        [(0, 10, 10), (10, -1, 10), (10, 10, 0), (10, 10, math.nan), (math.inf, 1, 1)],
    )
    def test_refuse_what_has_no_extent(self, length_m: float, width_m: float, swath_m: float) -> None:
        with pytest.raises(ValueError, match="lengths above 0"):
            legs_over_strip(Strip(1, (0, 0), 0, length_m, width_m), swath_m)


def cheapest(strip: Strip, pose: Pose, turn_radius_m: float, run_in_m: float, swath_m: float) -> tuple[Sweep, float]:
    """The shortest sweep, and the distance to its last run-out's end."""
    sweep, way_m = shortest_sweep(sweeps_over(strip, swath_m, turn_radius_m, run_in_m), pose, turn_radius_m)
    assert way_m + sweep.length_m == pytest.approx(distance_over(pose, sweep.passes, turn_radius_m))
    return sweep, way_m + sweep.length_m


class TestShortestSweep:
    # Legs at 10, 30 and 50 m east, 100 m long; the first runs north.
    STRIP = Strip(1, (30, 0), NORTH, 100, 60)

    @pytest.mark.parametrize(
        ("pose", "first"),
        [
            (Pose(10, -50, NORTH), ((10, 0), (10, 100))),
            (Pose(50, -50, NORTH), ((50, 0), (50, 100))),
            (Pose(10, 150, SOUTH), ((10, 100), (10, 0))),
            (Pose(50, 150, SOUTH), ((50, 100), (50, 0))),
        ],
    )
    def test_begins_at_the_nearest_end(self, pose: Pose, first: tuple[tuple[float, float], ...]) -> None:
        sweep, distance_m = cheapest(self.STRIP, pose, 10, 0, 20)
        ordered = sweep.legs
        assert ordered[0].start == pytest.approx(first[0], abs=1e-9)
        assert ordered[0].end == pytest.approx(first[1], abs=1e-9)
        # 50 m there, three legs and two half circles of 10 m radius.
        assert distance_m == pytest.approx(50 + 300 + 2 * 10 * math.pi)
        assert [leg.number for leg in ordered] == [1, 2, 3]
        assert [leg.across_m for leg in ordered] == ([10, 30, 50] if first[0][0] == 10 else [50, 30, 10])

    def test_goes_straight_before_and_after_legs(self) -> None:
        sweep, distance_m = cheapest(self.STRIP, Pose(10, -50, NORTH), 10, 30, 20)
        # The first run-in is part of the way there.
        assert distance_m == pytest.approx(50 + 300 + 2 * 10 * math.pi + 5 * 30)
        assert sweep.length_m == pytest.approx(300 + 2 * 10 * math.pi + 6 * 30)
        assert (*sweep.entry, *sweep.leave) == pytest.approx((10, -30, NORTH, 50, 130, NORTH))
        assert sweep.legs[0].length_m == pytest.approx(100)
        one_leg = Strip(1, (10, 0), NORTH, 100, 20)
        _, too_near_m = cheapest(one_leg, Pose(10, -20, NORTH), 10, 30, 20)
        _, near_enough_m = cheapest(one_leg, Pose(10, -30, NORTH), 10, 30, 20)
        assert near_enough_m == pytest.approx(160)
        assert too_near_m > 180

    def test_one_leg_is_flown_the_strips_way_or_back(self) -> None:
        one_leg = Strip(1, (10, 0), NORTH, 100, 20)
        there, back = sweeps_over(one_leg, 20, 10, 0)
        assert (*there.legs[0].start, *back.legs[0].start) == pytest.approx((10, 0, 10, 100), abs=1e-9)
        assert cheapest(one_leg, Pose(10, -50, NORTH), 10, 0, 20)[0] is there
        assert cheapest(one_leg, Pose(10, 150, SOUTH), 10, 0, 20)[0] is back

    @pytest.mark.parametrize("heading_rad", [0.3 * k for k in range(21)])
    def test_of_equal_ways_takes_the_first(self, heading_rad: float) -> None:
        # Where rounding makes one of them shorter, now this and now that.
        x_m, y_m = 123.4, -567.8
        behind = Pose(x_m - 100 * math.sin(heading_rad), y_m - 100 * math.cos(heading_rad), heading_rad)
        sweep, _ = cheapest(Strip(1, (x_m, y_m), heading_rad, 100, 60), behind, 10, 0, 20)
        assert [leg.across_m for leg in sweep.legs] == [10, 30, 50]

    @pytest.mark.parametrize(("shorter_m", "turned"), [(0.0, False), (0.019, False), (0.021, True)])
    def test_of_two_ways_that_differ_by_no_more_than_2_cm_takes_the_first(self, shorter_m: float, turned: bool) -> None:
        # Abeam of a strip's middle; so much shorter is the way to its far end from a little farther north.
        ways = sweeps_over(Strip(1, (-100, -50), NORTH, 100, 20), 20, 10, 0)

        def gain_m(north_m: float) -> float:
            to_start_m, to_end_m = (shortest_path(Pose(-30, north_m, WEST), one.entry, 10).length_m for one in ways)
            return to_start_m - to_end_m

        north_m = 0.0 if not shorter_m else brentq(lambda y_m: gain_m(y_m) - shorter_m, 0.0, 1.0)
        assert gain_m(north_m) == pytest.approx(shorter_m, abs=1e-9)
        sweep, _ = shortest_sweep(ways, Pose(-30, north_m, WEST), 10)
        assert sweep is ways[turned]

    @given(strips, poses, st.floats(2, 40), st.sampled_from([0.0, 15.0]))
    def test_is_the_shortest_of_the_four_ways(
        self, strip: Strip, pose: Pose, turn_radius_m: float, run_in_m: float
    ) -> None:
        legs = legs_over_strip(strip, 30)
        turned = [replace(leg, start=leg.end, end=leg.start) for leg in legs]

        def flown_m(way: list[Track]) -> float:
            total_m, at = 0.0, pose
            for leg in way:
                run_in = run_in_m * math.sin(leg.heading_rad), run_in_m * math.cos(leg.heading_rad)
                enter = Pose(leg.start[0] - run_in[0], leg.start[1] - run_in[1], leg.heading_rad)
                total_m += shortest_path(at, enter, turn_radius_m).length_m + leg.length_m + 2 * run_in_m
                at = Pose(leg.end[0] + run_in[0], leg.end[1] + run_in[1], leg.heading_rad)
            return total_m

        sweep, distance_m = cheapest(strip, pose, turn_radius_m, run_in_m, 30)
        ordered = list(sweep.legs)
        shortest_m = min(map(flown_m, (legs, legs[::-1], turned, turned[::-1])))
        assert shortest_m - 1e-6 <= distance_m <= shortest_m + TIE_M + 1e-6
        assert distance_m == pytest.approx(flown_m(ordered))
        assert {frozenset((leg.start, leg.end)) for leg in ordered} == {frozenset((leg.start, leg.end)) for leg in legs}
        # Each leg begins where the one before ends, one spacing beside it.
        for first, second in itertools.pairwise(ordered):
            assert math.dist(first.end, second.start) == pytest.approx(strip.width_m / len(legs))

    def test_nothing_is_flown_over_nothing(self) -> None:
        assert distance_over(Pose(0, 0, 0), [], 10) == 0
        assert distance_over(Pose(0, -50, NORTH), [pass_over((0, 0), (0, 100), 30)], 10) == pytest.approx(180)

    def test_a_sonar_that_sees_to_the_side_passes_on_either(self) -> None:
        strip = Strip(1, (0, 0), NORTH, 100, 60)
        ways = sweeps_over(strip, 60, 10, 0, beside_m=85)
        assert [way.entry.x_m for way in ways] == pytest.approx([85, 85, -85, -85])
        assert [way.entry.y_m for way in ways] == pytest.approx([0, 100, 0, 100])

    def test_none_enters_ground_to_keep_out_of_and_all_leave_room_to_turn(self) -> None:
        def ways(x_m: float, y_m: float) -> int:
            """How many stay out of 10 m square about a place; legs are 10, 30 and 50 m east, or 85 m to a side."""
            zone = KeepOut((((x_m - 5, y_m - 5), (x_m + 5, y_m - 5), (x_m + 5, y_m + 5), (x_m - 5, y_m + 5)),))
            beside = sweeps_over(Strip(1, (0, 0), NORTH, 100, 60), 60, 10, 0, beside_m=85, keep_out=zone)
            return len(sweeps_over(self.STRIP, 20, 10, 0, keep_out=zone)) + len(beside)

        assert ways(1000, 0) == 8
        assert ways(30, 50) == 4  # on the leg in the middle
        assert ways(85, 50) == 6  # on the leg to the right

    @pytest.mark.parametrize("heading_rad", [NORTH, EAST, SOUTH, WEST])
    def test_a_pass_is_flown_by_its_compass_heading(self, heading_rad: float) -> None:
        passed = pass_over((0, 0), (100 * math.sin(heading_rad), 100 * math.cos(heading_rad)), 30)
        assert (passed.begin.heading_rad, passed.end.heading_rad) == pytest.approx((heading_rad, heading_rad))

    def test_a_sonar_that_looks_ahead_flies_its_pass_earlier(self) -> None:
        begun, ended = pass_over((0, 0), (0, 100), 10, lead_m=30)
        assert begun[:2] == pytest.approx((0, -40))
        assert ended[:2] == pytest.approx((0, 80))
        first, *_ = sweeps_over(self.STRIP, 20, 10, 5, lead_m=30)
        for leg, one in zip(first.legs, first.passes, strict=True):
            assert math.dist(one.begin[:2], leg.start) == pytest.approx(35)
            assert math.dist(one.end[:2], leg.end) == pytest.approx(25)

    def test_refuses_no_sweeps_and_lengths_out_of_range(self) -> None:
        with pytest.raises(ValueError, match="no sweep"):
            shortest_sweep([], Pose(0, 0, 0), 10)
        for run_in_m in (-1, math.nan, math.inf):
            with pytest.raises(ValueError, match="run-in"):
                sweeps_over(self.STRIP, 20, 10, run_in_m)
        with pytest.raises(ValueError, match="turn radius"):
            sweeps_over(self.STRIP, 20, 0, 0)


class TestPastZones:
    STRIP = Strip(1, (30, 0), NORTH, 100, 60)
    # It lies across the half circle from the first leg's north end to the second one's.
    POST = KeepOut((((18, 108), (22, 108), (22, 112), (18, 112)),))

    def length_m(self, one: Pose, other: Pose) -> float:
        way = shortest_way(one, other, 10, self.POST)
        assert way is not None
        return way_length_m(way)

    def test_turns_count_as_they_lead_round_a_zone(self) -> None:
        ways = sweeps_over(self.STRIP, 20, 10, 0, keep_out=self.POST)
        round_m = self.length_m(Pose(10, 100, NORTH), Pose(30, 100, SOUTH))
        assert round_m > 10 * math.pi + 1
        # From the first leg to the second to the north, from the third to the second, and both turned.
        longer_m, usual_m = 300 + 10 * math.pi + round_m, 300 + 20 * math.pi
        assert [way.length_m for way in ways] == pytest.approx([longer_m, usual_m, usual_m, longer_m])

    def test_the_shortest_is_that_with_the_way_there_past_zones(self) -> None:
        ways = sweeps_over(self.STRIP, 20, 10, 0, keep_out=self.POST)
        for pose, best in ((Pose(22, -60, NORTH), 1), (Pose(20, 125, SOUTH), 2), (Pose(-20, 130, 3.0), 2)):
            totals_m = [self.length_m(pose, way.entry) + way.length_m for way in ways]
            sweep, way_m = shortest_sweep(ways, pose, 10, self.POST)
            assert ways.index(sweep) == totals_m.index(min(totals_m)) == best
            assert way_m + sweep.length_m == pytest.approx(min(totals_m))
            assert distance_over(pose, sweep.passes, 10, self.POST) == pytest.approx(min(totals_m))

    def test_where_no_way_there_stays_out_there_is_none(self) -> None:
        ring = KeepOut(
            tuple(
                ((west, south), (east, south), (east, north), (west, north))
                for west, south, east, north in (
                    (-240, -40, -160, -35),
                    (-240, 35, -160, 40),
                    (-240, -40, -235, 40),
                    (-165, -40, -160, 40),
                )
            )
        )
        ways = sweeps_over(self.STRIP, 20, 10, 0, keep_out=ring)
        assert len(ways) == 4
        with pytest.raises(NoSweepError, match="no sweep"):
            shortest_sweep(ways, Pose(-200, 0, EAST), 10, ring)

    def test_what_no_way_joins_is_no_sweep(self) -> None:
        # A wall between the first two legs, and one round each half.
        sides = ((-500, -500, -498, 500), (20, -500, 22, 500), (498, -500, 500, 500))
        ends = ((-500, -500, 500, -498), (-500, 498, 500, 500))
        walls = KeepOut(tuple(((w, s), (e, s), (e, n), (w, n)) for w, s, e, n in (*sides, *ends)))
        assert sweeps_over(self.STRIP, 20, 8, 0, keep_out=walls) == ()
        assert len(sweeps_over(Strip(1, (40, 0), NORTH, 100, 30), 20, 8, 0, keep_out=walls)) == 4
