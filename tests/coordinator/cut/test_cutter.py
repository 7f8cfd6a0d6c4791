"""Cutting again and again: what time is worth, by hand, and that it, and what ground counts, reaches the cut."""

from __future__ import annotations

import numpy as np
import pytest

from comms.said.messages import CoverageTile
from coordinator.cut.cutter import RISK_STEP, Cutter, worth_risk
from coordinator.cut.strips import Cut, CuttingRules
from planner.fleet_map import FleetMap
from planner.risk import NATS_PER_LEVEL
from planner.tiles import tiles
from planner.types import FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 40, 60)
RULES = CuttingRules(swath_m=50, p_detect=0.7, worth_risk=0.25, overhead_m=40, min_strip_m=30, max_strip_m=400)
COLUMN_M2 = 5 * 300


def fleet_that_left(risk: FloatArray) -> FleetMap:
    """A map of which all has settled, with about this residual risk."""
    fleet = FleetMap(GRID, 0.0)
    levels = np.rint(-np.log(risk) / NATS_PER_LEVEL).astype(np.uint8)
    settled = np.ones(GRID.shape, dtype=np.bool_)
    for tile in tiles(GRID):
        cells = levels[tile.window]
        told = CoverageTile(1, tile.first_row, tile.first_column, cells, cells, settled[tile.window])
        fleet.join("primary", 0, told)
    return fleet


def cuts(risk: FloatArray, sweeps_m2: float, weights: FloatArray | None = None) -> tuple[Cutter, list[Cut]]:
    inside = np.ones(GRID.shape, dtype=np.bool_)
    cutter = Cutter(fleet_that_left(risk), inside, RULES, np.ones(GRID.shape) if weights is None else weights)
    ground = cutter.assess({"primary": None}, sweeps_m2, ())
    return cutter, cutter.cut(ground, ())


@pytest.fixture
def ridge() -> FloatArray:
    """Columns of five each with 0.6, 0.9, 0.9, 0.6 from 50 m on, then 0.4; 0.1 elsewhere."""
    risk = np.full(GRID.shape, 0.1)
    risk[:, 10:30] = np.repeat([0.6, 0.9, 0.9, 0.6], 5)
    risk[:, 32:] = 0.4
    return risk


def test_where_time_is_short_strips_lie_side_by_side(ridge: FloatArray) -> None:
    # Time for all of the ridge and half of the 0.4. By what that is worth a strip's 68 rows cost 27; two of 0.75 bring
    # 90, that on the 0.9 brings 54.
    cutter, found = cuts(ridge, (20 + 4) * COLUMN_M2)
    assert cutter.rules.worth_risk == RULES.worth_risk
    assert cutter.rules.marginal_risk == pytest.approx(0.375, abs=0.026)
    assert sorted(one.window.first_column for one in found[:2]) == [10, 20]


def test_where_time_suffices_for_all_the_best_strip_comes_first(ridge: FloatArray) -> None:
    cutter, found = cuts(ridge, 100 * COLUMN_M2)
    assert cutter.rules.worth_risk == cutter.rules.marginal_risk < RULES.worth_risk
    assert found[0].window.first_column == 15


def test_ground_that_counts_more_raises_what_time_is_worth(ridge: FloatArray) -> None:
    weights = np.ones(GRID.shape)
    weights[:, 20:30] = 3.0
    plain, _ = cuts(ridge, 9.5 * COLUMN_M2)
    weighted, found = cuts(ridge, 9.5 * COLUMN_M2, weights)
    assert plain.rules.marginal_risk == pytest.approx(0.875, abs=0.026)  # 10 columns have 0.9
    assert weighted.rules.marginal_risk == pytest.approx(1.775, abs=0.051)  # 10 have 3 times 0.9 or 0.6
    assert found[0].window.first_column == 20
    assert found[0].counts_m2 == pytest.approx(3 * found[0].removable_m2)


def test_ground_that_counts_little_is_cut_where_there_is_time() -> None:
    _, found = cuts(np.full(GRID.shape, 0.8), 100 * COLUMN_M2, np.full(GRID.shape, 0.02))
    assert len(found) == 4  # the whole of it, 40 columns


class TestWorthRisk:
    RISK = np.array([0.9, 0.62, 0.62, 0.41, 0.3, 0.12, 0.01])

    @pytest.mark.parametrize(
        ("cells", "worth"),
        [(0, 0.9), (1, 0.6), (2.9, 0.6), (3, 0.4), (4, 0.3), (5, 0.1), (6, 0.05), (7, 0.05), (99, 0.05)],
    )
    def test_it_is_the_risk_of_the_first_cell_there_is_no_time_for_in_steps(self, cells: float, worth: float) -> None:
        assert worth_risk(self.RISK, cells) == pytest.approx(worth)

    def test_where_nothing_is_left_it_is_the_least(self) -> None:
        assert worth_risk(np.array([]), 0) == RISK_STEP
