"""Windows: what two share, what holds both and where one lies in another, cell by cell."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.types import EVERYWHERE, BoolArray, Window
from planner.windows import NOWHERE, around, shared, whole, window_about, within

SHAPE = 9, 7


@st.composite
def windows(draw: st.DrawFn) -> Window:
    """With at least a cell of a grid of that shape."""
    (row, end_row), (column, end_column) = (
        sorted(draw(st.lists(st.integers(0, size), min_size=2, max_size=2, unique=True))) for size in SHAPE
    )
    return slice(row, end_row), slice(column, end_column)


def cells_of(window: Window) -> BoolArray:
    cells = np.zeros(SHAPE, dtype=np.bool_)
    cells[window] = True
    return cells


@given(windows(), windows())
def test_two_share_the_cells_of_both_and_what_is_around_them_holds_both(one: Window, other: Window) -> None:
    both, found = cells_of(one) & cells_of(other), shared(one, other)
    assert (found is not None) == both.any()
    if found is not None:
        assert (cells_of(found) == both).all()
        assert (cells_of(one)[other][within(found, other)]).all()
        assert found == window_about(both)
    assert around(one, other) == window_about(cells_of(one) | cells_of(other))


@given(windows())
def test_nowhere_shares_nothing_and_counts_for_nothing(one: Window) -> None:
    assert shared(one, NOWHERE) is shared(NOWHERE, one) is None
    assert around(one, NOWHERE) == around(NOWHERE, one) == one
    assert around(NOWHERE, NOWHERE) == NOWHERE


def test_one_begins_and_ends_at_cells() -> None:
    assert whole(EVERYWHERE, SHAPE) == (slice(0, 9), slice(0, 7))
    assert whole((slice(2, None), slice(-3, 99)), SHAPE) == (slice(2, 9), slice(4, 7))


def test_the_rows_and_columns_that_hold_some_cells() -> None:
    cells = np.zeros(SHAPE, dtype=np.bool_)
    assert window_about(cells) == NOWHERE
    cells[3, 6] = cells[5, 2] = True
    assert window_about(cells) == (slice(3, 6), slice(2, 7))
