"""As many strips as there is time for: what a metre costs, by hand, and when strips stay where they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from looks_worth import worth_of

from coordinator.cut import cutter
from coordinator.cut.cutter import Cutter, Flown, FlownRoutes
from coordinator.cut.ground import OBJECTIVES, Ground
from coordinator.cut.laying import Laid, Laying
from coordinator.cut.legs import Flier
from coordinator.cut.strips import Counted, Cut, CuttingRules
from coordinator.cut.window import Window
from planner.types import FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 120, 60)  # twelve swaths of 300 m
RULES = CuttingRules(swath_m=50, overhead_m=100, min_strip_m=30, max_strip_m=400)
STRIP_M = 300 + 100
LOOK = 0.5
LEAST = 0.1 * LOOK * 25  # what a look at 0.1 removes of a cell


def ground(risk: FloatArray, objective: str = "mean") -> Ground:
    return Ground(
        risk=risk,
        look=np.full(GRID.shape, LOOK),
        weights=np.full(GRID.shape, 25.0),
        is_seen=np.ones(GRID.shape, dtype=np.bool_),
        objective=OBJECTIVES[objective],
        threshold=0.0,
    )


def lanes(*risks: float) -> FloatArray:
    """A map of lanes a swath wide with these risks, and nothing beside them."""
    risk = np.zeros(GRID.shape)
    for number, value in enumerate(risks):
        risk[:, 10 * number : 10 * number + 10] = value
    return risk


def lane(number: int) -> Window:
    return Window(0, 60, 10 * number, 10 * number + 10)


TWELVE = lanes(*np.linspace(0.95, 0.4, 12).tolist())


def windows(cuts: list[Cut]) -> list[Window]:
    return [one.window for one in cuts]


def best_in(time_m: float, *, across: bool = False) -> Flown:
    """Helpers that fly the best strips first as long as there is time, and only those of one heading."""

    def flown(cuts: Sequence[Counted]) -> Mapping[int, float]:
        shares, metres = {}, 0.0
        for place in sorted(range(len(cuts)), key=lambda one: -cuts[one].counts_m2 / length_m(cuts[one])):
            share = min(1.0, (time_m - metres) / length_m(cuts[place]))
            if cuts[place].window.across == across and share > 0:
                shares[place] = share
                metres += share * length_m(cuts[place])
        return shares

    return each(flown)


def each(flown: Callable[[Sequence[Counted]], Mapping[int, float]]) -> Flown:
    """What helpers fly of each choice of strips, as of one by itself."""
    return lambda choices: [FlownRoutes(flown(cuts), ()) for cuts in choices]


def length_m(one: Counted) -> float:
    return one.window.cells_long * 5 + 100


def cut(
    cutter: Cutter, told: Ground, time_m: float, claimed: Sequence[Window] = (), opened: Sequence[Window] = ()
) -> list[Cut]:
    """By helpers that fly along the tracks alone."""
    return cutter.cut(told, time_m, claimed, opened, best_in(time_m))


def price(cutter: Cutter) -> float:
    """Of a metre flown along the tracks."""
    return cutter._ways[0].price


class TestTime:
    @pytest.mark.parametrize("strips", [1, 3, 5])
    def test_so_many_are_cut_as_there_is_time_for_and_a_few_more_the_best_first(self, strips: int) -> None:
        cuts = cut(Cutter(GRID, RULES, LEAST, across=True), ground(TWELVE), (strips - 0.5) * STRIP_M, (), ())
        assert strips + 4 <= len(cuts) < 12
        assert windows(cuts) == [lane(number) for number in range(len(cuts))]

    @pytest.mark.parametrize(("strips", "count"), [(0.5, 5), (1.0, 5), (1.25, 6), (3.0, 7)])
    def test_four_are_to_spare_where_each_is_worth_far_less_than_the_one_before(
        self, strips: float, count: int
    ) -> None:
        told = replace(ground(lanes(*(0.95 / 1.5**number for number in range(12)))), look=np.ones(GRID.shape))
        cuts = cut(Cutter(GRID, RULES, 1e-3 * 25), told, strips * STRIP_M)
        assert windows(cuts) == [lane(number) for number in range(count)]

    def test_where_there_is_hardly_any_time_there_is_all_the_same(self) -> None:
        assert windows(cut(Cutter(GRID, RULES, LEAST), ground(TWELVE), 0.5))[0] == lane(0)

    def test_what_is_just_enough_is_enough(self) -> None:
        # There is time for two: of the six that are worth much four are to spare, and none of those worth less.
        rich_and_poor = ground(lanes(*[0.9] * 6, *[0.7] * 6))
        cuts = cut(Cutter(GRID, RULES, LEAST), rich_and_poor, 2.0 * STRIP_M, (), ())
        assert set(windows(cuts)) == {lane(number) for number in range(6)}

    @pytest.mark.parametrize("time_m", [40 * STRIP_M, math.inf])
    def test_where_there_is_time_for_all_all_are_cut_at_the_least_price(self, time_m: float) -> None:
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        assert set(windows(cut(cutter, ground(TWELVE), time_m, (), ()))) == {lane(number) for number in range(12)}
        assert price(cutter) == pytest.approx(0.1 * LOOK * 50)

    def test_what_is_worth_less_than_the_least_is_not_cut_whatever_time_there_is(self) -> None:
        # A strip of 300 m costs 400 m at 0.1 of a swath: what a look at 0.133 brings along it.
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        assert windows(cut(cutter, ground(lanes(0.13, 0.0, 0.14)), math.inf, (), ())) == [lane(2)]

    def test_without_time_nothing_is_cut(self) -> None:
        assert cut(Cutter(GRID, RULES, LEAST, across=True), ground(TWELVE), 0.0, (), ()) == []

    def test_without_time_what_is_open_is_left_as_it_is_also_where_it_pays_no_more(self) -> None:
        assert windows(cut(Cutter(GRID, RULES, LEAST), ground(lanes(0.05)), 0.0, (), [lane(0)])) == [lane(0)]

    def test_strips_along_the_tracks_are_cut_also_where_nobody_is_there_who_might_fly_them_yet(self) -> None:
        cuts = Cutter(GRID, RULES, LEAST, across=True).cut(ground(lanes(0.9)), math.inf, (), (), each(lambda cuts: {}))
        assert windows(cuts) == [lane(0)]

    def test_where_nothing_is_to_be_looked_at_nothing_is_cut(self) -> None:
        assert cut(Cutter(GRID, RULES, LEAST, across=True), ground(lanes()), math.inf, (), ()) == []

    @pytest.mark.parametrize("strips", [2.5, 3.0])
    def test_the_price_rises_where_time_is_short_and_falls_again_never_below_the_least(self, strips: float) -> None:
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        least = price(cutter)
        cut(cutter, ground(TWELVE), strips * STRIP_M, (), ())
        # Three strips are worth more than 400 m at this, and at 1.2 times as much they are not three.
        of_third, step = 0.85 * LOOK * 50 * 300 / STRIP_M, 1.2
        assert of_third / step <= price(cutter) < of_third
        dear = price(cutter)
        cut(cutter, ground(TWELVE), 6.5 * STRIP_M, (), ())
        assert least < price(cutter) < dear
        cut(cutter, ground(TWELVE), math.inf, (), ())
        assert price(cutter) == least

    @pytest.mark.parametrize("objective", sorted(OBJECTIVES))
    def test_the_first_cut_finds_the_price_however_far_it_lies_above_the_least(self, objective: str) -> None:
        cutter = Cutter(GRID, RULES, 1e-3 * 25, across=True)
        first = cut(cutter, ground(TWELVE, objective), 1.5 * STRIP_M, (), ())
        found = price(cutter)
        assert cut(cutter, ground(TWELVE, objective), 1.5 * STRIP_M, (), ()) == first
        assert price(cutter) == found > 100 * 1e-3 * 50

    def test_a_place_is_cut_once_until_it_has_had_its_look_and_again_where_all_is_to_be_planned(self) -> None:
        told = ground(lanes(0.9))
        assert windows(cut(Cutter(GRID, RULES, LEAST), told, math.inf)) == [lane(0)]
        flown = best_in(math.inf)
        many = Cutter(GRID, RULES, LEAST).cut(told, math.inf, (), (), flown, again=True)
        # At 0.9, 0.45 and 0.225 a look is worth its 400 m, at 0.1125 it is not: they cost as much as 0.133 bring.
        assert windows(many) == [lane(0)] * 3
        assert [one.counts_m2 for one in many] == pytest.approx([600 * 25 * LOOK * risk for risk in (0.9, 0.45, 0.225)])

    def test_the_price_is_that_of_the_last_look_that_there_is_time_for(self) -> None:
        cutter = Cutter(GRID, RULES, 1e-3 * 25)
        cut(cutter, ground(lanes(0.9)), 2.5 * STRIP_M)
        of_third, step = 0.225 * LOOK * 50 * 300 / STRIP_M, 1.2
        assert of_third / step <= price(cutter) < of_third

    @pytest.mark.parametrize("least", [1e-3, 1.2e-3])
    def test_where_there_is_just_so_much_time_the_price_is_that_of_the_last_look_too(self, least: float) -> None:
        cutter = Cutter(GRID, RULES, least * 25)
        cut(cutter, ground(lanes(0.9)), 3 * STRIP_M)
        of_third, step = 0.225 * LOOK * 50 * 300 / STRIP_M, 1.2
        assert of_third / step <= price(cutter) < of_third

    def test_where_time_is_short_two_side_by_side_are_cut_where_there_is_time_for_two(self) -> None:
        # Ten columns of 0.9, and six and four of 0.6 beside them: the best strip lies on the 0.9, but two bring more.
        risk = lanes()
        risk[:, 10:30] = np.repeat([0.6, 0.9, 0.6], [6, 10, 4])
        one, two = (
            windows(cut(Cutter(GRID, RULES, LEAST, across=True), ground(risk), n * STRIP_M, (), ())) for n in (0.9, 1.9)
        )
        assert one[0] == Window(0, 60, 16, 26)
        assert set(two[:2]) == {Window(0, 60, 10, 20), Window(0, 60, 20, 30)}


class TestWhatIsTold:
    def test_what_a_strip_brings(self) -> None:
        told = ground(lanes(0.8), "both")
        told.weights[:] *= 2.0
        (found,) = cut(Cutter(GRID, RULES, LEAST, across=True), told, math.inf, (), ())
        # 600 cells of 25 m2, of which a look removes 0.4; that counts twice, 0.7 for the mean and 0.3 / 0.3 for the
        # worst.
        assert found.removable_m2 == pytest.approx(600 * 25 * 0.4)
        assert found.counts_m2 == pytest.approx(2 * (0.7 + 0.3 / 0.3) * 600 * 25 * 0.4)

    def test_foreseen_is_what_is_for_the_most_part_not_seen_yet(self) -> None:
        told = ground(lanes(0.8, 0.8, 0.8))
        told.is_seen[29:, :10] = False  # 31 rows of 60
        told.is_seen[31:, 10:20] = False  # 29 rows
        told.is_seen[30:, 20:] = False  # a half
        cuts = cut(Cutter(GRID, RULES, LEAST, across=True), told, math.inf, (), ())
        assert {one.window: one.foreseen for one in cuts} == {lane(0): True, lane(1): False, lane(2): False}

    def test_the_ground_is_left_as_it_is(self) -> None:
        told = ground(TWELVE.copy())
        cut(Cutter(GRID, RULES, LEAST, across=True), told, math.inf, [lane(0)], [lane(1)])
        assert (told.risk == TWELVE).all()

    def test_from_where_on_a_cell_is_of_the_worst_is_asked_after_what_there_is_time_for(self) -> None:
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        risk = lanes(0.9, 0.9, 0.9, 0.9, *[0.6] * 6, 0.5, 0.5)
        assert cutter.threshold == 0.0
        cut(cutter, ground(risk), 0.0, (), ())
        assert cutter.threshold == pytest.approx(0.9)  # four of twelve
        cut(cutter, ground(risk), 1.5 * STRIP_M, (), ())
        assert cutter.threshold == pytest.approx(0.6)  # three of twelve
        cut(cutter, ground(risk), 1.5 * STRIP_M, [lane(1), lane(2)], ())
        assert cutter.threshold == pytest.approx(0.6)
        cut(cutter, ground(risk), 7.5 * STRIP_M, [lane(1), lane(2)], ())
        # All but 0.6, 0.5 and 0.5 have been flown; the next is what is left of 0.9.
        assert cutter.threshold == pytest.approx(0.45)


class TestHeading:
    ALL_HOT = ground(np.where(np.arange(60)[:, np.newaxis] < 20, 0.9, np.zeros(GRID.shape)))  # 100 m by 600 m

    @pytest.mark.parametrize("across", [False, True])
    def test_strips_are_cut_as_helpers_leave_least_by_them(self, across: bool) -> None:
        cuts = Cutter(GRID, RULES, LEAST, across=True).cut(
            self.ALL_HOT, 2 * STRIP_M, (), (), best_in(2 * STRIP_M, across=across)
        )
        assert {one.window.across for one in cuts} == {across}

    def test_those_across_a_band_are_one_swath_wide_and_as_long_as_allowed(self) -> None:
        cuts = Cutter(GRID, RULES, LEAST, across=True).cut(
            self.ALL_HOT, math.inf, (), (), best_in(math.inf, across=True)
        )
        pieces = {Window(row, row + 10, column, column + 60, across=True) for row in (0, 10) for column in (0, 60)}
        assert set(windows(cuts)) == pieces

    @pytest.mark.parametrize("weight", [1.0, 1e-4])
    def test_they_turn_only_where_that_is_better_by_a_margin_whatever_a_cell_counts(self, weight: float) -> None:
        def helpers_that_fly(along: float, across: float) -> Flown:
            """So much of every strip, of those at one place of the first."""

            def flown(cuts: Sequence[Counted]) -> Mapping[int, float]:
                first = {one.window: place for place, one in reversed(list(enumerate(cuts)))}
                return {place: across if window.across else along for window, place in first.items()}

            return each(flown)

        # Twelve strips of 100 m along, four of 300 m across: a look at all takes 27,000 m2, and a metre, with 100 m on
        # the way to each strip, costs 2.5 m2 at least. So 21,000 and 23,000 m2 are gained by flying all.
        even = 0.5 * 21 / 23
        cutter = Cutter(GRID, RULES, LEAST * weight, across=True)
        told = replace(self.ALL_HOT, weights=self.ALL_HOT.weights * weight)
        opened = windows(cutter.cut(told, math.inf, (), (), helpers_that_fly(0.5, 0.3)))
        assert not opened[0].across
        assert windows(cutter.cut(told, math.inf, (), opened, helpers_that_fly(0.5, even * 1.024))) == opened
        opened = windows(cutter.cut(told, math.inf, (), opened, helpers_that_fly(0.5, even * 1.027)))
        assert opened[0].across
        assert windows(cutter.cut(told, math.inf, (), opened, helpers_that_fly(0.5 * 1.024, even))) == opened
        assert not cutter.cut(told, math.inf, (), opened, helpers_that_fly(0.5 * 1.027, even))[0].window.across

    def test_the_other_heading_may_be_tried_in_some_of_the_cuts_alone(self) -> None:
        cutter, told = Cutter(GRID, RULES, LEAST, across=True, turns_each=3), self.ALL_HOT
        along, across = best_in(2 * STRIP_M), best_in(2 * STRIP_M, across=True)
        opened = windows(cutter.cut(told, 2 * STRIP_M, (), (), along))
        for tried in (False, False, True):
            opened = windows(cutter.cut(told, 2 * STRIP_M, (), opened, across))
            assert opened
            assert {one.across for one in opened} == {tried}
        # Where none is open it is tried at once.
        for flown in (across, along):
            first = cutter.cut(told, 2 * STRIP_M, (), (), flown)[0]
            assert first.window.across == (flown is across)

    def test_if_not_told_otherwise_none_lies_across_and_else_either_heading_is_tried_each_time(self) -> None:
        along, across = best_in(2 * STRIP_M), best_in(2 * STRIP_M, across=True)
        cuts = Cutter(GRID, RULES, LEAST).cut(self.ALL_HOT, 2 * STRIP_M, (), (), across)
        assert {one.window.across for one in cuts} == {False}
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        opened = windows(cutter.cut(self.ALL_HOT, 2 * STRIP_M, (), (), along))
        assert cutter.cut(self.ALL_HOT, 2 * STRIP_M, (), opened, across)[0].window.across

    def test_every_other_cut_may_try_it(self) -> None:
        cutter = Cutter(GRID, RULES, LEAST, across=True, turns_each=2)
        opened = windows(cutter.cut(self.ALL_HOT, 2 * STRIP_M, (), (), best_in(2 * STRIP_M)))
        for tried in (False, True):
            cuts = cutter.cut(self.ALL_HOT, 2 * STRIP_M, (), opened, best_in(2 * STRIP_M, across=True))
            assert {one.window.across for one in cuts} == {tried}


class TestLaying:
    ALONE = Flier(-50.0, -50.0, 0.0, 0.0, 1000.0, 2.0, 10.0, 20.0, 0.0)

    @staticmethod
    def flies(*routes: Sequence[int]) -> Flown:
        """Helpers with these routes over any choice, as far as it has such strips, all of them flown to the end."""

        def flown(cuts: Sequence[Counted]) -> FlownRoutes:
            there = [[place for place in route if place < len(cuts)] for route in routes]
            return FlownRoutes({place: 1.0 for route in there for place in route}, there)

        return lambda choices: [flown(cuts) for cuts in choices]

    @pytest.mark.parametrize(("better", "takes"), [(cutter.LAID_FOR, False), (cutter.LAID_FOR + 1e-4, True)])
    def test_strips_lie_as_they_are_laid_where_that_is_better_by_enough_and_behind_them_those_to_spare(
        self, better: float, takes: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        asked = list[tuple[Any, ...]]()
        aside = Window(0, 60, 12, 22)

        half = Window(0, 30, 12, 22)

        def laid(_: Laying, *given: Any) -> Laid:
            asked.append(given)
            return Laid([aside.in_blocks(2)], [half.in_blocks(2)], better)

        monkeypatch.setattr(Laying, "laid", laid)
        of_three, told = Cutter(GRID, RULES, LEAST), ground(lanes(0.9, 0.8, 0.7))
        cuts = of_three.cut(told, math.inf, (), (), self.flies([1]), [self.ALONE])
        assert windows(cuts) == ([aside, lane(0), lane(2)] if takes else [lane(0), lane(1), lane(2)])
        (on, routes, others, fliers, seed), *_ = asked
        assert (routes, fliers) == ([[lane(1).in_blocks(2)]], [self.ALONE])
        assert {lane(number).in_blocks(2) for number in range(3)} <= set(others)
        assert on.threshold == pytest.approx(0.9)  # of the worst when its route is flown
        of_three.cut(told, math.inf, (), (), self.flies([1]), [self.ALONE])
        assert asked[1][-1] != seed

    def test_nothing_is_laid_without_fliers_or_where_nothing_is_cut(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def laid(*_: Any) -> None:
            raise AssertionError("asked for")

        monkeypatch.setattr(Laying, "laid", laid)
        assert windows(Cutter(GRID, RULES, LEAST).cut(ground(lanes(0.9)), math.inf, (), (), self.flies([0])))
        flown = self.flies([])
        assert Cutter(GRID, RULES, LEAST).cut(ground(lanes()), math.inf, (), (), flown, [self.ALONE]) == []


class TestClaimed:
    def test_what_is_with_a_vehicle_counts_as_flown(self) -> None:
        # What a look leaves of 0.9 is 0.45: worth one more, after 0.6 and 0.5.
        risk = lanes(0.9, 0.6, 0.5)
        cuts = cut(Cutter(GRID, RULES, LEAST, across=True), ground(risk), 2.5 * STRIP_M, [lane(0)], ())
        assert windows(cuts) == [lane(1), lane(2), lane(0)]
        assert cuts[2].removable_m2 == pytest.approx(600 * 25 * 0.45 * LOOK)

    def test_what_is_claimed_in_part_is_worth_the_rest(self) -> None:
        (found,) = cut(
            Cutter(GRID, RULES, LEAST, across=True), ground(lanes(0.9)), math.inf, [Window(0, 30, 0, 10)], ()
        )
        assert found.window == lane(0)
        assert found.counts_m2 == pytest.approx(600 * 25 * (0.9 + 0.45) / 2 * LOOK)


class TestOpenStrips:
    def test_they_stay_where_what_is_cut_anew_is_hardly_better(self) -> None:
        # Eight columns of 0.9 are worth 5400 m2, the metres flown for them 1000: 22 m2 more are half a hundredth.
        opened = Window(0, 60, 2, 12)  # two columns aside, on which there is hardly anything
        for beside, stays in ((0.014, opened), (0.015, lane(0))):  # 1500 m2 of it, of which a look takes half
            risk = lanes(0.9)
            risk[:, 0:2] = beside
            cuts = cut(Cutter(GRID, RULES, LEAST, across=True), ground(risk), STRIP_M, (), [opened])
            assert windows(cuts) == [stays]

    def test_they_are_cut_anew_where_that_is_better(self) -> None:
        opened = Window(0, 60, 2, 12)  # brings eight tenths of what the lane does
        assert windows(cut(Cutter(GRID, RULES, LEAST, across=True), ground(lanes(0.9)), math.inf, (), [opened])) == [
            lane(0)
        ]

    def test_what_they_bring_is_told_anew(self) -> None:
        (found,) = cut(Cutter(GRID, RULES, LEAST, across=True), ground(lanes(0.7)), math.inf, (), [lane(0)])
        assert found.window == lane(0)
        assert found.removable_m2 == pytest.approx(600 * 25 * 0.35)

    def test_they_do_not_stay_where_there_is_time_for_more(self) -> None:
        cuts = cut(Cutter(GRID, RULES, LEAST, across=True), ground(lanes(0.9, 0.89)), math.inf, (), [lane(0)])
        assert windows(cuts) == [lane(0), lane(1)]

    def test_they_are_dropped_where_they_pay_no_more(self) -> None:
        assert cut(Cutter(GRID, RULES, LEAST, across=True), ground(lanes(0.05)), math.inf, (), [lane(0)]) == []
        # A look at 0.125 takes 937.5 m2 of a lane, just as much as 400 m cost at 2.34375 m2 each.
        assert cut(Cutter(GRID, RULES, 2.34375 * 25 / 50), ground(lanes(0.125)), math.inf, (), [lane(0)]) == []
        cuts = cut(Cutter(GRID, RULES, 2.34 * 25 / 50), ground(lanes(0.125)), math.inf, (), [lane(0)])
        assert windows(cuts) == [lane(0)]

    def test_one_that_is_dropped_takes_nothing_from_those_that_lie_on_it(self) -> None:
        # 0.133 over a swath pays. The first has 0.13. The other has 0.16 alone, and 0.1 if the first were flown before;
        # cut anew it would lie two columns aside, for what is hardly more.
        risk = lanes(0.0)
        risk[:, 6:8], risk[:, 8:10], risk[:, 10:18] = 0.0501, 0.6, 0.05
        first, other = lane(0), Window(0, 60, 8, 18)
        cutter = Cutter(GRID, RULES, LEAST)
        assert windows(cut(cutter, ground(risk), math.inf)) == [Window(0, 60, 6, 16)]
        assert windows(cut(cutter, ground(risk), math.inf, (), [first, other])) == [other]

    def test_cutting_again_changes_nothing(self) -> None:
        cutter = Cutter(GRID, RULES, LEAST, across=True)
        first = cut(cutter, ground(TWELVE), 3.5 * STRIP_M, (), ())
        assert cut(cutter, ground(TWELVE), 3.5 * STRIP_M, (), windows(first)) == first


@settings(max_examples=40, deadline=None)
@given(
    risks=st.lists(st.sampled_from([0.0, 0.2, 0.5, 0.8, 1.0]), min_size=12, max_size=12),
    strips=st.sampled_from([0.0, 0.5, 2.0, 6.0, math.inf]),
    claimed=st.lists(st.integers(0, 11), max_size=3, unique=True),
    objective=st.sampled_from(sorted(OBJECTIVES)),
)
def test_each_tells_what_those_before_it_and_those_that_are_claimed_leave(
    risks: list[float], strips: float, claimed: list[int], objective: str
) -> None:
    left = ground(lanes(*risks), objective)
    cutter = Cutter(GRID, RULES, LEAST, across=True)
    cuts = cut(cutter, left, strips * STRIP_M, [lane(number) for number in claimed], ())
    for number in claimed:
        left.fly(lane(number))
    for one in cuts:
        assert one.counts_m2 == pytest.approx(worth_of(left)[one.window.cells].sum())
        assert one.removable_m2 == pytest.approx(left.risk[one.window.cells].sum() * LOOK * 25)
        assert one.counts_m2 > LEAST / 25 * 50 * (one.window.rows * 5 + 100)  # 50 m a swath
        left.fly(one.window)


class TestBlocks:
    """Cells of 1 m: 40 of them make a swath, and eight by eight are taken together."""

    FINE = GridSpec(SweepFrame(0, 0, 0), 1, 160, 200)
    RULES = CuttingRules(swath_m=40, overhead_m=20, min_strip_m=16, max_strip_m=400)

    def found(self, risk: FloatArray, rules: CuttingRules = RULES, time_m: float = math.inf) -> list[Window]:
        rows, columns = risk.shape
        told = Ground(
            risk=risk,
            look=np.full(risk.shape, LOOK),
            weights=np.ones(risk.shape),
            is_seen=np.ones(risk.shape, dtype=np.bool_),
            objective=OBJECTIVES["mean"],
            threshold=0.0,
        )
        grid = replace(self.FINE, rows=rows, columns=columns)
        return windows(
            Cutter(grid, rules, 1e-3).cut(told, time_m, (), (), each(lambda cuts: dict.fromkeys(range(len(cuts)), 1.0)))
        )

    @pytest.mark.parametrize(("width", "block"), [(1, 1), (5, 1), (9, 1), (10, 2), (20, 4), (23, 1), (40, 8), (41, 1)])
    def test_as_many_are_taken_together_as_divide_a_swath_into_five_or_more(self, width: int, block: int) -> None:
        risk = np.zeros((4 * width, width))  # what is hot is a cell: found as the block that it is in
        risk[2 * width + 1, 0] = 1.0
        rules = CuttingRules(swath_m=width, overhead_m=0, min_strip_m=1, max_strip_m=400)
        (window,) = self.found(risk, rules)
        assert (window.rows, window.columns_wide) == (block, width)
        assert window.first_row <= 2 * width + 1 < window.end_row

    @settings(max_examples=40, deadline=None)
    @given(
        bands=st.lists(
            st.tuples(st.integers(0, 3), st.integers(0, 20), st.integers(3, 10), st.sampled_from([0.6, 0.8, 1.0])),
            max_size=4,
            unique_by=lambda one: one[0],
        )
    )
    def test_what_lies_on_blocks_is_cut_as_it_is_by_the_cell(self, bands: list[tuple[int, int, int, float]]) -> None:
        risk = np.zeros(self.FINE.shape)
        for place, first, rows, value in bands:
            risk[8 * first : 8 * min(first + rows, 25), 40 * place : 40 * (place + 1)] = value
        by_blocks = self.found(risk)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(cutter, "BLOCKS_A_SWATH", 41)  # none has so many
            by_cells = self.found(risk)
        assert set(by_blocks) == set(by_cells)

    def test_the_last_blocks_end_where_the_grid_does(self) -> None:
        found = self.found(np.ones((198, 158)))
        assert {(one.first_row, one.end_row) for one in found} == {(0, 198)}
        assert max(one.end_column for one in found) == 158
