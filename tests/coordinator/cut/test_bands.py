"""Bands of rows: those side by side, by hand and against every choice there is."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordinator.cut.bands import Bands
from coordinator.cut.window import Window
from planner.types import FloatArray


def searched(removable: FloatArray, width: int, row_cost: float = 0.0, fixed_cost: float = 0.0) -> Bands:
    bands = Bands(removable, width, row_cost, fixed_cost)
    bands.search(slice(0, removable.shape[1]))
    return bands


class TestByHand:
    ROWS = np.array([[3.0, 6.0, 6.5, 4.0]]).repeat(2, axis=0)  # windows of 2 columns bring 18, 25, 21

    def test_two_side_by_side_bring_more_than_the_best_and_what_that_leaves(self) -> None:
        bands = searched(self.ROWS, 2)
        assert bands.best() == [Window(0, 2, 1, 3)]  # leaves a column of 3 and one of 4
        assert bands.side_by_side(1.0) == [Window(0, 2, 2, 4), Window(0, 2, 0, 2)]  # the better first
        assert searched(self.ROWS[:, ::-1], 2).side_by_side(1.0) == [Window(0, 2, 0, 2), Window(0, 2, 2, 4)]

    def test_what_costs_more_is_left_out(self) -> None:
        # A row costs 2, a strip 3. Four times as much: 25 - 16 - 12 < 0. Three times: 18 - 12 - 9 < 0, 21 - 12 - 9 = 0,
        # 25 - 12 - 9 = 4, so the one in the middle. Twice: 18 - 8 - 6 and 21 - 8 - 6 = 11 in all, 25 - 8 - 6 = 11 too;
        # a little less than twice, and the two are better.
        bands = searched(self.ROWS, 2, row_cost=2.0, fixed_cost=3.0)
        assert bands.side_by_side(4.0) == []
        assert bands.side_by_side(3.0) == [Window(0, 2, 1, 3)]
        assert bands.side_by_side(1.9) == [Window(0, 2, 2, 4), Window(0, 2, 0, 2)]

    def test_they_are_moved_to_the_middle_of_what_they_hold(self) -> None:
        removable = np.zeros((3, 12))
        removable[:, 5] = 1.0
        assert searched(removable, 5).side_by_side(1.0) == [Window(0, 3, 3, 8)]

    def test_nothing_gives_none(self) -> None:
        bands = searched(np.zeros((3, 8)), 2)
        assert bands.side_by_side(1.0) == bands.best() == []


@given(
    columns=st.lists(st.integers(1, 9), min_size=4, max_size=12),
    width=st.integers(1, 4),
    fixed_cost=st.integers(0, 8),
    dearer=st.sampled_from([1.0, 1.5, 2.0]),
)
def test_no_other_choice_of_windows_that_do_not_overlap_brings_more(
    columns: list[int], width: int, fixed_cost: int, dearer: float
) -> None:
    row_cost, rows = 2.0, 3
    removable = np.array([columns], dtype=np.float64).repeat(rows, axis=0)
    windows = len(columns) - width + 1

    def profit(first: int) -> float:
        """All rows are alike, so the best band is all of them, or none."""
        return rows * (sum(columns[first : first + width]) - dearer * row_cost) - dearer * fixed_cost

    @cache
    def most(windows_left: int) -> float:
        if windows_left <= 0:
            return 0.0
        return max(most(windows_left - 1), most(windows_left - width) + profit(windows_left - 1))

    found = searched(removable, width, row_cost, fixed_cost).side_by_side(dearer)
    places = sorted(one.first_column for one in found)  # none is moved: every column holds something
    assert all(after - before >= width for before, after in pairwise(places))
    assert sum(profit(one.first_column) for one in found) == pytest.approx(most(windows))
    assert all((one.first_row, one.end_row) == (0, rows) for one in found)
