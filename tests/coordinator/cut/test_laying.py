"""Strips that are laid for routes: where they must come to lie, by hand, and what holds of all."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordinator.cut import laying
from coordinator.cut.ground import OBJECTIVES, Ground
from coordinator.cut.laying import Laying
from coordinator.cut.legs import Flier
from coordinator.cut.strips import CuttingRules
from coordinator.cut.window import Window
from planner.types import FloatArray, GridSpec, SweepFrame

BLOCKS = GridSpec(SweepFrame(0.0, 0.0, 0.0), 10.0, 30, 40)
LAYING = Laying(BLOCKS, 2.5, CuttingRules(swath_m=50.0, overhead_m=90.0, min_strip_m=50.0, max_strip_m=400.0))
BELOW = Flier(72.5, -40.0, 0.0, 0.0, 300.0, 2.0, 15.0, 20.0, 0.0)


def ground(risk: FloatArray, contacts: FloatArray | None = None) -> Ground:
    size = np.ones(BLOCKS.shape)
    return Ground(risk, 0.8 * size, 100.0 * size, risk > 0, OBJECTIVES["mean"], 0.0, contacts=contacts)


def band(*columns: int, first_row: int = 0, end_row: int = 40) -> FloatArray:
    """Risk in some columns, as wide as a swath each, from one row to before another."""
    risk = np.zeros(BLOCKS.shape)
    for column in columns:
        risk[first_row:end_row, column : column + 5] = 0.5
    return risk


class TestWhereStripsComeToLie:
    def test_aside_onto_what_was_seen_badly(self) -> None:
        found, _, better = LAYING.laid(ground(band(5)), [[Window(0, 40, 7, 12)]], [], [BELOW], 1)
        assert [one.columns for one in found] == [slice(5, 10)]
        assert better == pytest.approx(5 / 3 - 1, abs=0.05)  # five columns for three; a block less at an end is little

    def test_longer_to_where_that_ends(self) -> None:
        found, _, _ = LAYING.laid(ground(band(5, first_row=10, end_row=30)), [[Window(15, 25, 5, 10)]], [], [BELOW], 1)
        assert [(one.first_row <= 10, one.end_row >= 30) for one in found] == [(True, True)]

    def test_another_strip_takes_the_place_of_one_that_brings_less(self) -> None:
        worst = Window(0, 40, 20, 25)
        risk = band(20) + 0.1 * band(0)
        found, _, better = LAYING.laid(
            ground(risk), [[Window(0, 40, 0, 5)]], [worst], [BELOW._replace(ends_s=400.0)], 1
        )
        assert any(one.overlap(worst) > 0.9 for one in found)
        assert better > 5.0

    def test_who_has_no_route_is_given_one(self) -> None:
        found, _, better = LAYING.laid(ground(band(5)), [[]], [Window(0, 40, 5, 10)], [BELOW], 1)
        assert len(found) >= 1
        assert better == math.inf

    def test_who_has_nothing_to_fly_takes_what_another_has_no_time_for(self) -> None:
        strips = [Window(0, 40, 0, 5), Window(0, 40, 25, 30)]
        fliers = [BELOW, BELOW._replace(across_m=272.5)]
        found, _, better = LAYING.laid(ground(band(0, 25)), [strips, []], strips, fliers, 1)
        assert {one.first_column // 15 for one in found} == {0, 1}
        assert better == pytest.approx(1.0, abs=0.1)

    def test_onto_an_object_beside_it(self) -> None:
        contacts = np.zeros((2, *BLOCKS.shape))
        contacts[:, 20, 13] = 500.0
        found, _, better = LAYING.laid(ground(1e-3 * band(8), contacts), [[Window(0, 40, 8, 13)]], [], [BELOW], 1)
        assert any(one.holds(20, 13) for one in found)
        assert better > 10.0


def removed_m2(ground: Ground, windows: Sequence[Window]) -> float:
    """What looks along all of these remove, each of what those before it have left."""
    after = ground.copy()
    after.fly_each(windows)
    return float((ground.weights * (ground.risk - after.risk)).sum())


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 3), st.integers(1, 2), st.one_of(st.floats(50.0, 900.0), st.just(9000.0)))
def test_it_is_never_worse_and_strips_are_as_long_as_they_may_be(
    seed: int, strips: int, helpers: int, ends_s: float
) -> None:
    chance = np.random.default_rng(seed)
    told = ground(chance.random(BLOCKS.shape) ** 3)
    chosen = [Window(5, 35, 5 * number, 5 * number + 5) for number in range(strips)]
    others = [Window(8, 13, 0, 30, across=True), Window(20, 25, 2, 22, across=True)]
    fliers = [BELOW._replace(ends_s=ends_s), BELOW._replace(across_m=200.0, ends_s=ends_s)][:helpers]
    routes = [chosen, [Window(0, 40, 20, 25)]][:helpers]
    found, parts, better = LAYING.laid(told, routes, others, fliers, seed)
    assert (found, parts, better) == LAYING.laid(told, routes, others, fliers, seed)
    for one in found:
        assert 0 <= one.first_row < one.end_row <= 40
        assert 0 <= one.first_column < one.end_column <= 30
        assert 5 <= one.cells_long <= 40
        assert one.size == 5 * one.cells_long
    for one, part in zip(found, parts, strict=True):
        assert part.size > 0
        assert one.shared(part) == part.size
    if ends_s > 3000.0:  # there is time for all of it
        assert parts == found
        given_m2, laid_m2 = (removed_m2(told, some) for some in ([one for its in routes for one in its], found))
        assert laid_m2 >= given_m2
        assert better == (pytest.approx(laid_m2 / given_m2 - 1.0) if given_m2 else math.inf)
    assert told.risk.tolist() == (np.random.default_rng(seed).random(BLOCKS.shape) ** 3).tolist()


def test_more_steps_find_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a map with some structure, beginning with lanes at a wrong place."""
    rows, columns = np.mgrid[0:40, 0:30]
    told = ground(0.5 + 0.5 * np.sin(rows / 5.0) * np.cos(columns / 3.0))
    routes = [[Window(0, 40, column, column + 5) for column in (2, 12, 22)]]
    better = []
    for steps in (10, 100, 1000):
        monkeypatch.setattr(laying, "STEPS", steps)
        better.append(LAYING.laid(told, routes, [], [BELOW._replace(ends_s=700.0)], 1).better)
    assert better[0] < better[1] < better[2]
    assert better[2] > 0.1
