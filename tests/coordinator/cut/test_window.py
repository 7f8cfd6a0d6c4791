"""Rectangles of cells, as sets of cells and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordinator.cut.window import Window

Cell = tuple[int, int]


def cells(window: Window) -> set[Cell]:
    """All of its cells, by row and column."""
    return {
        (row, column)
        for row in range(window.first_row, window.end_row)
        for column in range(window.first_column, window.end_column)
    }


@st.composite
def windows(draw: st.DrawFn) -> Window:
    first_row, first_column = draw(st.integers(0, 6)), draw(st.integers(0, 6))
    rows, columns = draw(st.integers(1, 7)), draw(st.integers(1, 7))
    return Window(first_row, first_row + rows, first_column, first_column + columns, draw(st.booleans()))


@given(windows(), windows())
def test_it_shares_with_another_the_cells_of_both(one: Window, other: Window) -> None:
    both = cells(one) & cells(other)
    assert one.shared(other) == len(both)
    assert one.overlap(other) == len(both) / len(cells(one) | cells(other))
    assert one.size == len(cells(one))
    assert all(one.holds(row, column) == ((row, column) in cells(one)) for row in range(15) for column in range(15))
    if both:
        part = one.within(other)
        assert cells(part) == {(row - other.first_row, column - other.first_column) for row, column in both}
        assert part.across == one.across


@given(windows(), st.integers(1, 4))
def test_the_blocks_that_hold_it_are_those_that_hold_one_of_its_cells(one: Window, block: int) -> None:
    blocks = one.in_blocks(block)
    assert cells(blocks) == {(row // block, column // block) for row, column in cells(one)}
    assert blocks.across == one.across
    shape = (one.end_row, one.end_column + 1)
    back = blocks.in_cells(block, shape)
    assert cells(back) == {
        (row, column)
        for row in range(shape[0])
        for column in range(shape[1])
        if (row // block, column // block) in cells(blocks)
    }
    assert back.across == one.across


def test_what_it_is_of_a_grid() -> None:
    one = Window(2, 7, 3, 12)
    assert (one.rows, one.columns_wide, one.size, one.cells_long) == (5, 9, 45, 5)
    grid = np.arange(20 * 30).reshape(20, 30)
    assert (grid[one.cells] == grid[2:7, 3:12]).all()
    assert (grid[:, one.columns] == grid[:, 3:12]).all()
    assert one.moved(10, -2) == Window(12, 17, 1, 10)
    assert one.turned == Window(3, 12, 2, 7, across=True)
    assert one.turned.turned == one
    across = Window(2, 7, 3, 12, across=True)
    assert (across.cells_long, across.moved(1, 1).across) == (9, True)


@pytest.mark.parametrize(("first_column", "at_it"), [(0, True), (2, True), (3, False), (10, False)])
def test_it_is_at_another_one_if_three_quarters_of_it_are(first_column: int, at_it: bool) -> None:
    window = Window(0, 10, first_column, first_column + 10)
    assert window.is_at_one_of([Window(50, 60, 0, 10), Window(0, 10, 0, 10)]) == at_it


def test_just_three_quarters_of_it_are_enough_and_of_the_other_no_matter() -> None:
    assert Window(0, 8, 0, 10).is_at_one_of([Window(0, 6, 0, 99)])
    assert not Window(0, 8, 0, 10).is_at_one_of([Window(0, 6, 0, 9)])
    assert not Window(0, 8, 0, 10).is_at_one_of([Window(0, 3, 0, 10), Window(5, 8, 0, 10)])
    assert not Window(0, 8, 0, 10).is_at_one_of([])
