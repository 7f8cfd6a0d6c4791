"""Residual risk: the paper's equation, layers that add looks up, and their levels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.risk import (
    NATS_PER_LEVEL,
    LevelArray,
    RiskLayer,
    _add,
    _levels,
    residual_risk,
    risk_of_levels,
    risk_statistics,
    to_levels,
)
from planner.types import EVERYWHERE, FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, columns=4, rows=3)
LARGE = GridSpec(SweepFrame(0, 0, 0), 5, columns=150, rows=200)

P_DETECT = st.sampled_from([0.0, 1e-4, 0.005, 0.999]) | st.floats(0, 0.999)
looks = st.lists(arrays(np.float64, GRID.shape, elements=P_DETECT), min_size=1, max_size=6)
level_arrays = arrays(np.uint8, GRID.shape)


def layer_of(*p_detect: FloatArray) -> RiskLayer:
    layer = RiskLayer(GRID)
    for look in p_detect:
        layer.add_look(*EVERYWHERE, look)
    return layer


def levels(*values: int) -> LevelArray:
    return np.array(values, dtype=np.uint8)


def windows(grid: GridSpec) -> st.SearchStrategy[tuple[slice, slice]]:
    rows, columns = (
        st.tuples(st.integers(0, size), st.integers(0, size)).map(lambda ends: slice(*sorted(ends)))
        for size in grid.shape
    )
    return st.tuples(rows, columns)


class TestRiskLayer:
    def test_starts_without_any_look(self) -> None:
        layer = RiskLayer(GRID)
        assert layer.nats().shape == (2, 3, 4)
        assert not layer.nats().any()
        assert not layer.sum_levels.any()
        assert not layer.largest_levels.any()

    def test_adds_a_look_to_its_window_only(self) -> None:
        layer = RiskLayer(GRID)
        layer.add_look(slice(1, 2), slice(2, 4), np.array([[0.5, 0.0]]))
        layer.add_look(slice(0, 2), slice(2, 3), np.array([[0.2], [0.2]]))
        expected = np.zeros((3, 4))
        expected[0, 2], expected[1, 2] = -math.log(0.8), -math.log(0.4)
        assert layer.nats()[0] == pytest.approx(expected)
        # 0.223 and 0.916 nats.
        assert layer.sum_levels.tolist() == [[0, 0, 11, 0], [0, 0, 46, 0], [0, 0, 0, 0]]
        expected[1, 2] = -math.log(0.5)
        assert layer.nats()[1] == pytest.approx(expected)
        assert layer.largest_levels.tolist() == [[0, 0, 11, 0], [0, 0, 35, 0], [0, 0, 0, 0]]

    def test_takes_a_look_that_misses_the_grid(self) -> None:
        layer = layer_of()
        layer.add_look(slice(0, 0), slice(0, 0), np.zeros((0, 0)))
        assert not layer.nats()[0].any()

    @given(looks)
    def test_keeps_the_sum_over_looks_and_the_largest_of_them(self, p_detect: list[FloatArray]) -> None:
        layer = layer_of(*p_detect)
        nats = [-np.log(1 - look) for look in p_detect]
        assert layer.nats()[0] == pytest.approx(np.sum(nats, axis=0), abs=1e-12)
        assert layer.nats()[1] == pytest.approx(np.max(nats, axis=0), abs=1e-12)

    @given(st.lists(windows(LARGE), max_size=6), windows(LARGE))
    def test_the_part_that_is_held_grows_with_the_looks(
        self, looked_at: list[tuple[slice, slice]], asked: tuple[slice, slice]
    ) -> None:
        layer, expected = RiskLayer(LARGE), np.zeros((2, *LARGE.shape))
        for number, window in enumerate(looked_at, start=1):
            p_detect = np.full(expected[0][window].shape, 0.1 * number)
            layer.add_look(*window, p_detect)
            expected[0][window] += -np.log1p(-p_detect)
            expected[1][window] = -np.log1p(-p_detect)
        assert layer.nats().tolist() == expected.tolist()
        assert layer.nats(asked).tolist() == expected[:, *asked].tolist()

    @given(looks)
    def test_levels_are_those_of_the_layer_as_it_is(self, p_detect: list[FloatArray]) -> None:
        layer = layer_of(*p_detect)
        assert layer.sum_levels.tolist() == to_levels(layer.nats()[0]).tolist()
        assert layer.largest_levels.tolist() == to_levels(layer.nats()[1]).tolist()
        assert (layer.largest_levels <= layer.sum_levels).all()

    @given(looks)
    def test_what_was_looked_at_at_all_has_a_level(self, p_detect: list[FloatArray]) -> None:
        layer = layer_of(*p_detect)
        looked_at = np.any(p_detect, axis=0)
        assert (layer.sum_levels > 0).tolist() == looked_at.tolist()
        assert (layer.largest_levels > 0).tolist() == looked_at.tolist()

    @pytest.mark.parametrize("p_detect", [-0.01, 0.9991, 1.0, math.nan])
    def test_refuses_what_no_look_can_claim(self, p_detect: float) -> None:
        layer = RiskLayer(GRID)
        look = np.full(GRID.shape, 0.5)
        look[1, 1] = p_detect
        with pytest.raises(ValueError, match=r"0 to 0\.999"):
            layer.add_look(*EVERYWHERE, look)
        assert not layer.nats()[0].any()
        assert not layer.sum_levels.any()

    @pytest.mark.parametrize("shape", [(1, 4), (3, 1), (4, 3), (0, 4), (3, 5)])
    def test_refuses_a_look_in_another_window(self, shape: tuple[int, int]) -> None:
        layer = RiskLayer(GRID)
        with pytest.raises(ValueError, match="window"):
            layer.add_look(*EVERYWHERE, np.full(shape, 0.5))
        assert not layer.sum_levels.any()

    @needs_compiling
    def test_is_compiled_for_one_kind_of_looks(self) -> None:
        layer = layer_of(np.full((4, 3), 0.5).T, np.full((3, 8), 0.5)[:, ::2])
        layer.add_look(slice(1, 2), slice(2, 3), np.full((1, 1), 0.5))
        read_only = to_levels(layer.nats()).astype(np.float64)
        read_only.setflags(write=False)
        to_levels(read_only[0])
        assert times_compiled(_add) == times_compiled(_levels) == 1


class TestToLevels:
    def test_by_hand(self) -> None:
        # A trace; either side of one and a half levels; 0.693 nats; 5.0 nats; either side of 254 and a half; too many.
        nats = np.array([0.0, 1e-9, 0.0299, 0.0301, 0.693, 5.0, 5.0899, 5.0901, 6.9])
        found = to_levels(nats)
        assert found.dtype == np.uint8
        assert found.tolist() == [0, 1, 1, 2, 35, 250, 254, 255, 255]

    @given(arrays(np.float64, 20, elements=st.floats(0, 50)))
    def test_is_within_half_a_level_but_for_traces_and_where_it_saturates(self, nats: FloatArray) -> None:
        decided = to_levels(nats) * NATS_PER_LEVEL
        trace = (nats > 0) & (nats < 0.01)
        assert (decided[trace] == 0.02).all()
        assert (np.abs(np.minimum(nats, 5.1) - decided)[~trace] <= 0.01 + 1e-12).all()


class TestResidualRisk:
    def test_by_hand(self) -> None:
        sums, largest = levels(0, 50, 50), levels(0, 50, 20)
        assert residual_risk(sums, largest) == pytest.approx([1, math.exp(-1), math.exp(-1)])
        assert residual_risk(sums, largest, 0.5) == pytest.approx([1, math.exp(-1), math.exp(-0.7)])
        assert residual_risk(sums, largest, 1) == pytest.approx([1, math.exp(-1), math.exp(-0.4)])

    def test_what_all_share_nobody_can_change(self) -> None:
        shared = risk_of_levels(255)
        assert shared is risk_of_levels(255)
        with pytest.raises(ValueError, match="read-only"):
            shared[0] = 0.5

    def test_sums_of_many_layers_may_be_larger_than_a_byte(self) -> None:
        sums, largest = np.array([400], dtype=np.int64), np.array([200], dtype=np.int64)
        assert residual_risk(sums, largest) == pytest.approx([math.exp(-8)])
        assert residual_risk(sums, largest, 0.5) == pytest.approx([math.exp(-6)])

    @pytest.mark.parametrize("kind", [np.uint8, np.uint16])
    def test_small_numbers_of_levels_are_looked_up_and_tell_the_same(self, kind: type[np.unsignedinteger]) -> None:
        every = np.arange(np.iinfo(kind).max + 1)
        np.testing.assert_array_equal(residual_risk(every.astype(kind), every), residual_risk(every, every))

    @given(looks)
    def test_is_the_papers_product_where_looks_are_independent(self, p_detect: list[FloatArray]) -> None:
        layer = layer_of(*p_detect)
        product = np.prod([1 - look for look in p_detect], axis=0)
        risk = residual_risk(layer.sum_levels, layer.largest_levels)
        # Half a level but for traces, which count as a whole one, and for what saturates.
        assert (np.abs(np.log(risk) - np.log(np.maximum(product, math.exp(-5.1)))) <= 0.02 + 1e-9).all()

    @given(looks)
    def test_is_the_best_looks_alone_where_they_all_tell_the_same(self, p_detect: list[FloatArray]) -> None:
        layer = layer_of(*p_detect)
        best = 1 - np.max(p_detect, axis=0)
        risk = residual_risk(layer.sum_levels, layer.largest_levels, rho=1)
        assert (np.abs(np.log(risk) - np.log(np.maximum(best, math.exp(-5.1)))) <= 0.02 + 1e-9).all()

    @given(level_arrays, level_arrays, st.lists(st.floats(0, 1), min_size=2, max_size=2))
    def test_rises_the_more_looks_go_together(self, one: LevelArray, other: LevelArray, rhos: list[float]) -> None:
        sums, largest = np.maximum(one, other), np.minimum(one, other)
        less, more = (residual_risk(sums, largest, rho) for rho in sorted(rhos))
        assert (less <= more + 1e-12).all()
        assert (more <= 1).all()

    @pytest.mark.parametrize("rho", [-0.1, 1.1, math.nan])
    def test_refuses_a_rho_outside_0_to_1(self, rho: float) -> None:
        with pytest.raises(ValueError, match="rho"):
            residual_risk(levels(1), levels(1), rho)


class TestRiskStatistics:
    def test_by_hand(self) -> None:
        risk = np.array([[1.0, 0.9, 0.8, 0.7], [0.6, 0.5, 0.4, 0.3], [0.2, 0.1, 1.0, 1.0]])
        inside = np.ones((3, 4), dtype=bool)
        inside[2, 2:] = False
        statistics = risk_statistics(risk, risk < 1, inside)
        assert statistics.cells == 10
        assert statistics.mean == pytest.approx(0.55)
        assert statistics.worst30_mean == pytest.approx(0.9)
        assert statistics.uncovered_share == pytest.approx(0.1)

    @pytest.mark.parametrize(("cells", "worst"), [(1, 1), (2, 1), (4, 1), (5, 2), (8, 2), (9, 3), (15, 5), (25, 8)])
    def test_counts_the_worst_to_the_nearest_cell(self, cells: int, worst: int) -> None:
        risk = np.linspace(0.9, 0.1, cells)
        everywhere = np.ones(cells, dtype=bool)
        statistics = risk_statistics(risk, everywhere, everywhere)
        assert statistics.worst30_mean == pytest.approx(risk[:worst].mean())

    def test_of_the_papers_grid_the_worst_30_per_cent(self) -> None:
        everywhere = np.ones((80, 243), dtype=bool)
        risk = np.arange(19440).reshape(80, 243) / 19440
        assert risk_statistics(risk, everywhere, everywhere).worst30_mean == pytest.approx(risk.ravel()[-5832:].mean())

    @given(looks, st.floats(0, 1))
    def test_the_worst_are_no_better_than_all_and_what_is_unseen_is_among_them(
        self, p_detect: list[FloatArray], rho: float
    ) -> None:
        layer = layer_of(*p_detect)
        sums, largest = layer.sum_levels, layer.largest_levels
        risk = residual_risk(sums, largest, rho)
        statistics = risk_statistics(risk, sums > 0, np.ones(GRID.shape, dtype=bool))
        assert 0 <= statistics.mean <= statistics.worst30_mean + 1e-12 <= 1 + 1e-12
        assert statistics.mean >= statistics.uncovered_share - 1e-12
        assert statistics.uncovered_share == np.mean(risk == 1)

    def test_a_trace_is_enough_to_be_covered(self) -> None:
        trace = np.zeros(GRID.shape)
        trace[0, 0] = 1e-4
        sums = layer_of(trace).sum_levels
        statistics = risk_statistics(residual_risk(sums, sums), sums > 0, np.ones(GRID.shape, dtype=bool))
        assert statistics.uncovered_share == pytest.approx(11 / 12)
        assert statistics.mean == pytest.approx((11 + math.exp(-0.02)) / 12)

    def test_refuses_an_area_without_cells(self) -> None:
        with pytest.raises(ValueError, match="no cell"):
            risk_statistics(np.ones(3), np.zeros(3, dtype=bool), np.zeros(3, dtype=bool))
