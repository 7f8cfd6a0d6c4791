"""Cutting strips: by hand on small grids, by brute force, and what holds for every map."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from coordinator.cut.strips import Cut, CuttingRules, cut_strips, strip_of
from coordinator.cut.window import Window
from planner.types import BoolArray, FloatArray, GridSpec, SweepFrame

EAST = SweepFrame(0, 0, 0)
GRID = GridSpec(EAST, 5, 40, 60)  # 200 m across, 300 m along
RULES = CuttingRules(swath_m=50, p_detect=0.7, worth_risk=0.25, overhead_m=40, min_strip_m=30, max_strip_m=400)
NONE_OPEN: BoolArray = np.zeros(GRID.shape, dtype=np.bool_)


def hot(*windows: tuple[slice, slice], risk: float = 1.0) -> FloatArray:
    """A map with this risk in these windows, 0 elsewhere."""
    values = np.zeros(GRID.shape)
    for window in windows:
        values[window] = risk
    return values


def cut(risk: FloatArray, rules: CuttingRules = RULES, open_cells: BoolArray = NONE_OPEN) -> list[Cut]:
    return cut_strips(GRID, risk, open_cells, rules)


def by_hand(window: Window, removable_m2: float) -> Cut:
    return Cut(window, removable_m2, removable_m2)


def value(one: Cut, rules: CuttingRules, grid: GridSpec = GRID) -> float:
    """What a strip removes beyond the cost of its length."""
    rows = one.window.end_row - one.window.first_row
    return one.removable_m2 - rows * rules.worth_risk * rules.p_detect * rules.columns(grid) * grid.cell_area_m2


class TestByHand:
    def test_a_band_narrower_than_the_swath_gives_one_strip_centred_on_it(self) -> None:
        cuts = cut(hot(np.s_[10:40, 15:19]))
        # 4 columns about 16.5; the swath has 10 columns: 12 to 21. 30 x 4 cells of 25 m2, of which 0.7 is removed.
        assert [one.window for one in cuts] == [Window(10, 40, 12, 22)]
        assert cuts[0].removable_m2 == pytest.approx(120 * 25 * 0.7)

    @pytest.mark.parametrize(("columns", "first"), [(slice(0, 4), 0), (slice(36, 40), 30), (slice(15, 20), 12)])
    def test_a_strip_stays_on_the_grid_and_is_centred_to_half_a_cell(self, columns: slice, first: int) -> None:
        cuts = cut(hot((slice(10, 40), columns)))
        assert [one.window.first_column for one in cuts] == [first]

    def test_two_bands_give_two_strips_the_worse_one_first(self) -> None:
        risk = hot(np.s_[10:40, 2:8]) + hot(np.s_[5:25, 25:31], risk=0.9)
        assert [one.window for one in cut(risk)] == [Window(10, 40, 0, 10), Window(5, 25, 23, 33)]

    def test_a_band_two_swaths_wide_gives_two_strips_side_by_side(self) -> None:
        cuts = cut(hot(np.s_[10:40, 7:27]))
        assert {one.window for one in cuts} == {Window(10, 40, 7, 17), Window(10, 40, 17, 27)}

    def test_where_time_is_short_two_strips_side_by_side_are_better_than_the_best_one(self) -> None:
        # Five columns each of 0.6, 0.9, 0.9, 0.6: one strip on the 0.9, or two of 0.75 side by side. Full rows: 60 in
        # length and 8 for the way. If time is worth 0.4, that is 54 - 27.2 or 2 * (45 - 27.2); if 0.6, 54 - 40.8 or
        # 2 * (45 - 40.8).
        risk = hot(np.s_[:, 10:15], np.s_[:, 25:30], risk=0.6) + hot(np.s_[:, 15:25], risk=0.9)
        scarce, scarcer = (cut(risk, replace(RULES, marginal_risk=marginal_risk)) for marginal_risk in (0.4, 0.6))
        assert sorted(one.window.first_column for one in scarce) == [10, 20]
        assert all(one.window.rows == GRID.rows for one in scarce)
        assert scarcer[0].window.columns == cut(risk)[0].window.columns == slice(15, 25)

    def test_a_band_as_long_as_the_area_is_split_into_equal_pieces(self) -> None:
        cuts = cut(hot(np.s_[:, 15:19]), replace(RULES, max_strip_m=110))
        assert [one.window for one in cuts] == [Window(first, first + 20, 12, 22) for first in (0, 20, 40)]

    def test_a_piece_is_never_shorter_than_a_strip_may_be(self) -> None:
        cuts = cut(hot(np.s_[0:25, 15:19]), replace(RULES, min_strip_m=90, max_strip_m=100))
        assert [one.window for one in cuts] == [Window(0, 20, 12, 22)]  # 125 m: 100 m, and 25 m left out

    def test_what_is_too_short_is_left_out(self) -> None:
        full = hot(np.s_[10:15, 10:20])
        assert cut(full, replace(RULES, overhead_m=1)) == []
        assert len(cut(full, replace(RULES, overhead_m=1, min_strip_m=25))) == 1

    def test_what_does_not_pay_for_the_way_there_is_left_out(self) -> None:
        # A row of 4 of 10 columns brings 0.4 of a full row and costs 0.25: 0.15 a row. 40 m cost 8 rows of 0.25.
        assert cut(hot(np.s_[10:23, 15:19])) == []  # 13 rows: 1.95
        assert len(cut(hot(np.s_[10:24, 15:19]))) == 1  # 14 rows: 2.1

    def test_a_row_less_hot_than_it_is_worth_is_flown_only_on_the_way(self) -> None:
        # Five empty rows cost 1.25 between two runs that bring 0.75 a row.
        cuts = cut(hot(np.s_[5:20, 10:20], np.s_[25:40, 10:20]))
        assert [one.window for one in cuts] == [Window(5, 40, 10, 20)]
        far = cut(hot(np.s_[0:10, 10:20], np.s_[50:60, 10:20]))  # 40 rows cost 10, a run brings 7.5
        assert {one.window for one in far} == {Window(0, 10, 10, 20), Window(50, 60, 10, 20)}

    def test_ground_that_counts_more_comes_first_and_what_a_look_removes_stays_true(self) -> None:
        risk = hot(np.s_[10:40, 2:12], risk=0.8) + hot(np.s_[10:40, 25:35], risk=0.5)
        weights = np.where(np.arange(GRID.columns) < 20, 1.0, 2.0) * np.ones(GRID.shape)
        cuts = cut_strips(GRID, risk, NONE_OPEN, RULES, weights=weights)
        assert [one.window.first_column for one in cuts[:2]] == [25, 2]
        # 30 x 10 cells of 25 m2, of which 0.7 is removed: 0.5 of that counts twice.
        assert (cuts[0].removable_m2, cuts[0].counts_m2) == pytest.approx((2625, 5250))
        assert (cuts[1].removable_m2, cuts[1].counts_m2) == pytest.approx((4200, 4200))

    def test_ground_that_counts_nothing_gets_no_strip(self) -> None:
        assert cut_strips(GRID, hot(np.s_[:, :]), NONE_OPEN, RULES, weights=np.zeros(GRID.shape)) == []

    def test_nothing_hot_gives_nothing(self) -> None:
        assert cut(np.zeros(GRID.shape)) == []
        assert cut(np.full(GRID.shape, 0.25)) == []  # worth as much as it costs

    def test_what_still_grows_is_left_for_later(self) -> None:
        open_cells = NONE_OPEN.copy()
        open_cells[40:, 15:19] = True
        risk = hot(np.s_[10:40, 15:19])
        assert cut(risk, open_cells=open_cells) == []
        assert cut(hot(np.s_[20:50, 15:19]), open_cells=open_cells[::-1]) == []
        # Not if it is as long as a strip may be; nor if the open cells lie beyond a row, or beside the swath.
        assert len(cut(risk, replace(RULES, max_strip_m=150), open_cells)) == 1
        assert len(cut(risk, replace(RULES, max_strip_m=110), open_cells)) == 2
        assert len(cut(risk, open_cells=np.roll(open_cells, 1, axis=0) & (GRID.along_m > 200)[:, np.newaxis])) == 1
        assert len(cut(risk, open_cells=np.roll(open_cells, 8, axis=1))) == 1

    def test_what_is_left_for_later_does_not_hide_what_is_ready(self) -> None:
        open_cells = NONE_OPEN.copy()
        open_cells[50:, 2:8] = True
        cuts = cut(hot(np.s_[10:50, 2:8], np.s_[5:25, 25:31]), open_cells=open_cells)
        assert [one.window for one in cuts] == [Window(5, 25, 23, 33)]

    def test_a_band_a_swath_and_a_half_wide_gives_a_second_strip_over_the_rest(self) -> None:
        cuts = cut(hot(np.s_[10:40, 10:25]))
        assert [one.window for one in cuts] == [Window(10, 40, 10, 20), Window(10, 40, 15, 25)]
        assert [one.removable_m2 for one in cuts] == pytest.approx([300 * 25 * 0.7, (150 + 150 * 0.3) * 25 * 0.7])

    def test_a_place_is_cut_once_until_it_has_had_its_look(self) -> None:
        poor = replace(RULES, p_detect=0.4)  # leaves 0.6, worth another look; but not before the first
        risk = hot(np.s_[10:40, 10:20])
        assert [one.window for one in cut(risk, poor)] == [Window(10, 40, 10, 20)]
        assert cut_strips(GRID, risk, NONE_OPEN, poor, [Window(10, 40, 10, 20)]) == []
        assert cut_strips(GRID, risk, NONE_OPEN, poor, [Window(10, 40, 12, 22)]) == []  # 8 of 10 columns
        beside = cut_strips(GRID, risk, NONE_OPEN, poor, [Window(10, 40, 16, 26)])  # 4 of 10 columns
        assert [one.window for one in beside] == [Window(10, 40, 10, 20)]
        assert beside[0].removable_m2 == pytest.approx(30 * (6 + 4 * 0.6) * 25 * 0.4)

    def test_a_piece_of_a_band_is_cut_once_too(self) -> None:
        # A look leaves 0.3 of all, which is worth another one; the band is to be cut in two.
        rules = replace(RULES, max_strip_m=150)
        assert [one.window for one in cut(hot(np.s_[:, 10:20]), rules)] == [
            Window(0, 30, 10, 20),
            Window(30, 60, 10, 20),
        ]

    def test_a_piece_that_does_not_pay_does_not_hide_what_lies_elsewhere(self) -> None:
        # Half of the band is all hot and goes. What is left of both, 0.7 and 0.3 at most, would be the best run again,
        # of which neither half is a strip.
        rules = replace(RULES, p_detect=0.3, max_strip_m=150)
        risk = hot(np.s_[:30, 0:10]) + hot(np.s_[30:, 0:10], risk=0.3) + hot(np.s_[10:40, 25:35], risk=0.6)
        assert [one.window for one in cut(risk, rules)] == [Window(0, 30, 0, 10), Window(10, 40, 25, 35)]

    def test_the_swath_is_never_wider_than_the_sensor_sees(self) -> None:
        grid = GridSpec(EAST, 3.4, 40, 60)
        cuts = cut_strips(grid, np.ones(grid.shape), np.zeros(grid.shape, dtype=np.bool_), RULES)
        assert {one.window.end_column - one.window.first_column for one in cuts} == {14}  # 47.6 m; 15 would be 51 m

    def test_an_area_narrower_than_the_swath_is_cut_as_it_is(self) -> None:
        grid = GridSpec(EAST, 5, 6, 60)
        cuts = cut_strips(grid, np.ones(grid.shape), np.zeros(grid.shape, dtype=np.bool_), RULES)
        assert [one.window for one in cuts] == [Window(0, 60, 0, 6)]


class TestOverlap:
    @pytest.mark.parametrize(
        ("other", "share"),
        [
            (Window(0, 10, 0, 10), 1),
            (Window(0, 10, 5, 15), 50 / 150),
            (Window(5, 15, 5, 15), 25 / 175),
            (Window(10, 20, 0, 10), 0),
            (Window(30, 40, 30, 40), 0),
        ],
    )
    def test_it_is_the_shared_part_of_both(self, other: Window, share: float) -> None:
        window = Window(0, 10, 0, 10)
        assert window.overlap(other) == other.overlap(window) == pytest.approx(share)


SMALL = GridSpec(EAST, 5, 9, 8)
risks = arrays.arrays(np.float64, SMALL.shape, elements=st.sampled_from([0.0, 0.0, 0.2, 0.5, 0.9, 1.0]))
masks = arrays.arrays(np.bool_, SMALL.shape)
rules_of_all_kinds = st.builds(
    CuttingRules,
    swath_m=st.sampled_from([5.0, 15.0, 20.0]),
    p_detect=st.sampled_from([0.3, 0.7, 0.95]),
    worth_risk=st.sampled_from([0.1, 0.25, 0.6]),
    overhead_m=st.sampled_from([0.0, 5.0, 20.0]),
    min_strip_m=st.sampled_from([5.0, 10.0, 15.0]),
    max_strip_m=st.sampled_from([15.0, 20.0, 400.0]),
)


def best_by_brute_force(risk: FloatArray, rules: CuttingRules) -> float:
    """The value of the best rectangle as wide as the swath, of any length."""
    width = round(rules.swath_m / SMALL.cell_m)
    return max(
        value(by_hand(window, risk[window.cells].sum() * rules.p_detect * SMALL.cell_area_m2), rules, SMALL)
        for column in range(SMALL.columns - width + 1)
        for first in range(SMALL.rows)
        for end in range(first + 1, SMALL.rows + 1)
        for window in (Window(first, end, column, column + width),)
    )


BESIDE_WHAT_GIVES_NO_STRIP = np.zeros(SMALL.shape)
"""The third strip removes risk, too, that counts no more: a band that lies on the first strip holds it."""
BESIDE_WHAT_GIVES_NO_STRIP[[0, 1, 1, 2, 2], [0, 2, 3, 5, 7]] = 0.5, 0.5, 0.9, 0.9, 0.5


class TestEveryMap:
    @settings(max_examples=60, deadline=None)
    @given(risk=risks, rules=rules_of_all_kinds)
    def test_the_first_strip_is_the_best_there_is(self, risk: FloatArray, rules: CuttingRules) -> None:
        rules = replace(rules, min_strip_m=5, max_strip_m=400)
        cuts = cut_strips(SMALL, risk, np.zeros(SMALL.shape, dtype=np.bool_), rules)
        best = best_by_brute_force(risk, rules)
        fixed = rules.worth_risk * rules.p_detect * rules.swath_m * rules.overhead_m
        if cuts:
            assert value(cuts[0], rules, SMALL) == pytest.approx(best)
        assert bool(cuts) == (best > fixed + 1e-9) or abs(best - fixed) < 1e-9

    @settings(max_examples=60, deadline=None)
    @given(risk=risks, rules=rules_of_all_kinds)
    @example(risk=BESIDE_WHAT_GIVES_NO_STRIP, rules=CuttingRules(20.0, 0.3, 0.1, 0.0, 5, 400))
    def test_none_promises_more_than_is_left_and_the_best_come_first(
        self, risk: FloatArray, rules: CuttingRules
    ) -> None:
        rules = replace(rules, min_strip_m=5, max_strip_m=400)
        left = risk.copy()
        values: list[float] = []
        for one in cut_strips(SMALL, risk, np.zeros(SMALL.shape, dtype=np.bool_), rules):
            expected = left[one.window.cells].sum() * rules.p_detect * SMALL.cell_area_m2
            assert one.removable_m2 == pytest.approx(expected) if not values else one.removable_m2 <= expected + 1e-6
            left[one.window.cells] *= 1 - rules.p_detect
            # Risk in a band that gives no strip counts no more, though a strip that lies on it removes it too.
            values.append(value(replace(one, removable_m2=one.counts_m2), rules, SMALL))
        assert all(later <= earlier + 1e-6 for earlier, later in pairwise(values))

    @settings(max_examples=100, deadline=None)
    @given(
        risk=risks,
        open_cells=masks,
        weights=arrays.arrays(np.float64, SMALL.shape, elements=st.sampled_from([0.0, 0.5, 1.0, 3.0])),
        rules=rules_of_all_kinds,
        marginal_risk=st.sampled_from([0.0, 0.4, 0.7]),
        first_column=st.integers(0, 5),
    )
    def test_each_tells_what_those_before_it_and_those_that_are_claimed_leave(
        self,
        risk: FloatArray,
        open_cells: BoolArray,
        weights: FloatArray,
        rules: CuttingRules,
        marginal_risk: float,
        first_column: int,
    ) -> None:
        rules = replace(rules, marginal_risk=marginal_risk)
        served = Window(2, 7, first_column, first_column + rules.columns(SMALL))
        claimed = [served]
        left = risk * rules.p_detect * SMALL.cell_area_m2
        left[served.cells] *= 1 - rules.p_detect
        for one in cut_strips(SMALL, risk, open_cells, rules, [served], weights=weights):
            assert one.removable_m2 == pytest.approx(left[one.window.cells].sum())
            counts_m2 = (left * weights)[one.window.cells].sum()
            assert one.counts_m2 <= counts_m2 * (1 + 1e-9)  # what has led to no strip is left out
            row_m2 = rules.worth_risk * rules.p_detect * rules.columns(SMALL) * SMALL.cell_area_m2
            assert counts_m2 > row_m2 * (one.window.rows + rules.overhead_m / SMALL.cell_m)
            left[one.window.cells] *= 1 - rules.p_detect
            shared = max(one.window.shared(other) for other in claimed)
            assert shared < 0.75 * one.window.size
            claimed.append(one.window)

    @settings(max_examples=80, deadline=None)
    @given(risk=risks, open_cells=masks, rules=rules_of_all_kinds, marginal_risk=st.sampled_from([0.0, 0.4, 0.7]))
    def test_strips_lie_on_the_grid_are_as_long_as_allowed_and_worth_their_while(
        self, risk: FloatArray, open_cells: BoolArray, rules: CuttingRules, marginal_risk: float
    ) -> None:
        before = risk.copy()
        width = round(rules.swath_m / 5)
        rules = replace(rules, marginal_risk=marginal_risk)
        for one in cut_strips(SMALL, risk, open_cells, rules):
            window = one.window
            assert 0 <= window.first_row < window.end_row <= SMALL.rows
            assert 0 <= window.first_column < window.end_column <= SMALL.columns
            assert window.end_column - window.first_column == width
            assert rules.min_strip_m <= (window.end_row - window.first_row) * 5 <= rules.max_strip_m
            fixed = rules.worth_risk * rules.p_detect * rules.swath_m * rules.overhead_m
            assert value(one, rules, SMALL) > fixed * (1 - 1e-9)
        assert (risk == before).all()


class TestStripOf:
    def test_on_a_grid_that_points_north(self) -> None:
        strip = strip_of(GRID, Window(10, 40, 12, 22), 7)
        # Columns 12 to 21 are centred at 60 to 105 m; rows 10 to 39 lie from 50 to 200 m.
        assert (strip.number, strip.start, strip.end) == (7, (82.5, 50), (82.5, 200))
        assert (strip.length_m, strip.width_m, strip.heading_rad) == (150, 50, 0)

    @pytest.mark.parametrize("heading_deg", [30, 90, 200, 359])
    def test_on_a_rotated_grid_it_holds_the_centres_of_its_cells_and_no_others(self, heading_deg: float) -> None:
        grid = replace(GRID, frame=SweepFrame(1000, -500, math.radians(heading_deg)))
        window = Window(10, 40, 12, 22)
        strip = strip_of(grid, window, 1)
        x_m, y_m = grid.frame.to_mission(*np.meshgrid(grid.across_m, grid.along_m))
        across, along = SweepFrame(*strip.start, strip.heading_rad).to_sweep(x_m, y_m)
        within = (np.abs(across) < strip.width_m / 2) & (along > 0) & (along < strip.length_m)
        expected = np.zeros(grid.shape, dtype=np.bool_)
        expected[window.cells] = True
        assert (within == expected).all()


class TestWhereToLook:
    def test_what_lies_elsewhere_is_left_out(self) -> None:
        risk = np.zeros(GRID.shape)
        risk[10:40, 0:10] = risk[10:40, 23:33] = 0.8
        columns = np.zeros(GRID.columns, dtype=np.bool_)
        columns[28] = True
        cuts = cut_strips(GRID, risk, NONE_OPEN, RULES, columns=columns)
        assert [one.window for one in cuts] == [Window(10, 40, 23, 33)]
        assert cut_strips(GRID, risk, NONE_OPEN, RULES, columns=np.zeros_like(columns)) == []
