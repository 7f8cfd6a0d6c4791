"""Cutting windows at a price: by hand on small grids, and what holds for every map; and of the bands that lie side by
side, by hand, and against every choice there is."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from looks_worth import worth_of

from coordinator.cut.ground import OBJECTIVES, Ground, _in_blocks
from coordinator.cut.search import (
    SPARE_STRIPS,
    STEP,
    Costs,
    Counts,
    Left,
    _at,
    _edges,
    _side_by_side,
    _sum,
    fly_each,
    look_anew,
    windows_for,
)
from coordinator.cut.search import cut as cut_windows
from coordinator.cut.strips import Cutting, CuttingRules
from coordinator.cut.window import Window
from planner.types import FloatArray, GridSpec, SweepFrame

EAST = SweepFrame(0, 0, 0)
GRID = GridSpec(EAST, 5, 40, 60)  # 200 m across, 300 m along
RULES = CuttingRules(swath_m=50, overhead_m=40, min_strip_m=30, max_strip_m=400)
LOOK = 0.7
PRICE = 0.25 * LOOK * 50  # a metre costs what a look removes of 0.25 over its swath: a row 2.5 cells of 1, a way 20


def hot(*windows: tuple[slice, slice], risk: float = 1.0) -> FloatArray:
    """A map with this risk in these windows, 0 elsewhere."""
    values = np.zeros(GRID.shape)
    for window in windows:
        values[window] = risk
    return values


def ground(
    risk: FloatArray,
    grid: GridSpec = GRID,
    look: float = LOOK,
    objective: str = "mean",
    contacts: FloatArray | None = None,
) -> Ground:
    return Ground(
        risk=risk.copy(),
        look=np.full(grid.shape, look),
        weights=np.full(grid.shape, float(grid.cell_area_m2)),
        is_seen=np.ones(grid.shape, dtype=np.bool_),
        objective=OBJECTIVES[objective],
        threshold=0.4,
        contacts=None if contacts is None else contacts.copy(),
    )


def at_price(cutting: Cutting, price: float) -> list[Window]:
    """What is cut at a price, and no less."""
    return cutting.cut(price, price, math.inf)[0]


def cut(risk: FloatArray, rules: CuttingRules = RULES, price: float = PRICE, look: float = LOOK) -> list[Window]:
    """Where a first look is worth its price."""
    return list(dict.fromkeys(at_price(Cutting(GRID, ground(risk, look=look), rules), price)))


class TestByHand:
    def test_a_band_narrower_than_the_swath_gives_one_strip_centred_on_it(self) -> None:
        # 4 columns about 16.5; the swath has 10 columns: 12 to 21.
        assert cut(hot(np.s_[10:40, 15:19])) == [Window(10, 40, 12, 22)]

    @pytest.mark.parametrize(("columns", "first"), [(slice(0, 4), 0), (slice(36, 40), 30), (slice(15, 20), 12)])
    def test_a_strip_stays_on_the_grid_and_is_centred_to_half_a_cell(self, columns: slice, first: int) -> None:
        assert [one.first_column for one in cut(hot((slice(10, 40), columns)))] == [first]

    def test_two_bands_give_two_strips_the_worse_one_first(self) -> None:
        risk = hot(np.s_[10:40, 2:8]) + hot(np.s_[5:25, 25:31], risk=0.9)
        assert cut(risk) == [Window(10, 40, 0, 10), Window(5, 25, 23, 33)]

    def test_a_band_two_swaths_wide_gives_two_strips_side_by_side(self) -> None:
        assert set(cut(hot(np.s_[10:40, 7:27]))) == {Window(10, 40, 7, 17), Window(10, 40, 17, 27)}

    def test_two_strips_side_by_side_are_better_than_the_best_one_unless_they_are_dear(self) -> None:
        # Five columns each of 0.6, 0.9, 0.9, 0.6: one strip on the 0.9, or two of 0.75 side by side. Full rows: 60 in
        # length and 8 for the way. If a row costs 0.4, that is 54 - 27.2 or 2 * (45 - 27.2); if 0.6, 54 - 40.8 or
        # 2 * (45 - 40.8).
        risk = hot(np.s_[:, 10:15], np.s_[:, 25:30], risk=0.6) + hot(np.s_[:, 15:25], risk=0.9)
        cheap, dear = (cut(risk, price=of_full * LOOK * 50) for of_full in (0.4, 0.6))
        assert set(cheap) == {Window(0, 60, 10, 20), Window(0, 60, 20, 30)}
        assert dear == [Window(0, 60, 15, 25)]

    def test_a_band_as_long_as_the_area_is_split_into_equal_pieces(self) -> None:
        windows = cut(hot(np.s_[:, 15:19]), replace(RULES, max_strip_m=110, overhead_m=10))
        assert windows == [Window(first, first + 20, 12, 22) for first in (0, 20, 40)]

    @pytest.mark.parametrize(
        ("rows", "pieces"),
        [
            (25, [(0, 20)]),  # 125 m: 100 m, and 25 m left out
            (35, [(0, 20)]),
            (36, [(0, 18), (18, 36)]),
        ],
    )
    def test_a_piece_is_never_shorter_than_a_strip_may_be(self, rows: int, pieces: list[tuple[int, int]]) -> None:
        windows = cut(hot(np.s_[0:rows, 10:20]), replace(RULES, min_strip_m=90, max_strip_m=100))
        assert windows == [Window(*piece, 10, 20) for piece in pieces]

    def test_what_is_too_short_is_left_out(self) -> None:
        full = hot(np.s_[10:15, 10:20])
        assert cut(full, replace(RULES, overhead_m=1)) == []
        assert cut(full, replace(RULES, overhead_m=1, min_strip_m=25)) == [Window(10, 15, 10, 20)]

    def test_what_does_not_pay_for_the_way_there_is_left_out(self) -> None:
        # A row of 4 of 10 columns brings 0.4 of a full row and costs 0.25: 0.15 a row. 40 m cost 8 rows of 0.25.
        assert cut(hot(np.s_[10:23, 15:19])) == []  # 13 rows: 1.95
        assert len(cut(hot(np.s_[10:24, 15:19]))) == 1  # 14 rows: 2.1

    def test_each_piece_of_a_band_pays_for_its_own_way(self) -> None:
        # The whole brings 0.15 * 60 = 9, less 2 for the way; a piece of 12 rows 1.8, less 2.
        assert len(cut(hot(np.s_[:, 15:19]))) == 1
        assert cut(hot(np.s_[:, 15:19]), replace(RULES, max_strip_m=60)) == []

    def test_a_piece_that_brings_just_what_it_costs_is_left_out(self) -> None:
        # Pieces of 20 rows; the second brings 3.5 a row and costs 2.5, 20 in all, which is what the way to it costs.
        rules = replace(RULES, max_strip_m=100)
        assert cut(hot(np.s_[:20, 10:20]) + hot(np.s_[20:40, 10:20], risk=0.35), rules) == [Window(0, 20, 10, 20)]
        assert len(cut(hot(np.s_[:20, 10:20]) + hot(np.s_[20:40, 10:20], risk=0.3501), rules)) == 2

    def test_a_row_less_hot_than_it_costs_is_flown_only_on_the_way(self) -> None:
        # Five empty rows cost 1.25 between two runs that bring 0.75 a row.
        assert cut(hot(np.s_[5:20, 10:20], np.s_[25:40, 10:20])) == [Window(5, 40, 10, 20)]
        far = cut(hot(np.s_[0:10, 10:20], np.s_[50:60, 10:20]))  # 40 rows cost 10, a run brings 7.5
        assert set(far) == {Window(0, 10, 10, 20), Window(50, 60, 10, 20)}

    def test_ground_that_counts_more_comes_first(self) -> None:
        told = ground(hot(np.s_[10:40, 2:12], risk=0.8) + hot(np.s_[10:40, 25:35], risk=0.5))
        told.weights[:, 20:] *= 2.0
        assert list(dict.fromkeys(one.first_column for one in at_price(Cutting(GRID, told, RULES), PRICE))) == [25, 2]

    def test_where_a_look_takes_more_comes_first(self) -> None:
        told = ground(hot(np.s_[10:40, 2:12], np.s_[10:40, 25:35]))
        told.look[:, :20] = 0.5
        assert list(dict.fromkeys(one.first_column for one in at_price(Cutting(GRID, told, RULES), PRICE))) == [25, 2]

    def test_for_the_worst_only_what_is_above_the_threshold_is_cut(self) -> None:
        told = ground(hot(np.s_[:, 2:12], risk=0.4) + hot(np.s_[:, 25:35], risk=0.9), objective="worst30")
        assert at_price(Cutting(GRID, told, RULES), PRICE) == [Window(0, 60, 25, 35)]

    def test_nothing_hot_gives_nothing(self) -> None:
        assert cut(np.zeros(GRID.shape)) == []
        assert cut(np.full(GRID.shape, 0.25)) == []  # worth as much as it costs

    def test_a_band_a_swath_and_a_half_wide_gives_a_second_strip_over_the_rest(self) -> None:
        # On five columns a row brings 5 and costs 2.5; the strip beside is moved to their middle, over the other one.
        assert cut(hot(np.s_[10:40, 10:25])) == [Window(10, 40, 15, 25), Window(10, 40, 7, 17)]

    def test_a_place_is_cut_again_where_it_is_worth_another_look_after_that(self) -> None:
        # A poor look takes 20 m2 a metre, then 12 and 7.2; strips of 150 m cost 190 m at 9 m2, which is 11.4 a metre.
        told = ground(hot(np.s_[10:40, 10:20]), look=0.4)
        assert at_price(Cutting(GRID, told, RULES), 9.0) == [Window(10, 40, 10, 20)] * 2

    def test_the_swath_is_never_wider_than_the_sensor_sees(self) -> None:
        grid = GridSpec(EAST, 3.4, 40, 60)
        windows = at_price(Cutting(grid, ground(np.ones(grid.shape), grid), RULES), PRICE)
        assert {one.columns_wide for one in windows} == {14}  # 47.6 m; 15 would be 51 m

    def test_an_area_narrower_than_the_swath_is_cut_as_it_is(self) -> None:
        grid = GridSpec(EAST, 5, 6, 60)
        assert at_price(Cutting(grid, ground(np.ones(grid.shape), grid), RULES), PRICE) == [Window(0, 60, 0, 6)]

    def test_objects_are_worth_a_look_from_the_side_that_counts_and_once(self) -> None:
        # A strip of 95 m costs 135 m at 8.75 m2, which is 1181; along the tracks ten objects count 1300, across 1100.
        contacts = np.zeros((2, *GRID.shape))
        contacts[0, 20:40:2, 15], contacts[1, 20, 15:35:2] = 130, 110
        told = ground(np.zeros(GRID.shape), contacts=contacts)
        assert at_price(Cutting(GRID, told, RULES), PRICE) == [Window(20, 39, 10, 20)]
        assert at_price(Cutting(GRID, told, RULES, across=True), PRICE) == []
        assert at_price(Cutting(GRID, told, RULES, across=True), 0.9 * PRICE) == [Window(15, 25, 15, 34, across=True)]
        assert np.array_equal(told.contacts, contacts)  # type: ignore[arg-type]


class TestLengths:
    @pytest.mark.parametrize(
        ("band", "pieces"),
        [
            ((7, 10), [(7, 10)]),
            ((7, 12), [(7, 12)]),  # as long as a strip may be
            ((7, 13), [(7, 10), (10, 13)]),
            ((7, 18), [(7, 11), (11, 14), (14, 18)]),
            ((7, 9), []),  # too short
            ((0, 6), [(0, 3), (3, 6)]),
        ],
    )
    def test_a_band_is_cut_into_as_few_equal_pieces_of_3_to_5_rows_as_there_may_be(
        self, band: tuple[int, int], pieces: list[tuple[int, int]]
    ) -> None:
        assert pieces_of(*band, 3, 5) == pieces

    def test_where_equal_ones_would_be_too_short_into_the_longest(self) -> None:
        assert pieces_of(10, 25, 4, 5) == [(10, 15), (15, 20), (20, 25)]
        assert pieces_of(10, 21, 4, 5) == [(10, 15), (15, 20)]
        assert pieces_of(10, 26, 4, 5) == [(10, 14), (14, 18), (18, 22), (22, 26)]

    @pytest.mark.parametrize(("min_strip_m", "rows"), [(5, 1), (2, 1), (7, 1), (8, 2), (12, 2), (13, 3)])
    def test_the_least_length_is_rounded_to_whole_cells_and_at_least_one(self, min_strip_m: float, rows: int) -> None:
        rules = replace(RULES, overhead_m=1, min_strip_m=min_strip_m)
        for hot_rows in range(1, 5):
            found = cut(hot(np.s_[10 : 10 + hot_rows, 10:20]), rules)
            assert found == ([Window(10, 10 + hot_rows, 10, 20)] if hot_rows >= rows else [])

    def test_where_the_most_is_less_than_the_least_all_are_as_long_as_that(self) -> None:
        assert cut(hot(np.s_[10:16, 10:20]), replace(RULES, overhead_m=1, max_strip_m=5)) == [Window(10, 16, 10, 20)]

    def test_as_many_are_cut_as_there_are_cells_six_times(self) -> None:
        grid = GridSpec(EAST, 5, 10, 10)
        told = ground(np.ones(grid.shape), grid, look=0.1)
        rules = CuttingRules(swath_m=5, overhead_m=1, min_strip_m=5, max_strip_m=5)
        found = at_price(Cutting(grid, told, rules), 0.01)
        assert len(found) == 600
        assert len({*found}) == 100

    def test_a_place_is_cut_six_times_at_most(self) -> None:
        told = ground(hot(np.s_[10:40, 10:20]), look=0.1)
        assert at_price(Cutting(GRID, told, RULES), 0.1) == [Window(10, 40, 10, 20)] * 6


def pieces_of(first: int, end: int, shortest: int, longest: int) -> list[tuple[int, int]]:
    return [*pairwise(_edges(first, end, shortest, longest).tolist())]


SMALL = GridSpec(EAST, 5, 9, 8)
risks = arrays.arrays(np.float64, SMALL.shape, elements=st.sampled_from([0.0, 0.0, 0.2, 0.5, 0.9, 1.0]))
objects = st.none() | arrays.arrays(np.float64, (2, *SMALL.shape), elements=st.sampled_from([0.0, 0.0, 0.0, 3.0, 20.0]))
rules_of_all_kinds = st.builds(
    CuttingRules,
    swath_m=st.sampled_from([5.0, 15.0, 20.0]),
    overhead_m=st.sampled_from([0.0, 5.0, 20.0]),
    min_strip_m=st.sampled_from([5.0, 10.0, 15.0]),
    max_strip_m=st.sampled_from([15.0, 20.0, 400.0]),
)


@settings(max_examples=200, deadline=None)
@given(
    risk=risks,
    rules=rules_of_all_kinds,
    look=st.sampled_from([0.3, 0.7, 0.95]),
    price=st.sampled_from([0.2, 1.0, 3.0]),
    objective=st.sampled_from(sorted(OBJECTIVES)),
)
def test_windows_lie_on_the_grid_are_as_long_as_allowed_lie_apart_and_pay_for_themselves(
    risk: FloatArray, rules: CuttingRules, look: float, price: float, objective: str
) -> None:
    told = ground(risk, SMALL, look, objective)
    worth = worth_of(told)
    found: list[Window] = []
    for window in at_price(Cutting(SMALL, told, rules), price):
        assert 0 <= window.first_row < window.end_row <= SMALL.rows
        assert 0 <= window.first_column < window.end_column <= SMALL.columns
        assert window.columns_wide == round(rules.swath_m / SMALL.cell_m)
        assert rules.min_strip_m <= window.rows * SMALL.cell_m <= rules.max_strip_m
        if not window.is_at_one_of(found):  # else it is worth another look by what that leaves
            assert worth[window.cells].sum() > price * (window.rows * SMALL.cell_m + rules.overhead_m)
        found.append(window)
    assert (told.risk == risk).all()  # the ground that is asked of is left as it is


@settings(max_examples=60, deadline=None)
@given(
    risk=risks,
    contacts=objects,
    rules=rules_of_all_kinds,
    prices=st.lists(st.sampled_from([0.2, 0.5, 1.0, 3.0]), min_size=1, max_size=4),
    objective=st.sampled_from(sorted(OBJECTIVES)),
    across=st.booleans(),
)
def test_what_is_cut_further_is_cut_as_of_the_ground_as_it_was_left(
    risk: FloatArray,
    contacts: FloatArray | None,
    rules: CuttingRules,
    prices: list[float],
    objective: str,
    across: bool,
) -> None:
    left = ground(risk, SMALL, objective=objective, contacts=contacts)
    cutting = Cutting(SMALL, left, rules, across=across)
    for price in prices:
        new = Cutting(SMALL, left, rules, across=across)
        for known, anew in zip(cutting._left[:6], new._left[:6], strict=True):
            assert (known == anew).all()  # to the last bit
        lies = left.turned if across else left
        assert (cutting._left.worth == worth_of(lies)).all()
        width = lies.risk.shape[1] - len(cutting._left.sums) + 1
        sums = [worth_of(lies)[:, first : first + width].sum(axis=1) for first in range(len(cutting._left.sums))]
        assert cutting._left.sums == pytest.approx(np.array(sums))
        found = at_price(new, price)
        cutting._left.is_known[:] = False
        again = cut_windows(cutting._left, cutting._counts, _at(price, cutting._metres)).tolist()
        assert [Window(*each) for each in again] == [one.turned if across else one for one in found]
        for window in found:
            left.fly(window)


@settings(max_examples=100, deadline=None)
@given(
    risk=risks,
    contacts=objects,
    rules=rules_of_all_kinds,
    last_price=st.sampled_from([0.2, 0.3, 1.0, 5.0, 50.0]),
    time_m=st.sampled_from([1.0, 40.0, 100.0, 300.0, math.inf]),
    across=st.booleans(),
)
def test_for_some_time_they_are_cut_at_the_price_at_which_they_are_so_many_and_then_some_to_spare(
    risk: FloatArray,
    contacts: FloatArray | None,
    rules: CuttingRules,
    last_price: float,
    time_m: float,
    across: bool,
) -> None:
    least = 0.2

    def left_at(price: float) -> tuple[Cutting, list[Window]]:
        left = Cutting(SMALL, ground(risk, SMALL, contacts=contacts), rules, across=across)
        return left, further(left, price)

    def further(left: Cutting, price: float) -> list[Window]:
        left._left.is_known[:] = False
        found = cut_windows(left._left, left._counts, _at(price, left._metres)).tolist()
        return [Window(*each).turned if across else Window(*each) for each in found]

    def metres(windows: list[Window]) -> float:
        return sum(rules.metres_flown(one.cells_long * SMALL.cell_m) for one in windows)

    price = last_price
    while metres(left_at(price)[1]) < time_m and price > least:
        price = max(least, price / STEP)
    while metres(left_at(price)[1]) >= time_m and metres(left_at(price * STEP)[1]) >= time_m:
        price *= STEP
    left, expected = left_at(price)
    spare = price
    while metres(expected) < time_m + SPARE_STRIPS * metres(expected) / max(1, len(expected)) and spare > least:
        spare = max(least, spare / STEP**2)
        expected += further(left, spare)

    cutting = Cutting(SMALL, ground(risk, SMALL, contacts=contacts), rules, across=across)
    before = [array.tolist() for array in cutting._left]
    assert cutting.cut(last_price, least, time_m) == (expected, price)
    assert [array.tolist() for array in cutting._left] == before  # what is cut is a copy


@settings(max_examples=60, deadline=None)
@given(risk=risks, rules=rules_of_all_kinds, price=st.sampled_from([0.2, 1.0, 3.0]))
def test_across_the_tracks_they_are_cut_as_along_them_on_the_map_turned(
    risk: FloatArray, rules: CuttingRules, price: float
) -> None:
    told = ground(risk, SMALL)
    turned = GridSpec(SMALL.frame, SMALL.cell_m, SMALL.rows, SMALL.columns)
    across = at_price(Cutting(SMALL, told, rules, across=True), price)
    assert [one.turned for one in across] == at_price(Cutting(turned, ground(risk.T.copy(), turned), rules), price)
    assert all(one.across for one in across)
    assert (told.risk == risk).all()


class Bands:
    """Windows of so many columns side by side, on a map of what looks bring that may change."""

    def __init__(self, worth: FloatArray, width: int) -> None:
        windows = worth.shape[1] - width + 1
        self.left = Left(
            risk=worth.copy(),
            look=np.ones(worth.shape),
            weights=np.ones(worth.shape),
            contacts=np.zeros(worth.shape),
            worth=np.full(worth.shape, np.nan),
            sums=np.full((windows, len(worth)), np.nan),
            first_row=np.zeros(windows, dtype=np.int64),
            end_row=np.zeros(windows, dtype=np.int64),
            value=np.full(windows, np.nan),
            is_known=np.ones(windows, dtype=np.bool_),
        )
        self.change(worth, Window(0, len(worth), 0, worth.shape[1]))

    def change(self, worth: FloatArray, window: Window) -> None:
        """From now on looks bring this, which is something else at cells of the window alone."""
        self.left.risk[:] = worth
        look_anew(self.left, Counts(1.0, 0.0, 0.0), *window.bounds)

    def side_by_side(self, row_cost: float, fixed_cost: float) -> list[Window]:
        found = np.empty((self.left.risk.size, 4), dtype=np.int64)
        count = _side_by_side(self.left, self.costs(row_cost, fixed_cost), found, 0)
        return [Window(*each) for each in found[:count].tolist()]

    def costs(self, row_cost: float, fixed_cost: float) -> Costs:
        """As many rows as there are make one strip."""
        return Costs(row_cost, fixed_cost, 1, len(self.left.risk))


def side_by_side(worth: FloatArray, width: int, row_cost: float, fixed_cost: float) -> list[Window]:
    return Bands(worth, width).side_by_side(row_cost, fixed_cost)


class TestSideBySide:
    ROWS = np.array([[3.0, 6.0, 6.5, 4.0]]).repeat(2, axis=0)  # windows of 2 columns bring 18, 25, 21

    def test_two_side_by_side_bring_more_than_the_best_and_what_that_leaves(self) -> None:
        # The best, columns 1 and 2, leaves a column of 3 and one of 4. The better of the two comes first.
        assert side_by_side(self.ROWS, 2, 2.0, 3.0) == [Window(0, 2, 2, 4), Window(0, 2, 0, 2)]
        assert side_by_side(self.ROWS[:, ::-1], 2, 2.0, 3.0) == [Window(0, 2, 0, 2), Window(0, 2, 2, 4)]

    def test_what_costs_more_is_left_out(self) -> None:
        # A row costs 2, a strip 3. Four times as much: 25 - 16 - 12 < 0. Three times: 18 - 12 - 9 < 0, 21 - 12 - 9 = 0,
        # 25 - 12 - 9 = 4, so the one in the middle. Twice: 18 - 8 - 6 and 21 - 8 - 6 = 11 in all, 25 - 8 - 6 = 11 too;
        # a little less than twice, and the two are better.
        assert side_by_side(self.ROWS, 2, 8.0, 12.0) == []
        assert side_by_side(self.ROWS, 2, 6.0, 9.0) == [Window(0, 2, 1, 3)]
        assert side_by_side(self.ROWS, 2, 3.8, 5.7) == [Window(0, 2, 2, 4), Window(0, 2, 0, 2)]

    def test_a_band_reaches_over_poor_rows_where_going_on_brings_more_than_it_costs(self) -> None:
        worth = np.array([[9.0], [9.0], [0.0], [9.0]])  # less 3 a row: 6, 6, -3, 6
        assert side_by_side(worth, 1, 3.0, 0.0) == [Window(0, 4, 0, 1)]
        assert side_by_side(worth, 1, 5.0, 0.0) == [Window(0, 2, 0, 1)]  # 4, 4, -5, 4

    def test_of_bands_that_bring_as_much_it_is_that_which_begins_and_ends_first(self) -> None:
        assert side_by_side(np.array([[1.0], [3.0], [5.0]]), 1, 3.0, 0.0) == [Window(1, 3, 0, 1)]  # less 3: -2, 0, 2
        assert side_by_side(np.array([[5.0], [3.0], [1.0]]), 1, 3.0, 0.0) == [Window(0, 1, 0, 1)]
        assert side_by_side(np.array([[5.0], [0.0], [6.0], [3.0]]), 1, 3.0, 0.0) == [Window(2, 3, 0, 1)]  # 2, -3, 3, 0

    def test_one_is_moved_over_what_another_holds(self) -> None:
        worth = np.array([[5.0, 5.0, 1.0, 0.0]])
        assert side_by_side(worth, 2, 0.5, 0.0) == [Window(0, 1, 0, 2), Window(0, 1, 1, 3)]

    def test_they_are_moved_to_the_middle_of_what_they_hold(self) -> None:
        worth = np.zeros((3, 12))
        worth[:, 5] = 1.0
        assert side_by_side(worth, 5, 0.1, 0.1) == [Window(0, 3, 3, 8)]
        assert side_by_side(np.roll(worth, -5, axis=1), 5, 0.1, 0.1) == [Window(0, 3, 0, 5)]
        assert side_by_side(np.roll(worth, 6, axis=1), 5, 0.1, 0.1) == [Window(0, 3, 7, 12)]
        worth[:, 6] = 1.0  # of three columns to spare there are two before it
        assert side_by_side(worth, 5, 0.1, 0.1) == [Window(0, 3, 3, 8)]

    def test_nothing_gives_none(self) -> None:
        assert side_by_side(np.zeros((3, 8)), 2, 1.0, 0.0) == []
        assert side_by_side(np.ones((3, 8)), 2, 2.0, 0.0) == []  # worth just what it costs

    def test_a_long_column_is_searched_whole(self) -> None:
        rows = 20_001
        worth = np.zeros((rows, 2))
        worth[-3:] = 1.0, 0.9
        assert side_by_side(worth, 1, 0.5, 0.5) == [Window(rows - 3, rows, 0, 1), Window(rows - 3, rows, 1, 2)]

    @pytest.mark.parametrize("width", [16, 17])
    def test_wide_windows_are_summed_as_narrow_ones(self, width: int) -> None:
        worth = np.zeros((4, 60))
        worth[1:3, 20 : 20 + width] = 1.0
        assert side_by_side(worth, width, width - 0.5, 0.5) == [Window(1, 3, 20, 20 + width)]

    @pytest.mark.parametrize("width", [1, 3, 17])
    def test_after_a_change_all_is_found_as_if_it_had_always_been_so(self, width: int) -> None:
        rng = np.random.default_rng(3)
        worth = rng.random((6, 40))
        bands = Bands(worth, width)
        for number in range(5):
            assert bands.side_by_side(width * 0.4, 0.1) == side_by_side(worth, width, width * 0.4, 0.1)
            assert bands.left.is_known.all()
            changed = Window(number, number + 2, 7 * number, 7 * number + 3)
            worth[changed.cells] *= 2 * rng.random()
            bands.change(worth, changed)
            new = Bands(worth, width)
            assert (bands.left.worth == new.left.worth).all()
            assert (bands.left.sums == new.left.sums).all()
            anew = [changed.first_column - width < window < changed.end_column for window in range(new.left.value.size)]
            assert (~bands.left.is_known).tolist() == anew  # the others stay known

    @pytest.mark.parametrize("width", [7, 16, 19])
    def test_so_it_is_where_windows_are_worth_the_same_but_for_rounding(self, width: int) -> None:
        for changed in np.random.default_rng(0).random(20):
            worth = np.array([[0.2], [0.1]]).repeat(94, axis=1)
            bands = Bands(worth, width)
            bands.side_by_side(0.5, 0.1)
            worth[:, 0] = changed
            bands.change(worth, Window(0, 2, 0, 1))
            assert bands.side_by_side(0.5, 0.1) == side_by_side(worth, width, 0.5, 0.1)

    def test_what_is_known_is_not_looked_for_again(self) -> None:
        bands = Bands(np.ones((2, 6)), 2)
        # Of equals the last column's comes first.
        assert bands.side_by_side(1.0, 0.5) == [Window(0, 2, 4, 6), Window(0, 2, 2, 4), Window(0, 2, 0, 2)]
        bands.left.value[:], bands.left.end_row[:] = [0, 9, 0, 0, 0], 1
        assert bands.side_by_side(1.0, 0.5) == [Window(0, 1, 1, 3)]

    def test_they_are_put_behind_those_that_were_found_before(self) -> None:
        bands = Bands(np.ones((2, 2)), 2)
        found = np.full((4, 4), -9)
        assert _side_by_side(bands.left, bands.costs(1.0, 0.5), found, 2) == 3
        assert found.tolist() == [[-9] * 4, [-9] * 4, [0, 2, 0, 2], [-9] * 4]

    def test_what_brings_more_than_it_costs_by_rounding_alone_is_left_out(self) -> None:
        assert 0.1 + 0.2 > 0.3
        assert side_by_side(np.array([[0.1], [0.2]]), 1, 0.0, 0.3) == []
        assert side_by_side(np.array([[0.1], [0.2]]), 1, 0.0, 0.3 - 1e-8) == [Window(0, 2, 0, 1)]


@given(
    columns=st.lists(st.integers(1, 9), min_size=4, max_size=12),
    width=st.integers(1, 4),
    row_cost=st.sampled_from([2.0, 3.0, 4.0]),
    fixed_cost=st.integers(0, 8).map(float),
)
def test_no_other_choice_of_windows_that_do_not_overlap_brings_more(
    columns: list[int], width: int, row_cost: float, fixed_cost: float
) -> None:
    rows = 3
    worth = np.array([columns], dtype=np.float64).repeat(rows, axis=0)
    windows = len(columns) - width + 1

    def profit(first: int) -> float:
        """All rows are alike, so the best band is all of them, or none."""
        return rows * (sum(columns[first : first + width]) - row_cost) - fixed_cost

    @cache
    def most(windows_left: int) -> float:
        if windows_left <= 0:
            return 0.0
        return max(most(windows_left - 1), most(windows_left - width) + profit(windows_left - 1))

    found = side_by_side(worth, width, row_cost, fixed_cost)
    places = sorted(one.first_column for one in found)  # none is moved: every column holds something
    assert all(after - before >= width for before, after in pairwise(places))
    profits = [profit(one.first_column) for one in found]
    assert profits == sorted(profits, reverse=True)
    assert sum(profits) == pytest.approx(most(windows))
    assert all((one.first_row, one.end_row) == (0, rows) for one in found)


@needs_compiling
def test_for_ground_of_all_kinds_the_cutting_is_compiled_once() -> None:
    """A second time would cost seconds, of the first cut of that kind."""
    contacts = np.ones((2, *GRID.shape))
    rules = (RULES, replace(RULES, swath_m=5, overhead_m=0.5), replace(RULES, swath_m=1000.0))
    for objective in OBJECTIVES:
        for objects_there in (None, contacts, np.asfortranarray(contacts)):
            told = ground(hot(np.s_[10:40, 15:19]), objective=objective, contacts=objects_there)
            for its_rules in rules:
                for across in (False, True):
                    found, _ = Cutting(GRID, told, its_rules, across=across).cut(PRICE, 0.1, 1000.0)
                    told.in_blocks(2).copy().fly_each([])
                    told.copy().fly_each(found)
                    told.copy().fly_each(found, [0.5] * len(found), 10.0)
    for one in (windows_for, fly_each, look_anew, _in_blocks):
        assert times_compiled(one) == 1


@given(count=st.integers(0, 3000), seed=st.integers(0, 9))
def test_sums_are_those_of_numpy_to_the_last_bit(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.random(count + 1) * 10.0 ** rng.integers(-8, 8, count + 1)
    assert _sum(values, count) == values[:count].sum()
