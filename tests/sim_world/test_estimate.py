"""The estimated P_d: its mean is the truth, its spread what the config says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_world.looks import LOWEST_SEEN, PDetectEstimate
from sim_world.sonar import HIGHEST_P_DETECT

TRUTHS = (0.05, 0.3, 0.49, 0.7, 0.9)


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_mean_over_both_draws_is_the_truth(truth: float) -> None:
    generator = np.random.default_rng(1)
    noise = PDetectEstimate(0.23, 0.05)
    cells = np.full((2, 4, 25), truth)
    means = [noise.estimate(cells, noise.track_error(generator), generator).mean() for _ in range(4000)]
    assert np.mean(means) == pytest.approx(truth, abs=1e-3)


@settings(max_examples=20)
@given(truth=st.floats(0.02, 0.98), noise_cell=st.floats(0.0, 1.5))
def test_the_mean_is_the_truth_for_any_noise(truth: float, noise_cell: float) -> None:
    noise = PDetectEstimate(noise_cell, 0.0)
    estimates = noise.estimate(np.full((2, 100, 1000), truth), 0.0, np.random.default_rng(7))
    assert estimates.mean() == pytest.approx(
        truth, abs=max(4.5 * estimates.std() / np.sqrt(estimates.size), 1e-6) + 2e-4
    )


def test_cells_differ_by_the_cell_noise_and_tracks_by_the_track_noise() -> None:
    generator = np.random.default_rng(3)
    noise = PDetectEstimate(0.23, 0.05)
    estimates = noise.estimate(np.full((2, 200, 250), 0.4), 0.0, generator)
    assert np.log(estimates / (1.0 - estimates)).std() == pytest.approx(0.23, rel=0.02)
    tracks = np.array([noise.track_error(generator) for _ in range(20_000)])
    assert tracks.std() == pytest.approx(0.05, rel=0.03)
    assert tracks.mean() == pytest.approx(0.0, abs=2e-3)


def test_one_tracks_error_shifts_all_cells_alike() -> None:
    noise = PDetectEstimate(0.23, 0.05)
    cells = np.linspace(0.1, 0.8, 40).reshape(2, 4, 5)
    one, other = (noise.estimate(cells, error, np.random.default_rng(5)) for error in (0.0, 0.1))
    shift = np.log(other / (1.0 - other)) - np.log(one / (1.0 - one))
    assert shift == pytest.approx(np.full(cells.shape, 0.1))


def test_without_noise_the_estimate_is_the_truth() -> None:
    cells = np.array([[[0.0, 0.0005, 0.2, 0.49, 0.999]]])
    estimates = PDetectEstimate(0.0, 0.0).estimate(cells, 0.0, np.random.default_rng(1))
    assert estimates == pytest.approx(cells, abs=1e-12)


def test_unseen_stays_unseen_seen_stays_seen_and_nothing_is_certain() -> None:
    cells = np.array([[[0.0, 1e-9, 1e-300, 0.999]]])
    noise = PDetectEstimate(2.0, 2.0)
    for seed in range(50):
        estimates = noise.estimate(cells, 0.0, np.random.default_rng(seed))
        assert estimates[0, 0, 0] == 0.0
        assert np.all((estimates[0, 0, 1:] >= LOWEST_SEEN) & (estimates[0, 0, 1:] <= HIGHEST_P_DETECT))


def test_the_draws_do_not_depend_on_what_was_seen() -> None:
    noise = PDetectEstimate(0.23, 0.05)
    all_seen = np.full((1, 1, 6), 0.4)
    half_seen = np.where(np.arange(6) < 3, 0.0, all_seen)
    one, other = (noise.estimate(cells, 0.0, np.random.default_rng(9)) for cells in (all_seen, half_seen))
    assert np.array_equal(one[0, 0, 3:], other[0, 0, 3:])
