"""What second looks are expected to find: by the column, and by what they have found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from coordinator.cut.ground import LEAST_SHARE, ExpectedLooks
from coordinator.cut.window import Window
from planner.types import FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 6, 8)
EVERYWHERE = Window(0, 8, 0, 6)


def columns(*values: list[float]) -> FloatArray:
    """A map of columns with these residual risks, and nothing in the others."""
    risk = np.zeros(GRID.shape)
    for column, rows in enumerate(values):
        risk[:, column] = rows
    return risk


def test_where_all_of_a_column_is_seen_alike_nothing_hides() -> None:
    factor = ExpectedLooks(GRID).factor(columns([0.8] * 8, [0.4] * 8))
    assert (factor == 1).all()


def test_what_is_seen_worse_than_most_of_its_column_lies_where_the_seabed_hides() -> None:
    # Three quarters of the way up to the best of eight: the sixth, 0.4. A quarter of that, to the power of a half.
    factor = ExpectedLooks(GRID).factor(columns([0.6, 0.6, 0.6, 0.6, 0.6, 0.64, 0.8, 0.99]))
    assert factor[:5, 0] == pytest.approx(1)
    assert factor[5:, 0] == pytest.approx([0.9**0.5, 0.5**0.5, LEAST_SHARE**0.5])
    assert (factor[:, 1:] == 1).all()


def test_what_nobody_has_seen_tells_nothing_of_the_seabed() -> None:
    assert (ExpectedLooks(GRID).factor(columns([1.0] * 8, [1.0, *[0.5] * 7])) == 1).all()


def test_where_a_helper_has_looked_its_best_look_counts() -> None:
    looks = ExpectedLooks(GRID)
    p_detect = np.zeros((3, 2))
    p_detect[0] = [0.35, 0.7]
    looks.learn(Window(2, 5, 0, 2), p_detect, 0.7)
    looks.learn(Window(2, 5, 0, 2), p_detect / 2, 0.7)
    factor = looks.factor(columns([0.8] * 8, [0.8] * 8))
    assert factor[2, :2] == pytest.approx([0.5, 1.0])
    factor[2, :2] = 1
    assert (factor == 1).all()


def test_what_is_learned_later_counts_in_a_map_that_is_as_it_was() -> None:
    looks, risk = ExpectedLooks(GRID), columns([0.8] * 8)
    assert (looks.factor(risk) == 1).all()
    looks.learn(EVERYWHERE, np.full(GRID.shape, 0.14), 0.7)
    assert looks.factor(risk) == pytest.approx(0.2)


@settings(max_examples=50, deadline=None)
@given(st.lists(arrays.arrays(np.float64, GRID.shape, elements=st.sampled_from([0, 0.3, 0.7, 0.98, 1])), max_size=4))
def test_working_out_what_changed_alone_gives_the_same(maps: list[FloatArray]) -> None:
    looks = ExpectedLooks(GRID)
    for risk in maps:
        factor = looks.factor(risk).copy()
        assert (factor == ExpectedLooks(GRID).factor(risk)).all()
        assert ((factor > 0) & (factor <= 1)).all()
