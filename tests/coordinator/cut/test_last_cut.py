"""What counts as changed since strips were last cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coordinator.cut.cutter import LastCut
from coordinator.cut.ground import Growth
from coordinator.cut.strips import CuttingRules
from coordinator.cut.window import Window
from planner.types import FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 40, 30)
RISK = np.full(GRID.shape, 0.5)
ALL_SETTLED = np.zeros(GRID.shape, dtype=np.bool_)
STRIP = Window(5, 20, 30, 36)
# A swath of one column: what has changed is told with two columns beside.
RULES = CuttingRules(swath_m=5, p_detect=0.9, worth_risk=0.5, overhead_m=50, min_strip_m=20, max_strip_m=200)


@pytest.fixture
def last() -> LastCut:
    """A cut of an area that has settled, from which one strip came."""
    last = LastCut(GRID)
    assert changed(last) == [*range(40)]  # before the first cut all has changed
    last.remember([STRIP])
    return last


def changed(
    last: LastCut, risk: FloatArray = RISK, rules: CuttingRules = RULES, windows: tuple[Window, ...] = (STRIP,)
) -> list[int]:
    columns = last.changed_columns(risk, ALL_SETTLED, Growth.none(GRID), rules, windows)
    return np.flatnonzero(columns).tolist()


def with_risk(row: int, column: int) -> FloatArray:
    risk = RISK.copy()
    risk[row, column] = 0.6
    return risk


def test_nothing_has_where_all_is_as_it_was(last: LastCut) -> None:
    assert changed(last) == []


def test_the_column_of_a_cell_has_and_those_two_swaths_beside_within_the_grid(last: LastCut) -> None:
    assert changed(last, with_risk(3, 10)) == [8, 9, 10, 11, 12]
    assert changed(last, with_risk(3, 1)) == [0, 1, 2, 3, 8, 9, 10, 11, 12]  # the cell before is back, too
    assert changed(last, with_risk(3, 39)) == [0, 1, 2, 3, 37, 38, 39]


def test_nothing_has_where_time_alone_is_worth_another(last: LastCut) -> None:
    assert changed(last, rules=replace(RULES, marginal_risk=0.8)) == []
    assert changed(last, rules=replace(RULES, worth_risk=0.4)) == [*range(40)]


def test_a_wider_swath_reaches_farther(last: LastCut) -> None:
    wider = replace(RULES, swath_m=10)
    changed(last, rules=wider)
    assert changed(last, with_risk(3, 10), wider) == [*range(6, 15)]


def test_what_has_changed_once_is_known_the_next_time(last: LastCut) -> None:
    assert changed(last, with_risk(3, 10)) == [8, 9, 10, 11, 12]
    assert changed(last, with_risk(3, 10)) == []


def test_with_other_rules_all_has_once(last: LastCut) -> None:
    assert changed(last, rules=replace(RULES, worth_risk=0.4)) == [*range(40)]
    assert changed(last, rules=replace(RULES, worth_risk=0.4)) == []
    assert changed(last) == [*range(40)]


def test_where_a_strip_has_gone_the_cells_have(last: LastCut) -> None:
    assert changed(last, windows=()) == [*range(28, 38)]


def test_where_one_has_come_they_have_not(last: LastCut) -> None:
    assert changed(last, windows=(STRIP, Window(0, 9, 3, 9))) == []


def test_what_settles_has(last: LastCut) -> None:
    open_cells, growth = ALL_SETTLED.copy(), Growth.none(GRID)
    open_cells[7, 4] = True
    growth.settles_s[0, 20] = 99.0
    columns = last.changed_columns(RISK, open_cells, growth, RULES, [STRIP])
    assert np.flatnonzero(columns).tolist() == [*range(2, 7), *range(18, 23)]
