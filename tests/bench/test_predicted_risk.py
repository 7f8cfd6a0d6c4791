"""Is predicted risk true? As many targets are missed as the map says; `bench/predicted_risk.py` asks more missions."""

from __future__ import annotations

import numpy as np
import pytest
from missions import fly_scenario

from bench.predicted_risk import Met, calibration_error
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


def test_the_calibration_error_is_how_far_shares_are_from_those_predicted() -> None:
    # 100 targets with a risk of 0.1 each, of which 30 are missed, and 1400 with 0.5, of which half are.
    risk = np.repeat([0.1, 0.5], [100, 1400])
    missed = np.concatenate([np.arange(100) < 30, np.arange(1400) % 2 == 0])
    met = Met(risk, missed, (0.4, 0.5))
    assert met.bins[0].predicted == pytest.approx(0.1)
    assert met.bins[0].missed == pytest.approx(0.3)
    assert [one.targets for one in met.bins] == [100] * 15
    assert calibration_error(met.bins) == pytest.approx(0.2 / 15)
