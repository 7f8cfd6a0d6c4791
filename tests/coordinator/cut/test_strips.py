"""Cutting windows at a price: by hand on small grids, and what holds for every map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from coordinator.cut.ground import OBJECTIVES, Ground
from coordinator.cut.strips import Cut, Cutting, CuttingRules, _pieces, cells_wide, strip_of
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


def ground(risk: FloatArray, grid: GridSpec = GRID, look: float = LOOK, objective: str = "mean") -> Ground:
    return Ground(
        risk=risk.copy(),
        look=np.full(grid.shape, look),
        weights=np.full(grid.shape, float(grid.cell_area_m2)),
        is_seen=np.ones(grid.shape, dtype=np.bool_),
        objective=OBJECTIVES[objective],
        threshold=0.4,
    )


def cut(risk: FloatArray, rules: CuttingRules = RULES, price: float = PRICE, look: float = LOOK) -> list[Window]:
    """Where a first look is worth its price."""
    return list(dict.fromkeys(Cutting(GRID, ground(risk, look=look), rules).cut(price)))


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
        assert list(dict.fromkeys(one.first_column for one in Cutting(GRID, told, RULES).cut(PRICE))) == [25, 2]

    def test_where_a_look_takes_more_comes_first(self) -> None:
        told = ground(hot(np.s_[10:40, 2:12], np.s_[10:40, 25:35]))
        told.look[:, :20] = 0.5
        assert list(dict.fromkeys(one.first_column for one in Cutting(GRID, told, RULES).cut(PRICE))) == [25, 2]

    def test_for_the_worst_only_what_is_above_the_threshold_is_cut(self) -> None:
        told = ground(hot(np.s_[:, 2:12], risk=0.4) + hot(np.s_[:, 25:35], risk=0.9), objective="worst30")
        assert Cutting(GRID, told, RULES).cut(PRICE) == [Window(0, 60, 25, 35)]

    def test_nothing_hot_gives_nothing(self) -> None:
        assert cut(np.zeros(GRID.shape)) == []
        assert cut(np.full(GRID.shape, 0.25)) == []  # worth as much as it costs

    def test_a_band_a_swath_and_a_half_wide_gives_a_second_strip_over_the_rest(self) -> None:
        # On five columns a row brings 5 and costs 2.5; the strip beside is moved to their middle, over the other one.
        assert cut(hot(np.s_[10:40, 10:25])) == [Window(10, 40, 15, 25), Window(10, 40, 7, 17)]

    def test_a_place_is_cut_again_where_it_is_worth_another_look_after_that(self) -> None:
        # A poor look takes 20 m2 a metre, then 12 and 7.2; strips of 150 m cost 190 m at 9 m2, which is 11.4 a metre.
        told = ground(hot(np.s_[10:40, 10:20]), look=0.4)
        assert Cutting(GRID, told, RULES).cut(9.0) == [Window(10, 40, 10, 20)] * 2

    def test_the_swath_is_never_wider_than_the_sensor_sees(self) -> None:
        grid = GridSpec(EAST, 3.4, 40, 60)
        windows = Cutting(grid, ground(np.ones(grid.shape), grid), RULES).cut(PRICE)
        assert {one.columns_wide for one in windows} == {14}  # 47.6 m; 15 would be 51 m

    def test_an_area_narrower_than_the_swath_is_cut_as_it_is(self) -> None:
        grid = GridSpec(EAST, 5, 6, 60)
        assert Cutting(grid, ground(np.ones(grid.shape), grid), RULES).cut(PRICE) == [Window(0, 60, 0, 6)]


class TestLengthsAndWidths:
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
        assert _pieces(*band, 3, 5) == pieces

    def test_where_equal_ones_would_be_too_short_into_the_longest(self) -> None:
        assert _pieces(10, 25, 4, 5) == [(10, 15), (15, 20), (20, 25)]
        assert _pieces(10, 21, 4, 5) == [(10, 15), (15, 20)]
        assert _pieces(10, 26, 4, 5) == [(10, 14), (14, 18), (18, 22), (22, 26)]

    @pytest.mark.parametrize(
        ("cell_m", "swath_m", "wide"), [(5, 50, 10), (5, 54.9, 10), (5, 49.9, 9), (5, 4, 1), (0.1, 0.7, 7), (3, 2.9, 1)]
    )
    def test_a_swath_is_as_wide_as_the_whole_cells_in_it_but_for_rounding(
        self, cell_m: float, swath_m: float, wide: int
    ) -> None:
        assert cells_wide(GridSpec(EAST, cell_m, 40, 60), swath_m) == wide

    @pytest.mark.parametrize(("min_strip_m", "rows"), [(5, 1), (2, 1), (7, 1), (8, 2), (12, 2), (13, 3)])
    def test_the_least_length_is_rounded_to_whole_cells_and_at_least_one(self, min_strip_m: float, rows: int) -> None:
        rules = replace(RULES, overhead_m=1, min_strip_m=min_strip_m)
        for hot_rows in range(1, 5):
            found = cut(hot(np.s_[10 : 10 + hot_rows, 10:20]), rules)
            assert found == ([Window(10, 10 + hot_rows, 10, 20)] if hot_rows >= rows else [])

    def test_where_the_most_is_less_than_the_least_all_are_as_long_as_that(self) -> None:
        assert cut(hot(np.s_[10:16, 10:20]), replace(RULES, overhead_m=1, max_strip_m=5)) == [Window(10, 16, 10, 20)]

    def test_a_place_is_cut_six_times_at_most(self) -> None:
        told = ground(hot(np.s_[10:40, 10:20]), look=0.1)
        assert Cutting(GRID, told, RULES).cut(0.1) == [Window(10, 40, 10, 20)] * 6

    def test_metres_are_flown_for_a_strip_and_the_way_to_it(self) -> None:
        assert RULES.metres_flown(150) == 190

    @pytest.mark.parametrize(("heading_deg", "across_deg"), [(0, 90), (30, 120), (269, 359), (271, 1), (359, 89)])
    def test_across_the_tracks_it_is_headed_to_starboard_of_them(self, heading_deg: float, across_deg: float) -> None:
        grid = replace(GRID, frame=SweepFrame(1000, -500, math.radians(heading_deg)))
        assert math.degrees(strip_of(grid, Window(10, 40, 12, 22, across=True), 1).heading_rad) == pytest.approx(
            across_deg
        )
        assert math.degrees(strip_of(grid, Window(10, 40, 12, 22), 1).heading_rad) == pytest.approx(heading_deg)


SMALL = GridSpec(EAST, 5, 9, 8)
risks = arrays.arrays(np.float64, SMALL.shape, elements=st.sampled_from([0.0, 0.0, 0.2, 0.5, 0.9, 1.0]))
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
    worth = told.worth()
    found: list[Window] = []
    for window in Cutting(SMALL, told, rules).cut(price):
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
    rules=rules_of_all_kinds,
    prices=st.lists(st.sampled_from([0.2, 0.5, 1.0, 3.0]), min_size=1, max_size=4),
    across=st.booleans(),
)
def test_what_is_cut_further_is_cut_as_of_the_ground_as_it_was_left(
    risk: FloatArray, rules: CuttingRules, prices: list[float], across: bool
) -> None:
    left, cutting = ground(risk, SMALL), Cutting(SMALL, ground(risk, SMALL), rules, across=across)
    for price in prices:
        found = Cutting(SMALL, left, rules, across=across).cut(price)
        assert cutting.copy().cut(price) == found
        assert cutting.cut(price) == found
        for window in found:
            left.fly(window)


class TestStripOf:
    def test_on_a_grid_that_points_north(self) -> None:
        strip = Cut(Window(10, 40, 12, 22), 1.0, 1.0).strip(GRID, 7)
        # Columns 12 to 21 are centred at 60 to 105 m; rows 10 to 39 lie from 50 to 200 m.
        assert (strip.number, strip.start, strip.end) == (7, (82.5, 50), (82.5, 200))
        assert (strip.length_m, strip.width_m, strip.heading_rad) == (150, 50, 0)

    def test_across_the_rows(self) -> None:
        strip = strip_of(GRID, Window(10, 20, 12, 32, across=True), 7)
        # Columns 12 to 31 reach from 57.5 to 157.5 m, rows 10 to 19 from 50 to 100 m.
        assert strip.start == pytest.approx((57.5, 75))
        assert strip.end == pytest.approx((157.5, 75))
        assert (strip.length_m, strip.width_m) == (100, 50)

    @pytest.mark.parametrize("heading_deg", [30, 90, 200, 359])
    @pytest.mark.parametrize("across", [False, True])
    def test_on_a_rotated_grid_it_holds_the_centres_of_its_cells_and_no_others(
        self, heading_deg: float, across: bool
    ) -> None:
        grid = replace(GRID, frame=SweepFrame(1000, -500, math.radians(heading_deg)))
        window = Window(10, 40, 12, 22, across)
        strip = strip_of(grid, window, 1)
        x_m, y_m = grid.frame.to_mission(*np.meshgrid(grid.across_m, grid.along_m))
        across_m, along_m = SweepFrame(*strip.start, strip.heading_rad).to_sweep(x_m, y_m)
        within = (np.abs(across_m) < strip.width_m / 2) & (along_m > 0) & (along_m < strip.length_m)
        expected = np.zeros(grid.shape, dtype=np.bool_)
        expected[window.cells] = True
        assert (within == expected).all()


@settings(max_examples=60, deadline=None)
@given(risk=risks, rules=rules_of_all_kinds, price=st.sampled_from([0.2, 1.0, 3.0]))
def test_across_the_tracks_they_are_cut_as_along_them_on_the_map_turned(
    risk: FloatArray, rules: CuttingRules, price: float
) -> None:
    told = ground(risk, SMALL)
    turned = GridSpec(SMALL.frame, SMALL.cell_m, SMALL.rows, SMALL.columns)
    across = Cutting(SMALL, told, rules, across=True).cut(price)
    assert [one.turned for one in across] == Cutting(turned, ground(risk.T.copy(), turned), rules).cut(price)
    assert all(one.across for one in across)
    assert (told.risk == risk).all()
