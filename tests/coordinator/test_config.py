"""Ground that counts more or less: the weight of each cell."""

from __future__ import annotations

import math

import numpy as np
import pytest
from coordinator_by_hand import PATIENCE
from hypothesis import given
from hypothesis import strategies as st

from coordinator.allocate.simple import GreedyAllocator
from coordinator.config import CoordinatorConfig, weights_over
from planner.types import GridSpec, PriorityGround, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 10, 4, 6)  # 40 m across, 60 m along; cell centres 0, 10, 20, 30 and 5 to 55
ALL = np.ones(GRID.shape, dtype=np.bool_)


def test_without_priorities_all_counts_alike() -> None:
    assert (weights_over(GRID, ALL, ()) == 1).all()


def test_where_they_overlap_the_last_one_counts() -> None:
    south = PriorityGround((((-100.0, -100.0), (100.0, -100.0), (100.0, 20.0), (-100.0, 20.0)),), 3.0)  # rows 0 and 1
    west = PriorityGround((((-100.0, -100.0), (5.0, -100.0), (5.0, 100.0), (-100.0, 100.0)),), 0.5)  # column 0
    weights = weights_over(GRID, ALL, (south, west))
    mean = (6 * 0.5 + 6 * 3 + 12 * 1) / 24
    assert weights * mean == pytest.approx(np.array([[0.5, 3.0, 3.0, 3.0]] * 2 + [[0.5, 1.0, 1.0, 1.0]] * 4))


@given(st.floats(0.001, 100))
def test_what_all_of_the_area_counts_changes_nothing(weight: float) -> None:
    inside = ALL.copy()
    inside[0] = False
    around = PriorityGround((((-50.0, 9.0), (90.0, 9.0), (90.0, 90.0), (-50.0, 90.0)),), weight)
    assert weights_over(GRID, inside, [around])[inside] == pytest.approx(1)


def test_where_nothing_counts_it_stays_nothing() -> None:
    around = PriorityGround((((-50.0, -50.0), (90.0, -50.0), (90.0, 90.0), (-50.0, 90.0)),), 0.0)
    assert (weights_over(GRID, ALL, [around]) == 0).all()


def test_of_a_map_without_a_cell_in_the_area_weights_are_as_they_were_told() -> None:
    south = PriorityGround((((-100.0, -100.0), (100.0, -100.0), (100.0, 20.0), (-100.0, 20.0)),), 3.0)
    weights = weights_over(GRID, ~ALL, [south])
    assert (weights[:2].min(), weights[2:].max()) == (3.0, 1.0)


def test_where_nobody_says_otherwise_there_is_no_link_three_share_a_sector_and_none_keep_apart() -> None:
    config = CoordinatorConfig(GreedyAllocator(), 1.05, PATIENCE, 30, 400, 0.3, 0.2)
    assert (config.looks_within_ms, config.ahead_ms) == (0, 0)
    assert (config.answer_within_ms, config.helpers_a_team) == (10_000, 3)
    assert (config.separation_m, config.across, config.contacts) == (0, True, False)


@pytest.mark.parametrize("heading_deg", [0.0, 30.0, 90.0])
def test_they_lie_in_the_mission_frame_whatever_way_tracks_run(heading_deg: float) -> None:
    grid = GridSpec(SweepFrame(0, 0, math.radians(heading_deg)), 10, 30, 30)
    across_m, along_m = np.meshgrid(grid.across_m, grid.along_m)
    x_m, y_m = grid.frame.to_mission(across_m, along_m)
    inside = np.ones(grid.shape, dtype=np.bool_)
    weights = weights_over(
        grid, inside, [PriorityGround((((20.0, -60.0), (120.0, -60.0), (120.0, 60.0), (20.0, 60.0)),), 2.0)]
    )
    within = (x_m > 20) & (x_m < 120) & (y_m > -60) & (y_m < 60)
    assert within.any()
    assert (weights[within] == 2 * weights.min()).all()
    outside = (x_m < 19) | (x_m > 121) | (y_m < -61) | (y_m > 61)
    assert (weights[outside] == weights.min()).all()
