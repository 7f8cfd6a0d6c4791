"""The services of many strips at once are those of each by itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import helper, open_strip, situations, strip

from coordinator.allocate.service import (
    MOST_KEPT,
    Service,
    StripTable,
    StripWays,
    can_fly,
    expected_service,
    removed_m2,
)
from coordinator.allocate.situation import Situation
from planner.currents import FlowGrid, Sailing
from planner.dubins import Pose
from planner.keep_out import KeepOut
from planner.way_home import WayHome


@settings(max_examples=60, deadline=None)
@given(told=situations(), late_s=st.sampled_from([0.0, 77.0]))
def test_each_is_as_by_itself(told: Situation, late_s: float) -> None:
    for one in told.helpers:
        table = StripTable(told.strips, one)
        for pose, time_s in ((one.free_at, one.free_s), (Pose(50, -20, 2.0), one.free_s + late_s)):
            there = replace(one, free_at=pose, free_s=time_s)
            removed, free_s, leave = table.best_from(pose, time_s, told.deadline_s)
            assert removed.shape == free_s.shape == (len(told.strips),)
            for place, job in enumerate(told.strips):
                served = expected_service(job, there)
                expected = 0.0 if job.strip.number in one.refused else removed_m2(job, there, served, told.deadline_s)
                assert removed[place] == pytest.approx(expected)
                assert free_s[place] == pytest.approx(served.free_s)
                assert leave[place] == pytest.approx(served.free_at)


@settings(max_examples=60, deadline=None)
@given(told=situations())
def test_of_all_ways_the_shortest_is_the_one_that_is_expected(told: Situation) -> None:
    for one in told.helpers:
        table = StripTable(told.strips, one)
        poses = np.array([one.free_at, Pose(50, -20, 2.0)])
        assert table.ways.to_begin_s(poses).shape == (2, *table.sonar_on_s.shape)
        to_begin_s, ways = table.ways.shortest_from(poses)
        for row, pose in enumerate(poses.tolist()):
            there = replace(one, free_at=Pose(*pose), free_s=0.0)
            for place, job in enumerate(told.strips):
                served, way = expected_service(job, there), ways[row, place]
                assert to_begin_s[row, place] + table.sonar_on_s[place, way] == pytest.approx(served.ends_s)
                assert table.leave[place, way] == pytest.approx(served.free_at)


def test_of_ways_that_differ_by_less_than_2_cm_the_first_is_expected() -> None:
    # Begun at either end it is seen after 578 s, to 1.9 cm.
    one = helper("a", 188, 340, math.pi, speed_mps=1.0, swath_m=30)
    job = open_strip(strip(2, 0, 208, 243, 1.0))
    table = StripTable([job], one)
    to_begin_s, ((way,),) = table.ways.shortest_from(np.array([one.free_at]))
    ends_s = table.ways.to_begin_s(np.array([one.free_at]))[0, 0] + table.sonar_on_s[0]
    assert 0.018 < ends_s[way] - ends_s.min() < 0.02
    assert way < ends_s.argmin()
    assert to_begin_s[0, 0] + table.sonar_on_s[0, way] == ends_s[way]
    assert table.leave[0, way] == pytest.approx(expected_service(job, one).free_at)


def test_strips_of_one_leg_and_of_two_are_each_as_by_itself() -> None:
    one = helper(swath_m=30)
    jobs = [open_strip(strip(1)), open_strip(replace(strip(2, x_m=100), width_m=30))]
    _, free_s, leave = StripTable(jobs, one).best_from(one.pose, 0.0, np.inf)
    for place, job in enumerate(jobs):
        served = expected_service(job, one)
        assert free_s[place] == pytest.approx(served.free_s)
        assert leave[place] == pytest.approx(served.free_at)


def test_a_strip_that_can_be_flown_in_one_way_alone_is_flown_so_beside_one_of_two() -> None:
    # What is seen lies 30 m ahead. Southwards 1 would be begun at y = 335 m, within the zone; northwards it is left at
    # 275 m.
    zone = KeepOut((((-5.0, 330.0), (5.0, 330.0), (5.0, 340.0), (-5.0, 340.0)),))
    one = helper(y_m=600, heading_rad=np.pi, lead_m=30.0, keep_out=zone)
    jobs = [open_strip(strip(1)), open_strip(strip(2, x_m=200))]
    table = StripTable(jobs, one)
    assert table.leave[:, :, 1] == pytest.approx(np.array([[275, 275], [275, 125]]))
    _, _, leave = table.best_from(one.pose, 0.0, np.inf)
    assert leave[:, 1] == pytest.approx([275, 125])


def test_where_there_is_no_strip_there_is_nothing_to_serve() -> None:
    removed, free_s, leave = StripTable([], helper()).best_from(Pose(0, 0, 0), 0.0, np.inf)
    assert (removed.shape, free_s.shape, leave.shape) == ((0,), (0,), (0, 3))


@pytest.mark.parametrize(("from_x_m", "can"), [(-30.0, False), (10.0, False), (50.0, True)])
def test_what_lies_on_its_legs_keeps_a_helper_from_flying_a_strip(from_x_m: float, can: bool) -> None:
    zone = KeepOut((tuple((from_x_m + x_m, y_m) for x_m, y_m in ((0, 150), (60, 150), (60, 160), (0, 160))),))
    one = strip(1)  # along x = 0
    assert can_fly(one, replace(helper(swath_m=30), keep_out=zone)) is can
    assert can_fly(one, helper(swath_m=30))


class TestByHand:
    """200 m at 2 m/s, from 100 m before it; and from 100 m beyond it, headed for it."""

    TABLE = StripTable([open_strip(strip(1)), open_strip(strip(2))], helper(refused=frozenset({2}), lasts_until_s=200))

    def test_how_long_it_is_to_the_nearer_end(self) -> None:
        poses = np.array([Pose(0, 0, 0), Pose(0, 400, np.pi)])
        assert self.TABLE.ways.to_begin_s(poses).min(axis=2) == pytest.approx(np.full((2, 2), 50))
        assert self.TABLE.sonar_on_s == pytest.approx(np.full(self.TABLE.sonar_on_s.shape, 100))

    @pytest.mark.parametrize(
        ("begins_s", "deadline_s", "removed"),
        [(50, np.inf, 700), (50, 100, 350), (50, 50, 0), (50, 20, 0), (100, 1000, 700), (101, 1000, 0)],
    )
    def test_what_is_flown_by_the_deadline_counts_if_the_battery_lasts(
        self, begins_s: float, deadline_s: float, removed: float
    ) -> None:
        found = self.TABLE.removed_m2(np.full((1, *self.TABLE.sonar_on_s.shape), begins_s), deadline_s)
        assert found[0, 0] == pytest.approx(removed)
        assert (found[0, 1] == 0).all()  # it has refused that one


def test_who_must_wait_before_it_sets_out_is_there_so_much_later() -> None:
    served = expected_service(open_strip(strip(1)), helper(free_s=10, waits_s={1: 60.0, 2: 500.0}))
    assert (served.begins_s, served.ends_s, served.free_s) == pytest.approx((120, 220, 222.5))


@pytest.mark.parametrize(("deadline_s", "removed"), [(1000, 700), (100, 350), (75, 175), (20, 0)])
def test_a_service_removes_what_is_flown_by_the_deadline(deadline_s: float, removed: float) -> None:
    job = open_strip(strip(1))  # from 50 s to 150 s
    assert removed_m2(job, helper(), expected_service(job, helper()), deadline_s) == pytest.approx(removed)


def test_a_current_tells_from_when_to_when_the_sonar_is_on() -> None:
    # 2 m/s and 0.5 m/s from astern: 2.5 m/s over 95 m of way, 5 m of run-in, 200 m of strip and 5 m of run-out.
    one = replace(helper(), way_home=WayHome((0, 0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0))
    served = expected_service(open_strip(strip(1)), one)
    assert (served.begins_s, served.ends_s, served.free_s) == pytest.approx((40, 120, 122))


@pytest.mark.parametrize(("x_m", "y_m", "heading_rad"), [(0, 100, 0.0), (100, 0, np.pi / 2)])
def test_on_the_way_to_a_strip_the_flow_half_way_there_counts(x_m: float, y_m: float, heading_rad: float) -> None:
    # From astern, and rising to 0.9 m/s at 90 m; half-way over the 95 m to the run-in it is 0.475 m/s.
    # All of it 30 m east and 20 m south of the origin.
    north, flow = x_m == 0, np.array([0.0, 0.9])
    axis = np.array([-20.0, 70.0]) if north else np.array([30.0, 120.0])
    speeds = flow[np.newaxis, :, np.newaxis] if north else flow[np.newaxis, np.newaxis, :]
    still, nowhere = np.zeros_like(speeds), np.zeros(1)
    grid = FlowGrid(nowhere, axis, nowhere, still, speeds) if north else FlowGrid(axis, nowhere, nowhere, speeds, still)
    one = helper(way_home=WayHome((0, 0), Sailing(2.0, drift_mps=0.9, grid=grid), 6.0))
    table = StripTable([open_strip(strip(1, 30 + x_m, -20 + y_m, heading_rad=heading_rad))], one)
    to_begin_s = table.ways.to_begin_s(np.array([[30, -20, heading_rad]]))
    assert to_begin_s[0, 0, 0] == pytest.approx(95 / 2.475 + 5 / 2.9)


@pytest.mark.parametrize(("time_s", "share"), [(99, 0), (100, 0), (125, 0.25), (199, 0.99), (200, 1), (300, 1)])
def test_a_sweep_is_flown_evenly(time_s: float, share: float) -> None:
    assert Service(100, 200, Pose(0, 0, 0), 205).share_by(time_s) == pytest.approx(share)


@pytest.mark.parametrize("way_home", [None, WayHome((0.0, 0.0), Sailing(2.0), 6.0)])
def test_a_battery_that_just_lasts_to_the_end_and_home_lasts(way_home: WayHome | None) -> None:
    one = helper(way_home=way_home)
    job = open_strip(strip(1))
    served = expected_service(job, one)
    ends_s = served.ends_s + float(one.home_s(np.array([served.free_at], dtype=np.float64))[0])
    assert removed_m2(job, replace(one, lasts_until_s=ends_s), served, np.inf) == 700
    assert removed_m2(job, replace(one, lasts_until_s=ends_s - 1e-6), served, np.inf) == 0


def test_a_strip_that_cannot_be_flown_is_served_as_where_nothing_is_in_the_way() -> None:
    zone = KeepOut((((-30.0, 150.0), (30.0, 150.0), (30.0, 160.0), (-30.0, 160.0)),))
    job = open_strip(strip(1))
    assert expected_service(job, replace(helper(), keep_out=zone)) == expected_service(job, helper())


def test_who_lies_within_what_it_may_not_enter_is_expected_to_go_straight_out() -> None:
    zone = KeepOut((((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)),))
    job = open_strip(strip(1))
    assert expected_service(job, helper(keep_out=zone)) == expected_service(job, helper())


def test_of_two_ways_that_are_the_same_length_the_first_is_taken() -> None:
    # Midway beside the strip and headed across it: either end is as far.
    one = helper(x_m=-300, y_m=200, heading_rad=np.pi / 2)
    table = StripTable([open_strip(strip(1))], one)
    to_begin_s = table.ways.to_begin_s(np.array([one.pose]))
    assert to_begin_s[0, 0, 0] == pytest.approx(to_begin_s[0, 0, 1])
    _, ways = table.ways.shortest_from(np.array([one.pose]))
    assert ways.tolist() == [[0]]


@pytest.mark.parametrize(
    "other",
    [
        *({}, {"vehicle": "beta"}, {"p_detect": 0.4}, {"lasts_until_s": 100.0}, {"refused": frozenset({1})}),
        *({"speed_mps": 1.5}, {"turn_radius_m": 7}, {"run_in_m": 6}, {"swath_m": 30}, {"beside_m": 5.0}),
        *({"lead_m": 5.0}, {"keep_out": KeepOut((((900.0, 0.0), (950.0, 0.0), (950.0, 9.0)),))}),
        {"way_home": WayHome((0, 0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0)},
    ],
)
def test_only_the_ways_of_those_that_fly_alike_are_worked_out_in_common(other: dict[str, object]) -> None:
    jobs = [open_strip(strip(1)), open_strip(strip(2, x_m=200))]
    one, two = helper(), replace(helper(), **other)  # type: ignore[arg-type]
    tables = [StripTable(jobs, its) for its in (one, two)]
    flies_alike = not other or next(iter(other)) in ("vehicle", "p_detect", "lasts_until_s", "refused")
    assert (tables[0].ways is tables[1].ways) is flies_alike
    for table, its in zip(tables, (one, two), strict=True):
        lone = StripWays([job.strip for job in jobs], its)
        assert table.helper is its
        assert (table.home_s == lone.home_s(its)).all()
        assert (table.sonar_on_s == lone.sonar_on_s).all()
        assert (table.leave == lone.leave).all()


def test_what_was_worked_out_for_strips_stands_for_others_at_the_same_places() -> None:
    one, east, west = helper(), Pose(500, 0, 1.0), Pose(-900, 0, 1.0)
    homes = [replace(one, way_home=WayHome(home[:2], Sailing(one.speed_mps), 6.0)) for home in (east, west)]
    tables = [StripTable([open_strip(strip(number))], its) for number, its in zip((1, 2), homes, strict=True)]
    assert tables[0].ways is tables[1].ways
    for table, its in zip(tables, homes, strict=True):  # but for where each comes home
        assert (table.home_s == StripWays([strip(1)], its).home_s(its)).all()
    assert (tables[0].home_s != tables[1].home_s).any()
    ways, alone = tables[0].ways, StripWays([strip(1)], one)
    for poses in [
        np.array([east, west]),
        *(np.array([[x_m, 0.0, 1.0]]) for x_m in range(MOST_KEPT + 1)),
        np.array([east]),
    ]:
        expected = alone.shortest_from(poses)
        for found in (ways.shortest_from(poses), ways.shortest_from(poses), ways.shortest_from_each([poses])):
            assert [array.tolist() for array in found] == [array.tolist() for array in expected]
    begins_s, _ = ways.shortest_from(poses)
    with pytest.raises(ValueError, match="read-only"):
        begins_s += 1
    its_own_s, _ = ways.shortest_from_each([poses, np.array([west])])
    its_own_s += 1
    assert its_own_s[:1].tolist() == (begins_s + 1).tolist()


class TestHowLongRunInsAndWaysHomeTake:
    POSES = np.array([[[0, 100, 0.0], [0, 100, np.pi], [3, 4, 0.0]], [[9, 9, 0.0], [0, 0, np.pi], [5, 5, 0.0]]])

    def test_run_ins_in_still_water(self) -> None:
        assert helper().run_in_s(self.POSES).tolist() == [[2.5] * 3] * 2

    def test_run_ins_in_a_current_are_by_the_speed_over_the_ground(self) -> None:
        one = replace(helper(), way_home=WayHome((0, 0), Sailing(2.0, drift_mps=0.5, set_rad=0.0), 6.0))
        against = 5 / 1.5
        assert one.run_in_s(self.POSES) == pytest.approx(np.array([[2, against, 2], [2, against, 2]]))

    def test_home_is_reached_behind_the_run_out(self) -> None:
        poses = np.array([[0, 100, np.pi], [0, 40, np.pi]])
        assert helper().home_s(poses).tolist() == [0, 0]
        assert helper(way_home=WayHome((0.0, 0.0), Sailing(2.0), 6.0)).home_s(poses) == pytest.approx([52.5, 22.5])


def test_of_the_ways_over_a_strip_that_with_the_current_is_taken() -> None:
    # 0.5 m/s to the north: 200 m take 80 s with it and 133 s against it; from the side either end is as far.
    one = helper(x_m=-300, y_m=200, heading_rad=np.pi / 2, way_home=WayHome((0, 0), Sailing(2.0, 0.5, 0.0), 6.0))
    table = StripTable([open_strip(strip(1))], one)
    assert sorted(set(table.sonar_on_s[0].round(6).tolist())) == pytest.approx([80, 200 / 1.5])
    to_begin_s, ways = table.ways.shortest_from(np.array([one.pose]))
    assert table.sonar_on_s[0, ways[0, 0]] == pytest.approx(80)
    assert table.run_out_s[0, ways[0, 0]] == pytest.approx(2)
    assert table.leave[0, ways[0, 0]] == pytest.approx([0, 305, 0])
    removed, free_s, _ = table.best_from(one.pose, 10.0, np.inf)
    assert (removed[0], free_s[0]) == pytest.approx((700, 10 + to_begin_s[0, 0] + 82))


def test_the_battery_must_last_home_from_the_end_of_the_way_that_is_flown() -> None:
    one = helper(way_home=WayHome((0.0, -50.0), Sailing(2.0), 6.0))
    job = open_strip(strip(1))
    served = expected_service(job, one)
    home_s = float(one.home_s(np.array([served.free_at], dtype=np.float64))[0])
    assert home_s > 355 / 2
    for spare_s, removed in ((0.01, 700), (-0.01, 0)):
        table = StripTable([job], replace(one, lasts_until_s=served.ends_s + home_s + spare_s))
        assert table.best_from(one.pose, 0.0, np.inf)[0] == pytest.approx([removed])
