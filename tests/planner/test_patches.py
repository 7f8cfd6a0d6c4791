"""Patches: which cells touch, what is new about them, and which numbers they carry on, against plain definitions."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from planner.hotspots import HotspotMap, update_hotspots
from planner.patches import NOT_HOT, _compared, _labels, carried_on
from planner.types import BoolArray, GridSpec, SweepFrame

pictures = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))
SHAPES = array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=6)
Cell = tuple[int, int]


def cells_of(picture: str) -> BoolArray:
    return np.array([[mark == "#" for mark in line] for line in picture.split()])


def label_groups(cells: BoolArray, block: int) -> tuple[NDArray[np.int32], int]:
    labels, count = _labels(np.array(cells).ravel(), cells.shape[1], block)
    return labels.reshape(cells.shape), count


def cells_where(cells: BoolArray) -> list[Cell]:
    return [(row, column) for row, column in np.argwhere(cells).tolist()]


@given(st.data(), SHAPES)
def test_what_has_become_another_lies_within_the_bounds(data: st.DataObject, shape: Cell) -> None:
    hot, unsettled, growing_before = (data.draw(arrays(np.bool_, shape)) for _ in range(3))
    risk, risk_before = (data.draw(arrays(np.float64, shape, elements=st.sampled_from([0.0, 0.5]))) for _ in range(2))
    risk_before[data.draw(arrays(np.bool_, shape))] = NOT_HOT
    part = (
        *sorted(data.draw(st.tuples(*[st.integers(0, shape[0])] * 2))),
        *sorted(data.draw(st.tuples(*[st.integers(0, shape[1])] * 2))),
    )
    now, growing = risk_before.copy(), growing_before.copy()
    bounds = _compared(hot, unsettled, risk, part, now, growing)
    expected, expected_growing = risk_before.copy(), growing_before.copy()
    open_cells = set(cells_where(unsettled))
    for row, column in np.ndindex(shape):
        beside = {(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)}
        if part[0] - 1 <= row <= part[1] and part[2] - 1 <= column <= part[3]:
            expected[row, column] = risk[row, column] if hot[row, column] else NOT_HOT
            expected_growing[row, column] = hot[row, column] and bool(beside & open_cells)
    assert now.tolist() == expected.tolist()
    assert growing.tolist() == expected_growing.tolist()
    others = cells_where((now != risk_before) | (growing != growing_before))
    if others:
        rows, columns = zip(*others, strict=True)
        assert bounds == (min(rows), max(rows), min(columns), max(columns))
    else:
        assert bounds[1] == -1


def flood_fill(cells: BoolArray, block: int) -> tuple[NDArray[np.int32], int]:
    """The definition: from each cell that has no number yet, to all that can be reached."""
    labels = np.zeros(cells.shape, dtype=np.int32)
    count = 0
    for row, column in zip(*(places.tolist() for places in np.nonzero(cells)), strict=True):
        if labels[row, column]:
            continue
        count += 1
        ahead = [(row, column)]
        while ahead:
            r, c = ahead.pop()
            labels[r, c] = count
            for beside in ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)):
                inside = 0 <= beside[0] < cells.shape[0] and 0 <= beside[1] < cells.shape[1]
                one_block = (beside[0] // block, beside[1] // block) == (r // block, c // block)
                if inside and one_block and cells[beside] and not labels[beside]:
                    ahead.append(beside)
    return labels, count


def spiral(side: int) -> BoolArray:
    """One group, as long as can be: a way that winds inwards, one empty cell between its turns."""
    cells = np.zeros((side, side), dtype=bool)
    low, high = 0, side - 1
    while low < high:
        cells[low, max(low - 2, 0) : high + 1] = True
        cells[low : high + 1, high] = True
        cells[high, low : high + 1] = True
        cells[low + 2 : high + 1, low] = True
        low, high = low + 2, high - 2
    return cells


class TestGroupsByHand:
    def test_groups_touch_by_their_sides_and_are_numbered_along_the_rows(self) -> None:
        labels, count = label_groups(cells_of("#.#.# ###.. ...## #..#."), 100)
        assert labels.tolist() == [[1, 0, 1, 0, 2], [1, 1, 1, 0, 0], [0, 0, 0, 3, 3], [4, 0, 0, 3, 0]]
        assert count == 4

    def test_rows_do_not_run_on_into_the_next(self) -> None:
        labels, count = label_groups(cells_of("..## ##.."), 100)
        assert labels.tolist() == [[0, 0, 1, 1], [2, 2, 0, 0]]
        assert count == 2

    def test_groups_end_at_the_borders_of_blocks(self) -> None:
        labels, count = label_groups(np.ones((3, 5), dtype=bool), 2)
        assert labels.tolist() == [[1, 1, 2, 2, 3], [1, 1, 2, 2, 3], [4, 4, 5, 5, 6]]
        assert count == 6

    def test_blocks_of_one_cell(self) -> None:
        labels, count = label_groups(cells_of("##. #.#"), 1)
        assert labels.tolist() == [[1, 2, 0], [3, 0, 4]]
        assert count == 4

    @pytest.mark.parametrize("shape", [(3, 4), (0, 4), (3, 0)])
    def test_no_cells_no_groups(self, shape: tuple[int, int]) -> None:
        labels, count = label_groups(np.zeros(shape, dtype=bool), 2)
        assert labels.tolist() == np.zeros(shape).tolist()
        assert count == 0


class TestGroups:
    @given(pictures, st.integers(1, 14))
    @example(spiral(40), 100)
    @example(spiral(40), 15)
    @example(spiral(41).T, 100)
    @example(np.tile(cells_of("#.# ###"), (1, 20)), 100)
    @example(np.tile(cells_of("### #.#"), (1, 20)), 33)
    def test_is_the_flood_fill(self, cells: BoolArray, block: int) -> None:
        labels, count = label_groups(cells, block)
        expected, expected_count = flood_fill(cells, block)
        assert labels.tolist() == expected.tolist()
        assert count == expected_count

    @pytest.mark.parametrize("share", [0.3, 0.55, 0.6, 0.9])
    def test_is_the_flood_fill_on_a_large_grid(self, share: float) -> None:
        cells = np.random.default_rng(3).random((80, 243)) < share
        labels, count = label_groups(cells, 100)
        expected, expected_count = flood_fill(cells, 100)
        assert labels.tolist() == expected.tolist()
        assert count == expected_count


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


@given(st.data(), SHAPES, st.integers(1, 4), st.sampled_from([1.0, 7.0, 12.0]))
def test_numbers_are_carried_on(data: st.DataObject, shape: Cell, block: int, least_m2: float) -> None:
    hot, unsettled, growing_before = (data.draw(arrays(np.bool_, shape)) for _ in range(3))
    before = data.draw(arrays(np.int32, shape, elements=st.integers(0, 5)))
    risk = data.draw(arrays(np.float64, shape, elements=st.floats(0, 1)))
    risk_before = np.where(data.draw(arrays(np.bool_, shape)), risk, NOT_HOT)
    given_before, all_of_it = (risk_before, growing_before, before.copy()), (0, shape[0], 0, shape[1])
    found = carried_on(hot, unsettled, risk, all_of_it, *given_before, 6, block, (3.0, least_m2))

    risk, growing = found.risk, found.growing
    others = np.argwhere((risk != risk_before) | (growing != growing_before))
    if not others.size:
        assert found.window[0] >= found.window[1]
        return
    (first_row, first_column), (last_row, last_column) = others.min(axis=0) // block, others.max(axis=0) // block
    there = (
        slice(first_row * block, min((last_row + 1) * block, shape[0])),
        slice(first_column * block, min((last_column + 1) * block, shape[1])),
    )
    assert found.window == (there[0].start, there[0].stop, there[1].start, there[1].stop)
    labels, count = flood_fill(hot[there], block)
    assert found.labels_there.tolist() == labels.tolist()

    cells = {label: cells_where(labels == label) for label in range(1, count + 1)}
    patches = {label: its for label, its in cells.items() if 3.0 * len(its) >= least_m2}
    had = {cell: int(before[there][cell]) for cell in np.ndindex(labels.shape)}
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
    # Numbers that happen to be whole, and cells in another order or not to be written to.
    grid = GridSpec(SweepFrame(0, 0, 0), 5, columns=4, rows=6)
    hot = np.ones((4, 6), dtype=np.bool_).T
    hot.setflags(write=False)
    update_hotspots(grid, hot, ~hot, np.ones((6, 8))[:, ::2], HotspotMap.empty(grid), least_area_m2=100)
    assert times_compiled(carried_on) == 1
