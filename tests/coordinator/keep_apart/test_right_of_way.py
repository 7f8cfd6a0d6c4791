"""Who gives way: offers that wait, strips given back, helpers that stand aside."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import pytest
from by_hand import vehicle
from situations import helper, open_strip, situation, strip

from comms.said.announcement import Role
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.allocate.allocators import ASKED_LATER_S, Gate, offers_let_through
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.simple import GreedyAllocator, NearestAllocator
from coordinator.allocate.situation import Allocator, Helper, OpenStrip, Situation
from coordinator.keep_apart.courses import too_close
from coordinator.keep_apart.right_of_way import Instruction, RightOfWay, Underway
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
    """Lets these strips through, and the others only after so many seconds: as somebody at work is in the way, or, for
    some, somebody who is free."""

    def __init__(self, through: set[int], wait_s: float, for_free: Collection[int] = ()) -> None:
        self.through, self.seconds, self.for_free = through, wait_s, for_free
        self.blocked = set[tuple[str, int]]()

    def begin(self) -> None:
        self.blocked.clear()

    def wait_s(self, helper: Helper, one: OpenStrip) -> float:
        if one.strip.number in self.through:
            return 0.0
        if one.strip.number not in self.for_free:
            self.blocked.add((helper.vehicle, one.strip.number))
        return self.seconds


def let_through(
    allocator: Allocator, asked: Situation, gate: Gate, impatient: Sequence[str] = ()
) -> tuple[list[tuple[str, int]], float]:
    found = offers_let_through(allocator, asked, gate, impatient)
    return found.offers, found.again_s


class TestOffers:
    near, far = open_strip(strip(1, 0, 50)), open_strip(strip(2, 300, 50))

    @pytest.mark.parametrize("allocator", [GreedyAllocator(), NearestAllocator()])
    def test_another_strip_is_taken_where_one_must_wait_long(self, allocator: Allocator) -> None:
        asked = situation([self.near, self.far], [helper()])
        assert let_through(allocator, asked, Waits({1, 2}, 0)) == ([("alpha", 1)], math.inf)
        assert let_through(allocator, asked, Waits({2}, math.inf)) == ([("alpha", 2)], ASKED_LATER_S)

    def test_who_plans_routes_waits_for_the_near_one_unless_it_has_waited_for_long(self) -> None:
        # The far one is 200 s farther on.
        near, far = open_strip(strip(1, 0, 50)), open_strip(strip(2, 0, 650))
        asked, gate = situation([near, far], [helper()]), Waits({2}, math.inf)
        assert let_through(RoutesAllocator(), asked, gate) == ([], ASKED_LATER_S)
        assert let_through(RoutesAllocator(), asked, gate, ["beta"]) == ([], ASKED_LATER_S)
        assert let_through(RoutesAllocator(), asked, gate, ["alpha"]) == ([("alpha", 2)], ASKED_LATER_S)

    def test_while_it_goes_on_with_another_or_is_to_be_turned_round_it_takes_the_far_one(self) -> None:
        near, far = open_strip(strip(1, 0, 50)), open_strip(strip(2, 0, 650))
        asked = situation([near, far], [helper(free_s=30)])
        assert let_through(RoutesAllocator(), asked, Waits({2}, math.inf)) == ([("alpha", 2)], ASKED_LATER_S)

    @pytest.mark.parametrize("allocator", [GreedyAllocator(), NearestAllocator(), RoutesAllocator()])
    def test_who_has_waited_for_long_gets_the_one_way_that_is_clear_of_many(self, allocator: Allocator) -> None:
        asked = situation([open_strip(strip(number, 0, 50 * number)) for number in range(1, 10)], [helper()])
        assert let_through(allocator, asked, Waits({9}, 10.0)) == ([], 10.0)
        assert let_through(allocator, asked, Waits({9}, 10.0), ["alpha"]) == ([("alpha", 9)], 10.0)

    def test_for_who_is_free_it_goes_on_waiting_as_that_makes_room(self) -> None:
        asked = situation([self.near, self.far], [helper()])
        found = offers_let_through(GreedyAllocator(), asked, Waits(set(), 10.0, {1, 2}), ["alpha"])
        assert (found.offers, found.again_s, found.waiting) == ([], 10.0, frozenset())

    def test_it_is_told_who_waits_for_somebody_at_work(self) -> None:
        asked = situation([self.near, self.far], [helper(), helper("beta", x_m=300)])
        found = offers_let_through(NearestAllocator(), asked, Waits({2}, 10.0))
        assert found.offers == [("beta", 2)]
        assert found.waiting == {"alpha"}

    def test_an_offer_that_is_clear_soon_waits(self) -> None:
        asked = situation([self.near, self.far], [helper()])
        assert let_through(GreedyAllocator(), asked, Waits({2}, 10)) == ([], 10)

    def test_an_allocator_is_told_how_long_a_helper_must_wait_for_each_strip_that_it_gives_it(self) -> None:
        told = list[Mapping[int, float]]()

        class Takes:
            def assign(self, asked: Situation) -> dict[str, int]:
                told.append(asked.helpers[0].waits_s)
                return {"alpha": len(told)}

        asked = situation([open_strip(strip(number)) for number in (1, 2, 3)], [helper()])
        assert let_through(Takes(), asked, Waits({3}, 40)) == ([("alpha", 3)], ASKED_LATER_S)
        assert told == [{}, {1: 40}, {1: 40, 2: 40}]

    @pytest.mark.parametrize(("wait_s", "offers", "again_s"), [(10, [], 10), (60, [("alpha", 2)], ASKED_LATER_S)])
    def test_a_helper_waits_for_the_better_strip_unless_that_takes_too_long(
        self, wait_s: float, offers: list[tuple[str, int]], again_s: float
    ) -> None:
        # Done after 75 s and the wait the first removes 700 m2, the second 350 m2 after 50 s.
        better, soon = open_strip(strip(1, 0, 50, 100), 1000), open_strip(strip(2, 0, 50, 50), 500)
        asked = situation([better, soon], [helper()])
        assert let_through(GreedyAllocator(), asked, Waits({2}, wait_s)) == (offers, again_s)

    def test_an_allocator_that_takes_no_notice_of_waits_waits_but_not_for_long(self) -> None:
        class LowestFirst:
            def assign(self, asked: Situation) -> dict[str, int]:
                (alpha,) = asked.helpers
                return {"alpha": min(one.strip.number for one in asked.strips if one.strip.number not in alpha.refused)}

        asked = situation([open_strip(strip(number)) for number in (1, 2, 3)], [helper()])
        assert let_through(LowestFirst(), asked, Waits({3}, math.inf)) == ([("alpha", 3)], ASKED_LATER_S)
        assert let_through(LowestFirst(), asked, Waits({3}, 60)) == ([], ASKED_LATER_S)

    def test_an_allocator_that_insists_gets_nothing(self) -> None:
        class Insists:
            def assign(self, asked: object) -> dict[str, int]:
                return {"alpha": 1}

        asked = situation([self.near], [helper()])
        assert let_through(Insists(), asked, Waits(set(), math.inf)) == ([], ASKED_LATER_S)

    @pytest.mark.parametrize(("clear", "offers"), [(6, [("alpha", 6)]), (7, [])])
    def test_an_allocator_is_asked_six_times_for_one_that_may_be_offered(
        self, clear: int, offers: list[tuple[str, int]]
    ) -> None:
        asked = situation([open_strip(strip(number, 100 * number)) for number in range(1, 9)], [helper()])
        assert let_through(NearestAllocator(), asked, Waits({clear}, math.inf)) == (offers, ASKED_LATER_S)

    def test_a_helper_gives_its_task_back_only_where_the_way_to_the_other_is_clear(self) -> None:
        class TurnsRound:
            def assign(self, asked: object) -> dict[str, int]:
                return {"alpha": 1}

        busy = replace(helper(), task=self.far)
        asked = situation([self.near], [busy])
        assert let_through(TurnsRound(), asked, Waits({1}, 0)) == ([("alpha", 1)], math.inf)
        assert let_through(TurnsRound(), asked, Waits(set(), math.inf)) == ([], ASKED_LATER_S)


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
        # It is expected on the way that was found clear, though it has not answered yet.
        assert right._traffic.course(one, far.strip, 3.0) is departures.ways["helper", 1][1]

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


def busy_helper(x_m: float, y_m: float, name: str = "helper", number: int = 7) -> tuple[Underway, Strip]:
    """At work, heading north at 2 m/s straight to a strip that begins 10 m before it."""
    to = strip(number, x_m, y_m + 10, length_m=250)
    return Underway(known(name, Role.REVISIT, Mode.TRANSIT, x_m, y_m, number), to), to


def lying(x_m: float, y_m: float) -> Underway:
    """One whose battery is empty."""
    return Underway(known("empty", Role.REVISIT, Mode.EMPTY, x_m, y_m), None)


class TestWhoGivesWay:
    @pytest.mark.parametrize(
        ("role", "mode", "finished_ms", "gives_way"),
        [
            (Role.REVISIT, Mode.IDLE, None, True),
            (Role.REVISIT, None, None, True),
            (Role.REVISIT, Mode.RETURNING, None, False),
            (Role.SURVEY, Mode.FINISHED, 1000, False),
            (Role.SURVEY_REVISIT, Mode.SURVEY, None, False),
            (Role.SURVEY_REVISIT, Mode.FINISHED, 1000, True),
            (Role.SURVEY_REVISIT, Mode.RETURNING, 1000, False),
        ],
    )
    def test_who_can_be_told_to(self, role: Role, mode: Mode | None, finished_ms: int | None, gives_way: bool) -> None:
        one = KnownVehicle(vehicle("one", role), 0, finished_ms=finished_ms)
        one.state = None if mode is None else AgentState(mode, 0, 1, 0, 0, 0, NORTH)
        assert Underway(one, None).gives_way is gives_way

    def test_one_at_work_before_one_that_is_free_whatever_their_names(self) -> None:
        at_work, _ = busy_helper(0, 0, "zeta")
        free = Underway(known("alpha", Role.REVISIT, Mode.IDLE, 3, 100), None)
        (told,) = right_of_way().check([free, at_work], 0.0)
        assert (told.name, told.gives_back) == ("alpha", None)

    def test_who_was_sent_before_anybody_here_knows_of_goes_first(self) -> None:
        right = right_of_way()
        first, _ = busy_helper(0, 0, "zeta")
        to = strip(8, 50, 60, length_m=200, heading_rad=WEST)  # both are at (0, 60) after 30 s
        second = known("alpha", Role.REVISIT, Mode.TRANSIT, 60, 60, 8)
        assert second.state is not None
        second.state = replace(second.state, heading_rad=WEST)
        departures = right.departures([Underway(second, None)], 0.5)
        departures.wait_s(helper("alpha"), open_strip(to))
        right.offered("alpha", 8, departures)
        assert right.check([Underway(second, to), first], 0.5) == [Instruction("alpha", to, None)]

    def test_who_lies_at_home_is_in_nobody_s_way(self) -> None:
        at_work, _ = busy_helper(0, 0)
        assert right_of_way().check([at_work, Underway(known("home", Role.REVISIT, Mode.HOME, 0, 60), None)], 0.0) == []

    def test_who_is_lost_is_in_nobody_s_way(self) -> None:
        at_work, _ = busy_helper(0, 0)
        empty = lying(0, 60)
        empty.vehicle.lost = True
        assert right_of_way().check([at_work, empty], 0.0) == []

    @pytest.mark.parametrize("of", ["primary", "helper"])
    def test_who_was_never_heard_is_nowhere(self, of: str) -> None:
        one, me = primary(0), known("helper", Role.REVISIT, Mode.IDLE, 3, 60)
        (one if of == "primary" else me).state = None
        right = right_of_way()
        assert right.check([Underway(one, None), Underway(me, None)], 7.0) == []
        assert right.check_s == 97


class TestMargins:
    @pytest.mark.parametrize(("beside_m", "told"), [(25.9, True), (26.1, False)])
    def test_a_helper_at_work_gives_way_to_whom_it_would_come_nearer_than_11_m_and_the_separation(
        self, beside_m: float, told: bool
    ) -> None:
        at_work, to = busy_helper(0, 0)
        right = right_of_way()
        found = right.check([at_work, lying(beside_m, 60)], 0.0)
        assert found == ([Instruction("helper", to, None)] if told else [])
        assert right.check_s == 1  # what is near is looked at each second

    @pytest.mark.parametrize(("beside_m", "too_near"), [(18.9, True), (19.1, False)])
    def test_of_two_that_are_near_already_one_may_pass_4_m_farther_off_than_the_separation(
        self, beside_m: float, too_near: bool
    ) -> None:
        at_work, to = busy_helper(0, 0)
        empty = lying(beside_m, 12)  # passed after 6 s
        assert [one.gives_back for one in right_of_way().check([at_work, empty], 0.0)] == ([to] if too_near else [])
        me = Underway(known("helper", Role.REVISIT, Mode.IDLE, 0, 0), None)
        departures = right_of_way().departures([me, empty], 0.0)
        waits_s = departures.wait_s(helper("helper"), open_strip(strip(1, 0, 30, length_m=250)))
        assert waits_s == (math.inf if too_near else 0)

    @pytest.mark.parametrize(("now_s", "meets_s", "told"), [(0.0, 51.0, True), (1.0, 53.0, False)])
    def test_a_helper_at_work_looks_50_s_ahead(self, now_s: float, meets_s: float, told: bool) -> None:
        # To the first multiple of 2 s behind that.
        at_work, _ = busy_helper(0, 0)
        found = right_of_way().check([at_work, lying(0, 26 + 2 * meets_s)], now_s)
        assert [one.name for one in found] == (["helper"] if told else [])

    @pytest.mark.parametrize(("now_s", "meets_s", "told"), [(0.0, 91.0, True), (1.0, 93.0, False)])
    def test_a_helper_that_is_free_looks_90_s_ahead(self, now_s: float, meets_s: float, told: bool) -> None:
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 26 + 1.5 * meets_s)
        found = right_of_way().check([Underway(primary(0), None), Underway(me, None)], now_s)
        assert [one.name for one in found] == (["helper"] if told else [])

    @pytest.mark.parametrize(("now_s", "meets_s", "waits_s"), [(0.0, 61.0, 10), (1.0, 63.0, 0)])
    def test_one_that_is_free_needs_60_s_to_stand_aside(self, now_s: float, meets_s: float, waits_s: float) -> None:
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
        other = known("second", Role.REVISIT, Mode.IDLE, 0, 31 + 2 * (meets_s - now_s))
        departures = right_of_way().departures([Underway(one, None) for one in (me, other)], now_s)
        to = open_strip(strip(1, 0, 30, length_m=250))
        assert departures.wait_s(helper("helper"), to) == waits_s


class TestHowLongAnOfferWaits:
    @pytest.mark.parametrize(
        ("crosses_s", "waits_s"),
        [
            (133.9, 10),
            (134.4, 20),
            (143.9, 20),
            (144.4, 30),
            (153.9, 30),
            (154.4, 40),
            (163.9, 40),
            (164.4, 50),
            (173.9, 50),
            (174.4, 60),
            (175.7, 60),
            (176, 0),
        ],
    )
    def test_until_it_passes_25_8_s_behind_who_crosses_its_way(self, crosses_s: float, waits_s: float) -> None:
        # Eastwards at 2 m/s it is at the crossing after 150 s; 31 m is 25.8 s of that beside the primary's 1.5 m/s.
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
        assert me.state is not None
        me.state = replace(me.state, heading_rad=math.pi / 2)
        east = open_strip(strip(1, 50, 0, heading_rad=math.pi / 2, length_m=400))
        fleet = [Underway(me, None), Underway(primary(300, -1.5 * crosses_s), None)]
        assert right_of_way().departures(fleet, 0.0).wait_s(helper("helper"), east) == waits_s

    def test_what_it_meets_on_its_way_later_than_it_would_without_waiting_counts_too(self) -> None:
        # The primary is at the crossing after 75 s, 5 s before it; a sweep that begins after 90 s is no matter yet.
        me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
        assert me.state is not None
        me.state = replace(me.state, heading_rad=math.pi / 2)
        departures = right_of_way().departures([Underway(me, None), Underway(primary(160, -112.5), None)], 0.0)
        assert departures.wait_s(helper("helper"), open_strip(strip(1, 200, 0, 200, math.pi / 2))) == 30

    def test_one_that_waits_is_in_nobody_s_way(self) -> None:
        me, other = known("helper", Role.REVISIT, Mode.IDLE, 0, 0), known("second", Role.REVISIT, Mode.IDLE, 150, -150)
        assert me.state is not None
        me.state = replace(me.state, heading_rad=math.pi / 2)
        fleet = [Underway(one, None) for one in (me, other, primary(300, -225))]
        departures = right_of_way().departures(fleet, 0.0)
        assert departures.wait_s(helper("helper"), open_strip(strip(1, 50, 0, 400, math.pi / 2))) == 30
        assert departures.wait_s(helper("second"), open_strip(strip(2, 150, -100))) == 0

    def test_one_that_sets_out_is_in_the_way_as_one_at_work_is(self) -> None:
        # Both are at the crossing after 75 s: 31 m is 21.9 s of either's way.
        one, other = known("helper", Role.REVISIT, Mode.IDLE, 0, 0), known("second", Role.REVISIT, Mode.IDLE, -150, 150)
        assert other.state is not None
        other.state = replace(other.state, heading_rad=math.pi / 2)
        departures = right_of_way().departures([Underway(one, None), Underway(other, None)], 0.0)
        assert departures.wait_s(helper("second"), open_strip(strip(2, -60, 150, 200, math.pi / 2))) == 0
        assert departures.wait_s(helper("helper"), open_strip(strip(1, 0, 50, length_m=250))) == 30

    def test_of_who_is_lost_nothing_is_known_but_of_those_behind_it(self) -> None:
        lost, me = known("aaa", Role.REVISIT, Mode.IDLE, 0, 40), known("helper", Role.REVISIT, Mode.IDLE, 0, 140)
        lost.lost = True
        to = open_strip(strip(1, 0, 20, length_m=100))
        for other, waits in ((primary(0), True), (primary(200), False)):
            fleet = [Underway(one, None) for one in (lost, me, other)]
            assert (right_of_way().departures(fleet, 0.0).wait_s(helper("helper"), to) > 0) is waits

    @pytest.mark.parametrize(("begin_m", "meets_s", "clear"), [(46, 71.0, False), (48, 73.0, True)])
    def test_a_way_is_clear_20_s_beyond_its_end(self, begin_m: float, meets_s: float, clear: bool) -> None:
        # It has seen all after 50.5 or 51.5 s and then circles; 20 s later, at most to the next multiple of 2 s, it is
        # as near as it may be to one that lies where it then is headed.
        me = Underway(known("helper", Role.REVISIT, Mode.IDLE, 0, 0), None)
        to = open_strip(strip(1, 0, begin_m, length_m=50))
        alone = right_of_way().departures([me], 0.0)
        assert alone.wait_s(helper("helper"), to) == 0
        _, course, _ = alone.ways["helper", 1]
        assert course.arrives_s == (begin_m + 55) / 2
        there = course.at(meets_s)
        survey = known("primary", Role.SURVEY, Mode.SURVEY, there.x_m, 0, 1, expected_end_ms=round(meets_s * 1000))
        south = (there.x_m, there.y_m + 231.0, there.x_m, there.y_m + 31.0)
        survey.plan = Plan(1, (PlannedTrack(1, 0, *south, False),), (), (), "")
        departures = right_of_way().departures([me, Underway(survey, None)], 0.0)
        assert (departures.wait_s(helper("helper"), to) == 0) is clear

    def test_who_was_in_the_way_is_not_when_all_are_judged_anew(self) -> None:
        places = {"helper": 0, "second": 60}
        fleet = [Underway(known(name, Role.REVISIT, Mode.IDLE, 0, y_m), None) for name, y_m in places.items()]
        right = right_of_way()
        departures = right.departures(fleet, 0.0)
        assert departures.wait_s(helper("helper"), open_strip(strip(1, 0, 50))) == 10
        departures.begin()
        assert right.make_room(departures, fleet) == []

    def test_only_who_is_free_makes_room(self) -> None:
        right, second = right_of_way(), known("second", Role.REVISIT, Mode.IDLE, 0, 60)
        fleet = [Underway(known("helper", Role.REVISIT, Mode.IDLE, 0, 0), None), Underway(second, None)]
        departures = right.departures(fleet, 0.0)
        departures.wait_s(helper("helper"), open_strip(strip(1, 0, 50)))
        second.state = AgentState(Mode.TRANSIT, 2, 1, 0, 0, 60, NORTH)
        offered_since = [fleet[0], Underway(second, strip(2, 0, 300))]
        assert right.make_room(departures, offered_since) == []


class TestWhatIsTold:
    def test_the_first_place_that_is_clear_for_three_minutes(self) -> None:
        # 30 m aside a circle of 6 m leads back to within 31 m of the primary's track; 52.5 m to the north-east not.
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        (told,) = right_of_way().check(fleet, 0.0)
        assert told.place == pytest.approx((3 + 52.5 * math.sqrt(0.5), 90 + 52.5 * math.sqrt(0.5)))

    @pytest.mark.parametrize("number", [0, 1, 2, 3, 5, 6, 7])
    def test_each_eighth_of_a_circle_but_astern_is_tried(self, number: int) -> None:
        x_m = 20 if number < 4 else -20
        there = (x_m + 75 * math.sin(number * math.pi / 4), 90 + 75 * math.cos(number * math.pi / 4))
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, x_m, 90), None)]
        (told,) = RightOfWay(15, lambda place: math.dist(place, there) < 1).check(fleet, 0.0)
        assert told.place == pytest.approx(there)

    def test_a_place_that_is_clear_for_two_minutes_is_not_taken_if_one_is_for_three(self) -> None:
        # 75 m ahead the primary is near after some 125 s.
        fleet = [Underway(primary(0, -60), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        ahead, beside = (3.0, 165.0), (78.0, 90.0)
        both = RightOfWay(15, lambda place: min(math.dist(place, ahead), math.dist(place, beside)) < 1)
        one = RightOfWay(15, lambda place: math.dist(place, ahead) < 1)
        assert both.check(fleet, 0.0)[0].place == pytest.approx(beside)
        assert one.check(fleet, 0.0)[0].place == pytest.approx(ahead)

    def test_one_that_is_clear_for_three_minutes_and_no_longer_is_taken(self) -> None:
        # 150 m ahead the primary is near after some 183 s.
        fleet = [Underway(primary(0, -86), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        places = ((3, 240), (153, 90))
        right = RightOfWay(30, lambda place: min(math.dist(place, one) for one in places) < 1)
        (told,) = right.check(fleet, 0.0)
        assert told.place == pytest.approx((3, 240))

    def test_or_else_for_one_minute(self) -> None:
        # Ahead all lies on the primary's track: it comes to 30 m ahead after some 95 s, in three minutes beyond all.
        fleet = [Underway(primary(0, -60), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        (told,) = RightOfWay(15, lambda place: abs(place[0] - 3) < 1).check(fleet, 0.0)
        assert told.place == pytest.approx((3, 120))

    def test_a_helper_at_work_stands_aside_where_it_cannot_stay(self) -> None:
        # It circles where it is if that is clear for a minute; the primary is near after (y - 26) / 1.5 s.
        for y_m, stays in ((70, False), (140, True)):
            to = strip(7, 0, 20, length_m=100)
            at_work = known("helper", Role.REVISIT, Mode.TRANSIT, 0, y_m, 7)
            right, fleet = right_of_way(), [Underway(primary(0), None), Underway(at_work, to)]
            (told,) = right.check(fleet, 0.0)
            assert told.gives_back == to
            assert (told.place is None) is stays
            if told.place is not None:  # and is expected there
                course = right._traffic.course(at_work, None, 0.0)
                assert course is not None
                assert course.at(course.arrives_s)[:2] == pytest.approx(told.place, abs=0.01)

    def test_it_is_told_again_after_10_s(self) -> None:
        at_work, _ = busy_helper(0, 90)
        right = right_of_way()
        for now_s, told in ((5.0, 1), (14.9, 0), (15.0, 1)):
            right.changed("helper")
            assert len(right.check([lying(0, 150), at_work], now_s)) == told

    def test_who_stands_aside_is_sent_elsewhere_after_10_s(self) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        right = right_of_way()
        (told,) = right.check(fleet, 0.0)
        assert told.place is not None
        fleet.append(lying(told.place[0] + 20, told.place[1]))
        for now_s, times in ((9.9, 0), (10.0, 1)):
            right.changed("helper")
            assert len(right.check(fleet, now_s)) == times

    def test_or_sooner_once_where_who_comes_into_its_way_does_something_else_since_then(self) -> None:
        fleet = [Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)]
        right = right_of_way()
        right.changed("primary")  # before it is told anything
        (told,) = right.check(fleet, 0.0)
        assert told.place is not None
        fleet.append(lying(told.place[0] + 20, told.place[1]))
        for changed, now_s, times in (("helper", 1.0, 0), ("primary", 2.0, 0), (fleet[-1].name, 3.0, 1)):
            right.changed(changed)
            again = right.check(fleet, now_s)
            assert len(again) == times
        assert again[0].place is not None
        fleet[-1] = lying(again[0].place[0] + 20, again[0].place[1])
        assert right.check(fleet, 4.0) == []

    def test_where_it_has_nowhere_to_go_that_is_said_once_of_each_two(self, caplog: pytest.LogCaptureFixture) -> None:
        caplog.set_level("DEBUG", "secondlook.coordinator")
        right = RightOfWay(15, lambda place: False)
        fleet = [
            *(Underway(primary(0), None), Underway(known("helper", Role.REVISIT, Mode.IDLE, 3, 90), None)),
            Underway(known("second", Role.REVISIT, Mode.IDLE, -3, 90), None),
        ]
        for now_s in (0.0, 1.0, 2.0):
            assert right.check(fleet, now_s) == []
        assert [one.getMessage() for one in caplog.records] == [
            f"{name} will come within 3 m of primary at 42 s and has nowhere to go (said once)"
            for name in ("helper", "second")
        ]

    def test_in_a_large_fleet_each_two_are_looked_at_by_themselves(self) -> None:
        far = [Underway(known(f"far-{n}", Role.REVISIT, Mode.IDLE, 0, 5000 + 400 * n), None) for n in range(12)]
        near = Underway(known("near", Role.REVISIT, Mode.IDLE, 3, 90), None)
        right = right_of_way()
        assert right.check([Underway(primary(0, 4000), None), *far, near], 0.0) == []
        fleet = [*far, near, Underway(primary(0), None)]
        assert right.check(fleet, 1.0) == []  # not to be looked at yet
        right.changed("far-3")
        assert right.check(fleet, 2.0) == []
        right.changed("primary")
        assert [told.name for told in right.check(fleet, 3.0)] == ["near"]


class TestWhenItIsChecked:
    def test_first_at_once(self) -> None:
        assert right_of_way().check_s == 0

    def test_two_that_may_just_now_be_near_enough_are_looked_at_and_then_a_second_later(self) -> None:
        # 135 m of the primary's way, a circle of 12 m, and 26 m.
        me = known("helper", Role.REVISIT, Mode.IDLE, 173, 0)
        right = right_of_way()
        assert right.check([Underway(primary(0), None), Underway(me, None)], 0.0) == []
        assert right.check_s == 1

    def test_where_nobody_gives_way_a_minute_and_a_half_later(self) -> None:
        right = right_of_way()
        assert right.check([Underway(primary(0), None)], 30.0) == []
        assert right.check_s == 120

    def test_two_that_are_near_each_second_and_no_sooner(self) -> None:
        at_work, _ = busy_helper(0, 0)
        empty, right = lying(200, 60), right_of_way()
        assert right.check([at_work, empty], 10.0) == []
        assert right.check_s == 11
        at_work, _ = busy_helper(180, 0)
        assert right.check([at_work, empty], 10.9) == []
        assert len(right.check([at_work, empty], 11.0)) == 1

    def test_all_of_a_sweep_50_s_before_it_begins(self) -> None:
        # It begins after 60 s and is at its end, where it then circles, after 215 s; 3 s before it is 26 m from who
        # lies behind that, or not.
        for x_m, told in ((0, ["helper"]), (60, [])):
            me = known("helper", Role.REVISIT, Mode.IDLE, 0, 0)
            to, right, empty = strip(7, 0, 125, length_m=300), right_of_way(), lying(x_m, 451)
            departures = right.departures([Underway(me, None)], 0.0)
            assert departures.wait_s(helper("helper"), open_strip(to)) == 0
            assert departures.sweeps_s["helper", 7] == pytest.approx(60)
            right.offered("helper", 7, departures)
            me.state = AgentState(Mode.TRANSIT, 7, 1, 0, 0, 0, NORTH)
            fleet = [Underway(me, to), empty]
            assert right.check(fleet, 0.0) == []
            assert right.check_s == pytest.approx(10)
            assert right.check(fleet, 9.9) == []
            assert [one.name for one in right.check(fleet, 10.0)] == told
            assert right.check_s > 10.9  # once
            right.changed("helper")
            assert right.check(fleet, 21.0) == []

    def test_what_is_said_of_one_concerns_no_other_two(self) -> None:
        right = right_of_way()
        at_work, _ = busy_helper(0, 0)
        fleet = [at_work, lying(200, 60)]
        right.check(fleet, 10.0)
        right.changed("somebody")
        assert right.check_s == 0
        near = [busy_helper(180, 0)[0], fleet[1]]
        assert right.check(near, 10.5) == []
        right.changed("empty")
        assert len(right.check(near, 10.5)) == 1
