"""The statistics of a map that is drawn in blocks are those of the whole map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.risk import risk_statistics
from planner.types import GridSpec, SweepFrame
from viz.risk_map import MOST_BLOCKS, Blocks, RiskTally

LEVELS = st.integers(0, 255)


def counted(levels: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """How many cells have each level, and the risk of each level."""
    return np.bincount(levels, minlength=256), np.exp(-0.02 * np.arange(256))


@given(levels=arrays(np.uint8, (3, 40), elements=LEVELS), later=arrays(np.uint8, (2, 40), elements=LEVELS))
def test_it_says_what_the_whole_map_says(levels: np.ndarray[Any, Any], later: np.ndarray[Any, Any]) -> None:
    tally = RiskTally(3)
    for block, row in enumerate(levels):
        tally.replace(block, *counted(row))
    for block, row in enumerate(later):
        changed = bool(np.count_nonzero(row) != np.count_nonzero(levels[block]))
        assert tally.replace(block, *counted(row)) is changed
    risk = np.exp(-0.02 * np.vstack([later, levels[2:]]))
    expected = risk_statistics(risk, risk < 1.0, np.ones_like(risk, dtype=np.bool_))
    found = tally.statistics()
    assert found.cells == expected.cells
    assert found.mean == pytest.approx(expected.mean)
    assert found.worst30_mean == pytest.approx(expected.worst30_mean, abs=1e-3)
    assert found.uncovered_share == pytest.approx(expected.uncovered_share)


def test_without_a_cell_there_are_no_statistics() -> None:
    with pytest.raises(ValueError, match="no cell lies inside the area"):
        RiskTally(1).statistics()


@given(rows=st.integers(1, 4000), columns=st.integers(1, 5000), place=st.floats(0, 0.999), across=st.floats(0, 0.999))
def test_each_cell_lies_in_one_of_not_too_many_blocks(rows: int, columns: int, place: float, across: float) -> None:
    blocks = Blocks(GridSpec(SweepFrame(0, 0, 0), 1.0, columns, rows))
    assert len(blocks.all) <= MOST_BLOCKS
    assert len({block.name for block in blocks.all}) == len(blocks.all)
    row, column = int(rows * place), int(columns * across)
    within = [
        index
        for index, block in enumerate(blocks.all)
        if block.window[0].start <= row < block.window[0].stop
        and block.window[1].start <= column < block.window[1].stop
    ]
    assert within == [blocks.index_at(row, column)]
