"""What second looks are expected to find: by the seabed, and by what they have found."""

from __future__ import annotations

import numpy as np
import pytest

from coordinator.expected_looks import ExpectedLooks
from coordinator.strips import Window
from planner.types import GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 6, 8)
CLEAR = np.ones(GRID.shape)


def test_what_the_seabed_leaves_a_primary_counts_by_its_root() -> None:
    share = CLEAR.copy()
    share[2, 3] = 0.49
    factor = ExpectedLooks(GRID).factor(share)
    assert factor[2, 3] == pytest.approx(0.7)
    assert factor.sum() == pytest.approx(CLEAR.sum() - 0.3)


def test_where_a_helper_has_looked_its_best_look_counts() -> None:
    looks = ExpectedLooks(GRID)
    p_detect = np.zeros((3, 2))
    p_detect[0] = [0.35, 0.7]
    looks.learn(Window(2, 5, 0, 2), p_detect, 0.7)
    looks.learn(Window(2, 5, 0, 2), p_detect / 2, 0.7)
    factor = looks.factor(0.25 * CLEAR)
    assert factor[2, :2] == pytest.approx([0.5, 1.0])
    factor[2, :2] = 0.5
    assert (factor == 0.5).all()
