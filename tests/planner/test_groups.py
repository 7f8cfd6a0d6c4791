"""Groups of cells that touch: by hand, and what holds for every map."""

from __future__ import annotations

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from planner.groups import _labels, label_groups
from planner.types import BoolArray

pictures = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def cells_of(picture: str) -> BoolArray:
    return np.array([[mark == "#" for mark in line] for line in picture.split()])


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


class TestByHand:
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

    def test_leaves_its_argument_alone(self) -> None:
        cells = cells_of("##. #.#")
        label_groups(cells, 2)
        assert cells.tolist() == cells_of("##. #.#").tolist()

    @pytest.mark.parametrize("block", [0, -1])
    def test_refuses_blocks_without_cells(self, block: int) -> None:
        with pytest.raises(ValueError, match="block"):
            label_groups(np.ones((2, 2), dtype=bool), block)

    @needs_compiling
    def test_is_compiled_for_one_kind_of_cells(self) -> None:
        read_only = cells_of("##. #.#")
        read_only.setflags(write=False)
        for cells in (read_only, read_only.T, read_only[:, ::2]):
            label_groups(cells, 2)
        assert times_compiled(_labels) == 1


class TestProperties:
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
