"""Is predicted risk true? As many targets are missed as the map says; `bench/predicted_risk.py` asks more missions."""

from __future__ import annotations

import numpy as np
import pytest
from missions import fly_scenario

from bench.predicted_risk import Met, calibration_error, fly
from secondlook.scenario import load_scenario

A_SIXTH_OF_IT = "area.polygon_m=[[0, 0], [400, 0], [400, 200], [0, 200]]"


@pytest.mark.parametrize("scenario", ["tellaro", "patchy"])
def test_the_share_of_targets_missed_is_the_mean_residual_risk_where_they_lie(scenario: str) -> None:
    settings = (A_SIXTH_OF_IT, "targets.count=1000")
    met = [fly_scenario(load_scenario(scenario, settings, seed)).metrics.targets_met() for seed in range(1, 5)]
    predicted, true = (np.concatenate(values) for values in zip(*met, strict=True))
    assert true.size == 4000
    # 4000 targets: the standard error of the share is below 0.008.
    assert true.mean() == pytest.approx(predicted.mean(), abs=0.025)
    # Not only on average: of those said to be safest and of those said to be worst.
    safest, worst = predicted <= np.quantile(predicted, 0.25), predicted >= np.quantile(predicted, 0.75)
    for part in (safest, worst):
        assert true[part].mean() == pytest.approx(predicted[part].mean(), abs=0.05)


def missed_beyond(scenario: str, estimate: str) -> list[float]:
    """By how much more of 3000 targets is missed than the map says, where all vehicles' estimates of P_d are wrong as
    told: of the quarter that it says is safest, and on to the worst."""
    vehicles = load_scenario(scenario).vehicles
    settings = [f"vehicles.{name}.sensor.estimate={estimate}" for name in vehicles]
    met = [fly(scenario, (A_SIXTH_OF_IT, "targets.count=1000", *settings), seed) for seed in (1, 2, 3)]
    risk, missed = (np.concatenate(parts) for parts in zip(*((one.risk, one.missed) for one in met), strict=True))
    return [float((missed[part] - risk[part]).mean()) for part in np.array_split(np.argsort(risk, kind="stable"), 4)]


@pytest.mark.parametrize(
    ("scenario", "estimate", "least", "most"),
    [
        ("tellaro", "{bias: 0.3}", (0.08, 0.09, 0.09, 0.02), (0.16, 0.2, 0.22, 0.14)),
        ("tellaro", "{bias: -0.3}", (-0.22, -0.27, -0.27, -0.19), (-0.09, -0.12, -0.13, -0.06)),
        # What is seen from afar is said to be seen best, and where a turn has just ended.
        ("tellaro", "{bias_at_reach: 0.6}", (0.08, 0.08, 0.06, 0.03), (0.2, 0.2, 0.18, 0.16)),
        ("tellaro", "{bias_after_turn: 2}", (0.12, 0.02, 0.0, -0.03), (0.25, 0.13, 0.11, 0.09)),
        # With a mean of nothing: a walk that has gone too high makes the safest seem safer, and one along the track,
        # of which a cell has several looks, hardly that.
        ("tellaro", "{drift_per_km: 0.6}", (0.01, -0.05, -0.05, -0.05), (0.12, 0.06, 0.05, 0.05)),
        ("tellaro", "{noise_along_m: 100}", (-0.05, -0.05, -0.05, -0.06), (0.05, 0.05, 0.05, 0.05)),
        ("patchy", "{blind_to_seabed: true}", (0.7, 0.6, 0.4, 0.2), (0.9, 0.9, 0.8, 0.5)),
    ],
)
def test_a_wrong_estimate_shows_in_each_bin_of_risk(
    scenario: str, estimate: str, least: tuple[float, ...], most: tuple[float, ...]
) -> None:
    """Of 750 targets a share of a half is known to 0.018."""
    found = missed_beyond(scenario, estimate)
    assert all(low < one < high for low, one, high in zip(least, found, most, strict=True)), found


def test_the_calibration_error_is_how_far_shares_are_from_those_predicted() -> None:
    # 100 targets with a risk of 0.1 each, of which 30 are missed, and 1400 with 0.5, of which half are.
    risk = np.repeat([0.1, 0.5], [100, 1400])
    missed = np.concatenate([np.arange(100) < 30, np.arange(1400) % 2 == 0])
    met = Met(risk, missed, {})
    assert met.bins[0].predicted == pytest.approx(0.1)
    assert met.bins[0].missed == pytest.approx(0.3)
    assert [one.targets for one in met.bins] == [100] * 15
    assert calibration_error(met.bins) == pytest.approx(0.2 / 15)
