"""The residual risk over the mission and at its end, in one pass over the tiles: of a large map these are many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comms.said.messages import CoverageTile, RunInfo
from secondlook.recorded import RecordedMission, RiskMap
from secondlook.recorded.metrics import Metrics

MOST_SAMPLES, FEWEST_SAMPLES = 240, 30
CELLS_TO_SUM_UP = 20_000_000  # over all samples: about a second


@dataclass(frozen=True)
class RiskSample:
    """Mean residual risk, its mean over the worst 30 % of the area, and the share of the area that nobody has seen."""

    t_s: float
    mean: float
    worst30_mean: float
    unseen_share: float


@dataclass(frozen=True)
class RiskSeries:
    """`samples`: from the start to the end, evenly spaced; fewer of a map with very many cells. `before`, `after`: the
    map at the end by the primaries alone and by all."""

    samples: list[RiskSample]
    before: RiskMap
    after: RiskMap


def risk_series(mission: RecordedMission) -> RiskSeries:
    """The residual risk of a mission."""
    cells = mission.run.grid.columns * mission.run.grid.rows
    count = max(FEWEST_SAMPLES, min(MOST_SAMPLES, CELLS_TO_SUM_UP // cells))
    times_s = list(np.linspace(0.0, mission.end_s, count + 1))
    metrics = Metrics()
    samples: list[RiskSample] = []
    for received in mission.received(RunInfo, CoverageTile):
        while received.header.sent_ms / 1000 > times_s[len(samples)]:
            samples.append(_sample(metrics, times_s[len(samples)]))
        metrics.take(received)
    samples += [_sample(metrics, t_s) for t_s in times_s[len(samples) :]]
    before, after = (RiskMap.of(mission.end_s, metrics, vehicles) for vehicles in (mission.primaries, None))
    return RiskSeries(samples, before, after)


def _sample(metrics: Metrics, t_s: float) -> RiskSample:
    risk = metrics.risk()
    assert risk is not None  # announced before anything else
    return RiskSample(t_s, risk.mean, risk.worst30_mean, risk.uncovered_share)
