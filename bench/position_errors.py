"""What is lost where helpers are not where they believe they are: the gain of second looks by true positions.

python -m bench.position_errors [SCENARIO [SEEDS]]; prints a row for each error. The error is a constant distance in a
random direction, or a drift that grows by so much an hour; the primaries' positions are right. `told` is the mean
residual risk of the fleet's map, which holds what helpers believe to have seen; `true` is that of a map in which each
look lies where it was taken. The gain is what second looks take off the primaries' mean.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from comms.messages import Look, Nav, RunInfo, TruthPose
from comms.node import Received
from planner.region import Region
from planner.risk import residual_risk, risk_statistics
from planner.types import Point
from secondlook.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario
from vehicle_agent.coverage import CoverageLayer

ERRORS_M = (5, 10, 20)
KEYS = {"m off": "position_error_m", "m/h drift": "position_drift_m_per_h"}


@dataclass
class TrueMap:
    """Puts each look where it was taken."""

    run: RunInfo | None = None
    layers: dict[str, CoverageLayer] = field(default_factory=dict)
    believed: dict[str, Nav] = field(default_factory=dict)
    off_m: dict[str, Point] = field(default_factory=dict)

    def take(self, received: Received) -> None:
        """Takes a message, in the order of sending."""
        message, name = received.message, received.vehicle
        if isinstance(message, RunInfo):
            self.run = message
        elif isinstance(message, Nav):
            self.believed[name] = message
        elif isinstance(message, TruthPose):
            nav = self.believed[name]  # of the same moment: it is said right before
            self.off_m[name] = (message.x_m - nav.x_m, message.y_m - nav.y_m)
        elif isinstance(message, Look) and message.valid and self.run is not None:
            east_m, north_m = self.off_m.get(name, (0.0, 0.0))
            layer = self.layers.setdefault(name, CoverageLayer(name, self.run.grid.spec))
            layer.add(replace(message, origin_x_m=message.origin_x_m + east_m, origin_y_m=message.origin_y_m + north_m))

    def mean_risk(self) -> float:
        """The fleet's mean residual risk over the area."""
        assert self.run is not None
        spec = self.run.grid.spec
        sums, largest = np.zeros(spec.shape, dtype=np.int64), np.zeros(spec.shape, dtype=np.int64)
        for one in self.layers.values():
            sums += one.layer.sum_levels()
            np.maximum(largest, one.layer.largest_levels(), out=largest)
        inside = Region(self.run.outline, self.run.hole_outlines).inside(spec)
        return float(risk_statistics(residual_risk(sums, largest, self.run.rho), sums > 0, inside).mean)


def fly(scenario: str, seed: int, error: str, size: int) -> tuple[float, float, float]:
    """Mean residual risk of the primaries alone, of the fleet's map, and by true positions."""
    helpers = load_scenario(scenario, (), seed).revisit_vehicles
    settings = [f"vehicles.{name}.{error}={size}" for name in helpers]
    truth = TrueMap()
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(Path(folder), "local", None, record=False, watch=truth.take)
        told = run_mission(load_scenario(scenario, settings, seed), options)
    return told["risk_primary_alone"]["mean"], told["risk"]["mean"], truth.mean_risk()


def main(scenario: str = "tellaro", seeds: int = 5) -> None:
    rows = [("none", "position_error_m", 0)]
    rows += [(f"{size} {what}", key, size) for what, key in KEYS.items() for size in ERRORS_M]
    print(f"{scenario}, seeds 0 to {seeds - 1}")
    print(f"{'error':>13} {'told':>7} {'true':>7} {'gain':>7} {'lost':>7}   least and most lost")
    exact = np.zeros(0)
    for what, key, size in rows:
        alone, told, true = np.array([fly(scenario, seed, key, size) for seed in range(seeds)]).T
        gain = alone - true
        exact = gain if size == 0 else exact
        lost = 1 - gain / exact
        spread = f"{lost.min():7.1%} {lost.max():7.1%}"
        print(f"{what:>13} {told.mean():7.4f} {true.mean():7.4f} {gain.mean():7.4f} "
              f"{1 - gain.sum() / exact.sum():7.1%}   {spread}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
