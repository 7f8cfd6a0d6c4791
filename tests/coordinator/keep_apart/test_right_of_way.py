"""Who gives way: offers that wait, strips given back, helpers that stand aside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import pytest
from by_hand import vehicle
from situations import helper, open_strip, situation, strip

from comms.said.announcement import Role
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.allocate.allocators import ASKED_LATER_S, offers_let_through
from coordinator.allocate.simple import GreedyAllocator, NearestAllocator
from coordinator.allocate.situation import Allocator, Helper, OpenStrip, Situation
from coordinator.keep_apart.courses import too_close
from coordinator.keep_apart.right_of_way import RightOfWay, Underway
from coordinator.vehicles import KnownVehicle
from planner.dubins import Pose
from planner.types import Strip

NORTH, WEST = 0.0, 1.5 * math.pi


def known(name: str, role: Role, mode: Mode, x_m: float, y_m: float, works_on: int = 0, **other: int) -> KnownVehicle:
    """A vehicle heard at time 0, heading north."""
    state = AgentState(mode, works_on, 1, other.get("expected_end_ms", 0), x_m, y_m, NORTH)
    return KnownVehicle(vehicle(name, role), 0, state)


def primary(x_m: float, y_m: float = 0) -> KnownVehicle:
    """On a track northwards at 1.5 m/s, 300 m of it left."""
    found = known("primary", Role.SURVEY, Mode.SURVEY, x_m, y_m, 1, expected_end_ms=200_000)
    found.plan = Plan(1, (PlannedTrack(1, 0, x_m, y_m, x_m, y_m + 300, False),), (), (), "")
    return found


def right_of_way() -> RightOfWay:
    return RightOfWay(15, lambda place: abs(place[0]) <= 500 and abs(place[1]) <= 500)


class Waits:
    """Lets these strips through, and the others only after so many seconds."""

    def __init__(self, through: set[int], wait_s: float) -> None:
        self.through, self.seconds = through, wait_s

    def begin(self) -> None:
        pass

    def wait_s(self, helper: Helper, one: OpenStrip) -> float:
        return 0.0 if one.strip.number in self.through else self.seconds


class TestOffers:
    near, far = open_strip(strip(1, 0, 50)), open_strip(strip(2, 300, 50))

    @pytest.mark.parametrize("allocator", [GreedyAllocator(), NearestAllocator()])
    def test_another_strip_is_taken_where_one_must_wait_long(self, allocator: Allocator) -> None:
        asked = situation([self.near, self.far], [helper()])
        assert offers_let_through(allocator, asked, Waits({1, 2}, 0)) == ([("alpha", 1)], math.inf)
        assert offers_let_through(allocator, asked, Waits({2}, math.inf)) == ([("alpha", 2)], ASKED_LATER_S)

    def test_an_offer_that_is_clear_soon_waits(self) -> None:
        asked = situation([self.near, self.far], [helper()])
        assert offers_let_through(GreedyAllocator(), asked, Waits({2}, 10)) == ([], 10)

    def test_an_allocator_is_told_how_long_a_helper_must_wait_for_each_strip_that_it_gives_it(self) -> None:
        told = list[Mapping[int, float]]()

        class Takes:
            def assign(self, asked: Situation) -> dict[str, int]:
                told.append(asked.helpers[0].waits_s)
                return {"alpha": len(told)}

        asked = situation([open_strip(strip(number)) for number in (1, 2, 3)], [helper()])
        assert offers_let_through(Takes(), asked, Waits({3}, 40)) == ([("alpha", 3)], ASKED_LATER_S)
        assert told == [{}, {1: 40}, {1: 40, 2: 40}]

    @pytest.mark.parametrize(("wait_s", "offers", "again_s"), [(10, [], 10), (60, [("alpha", 2)], ASKED_LATER_S)])
    def test_a_helper_waits_for_the_better_strip_unless_that_takes_too_long(
        self, wait_s: float, offers: list[tuple[str, int]], again_s: float
    ) -> None:
        # Done after 75 s and the wait the first removes 700 m2, the second 350 m2 after 50 s.
        better, soon = open_strip(strip(1, 0, 50, 100), 1000), open_strip(strip(2, 0, 50, 50), 500)
        asked = situation([better, soon], [helper()])
        assert offers_let_through(GreedyAllocator(), asked, Waits({2}, wait_s)) == (offers, again_s)

    def test_an_allocator_that_insists_gets_nothing(self) -> None:
        class Insists:
            def assign(self, asked: object) -> dict[str, int]:
                return {"alpha": 1}

        asked = situation([self.near], [helper()])
        assert offers_let_through(Insists(), asked, Waits(set(), math.inf)) == ([], ASKED_LATER_S)

    @pytest.mark.parametrize(("clear", "offers"), [(6, [("alpha", 6)]), (7, [])])
    def test_an_allocator_is_asked_six_times_for_one_that_may_be_offered(
        self, clear: int, offers: list[tuple[str, int]]
    ) -> None:
        asked = situation([open_strip(strip(number, 100 * number)) for number in range(1, 9)], [helper()])
        assert offers_let_through(NearestAllocator(), asked, Waits({clear}, math.inf)) == (offers, ASKED_LATER_S)

    def test_a_helper_gives_its_task_back_only_where_the_way_to_the_other_is_clear(self) -> None:
        class TurnsRound:
            def assign(self, asked: object) -> dict[str, int]:
                return {"alpha": 1}

        busy = replace(helper(), task=self.far)
        asked = situation([self.near], [busy])
        assert offers_let_through(TurnsRound(), asked, Waits({1}, 0)) == ([("alpha", 1)], math.inf)
        assert offers_let_through(TurnsRound(), asked, Waits(set(), math.inf)) == ([], ASKED_LATER_S)


class TestDepartures:
    def wait_s(self, right: RightOfWay, fleet: list[KnownVehicle], to: Strip) -> float:
        departures = right.departures([Underway(one, None) for one in fleet], 0.0)
        return departures.wait_s(helper("helper"), open_strip(to))

    def test_towards_a_primary(self) -> None:
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 140)
        to = strip(1, 0, 20, length_m=100)
        assert self.wait_s(right_of_way(), [primary(200), me], to) == 0
        # Southwards over the strip it would meet the primary at about 40 s.
        assert self.wait_s(right_of_way(), [primary(0), me], to) > 0

    @pytest.mark.parametrize(("beside_m", "sets_out"), [(31.2, True), (30.8, False)])
    def test_a_way_that_is_offered_keeps_16_m_farther_off_than_the_separation(
        self, beside_m: float, sets_out: bool
    ) -> None:
        # It overtakes the primary, 0.5 m/s faster, 40 s from now.
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, -20)
        waits_s = self.wait_s(right_of_way(), [primary(-beside_m), me], strip(1, 0, 30, length_m=250))
        assert (waits_s == 0) is sets_out

    def test_a_helper_at_work_goes_on_to_its_next_from_where_and_when_it_is_free(self) -> None:
        # At 60 s, at its strip's end; told to leave it for another it sets out now, from where it is.
        me = known("helper", Role.REVISIT, Mode.REVISIT, 0, 20, 7)
        at_work, then = Underway(me, strip(7, 0, 20, length_m=100)), open_strip(strip(1, 0, 200))
        free = helper("helper", free_at=Pose(0, 125, NORTH), free_s=60)
        for one, start_s, y_m in ((free, 60.0, 125), (replace(free, task=then), 0.0, 20)):
            departures = right_of_way().departures([at_work], 0.0)
            assert departures.wait_s(one, then) == 0
            _, course, _ = departures.ways["helper", 1]
            assert course.start_s == start_s
            assert course.at(start_s) == pytest.approx((0, y_m, NORTH))

    def test_to_its_next_it_goes_without_waiting_or_not_at_all(self) -> None:
        # Over its next one it meets the primary, which is ahead of it, from 60 s on.
        to = strip(7, 0, 20, length_m=100)
        at_work = Underway(known("helper", Role.REVISIT, Mode.REVISIT, 0, 20, 7), to)
        free = helper("helper", free_at=Pose(0, 125, NORTH), free_s=60)
        for x_m, waits_s in ((0, math.inf), (200, 0)):
            departures = right_of_way().departures([Underway(primary(x_m, 100), None), at_work], 0.0)
            assert departures.wait_s(free, open_strip(strip(1, 0, 200))) == waits_s

    @pytest.mark.parametrize(("begin_m", "waits_s"), [(50, 30), (185, 30), (186, 0)])
    def test_a_sweep_that_begins_within_90_s_is_to_be_clear_to_its_end(self, begin_m: float, waits_s: float) -> None:
        # Eastwards, 5 m of run-in before the strip; the primary crosses at 300 m after 150 s, and 30 s later is clear.
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
        assert me.state is not None
        me.state = replace(me.state, heading_rad=math.pi / 2)
        east = strip(1, begin_m, 0, heading_rad=math.pi / 2, length_m=400)
        assert self.wait_s(right_of_way(), [primary(300, -225), me], east) == waits_s

    def test_who_is_let_through_is_in_the_others_way_until_all_are_judged_anew(self) -> None:
        # Northwards along x = 0, and eastwards across that at 150 m, both there after about 75 s.
        one, other = known("helper", Role.REVISIT, Mode.IDLE, 0, 0), known("second", Role.REVISIT, Mode.IDLE, -150, 150)
        north, east = open_strip(strip(1, 0, 50, length_m=250)), open_strip(strip(2, -60, 150, 200, math.pi / 2))
        departures = right_of_way().departures([Underway(one, None), Underway(other, None)], 0.0)
        assert departures.wait_s(helper("second"), east) == 0
        assert departures.wait_s(helper("helper"), north) > 0
        departures.begin()
        assert departures.wait_s(helper("helper"), north) == 0

    def test_a_free_helper_in_the_way_makes_room(self) -> None:
        right = right_of_way()
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
        other = known("second", Role.REVISIT, Mode.IDLE, 0, 60)
        fleet = [Underway(one, None) for one in (me, other)]
        departures = right.departures(fleet, 0.0)
        assert departures.wait_s(helper("helper"), open_strip(strip(1, 0, 50))) == 10
        (told,) = right.make_room(departures, fleet)
        assert (told.name, told.gives_back) == ("second", None)
        # It lies elsewhere once it is there, and the way is clear.
        assert told.place is not None
        other.state = AgentState(Mode.IDLE, 0, 1, 0, *told.place, NORTH)
        assert self.wait_s(right_of_way(), [me, other], strip(1, 0, 50)) == 0


class TestCheck:
    def test_a_free_helper_stands_aside_for_a_primary(self) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        right = right_of_way()
        (told,) = right.check(fleet, 0.0)
        assert (told.name, told.gives_back) == ("helper", None)
        assert told.place is not None
        its = right._traffic.course(fleet[0].vehicle, None, 0.0)
        mine = right._traffic.course(fleet[1].vehicle, None, 0.0)
        assert its is not None
        assert mine is not None
        assert too_close(mine, its, 15, 0, 180) is None

    @pytest.mark.parametrize("far_m", [52.5, 75.0])
    def test_the_place_is_three_and_a_half_times_the_separation_away_or_where_there_is_none_five_times(
        self, far_m: float
    ) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        (told,) = RightOfWay(15, lambda place: math.dist(place, (3, 90)) > far_m - 1).check(fleet, 0.0)
        assert told.place is not None
        assert math.dist(told.place, (3, 90)) == pytest.approx(far_m)

    def test_none_is_sent_dead_astern_as_it_may_turn_to_either_side(self) -> None:
        me = known("helper", Role.REVISIT, Mode.IDLE, 10, 90)
        assert me.state is not None
        me.state = replace(me.state, heading_rad=WEST)
        fleet = [Underway(primary(0), None), Underway(me, None)]
        (told,) = RightOfWay(15, lambda place: place[0] > 10).check(fleet, 0.0)
        assert told.place is not None
        assert abs(told.place[1] - 90) > 10
        assert RightOfWay(15, lambda place: place[0] > 10 and abs(place[1] - 90) < 1).check(fleet, 0.0) == []

    def test_one_that_is_far_does_not(self) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 200, 90), None)]
        assert right_of_way().check(fleet, 0.0) == []

    def test_who_does_something_else_is_checked_at_once(self) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 200, 90), None)]
        right = right_of_way()
        right.check(fleet, 100.0)
        assert right.check_s > 100
        right.changed("helper")
        assert right.check_s == 0

    def test_who_is_sent_to_a_strip_is_checked_at_once(self) -> None:
        one, far = known("helper", Role.REVISIT, Mode.IDLE, 200, 90), open_strip(strip(1, 200, 100))
        right, fleet = right_of_way(), [Underway(primary(0), None), Underway(one, None)]
        right.check(fleet, 0.0)
        assert right.check_s > 0
        departures = right.departures(fleet, 0.0)
        departures.wait_s(helper("helper"), far)
        right.offered("helper", 1, departures)
        assert right.check_s == 0

    @pytest.mark.parametrize("now_s", [0.0, 10.0])
    def test_two_are_checked_when_they_may_be_near_enough(self, now_s: float) -> None:
        # Heard 400 m apart at 0 s, closing at 2 and 1.5 m/s at most: one that is free stands aside for what is expected
        # within 90 s, 135 m of the primary's way and a circle of 12 m; one at work gives way 50 s before, 175 m.
        for strip_, near_m in ((None, 147.0), (strip(7, 400, 20, length_m=100), 175.0)):
            me = known("helper", Role.REVISIT, Mode.IDLE if strip_ is None else Mode.TRANSIT, 400, 0)
            right = right_of_way()
            assert right.check([Underway(primary(0), None), Underway(me, strip_)], now_s) == []
            assert right.check_s == pytest.approx((400 - near_m - 15 - 11) / 3.5)

    def test_from_when_they_were_heard(self) -> None:
        # At 10 s they are at least 400 m less 8 s and 6 s of their ways apart.
        one, me = primary(0), known("helper", Role.REVISIT, Mode.IDLE, 400, 0)
        one.heard_ms, me.heard_ms = 2000, 4000
        right = right_of_way()
        assert right.check([Underway(one, None), Underway(me, None)], 10.0) == []
        assert right.check_s == pytest.approx(10 + (400 - 8 * 1.5 - 6 * 2 - 147 - 15 - 11) / 3.5)

    def test_a_helper_at_work_gives_its_strip_back_to_a_primary(self) -> None:
        to = strip(7, 0, 20, length_m=100)
        at_work = known("helper", Role.REVISIT, Mode.TRANSIT, 0, 140, 7)
        (told,) = right_of_way().check([Underway(primary(0), None), Underway(at_work, to)], 0.0)
        assert (told.name, told.gives_back) == ("helper", to)

    def test_it_is_told_nothing_while_its_answer_to_an_offer_is_under_way(self) -> None:
        to = strip(7, 0, 20, length_m=100)
        idle = known("helper", Role.REVISIT, Mode.IDLE, 0, 140)
        assert right_of_way().check([Underway(primary(0), None), Underway(idle, to)], 0.0) == []
        (told,) = right_of_way().check([Underway(primary(0), None), Underway(idle, None)], 0.0)
        assert told.name == "helper"  # it is in the way

    def test_it_does_not_before_it_is_50_s_from_there_or_begins_to_sweep(self) -> None:
        # It is at the strip's northern end in about 60 s, and meets the primary on it some 14 s later.
        to = strip(7, 10, 60, length_m=100)
        at_work = known("helper", Role.REVISIT, Mode.TRANSIT, 120, 150, 7)
        fleet = [Underway(primary(0), None), Underway(at_work, to)]
        right = right_of_way()
        assert right.check(fleet, 0.0) == []
        its, mine = (right._traffic.course(one.vehicle, one.strip, 0.0) for one in fleet)
        assert its is not None
        assert mine is not None
        approach = too_close(mine, its, 15 + 11, 0, 200)
        assert approach is not None
        assert approach.time_s > 60

    def test_of_two_at_work_the_one_sent_later(self) -> None:
        right = right_of_way()
        first = known("helper", Role.REVISIT, Mode.IDLE, -60, 0)
        second = known("second", Role.REVISIT, Mode.IDLE, 60, 300)
        to = {"helper": replace(strip(1, 0, 60), width_m=40), "second": replace(strip(2, 0, 61), width_m=40)}
        for now_s, one in ((0.0, second), (1.0, first)):
            name = one.entry.vehicle
            departures = right.departures([Underway(one, None)], now_s)
            departures.wait_s(helper(name), open_strip(to[name]))
            right.offered(name, to[name].number, departures)
            assert one.state is not None
            one.state = replace(one.state, mode=Mode.TRANSIT, works_on=to[name].number)
        all_told = right.check([Underway(one, to[one.entry.vehicle]) for one in (first, second)], 1.0)
        assert [told.name for told in all_told] == ["helper"]
