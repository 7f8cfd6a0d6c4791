"""Bands of rows side by side: by hand, and against every choice there is."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordinator.cut.bands import MOST_ADDED, Bands
from coordinator.cut.ground import CELLS_AT_ONCE
from coordinator.cut.window import Window
from planner.types import FloatArray


def side_by_side(worth: FloatArray, width: int, row_cost: float, fixed_cost: float) -> list[Window]:
    return Bands(worth, width).side_by_side(row_cost, fixed_cost)


class TestByHand:
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

    def test_a_column_longer_than_what_is_worked_on_at_once_is_searched_whole(self) -> None:
        rows = CELLS_AT_ONCE + 1
        worth = np.zeros((rows, 2))
        worth[-3:] = 1.0, 0.9
        assert side_by_side(worth, 1, 0.5, 0.5) == [Window(rows - 3, rows, 0, 1), Window(rows - 3, rows, 1, 2)]

    @pytest.mark.parametrize("width", [MOST_ADDED, MOST_ADDED + 1])
    def test_wide_windows_are_summed_as_narrow_ones(self, width: int) -> None:
        worth = np.zeros((4, 60))
        worth[1:3, 20 : 20 + width] = 1.0
        assert side_by_side(worth, width, width - 0.5, 0.5) == [Window(1, 3, 20, 20 + width)]

    @pytest.mark.parametrize("width", [1, 3, MOST_ADDED + 1])
    def test_after_a_change_all_is_found_as_if_it_had_always_been_so(self, width: int) -> None:
        rng = np.random.default_rng(3)
        worth = rng.random((6, 40))
        bands = Bands(worth, width)
        for number, row_cost in enumerate([0.4, 0.4, 0.4, 0.6, 0.6]):
            assert bands.side_by_side(width * row_cost, 0.1) == side_by_side(worth, width, width * row_cost, 0.1)
            changed = Window(number, number + 2, 7 * number, 7 * number + 3)
            worth = worth.copy()
            worth[changed.cells] *= 2 * rng.random()
            bands.change(worth, [changed])

    @pytest.mark.parametrize("width", [7, MOST_ADDED, MOST_ADDED + 3])
    def test_so_it_is_where_windows_are_worth_the_same_but_for_rounding(self, width: int) -> None:
        for changed in np.random.default_rng(0).random(20):
            worth = np.array([[0.2], [0.1]]).repeat(94, axis=1)
            bands = Bands(worth, width)
            bands.side_by_side(0.5, 0.1)
            worth = worth.copy()
            worth[:, 0] = changed
            bands.change(worth, [Window(0, 2, 0, 1)])
            assert bands.side_by_side(0.5, 0.1) == side_by_side(worth, width, 0.5, 0.1)

    def test_what_is_found_of_a_copy_is_not_known_of_the_other(self) -> None:
        bands = Bands(np.ones((2, 6)), 2)
        bands.side_by_side(1.0, 0.5)
        changed = np.zeros((2, 6))
        changed[:, 4:] = 3.0
        bands.change(changed, [Window(0, 2, 0, 6)])
        found = bands.copy().side_by_side(1.0, 0.5)
        assert found == bands.side_by_side(1.0, 0.5) == [Window(0, 2, 4, 6)]

    def test_what_brings_more_than_it_costs_by_rounding_alone_is_left_out(self) -> None:
        assert 0.1 + 0.2 > 0.3
        assert side_by_side(np.array([[0.1], [0.2]]), 1, 0.0, 0.3) == []
        assert side_by_side(np.array([[0.1], [0.2]]), 1, 0.0, 0.3 - 1e-8) == [Window(0, 2, 0, 1)]


@given(
    columns=st.lists(st.integers(1, 9), min_size=4, max_size=12),
    width=st.integers(1, 4),
    row_cost=st.sampled_from([2.0, 3.0, 4.0]),
    fixed_cost=st.integers(0, 8),
)
def test_no_other_choice_of_windows_that_do_not_overlap_brings_more(
    columns: list[int], width: int, row_cost: float, fixed_cost: int
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
