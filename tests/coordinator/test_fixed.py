"""Second looks that do not react to what is seen: lanes, and routes planned beforehand, by hand."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, SECOND_HELPER, run_info, vehicle
from coordinator_by_hand import DONE, ELSEWHERE, GRID, HOT, OFFERED, OPEN, TWO_HELPERS, WITHDRAWN, Told, coordinator
from one_node import OneNode
from situations import at_work, helper, open_strip, situation, strip

from comms.said.announcement import Role, Vertex, Zone
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack, StripStatus, TaskState
from coordinator.coordinator import Coordinator
from coordinator.cut.window import Window
from coordinator.fixed import FixedRoutes, _lanes
from planner.region import Region
from planner.types import BoolArray

LANES = ("lanes", "lanes_across")
DENTED = ((0.0, 0.0), (400.0, 0.0), (400.0, 400.0), (300.0, 400.0), (200.0, 100.0), (100.0, 400.0), (0.0, 400.0))
BOTH = (HELPER, SECOND_HELPER)


def cells_of(strip: StripStatus) -> BoolArray:
    """The cells whose centres lie on a strip, shape of the grid."""
    x_m, y_m = GRID.across_m[np.newaxis, :] - strip.start_x_m, GRID.along_m[:, np.newaxis] - strip.start_y_m
    sin, cos = np.sin(strip.heading_rad), np.cos(strip.heading_rad)
    along_m, beside_m = x_m * sin + y_m * cos, x_m * cos - y_m * sin
    on_it: BoolArray = (np.abs(beside_m) < strip.width_m / 2) & (along_m > 0) & (along_m < strip.length_m)
    return on_it


def at_x_m(told: Told) -> list[float]:
    """Where the lanes lie, by number."""
    return [strip.start_x_m for _, strip in sorted(told.strips().items())]


def serve(told: Told, name: str, risk: np.ndarray) -> int:
    """A helper serves what it was offered last; returns its number. `risk`: what its looks have left, changed."""
    number = [strip for vehicle, _, strip in told.tasks() if vehicle == name][-1]
    told.status(name, number, TaskState.ACCEPTED)
    told.state(name, Mode.REVISIT, number)
    risk[cells_of(told.strips()[number])] *= 0.3
    told.layer(name, risk)
    told.status(name, number, TaskState.DONE)
    told.state(name, Mode.IDLE)
    told.settle()
    assert told.states()[number] is DONE
    return number


class TestLanes:
    @pytest.mark.parametrize("strips", LANES)
    @pytest.mark.parametrize("area", [None, DENTED])
    @pytest.mark.parametrize(("vehicles", "idle"), [(TWO_HELPERS[:2], BOTH[:1]), (TWO_HELPERS, BOTH)])
    def test_together_they_cover_the_area(
        self,
        strips: Literal["lanes", "lanes_across"],
        area: tuple[tuple[float, float], ...] | None,
        vehicles: tuple[object, ...],
        idle: tuple[str, ...],
    ) -> None:
        told = coordinator(vehicles, idle=idle, strips=strips, area=area)  # type: ignore[arg-type]
        inside = Region(area or run_info(400, 400).outline).inside(GRID)
        covered = np.any([cells_of(one) for one in told.strips().values()], axis=0)
        assert inside.sum() > 4000
        assert covered[inside].all()
        assert {one.width_m for one in told.strips().values()} == {50}

    def test_each_is_as_long_as_the_area_is_there(self) -> None:
        told = coordinator(strips="lanes", area=DENTED)
        lengths_m = {one.start_x_m: one.length_m for one in told.strips().values()}
        assert lengths_m[22.5] == 400
        # Columns 40 to 49 begin at 200 m, right beside the dent's foot, which climbs by 3 m a metre: to 247.5 m.
        assert lengths_m[222.5] == pytest.approx(100 + 3 * 45, abs=15)

    def test_it_begins_at_its_side_and_all_are_there_from_the_first_second(self) -> None:
        told = coordinator(strips="lanes")
        assert told.node.now_ms <= 3
        assert at_x_m(told) == [22.5, 72.5, 122.5, 172.5, 222.5, 272.5, 322.5, 372.5, 377.5]
        assert told.states() == {1: OFFERED, **dict.fromkeys(range(2, 10), OPEN)}
        assert {one.start_y_m for one in told.strips().values()} == {0}

    def test_across_they_run_from_west_to_east(self) -> None:
        told = coordinator(strips="lanes_across")
        lanes = [strip for _, strip in sorted(told.strips().items())]
        assert [lane.start_y_m for lane in lanes] == [25, 75, 125, 175, 225, 275, 325, 375]
        assert {lane.start_x_m for lane in lanes} == {-2.5}
        assert {lane.length_m for lane in lanes} == {405}
        assert [lane.heading_rad for lane in lanes] == pytest.approx([np.pi / 2] * 8)

    def test_they_are_flown_in_order_and_then_back_again(self) -> None:
        told = coordinator(strips="lanes")
        risk = np.ones(GRID.shape)
        flown = [serve(told, HELPER, risk) for _ in range(18)]
        assert flown == list(range(1, 19))
        assert at_x_m(told)[9:18] == at_x_m(told)[8::-1]
        assert at_x_m(told)[18:] == at_x_m(told)[:9]
        assert told.states()[19] is OFFERED

    def test_what_is_seen_changes_nothing(self) -> None:
        told = coordinator(strips="lanes")
        before = told.strips()
        told.plan(60.0, 180.0)
        told.hotspot(ELSEWHERE)
        told.layer(PRIMARY, np.full(GRID.shape, 0.5))
        told.keep_alive([PRIMARY, HELPER], 5)
        assert {number: strip.start_x_m for number, strip in told.strips().items()} == {
            number: strip.start_x_m for number, strip in before.items()
        }

    def test_nothing_is_shared_out_before_all_helpers_are_heard(self) -> None:
        told = coordinator(TWO_HELPERS, strips="lanes")
        assert told.strips() == {}
        told.state(SECOND_HELPER, Mode.IDLE)
        told.settle()
        assert {name for name, _, _ in told.tasks()} == set(BOTH)


class TestSharing:
    def test_two_that_are_alike_have_a_half_each_on_their_sides(self) -> None:
        # Columns 0 to 39 and 40 to 80: at 122.5 m and 322.5 m both are nearer to the east end of their own.
        told = coordinator(TWO_HELPERS, idle=BOTH, strips="lanes")
        assert at_x_m(told) == [172.5, 122.5, 72.5, 22.5, 377.5, 372.5, 322.5, 272.5, 222.5]
        assert {name: number for name, _, number in told.tasks()} == {HELPER: 1, SECOND_HELPER: 5}

    def test_who_is_three_times_as_fast_has_three_quarters(self) -> None:
        # Columns 0 to 19 and 20 to 80.
        fast = (*TWO_HELPERS[:2], replace(TWO_HELPERS[2], speed_mps=6.0))
        told = coordinator(fast, idle=BOTH, strips="lanes")
        assert at_x_m(told)[:2] == [72.5, 22.5]
        assert min(at_x_m(told)[2:]) == 122.5

    def test_the_side_counts_and_not_the_name(self) -> None:
        west = vehicle("west", Role.REVISIT)  # at 122.5 m, as all but the second helper
        told = coordinator((TWO_HELPERS[0], west, TWO_HELPERS[2]), idle=("west", SECOND_HELPER), strips="lanes")
        places_m = {name: told.strips()[number].start_x_m for name, _, number in told.tasks()}
        assert places_m == {"west": 172.5, SECOND_HELPER: 377.5}

    @pytest.mark.parametrize(("strips", "first"), [("lanes", HELPER), ("lanes_across", SECOND_HELPER)])
    def test_who_has_the_first_lanes_lies_west_or_across_the_tracks_south(
        self, strips: Literal["lanes", "lanes_across"], first: str
    ) -> None:
        told = coordinator(TWO_HELPERS, idle=(), strips=strips)
        for name, x_m, y_m in ((HELPER, 100.0, 300.0), (SECOND_HELPER, 300.0, 100.0)):
            told.node.hear(f"agent/{name}/state", AgentState(Mode.IDLE, 0, 1, 0, x_m, y_m, 0, 0, 0))
        told.settle()
        assert min(told.tasks(), key=lambda task: task[2])[0] == first

    def test_each_flies_its_own(self) -> None:
        told = coordinator(TWO_HELPERS, idle=BOTH, strips="lanes")
        risk = np.ones(GRID.shape)
        flown = [serve(told, HELPER, risk) for _ in range(5)]
        assert flown == [1, 2, 3, 4, 10]  # 5 to 9 are the other's; 10 is where 4 is
        assert at_x_m(told)[9:] == [22.5, 72.5, 122.5, 172.5]

    def test_of_two_at_one_place_the_first_name_has_the_first_lanes(self) -> None:
        vehicles = (TWO_HELPERS[0], vehicle("west", Role.REVISIT), vehicle("a-west", Role.REVISIT))
        told = coordinator(vehicles, idle=("west", "a-west"), strips="lanes")
        assert {name: told.strips()[number].start_x_m for name, _, number in told.tasks()} == {
            "a-west": 172.5,
            "west": 222.5,
        }

    @pytest.mark.parametrize(("x_m", "first_m"), [(202.4, 22.5), (202.5, 22.5), (202.6, 377.5)])
    def test_who_lies_beyond_the_middle_begins_at_the_far_end(self, x_m: float, first_m: float) -> None:
        told = coordinator(idle=(), strips="lanes")
        told.node.hear(f"agent/{HELPER}/state", AgentState(Mode.IDLE, 0, 1, 0, x_m, 0, 0, 0, 0))
        told.settle()
        assert at_x_m(told)[0] == first_m

    def test_who_is_wider_has_more(self) -> None:
        # 30 m beside 50 m of 81 columns: 30 and 51.
        narrow = (*TWO_HELPERS[:1], replace(TWO_HELPERS[1], far_m=15.0), TWO_HELPERS[2])
        told = coordinator(narrow, idle=BOTH, strips="lanes")
        assert {one.width_m: one.start_x_m for one in told.strips().values() if one.start_x_m < 200} == {
            **dict.fromkeys([30.0], 12.5),
            **dict.fromkeys([50.0], 172.5),
        }


class TestWhatLanesAre:
    def test_a_lane_is_worth_what_the_poorest_look_takes_of_its_cells_inside_and_is_foreseen(self) -> None:
        poor = (*TWO_HELPERS[:2], replace(TWO_HELPERS[2], p_detect=0.4))
        told = coordinator(poor, idle=BOTH, strips="lanes", area=DENTED)
        inside = Region(DENTED).inside(GRID)
        for one in told.strips().values():
            assert one.removable_m2 == pytest.approx(0.4 * 25 * inside[cells_of(one)].sum(), rel=1e-3)
            assert (one.foreseen, one.why) == (True, "a lane")

    def test_who_has_failed_at_its_last_lane_begins_anew(self) -> None:
        told = coordinator(strips="lanes", area=((0.0, 0.0), (40.0, 0.0), (40.0, 400.0), (0.0, 400.0)))
        assert told.states() == {1: OFFERED}
        told.status(HELPER, 1, TaskState.FAILED, "no")
        told.keep_alive([PRIMARY, HELPER], 1)
        told.settle()
        assert list(told.states())[:2] == [1, 2]

    def test_one_is_no_wider_than_the_area(self) -> None:
        told = coordinator(strips="lanes")
        narrow = Told(OneNode(Coordinator(told.node.node.config), Role.COORDINATOR))  # type: ignore[attr-defined]
        narrow.node.hear("run", run_info(20, 400), at_ms=1)
        narrow.state(HELPER, Mode.IDLE)
        narrow.settle()
        assert [(one.width_m, one.length_m) for one in narrow.strips().values()] == [(25, 400)]  # five columns

    def test_where_no_cell_is_inside_there_is_none(self) -> None:
        inside = np.zeros((10, 20), dtype=np.bool_)
        inside[3:8, 2:6] = inside[5:9, 17:] = True
        assert _lanes(inside, 0, 20, 4) == [Window(3, 8, 0, 4), Window(3, 8, 4, 8), Window(5, 9, 16, 20)]
        assert _lanes(inside, 14, 19, 4) == [Window(5, 9, 14, 18), Window(5, 9, 16, 20)]
        assert _lanes(inside, 0, 20, 20) == [Window(3, 9, 0, 20)]

    def test_what_cannot_be_flown_of_them_is_left_out(self) -> None:
        # A zone right across the first two lanes: 1.5 m off it stays a run-out of 5 m, and a turn of 6 m after that.
        told = coordinator(idle=(), strips="lanes")
        config = told.node.node.config  # type: ignore[attr-defined]
        zone = Zone(tuple(Vertex(*corner) for corner in ((-20, 200), (90, 200), (90, 220), (-20, 220))))
        told = Told(OneNode(Coordinator(config), Role.COORDINATOR))
        told.node.hear("run", replace(run_info(400, 400), keep_out=(zone,), keep_out_margin_m=1.5), at_ms=1)
        told.state(PRIMARY, Mode.SURVEY, 1)
        told.state(HELPER, Mode.IDLE)
        told.settle()
        lanes = [(one.start_x_m, one.start_y_m, one.length_m) for _, one in sorted(told.strips().items())]
        assert lanes[4:] == [(x_m, 0, 400) for x_m in (122.5, 172.5, 222.5, 272.5, 322.5, 372.5, 377.5)]
        assert lanes[:4] == [(x_m, y_m, long_m) for x_m in (22.5, 72.5) for y_m, long_m in ((0, 185), (235, 165))]


def test_each_is_offered_the_next_of_its_own_that_is_there_and_that_it_has_not_refused() -> None:
    routes = FixedRoutes({"alpha": [4, 2, 3, 1], "beta": [6, 5], "gamma": [9]})
    jobs = [open_strip(strip(number)) for number in (1, 2, 3, 5, 6)]
    alpha = helper("alpha", refused=frozenset({2}))
    told = situation(jobs, [alpha, at_work(helper("beta"), jobs[0]), helper("gamma"), helper("delta")])
    assert routes.assign(told) == {"alpha": 3}
    assert routes.assign(situation(jobs, [helper("alpha"), helper("beta")])) == {"alpha": 2, "beta": 6}


class TestBeforehand:
    def test_nothing_is_planned_before_all_primaries_have_said_their_plans_and_all_helpers_were_heard(self) -> None:
        second = vehicle("another", Role.SURVEY)
        told = coordinator((*TWO_HELPERS[:2], second), idle=(), strips="beforehand")
        told.plan(60.0, 180.0)
        told.settle()
        track = PlannedTrack(1, 300, 300, 0, 300, 400, False)
        told.node.hear("agent/another/plan", Plan(1, (track,), (60,), (), ""))
        told.keep_alive([PRIMARY, "another"], 1)
        told.settle()
        assert told.strips() == {}
        told.state(HELPER, Mode.IDLE)
        told.settle()
        assert told.strips() != {}
        told = coordinator((*TWO_HELPERS[:2], second), strips="beforehand", deadline_s=2000.0)
        told.hotspot()
        told.plan(60.0, 180.0)
        told.settle()
        assert told.strips() == {}

    def test_nothing_is_planned_while_one_of_two_helpers_is_not_heard(self) -> None:
        told = coordinator(TWO_HELPERS, strips="beforehand")
        told.plan(60.0, 180.0)
        told.settle()
        assert told.strips() == {}
        told.state(SECOND_HELPER, Mode.IDLE)
        told.settle()
        assert {name for name, _, _ in told.tasks()} == set(BOTH)

    def test_nothing_is_planned_before_the_primary_has_said_its_plan(self) -> None:
        told = coordinator(strips="beforehand")
        told.hotspot()
        told.settle()
        assert told.strips() == {}
        assert told.tasks() == []
        told.plan(60.0, 180.0, 300.0)
        told.settle()
        assert list(told.states().values()).count(OFFERED) == 1

    def test_routes_go_to_the_deadline_and_no_farther(self) -> None:
        # Three tracks of 400 m at 1.5 m/s, and the ways to them, take some 1300 s; the helper serves 400 m in 225 s.
        routes = []
        for deadline_s in (None, 500.0, 250.0):
            told = coordinator(strips="beforehand", deadline_s=deadline_s)
            told.plan(60.0, 180.0, 300.0)
            told.settle()
            routes.append(sum(one.state is not WITHDRAWN for one in told.strips().values()))
        assert routes[0] > routes[1] == 2
        assert routes[2] == 1

    @pytest.mark.parametrize(("p_detect", "most"), [(0.7, 1), (0.3, 2)])
    def test_a_place_that_is_worth_another_look_is_planned_twice(self, p_detect: float, most: int) -> None:
        poor = (TWO_HELPERS[0], replace(TWO_HELPERS[1], p_detect=p_detect))
        told = coordinator(poor, strips="beforehand", deadline_s=3000.0)
        told.plan(60.0, 180.0, 300.0)
        told.settle()
        assert max(Counter((one.start_x_m, one.start_y_m) for one in told.strips().values()).values()) == most

    def test_strips_stay_as_first_planned(self) -> None:
        told = coordinator(strips="beforehand")
        told.plan(60.0, 180.0, 300.0)
        told.settle()
        before = told.strips()
        assert list(told.states().values()).count(OPEN) > 1
        risk = np.full(GRID.shape, 0.01)
        risk[:, 70:] = 1.0
        told.layer(PRIMARY, risk)
        told.hotspot(HOT)
        told.plan(60.0, 200.0, 340.0, revision=2)
        told.settle()
        told.keep_alive([PRIMARY, HELPER], 5)
        after = told.strips()
        assert after.keys() == before.keys()
        places = [[(one.start_x_m, one.start_y_m, one.length_m) for one in every.values()] for every in (before, after)]
        assert places[0] == places[1]

    def test_what_is_in_no_route_is_withdrawn(self) -> None:
        told = coordinator(strips="beforehand", idle=())
        told.state(HELPER, Mode.IDLE, battery=0.06)  # 864 s: for a few of the strips, and home
        told.plan(60.0, 180.0, 300.0)
        told.settle()
        states = told.states()
        left = [told.strips()[number] for number, state in states.items() if state in (OFFERED, OPEN)]
        assert list(states.values()).count(OFFERED) == 1
        assert list(states.values()).count(WITHDRAWN) == len(states) - len(left) > 1
        assert sum(one.length_m for one in left) <= 864 * 2
