"""One mission flown for its figures, on the local bus."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.recorded.metrics import Metrics
from secondlook.recorded.observer import Watch
from secondlook.scenario import Scenario


@dataclass(frozen=True)
class Risk:
    """Residual risk at one time: its mean over the area, and over the worst 30 % of it."""

    t_s: float
    mean: float
    worst30_mean: float


@dataclass(frozen=True)
class Flight:
    """What came of a mission.

    `primary_s`: when the last primary had surveyed all. `at_primary_s`, `at_105`: then, and at 1.05 times that;
    `at_end`: when the mission was over. `survey_alone`: mean residual risk without any second look. `removed_m2`: what
    second looks removed of it, times the area. `served`: strips done. `over_time`: about every 10 s.
    """

    seed: int
    digest: str
    primary_s: float
    at_primary_s: Risk
    at_105: Risk
    at_end: Risk
    survey_alone: float
    removed_m2: float
    served: int
    over_time: tuple[Risk, ...]


@dataclass(frozen=True)
class FailedFlight:
    """A mission that failed, and the sentence that says why."""

    seed: int
    failure: str


def fly(scenario: Scenario, watch: Watch | None = None) -> Flight | FailedFlight:
    """Flies a mission; its files lie in a folder that is gone afterwards. `watch`: see `RunOptions`."""
    notes = _Notes()
    with tempfile.TemporaryDirectory(prefix="secondlook-compare-") as folder:
        try:
            options = RunOptions(Path(folder), bus="local", record=False, progress=notes.take, watch=watch)
            summary = run_mission(scenario, options)
        except RunFailedError as error:
            return FailedFlight(scenario.seed, str(error))
    primary_s, mission_s = summary["time"]["primary_s"], summary["time"]["mission_s"]
    if primary_s is None or summary["risk"] is None:
        return FailedFlight(scenario.seed, "the mission was over before the survey")
    at_primary_s, at_105 = (Risk(**at) for at in summary["risk_at"])
    at_end = Risk(mission_s, summary["risk"]["mean"], summary["risk"]["worst30_mean"])
    alone = summary["risk_primary_alone"]
    return Flight(
        seed=scenario.seed,
        digest=summary["digest"],
        primary_s=primary_s,
        at_primary_s=at_primary_s,
        at_105=at_105,
        at_end=at_end,
        survey_alone=alone["mean"],
        removed_m2=(alone["mean"] - at_end.mean) * alone["cells"] * scenario.area.cell_m**2,
        served=summary["hotspots"]["revisited"],
        over_time=(*notes.taken, at_end),
    )


@dataclass
class _Notes:
    """Notes the risk as the mission goes on."""

    taken: list[Risk] = field(default_factory=list)

    def take(self, metrics: Metrics) -> None:
        """Called every 10 simulated seconds."""
        risk = metrics.risk()
        if risk is not None:
            self.taken.append(Risk(metrics.now_ms / 1000, risk.mean, risk.worst30_mean))
