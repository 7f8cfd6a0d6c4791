"""Patches: what is new about them, and which numbers they carry on, against plain definitions."""

from __future__ import annotations

from collections import Counter

import numpy as np
from compiling import needs_compiling, times_compiled
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from planner.patches import NOT_HOT, carried_on, compared
from planner.types import BoolArray

SHAPES = array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=6)
Cell = tuple[int, int]


def cells_where(cells: BoolArray) -> list[Cell]:
    return [(row, column) for row, column in np.argwhere(cells).tolist()]


@given(st.data(), SHAPES)
def test_what_is_another_than_before_lies_within_the_bounds(data: st.DataObject, shape: Cell) -> None:
    hot, unsettled, growing_before = (data.draw(arrays(np.bool_, shape)) for _ in range(3))
    risk, risk_before = (data.draw(arrays(np.float64, shape, elements=st.sampled_from([0.0, 0.5]))) for _ in range(2))
    risk_before[data.draw(arrays(np.bool_, shape))] = NOT_HOT
    now, growing = risk.copy(), np.zeros(shape, dtype=np.bool_)
    bounds = compared(hot, unsettled, now, growing, risk_before, growing_before)
    assert now.tolist() == np.where(hot, risk, NOT_HOT).tolist()
    open_cells = set(cells_where(unsettled))
    for row, column in np.ndindex(shape):
        beside = {(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)}
        assert growing[row, column] == (hot[row, column] and bool(beside & open_cells))
    others = cells_where((now != risk_before) | (growing != growing_before))
    if others:
        rows, columns = zip(*others, strict=True)
        assert bounds == (min(rows), max(rows), min(columns), max(columns))
    else:
        assert bounds[1] == -1


def numbers_by_definition(patches: dict[int, list[Cell]], before: dict[Cell, int], next_number: int) -> dict[int, int]:
    """The number of each patch by its label: who is larger chooses first, and nobody another number before all had a
    chance at the one they want most."""
    number_of: dict[int, int] = {}
    largest_first = sorted(patches, key=lambda label: (-len(patches[label]), label))
    for most in (1, None):
        for label in largest_first:
            had = Counter(before[cell] for cell in patches[label] if before[cell])
            wanted = sorted(had, key=lambda number: (-had[number], number))[:most]
            free = [number for number in wanted if number not in number_of.values()]
            if label not in number_of and free:
                number_of[label] = free[0]
    for label in patches:
        if label not in number_of:
            number_of[label], next_number = next_number, next_number + 1
    return number_of


@given(st.data(), SHAPES, st.integers(0, 2), st.integers(0, 2), st.sampled_from([1.0, 7.0, 12.0]))
def test_numbers_are_carried_on(data: st.DataObject, shape: Cell, top: int, left: int, least_m2: float) -> None:
    labels = data.draw(arrays(np.int32, shape, elements=st.integers(0, 4)))
    whole = shape[0] + top + 1, shape[1] + left + 1
    before = data.draw(arrays(np.int32, whole, elements=st.integers(0, 5)))
    risk, growing = data.draw(arrays(np.float64, whole, elements=st.floats(0, 1))), data.draw(arrays(np.bool_, whole))
    found = carried_on(labels, (top, left), 4, risk, growing, before.copy(), 6, (3.0, least_m2))

    cells = {label: cells_where(labels == label) for label in range(1, 5)}
    patches = {label: its for label, its in cells.items() if 3.0 * len(its) >= least_m2}
    there = (slice(top, top + shape[0]), slice(left, left + shape[1]))
    had = {cell: int(before[there][cell]) for cell in np.ndindex(shape)}
    number_of = numbers_by_definition(patches, had, 6)
    assert dict(zip(found.labels.tolist(), found.number_of.tolist(), strict=True)) == number_of
    assert found.labels.tolist() == sorted(patches)
    assert found.next_number == max([5, *number_of.values()]) + 1
    expected = before.copy()
    expected[there] = 0
    for label, its in patches.items():
        for cell in its:
            expected[there][cell] = number_of[label]
    assert found.numbers.tolist() == expected.tolist()

    for place, (label, its) in enumerate(patches.items()):
        rows, columns = zip(*its, strict=True)
        assert found.sizes[place] == len(its)
        assert found.bounds[place].tolist() == [min(rows), max(rows) + 1, min(columns), max(columns) + 1]
        assert found.risk_sums[place] == sum(float(risk[there][cell]) for cell in its)  # to the last bit: row by row
        assert found.is_growing[place] == any(growing[there][cell] for cell in its)
        assert found.is_reshaped[place] == ({cell for cell in had if had[cell] == number_of[label]} != set(its))

    gone = [number for number in dict.fromkeys(had.values()) if number and number not in number_of.values()]
    assert found.gone.tolist() == gone
    for number, heir in zip(gone, found.heirs.tolist(), strict=True):
        has = Counter(int(expected[there][cell]) for cell in had if had[cell] == number)
        del has[0]
        assert heir == min(has, key=lambda one: (-has[one], one), default=0)


@needs_compiling
def test_are_compiled_for_one_kind_of_arguments() -> None:
    assert times_compiled(compared) == times_compiled(carried_on) == 1
