"""How well looks do on the ground of an area, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from compiling import needs_compiling, times_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from coordinator.cut.window import Window
from coordinator.expect.seabed import LEAST_SHARE, MOST_OF_TOLD, Seabed, sliding_mean
from planner.types import FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 20, 30)  # 20 m are four cells to either side: nine in all
EVERYWHERE = Window(0, 30, 0, 20)
NOTHING = np.zeros(GRID.shape)


def nats(p_detect: float | FloatArray) -> FloatArray:
    """-ln(1 - P_d) everywhere."""
    return np.broadcast_to(-np.log1p(-np.asarray(p_detect)), GRID.shape).copy()


def test_before_anything_is_known_looks_do_as_expected() -> None:
    share, helpers = Seabed(GRID).shares(NOTHING, NOTHING)
    assert share == pytest.approx(1.0)
    assert helpers == pytest.approx(1.0)


class TestByTracks:
    def test_tracks_that_find_half_of_what_is_expected_halve_what_is_expected_of_others_and_of_helpers(self) -> None:
        share, helpers = Seabed(GRID).shares(nats(0.25), nats(0.5))
        assert share == pytest.approx((0.25 + 0.1) / (0.5 + 0.1))
        assert (helpers == share).all()

    def test_it_is_learned_about_where_it_was_found(self) -> None:
        found = np.full(GRID.shape, 0.5)
        found[:, :10] = 0.25
        share, _ = Seabed(GRID).shares(nats(found), nats(0.5))
        # Column 9 has five columns of a quarter about it and four of a half: 13/36.
        assert share[15, [0, 5, 9, 10, 14, 19]] == pytest.approx(
            [0.35 / 0.6, 0.35 / 0.6, (13 / 36 + 0.1) / 0.6, (14 / 36 + 0.1) / 0.6, 1.0, 1.0]
        )
        assert share == pytest.approx(share[[15]].repeat(GRID.rows, axis=0))

    def test_20_m_to_either_side_of_a_cell_are_about_it_whatever_its_size(self) -> None:
        for cell_m, last in ((1.0, 20), (3.0, 7), (6.0, 3), (50.0, 0)):
            grid = GridSpec(SweepFrame(0, 0, 0), cell_m, 60, 1)
            found = np.full(grid.shape, 0.5)
            found[0, 30] = 0.0
            share, _ = Seabed(grid).shares(-np.log1p(-found), np.full(grid.shape, math.log(2)))
            below = np.flatnonzero(share[0] < 1.0 - 1e-9)
            assert (below[0], below[-1]) == (30 - last, 30 + last)

    def test_rows_beyond_the_edge_are_not_counted(self) -> None:
        found = np.zeros(GRID.shape)
        found[0] = 0.5
        share, _ = Seabed(GRID).shares(nats(found), nats(0.5))
        assert share[[0, 2, 4, 5], 7] == pytest.approx([(0.5 / n + 0.1) / 0.6 for n in (5, 7, 9)] + [0.1 / 0.6])

    def test_what_was_found_where_nothing_was_expected_tells_nothing(self) -> None:
        share, _ = Seabed(GRID).shares(nats(0.5), NOTHING)
        assert share == pytest.approx(1.0)

    def test_it_is_taken_for_no_less_than_a_tenth_and_no_more_than_ten_times_of_what_is_expected(self) -> None:
        for found, expected, held in ((0.0, 0.95, 0.1), (0.999, 0.001, 10.0)):  # 0.1 / 1.05 and 1.099 / 0.101
            share, _ = Seabed(GRID).shares(nats(found), nats(expected))
            assert share == pytest.approx(held)


class TestByHelpers:
    def test_helpers_that_find_half_are_expected_to_find_half(self) -> None:
        seabed = Seabed(GRID)
        seabed.learn(EVERYWHERE, np.full(GRID.shape, 0.35), 0.7)
        share, helpers = seabed.shares(NOTHING, NOTHING)
        of_helpers = 0.355 / 0.705
        # Beside what helpers find anywhere they have found 0.35 / 0.3550 * 0.705 = 0.695 of 0.7 here.
        assert share == pytest.approx((0.35 / of_helpers + 0.1) / 0.8)
        assert helpers == pytest.approx(of_helpers * (0.35 / of_helpers + 0.1) / 0.8)

    def test_what_tracks_have_told_already_is_not_held_against_helpers(self) -> None:
        seabed = Seabed(GRID)
        seabed.learn(EVERYWHERE, np.full(GRID.shape, 0.35), 0.7)
        _, helpers = seabed.shares(nats(0.25), nats(0.5))
        of_helpers = 0.355 / (0.7 * 0.35 / 0.6 + 0.005)
        assert helpers == pytest.approx(of_helpers * (0.25 + 0.35 / of_helpers + 0.1) / (0.5 + 0.7 + 0.1))
        assert helpers[0, 0] == pytest.approx(0.5, abs=0.01)

    def test_cells_that_it_did_not_look_at_tell_nothing(self) -> None:
        seen = np.zeros((10, 5))
        seen[:, 0] = 0.7
        of_column, of_window = Seabed(GRID), Seabed(GRID)
        of_column.learn(Window(5, 15, 3, 4), seen[:, :1], 0.7)
        of_window.learn(Window(5, 15, 3, 8), seen, 0.7)
        for one, other in zip(of_column.shares(NOTHING, NOTHING), of_window.shares(NOTHING, NOTHING), strict=True):
            assert (one == other).all()
            assert one == pytest.approx(1.0)

    def test_passes_add_up(self) -> None:
        seabed = Seabed(GRID)
        seabed.learn(EVERYWHERE, np.full(GRID.shape, 0.35), 0.7)
        seabed.learn(EVERYWHERE, np.full(GRID.shape, 0.7), 0.7)
        _, helpers = seabed.shares(NOTHING, NOTHING)
        of_helpers = 1.055 / 1.405
        assert helpers == pytest.approx(of_helpers * (1.05 / of_helpers + 0.1) / 1.5)


@settings(max_examples=40, deadline=None)
@given(
    found=arrays.arrays(np.float64, GRID.shape, elements=st.sampled_from([0, 0.3, 0.9, 5.0])),
    expected=arrays.arrays(np.float64, GRID.shape, elements=st.sampled_from([0, 0.3, 0.9, 5.0])),
    learned=st.sampled_from([0.0, 0.1, 0.7, 0.99]),
)
def test_whatever_is_found_shares_stay_within_bounds(found: FloatArray, expected: FloatArray, learned: float) -> None:
    seabed = Seabed(GRID)
    seabed.learn(Window(0, 10, 0, 10), np.full((10, 10), learned), 0.7)
    share, helpers = seabed.shares(found, expected)
    assert ((share >= LEAST_SHARE) & (share <= 1 / LEAST_SHARE)).all()
    assert ((helpers > 0) & (helpers <= MOST_OF_TOLD)).all()
    assert math.isfinite(float(helpers.sum()))


@given(
    values=arrays.arrays(np.float64, arrays.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.floats(0, 9)),
    rows=st.integers(-1, 10),
    columns=st.integers(-1, 10),
)
def test_the_mean_is_that_of_the_rows_beside_each_and_then_of_the_columns(
    values: FloatArray, rows: int, columns: int
) -> None:
    def mean(along: FloatArray, beside: int) -> FloatArray:
        return np.array([along[max(at - beside, 0) : at + beside + 1].mean(axis=0) for at in range(len(along))])

    expected = mean(values, rows) if rows >= 0 else values
    expected = mean(expected.T, columns).T if columns >= 0 else expected
    before = values.copy()
    assert sliding_mean(values, rows, columns) == pytest.approx(expected, abs=1e-12)
    assert (values == before).all()


@needs_compiling
def test_the_mean_is_compiled_for_one_kind_of_arguments() -> None:
    Seabed(GRID).shares(nats(0.25), nats(0.5))
    assert times_compiled(sliding_mean) == 1
