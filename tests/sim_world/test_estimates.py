"""The estimated P_d: its mean is the truth, its spread what the config says, and it is wrong on purpose as asked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comms.node import random_stream
from planner.types import DetectionCurve, FloatArray
from sim_world.config import EstimateConfig, SensorConfig
from sim_world.estimates import Estimates, PDetectEstimate

TRUTHS = (0.05, 0.3, 0.49, 0.7, 0.9)


def estimated(noise: PDetectEstimate, cells: FloatArray, error: float, generator: np.random.Generator) -> FloatArray:
    return noise.estimate(cells, error, noise.cell_errors(cells.shape, generator))


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_mean_over_both_draws_is_the_truth(truth: float) -> None:
    generator = np.random.default_rng(1)
    noise = PDetectEstimate(0.23, 0.05)
    cells = np.full((2, 4, 25), truth)
    means = [estimated(noise, cells, noise.track_error(generator), generator).mean() for _ in range(4000)]
    assert np.mean(means) == pytest.approx(truth, abs=1e-3)


@settings(max_examples=20)
@given(truth=st.floats(0.02, 0.98), noise_cell=st.floats(0.0, 1.5))
def test_the_mean_is_the_truth_for_any_noise(truth: float, noise_cell: float) -> None:
    noise = PDetectEstimate(noise_cell, 0.0)
    estimates = estimated(noise, np.full((2, 100, 1000), truth), 0.0, np.random.default_rng(7))
    assert estimates.mean() == pytest.approx(
        truth, abs=max(4.5 * estimates.std() / np.sqrt(estimates.size), 1e-6) + 2e-4
    )


@pytest.mark.parametrize("noise", [(0.6, 0.25), (1.5, 0.0), (0.0, 0.3), (0.0, 0.0)])
def test_the_mean_is_the_truth_by_summing_up_over_all_errors(noise: tuple[float, float]) -> None:
    truths = np.array([0.001, 0.02, 0.11, 0.3, 0.5, 0.77, 0.95, 0.99])
    told = PDetectEstimate(*noise).estimate(truths, 0.0, np.zeros(truths.shape))
    errors = np.linspace(-8.0, 8.0, 4001)[:, None]
    density = np.exp(-(errors**2) / 2)
    spread = 1.0 / (1.0 + (1.0 - told) / told * np.exp(-np.hypot(*noise) * errors))
    assert (spread * density).sum(axis=0) / density.sum() == pytest.approx(truths, rel=2e-5)


def test_what_is_told_without_an_error_is_the_same_in_every_version_of_the_program() -> None:
    told = PDetectEstimate(2.0, 1.0).estimate(np.array([0.02, 0.3, 0.77]), 0.0, np.zeros(3))
    assert told == pytest.approx([0.0025907121852964533, 0.18491373745786352, 0.8902382990447898], rel=1e-9)


def test_cells_differ_by_the_cell_noise_and_tracks_by_the_track_noise() -> None:
    generator = np.random.default_rng(3)
    noise = PDetectEstimate(0.23, 0.05)
    estimates = estimated(noise, np.full((2, 200, 250), 0.4), 0.0, generator)
    assert np.log(estimates / (1.0 - estimates)).std() == pytest.approx(0.23, rel=0.02)
    tracks = np.array([noise.track_error(generator) for _ in range(20_000)])
    assert tracks.std() == pytest.approx(0.05, rel=0.03)
    assert tracks.mean() == pytest.approx(0.0, abs=2e-3)


def test_one_tracks_error_shifts_all_cells_alike() -> None:
    noise = PDetectEstimate(0.23, 0.05)
    cells = np.linspace(0.1, 0.8, 40).reshape(2, 4, 5)
    one, other = (estimated(noise, cells, error, np.random.default_rng(5)) for error in (0.0, 0.1))
    shift = np.log(other / (1.0 - other)) - np.log(one / (1.0 - one))
    assert shift == pytest.approx(np.full(cells.shape, 0.1))


def test_without_noise_the_estimate_is_the_truth() -> None:
    cells = np.array([[[0.0, 0.0005, 0.2, 0.49, 0.999]]])
    estimates = estimated(PDetectEstimate(0.0, 0.0), cells, 0.0, np.random.default_rng(1))
    assert estimates == pytest.approx(cells, abs=1e-12)


def test_unseen_stays_unseen_seen_stays_seen_and_nothing_is_certain() -> None:
    cells = np.array([[[0.0, 1e-9, 1e-300, 0.999]]])
    noise = PDetectEstimate(2.0, 2.0)
    for seed in range(50):
        estimates = estimated(noise, cells, 0.0, np.random.default_rng(seed))
        assert estimates[0, 0, 0] == 0.0
        assert np.all((estimates[0, 0, 1:] >= 0.0001) & (estimates[0, 0, 1:] <= 0.999))


def test_what_is_hardly_seen_is_told_by_the_wires_least_step() -> None:
    cells = np.array([[[1e-9, 0.00005, 0.00015]]])
    told = estimated(PDetectEstimate(0.0, 0.0), cells, 0.0, np.random.default_rng(1))
    assert told[0, 0] == pytest.approx([0.0001, 0.0001, 0.00015], rel=1e-6)


def test_the_draws_do_not_depend_on_what_was_seen() -> None:
    noise = PDetectEstimate(0.23, 0.05)
    all_seen = np.full((1, 1, 6), 0.4)
    half_seen = np.where(np.arange(6) < 3, 0.0, all_seen)
    one, other = (estimated(noise, cells, 0.0, np.random.default_rng(9)) for cells in (all_seen, half_seen))
    assert np.array_equal(one[0, 0, 3:], other[0, 0, 3:])


CURVE = DetectionCurve(np.array([0.0, 30.0, 60.0, 100.0]), np.full(4, 0.4))
SHAPE = (2, 4, 11)


def published(
    wrong: EstimateConfig,
    looks: int = 1,
    noise: tuple[float, float] = (0.0, 0.0),
    p_detect: float = 0.4,
    seed: int = 1,
    tracks: int = 1,
) -> FloatArray:
    """What a vehicle tells of looks over 20 m in 4 bins, 11 range bins of 10 m to either side: shape (looks, 2, 4, 11).
    Of several tracks each has as many looks."""
    estimates = Estimates(
        SensorConfig(CURVE, noise_cell=noise[0], noise_track=noise[1], estimate=wrong),
        lambda name, number: random_stream(seed, name, str(number)),
    )
    range_m, found = np.broadcast_to(10.0 * np.arange(11.0), (2, 1, 11)), []
    for track in range(tracks):
        estimates.begin_track(track + 1)
        for look in range(looks):
            straight_m = 20.0 * look + 5.0 * (np.arange(4.0)[:, None] + 0.5)
            number = track * looks + look + 1
            found.append(estimates.of_look(number, np.full(SHAPE, p_detect), range_m, straight_m, 20.0))
    return np.array(found)


def logits(p_detect: FloatArray) -> FloatArray:
    return np.log(p_detect / (1.0 - p_detect))


class TestWrongOnPurpose:
    def test_by_nothing_it_is_the_estimate_with_its_noise(self) -> None:
        noise = PDetectEstimate(0.23, 0.05)
        track_error = noise.track_error(random_stream(1, "track_noise", "1"))
        errors = noise.cell_errors(SHAPE, random_stream(1, "noise", "1"))
        expected = noise.estimate(np.full(SHAPE, 0.4), track_error, errors)
        assert np.array_equal(published(EstimateConfig(), noise=(0.23, 0.05))[0], expected)

    def test_a_share_too_high_or_too_low(self) -> None:
        assert published(EstimateConfig(bias=0.2)) == pytest.approx(0.48)
        assert published(EstimateConfig(bias=-0.5)) == pytest.approx(0.2)

    def test_nothing_is_told_to_be_certain(self) -> None:
        assert published(EstimateConfig(bias=9.0)) == pytest.approx(0.999)

    def test_a_share_that_grows_with_the_range(self) -> None:
        told = published(EstimateConfig(bias_at_reach=0.5))
        assert told[0, 0, 0] == pytest.approx(0.4 * (1.0 + 0.05 * np.arange(11.0)))
        assert np.array_equal(told[0, 0], told[0, 1])

    def test_a_share_after_the_turn_that_fades_on_the_straight(self) -> None:
        told = published(EstimateConfig(bias_after_turn=-0.8, turn_m=25.0), looks=2)[:, 0, :, 0].ravel()
        # Bins are centred at 2.5, 7.5, ... m; behind 25 m nothing is left.
        assert told[:5] == pytest.approx([0.4 * (1.0 - 0.8 * left) for left in (0.9, 0.7, 0.5, 0.3, 0.1)])
        assert told[5:] == pytest.approx(0.4)

    def test_shares_multiply(self) -> None:
        told = published(EstimateConfig(bias=0.5, bias_at_reach=1.0, bias_after_turn=-0.5, turn_m=10.0))
        assert told[0, 0, 0, 10] == pytest.approx(0.4 * 1.5 * 2.0 * (1.0 - 0.5 * 0.75))

    def test_a_walk_at_random_grows_with_the_root_of_the_way_and_moves_all_cells_alike(self) -> None:
        # 50 looks of 20 m are a kilometre.
        walks = np.array(
            [logits(published(EstimateConfig(drift_per_km=0.3), 50, seed=seed)[:, 0, 0, 0]) for seed in range(400)]
        )
        walks -= logits(np.array(0.4))
        assert walks[:, -1].std() == pytest.approx(0.3, rel=0.15)
        assert walks[:, 11].std() == pytest.approx(0.3 * np.sqrt(12 / 50), rel=0.15)
        assert walks[:, -1].mean() == pytest.approx(0.0, abs=4 * 0.3 / 20)
        told = published(EstimateConfig(drift_per_km=0.3), 3)
        assert np.ptp(told, axis=(1, 2, 3)) == pytest.approx(0.0, abs=1e-12)

    def test_a_walk_goes_on_over_the_tracks(self) -> None:
        one, two = (published(EstimateConfig(drift_per_km=0.3), looks, tracks=6 // looks) for looks in (6, 3))
        assert np.array_equal(one, two)

    def test_errors_along_the_track_are_alike_as_told_and_of_the_same_size(self) -> None:
        # Bins of 5 m, alike to 1 / e over 20 m: from one bin to the next by exp(-1/4), four looks on by exp(-4).
        rows = logits(published(EstimateConfig(noise_along_m=20.0), 1500, (0.25, 0.0)))
        rows = rows.transpose(0, 2, 1, 3).reshape(6000, 22)
        rows -= rows.mean()
        assert rows.std() == pytest.approx(0.25, rel=0.02)
        for apart, expected in ((1, np.exp(-0.25)), (4, np.exp(-1.0)), (16, np.exp(-4.0))):
            alike = (rows[apart:] * rows[:-apart]).mean() / rows.var()
            assert alike == pytest.approx(expected, abs=0.03)
        across = (rows[:, 1:] * rows[:, :-1]).mean() / rows.var()
        assert across == pytest.approx(0.0, abs=0.03)

    def test_errors_begin_anew_on_each_track(self) -> None:
        told = logits(published(EstimateConfig(noise_along_m=500.0), 1, (0.25, 0.0), tracks=400))
        last, first = told[:-1, :, -1].ravel(), told[1:, :, 0].ravel()
        assert np.corrcoef(last, first)[0, 1] == pytest.approx(0.0, abs=0.05)
        assert np.corrcoef(told[:, :, 0].ravel(), told[:, :, -1].ravel())[0, 1] > 0.95
