"""What is lost where helpers are not where they believe they are: the gain of second looks by true positions.

python -m bench.position_errors [SCENARIO [SEEDS]]; prints a row for each error. The error is a constant distance in a
random direction, or a drift that grows by so much an hour; the primaries' positions are right. `told` is the mean
residual risk of the fleet's map, which holds what helpers believe to have seen; `true` is that of a map with cells of
1 m in which each look lies where it was taken. The gain is what second looks take off the primaries' mean there.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from comms.node import Received
from comms.said.announcement import Role, RunInfo
from comms.said.messages import Look, Nav, TruthPose
from planner.region import Region
from planner.risk import residual_risk, risk_statistics
from planner.types import GridSpec, Point
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario
from vehicle_agent.coverage import CoverageLayer

ERRORS_M = (5, 10, 20)
CELL_M = 1.0  # of the true map: a swath's edges fall on whole cells nowhere
KEYS = {"m off": "position_error_m", "m/h drift": "position_drift_m_per_h"}


@dataclass
class TrueMap:
    """Puts each look where it was taken."""

    run: RunInfo | None = None
    layers: dict[str, CoverageLayer] = field(default_factory=dict)
    believed: dict[str, Nav] = field(default_factory=dict)
    off_m: dict[str, Point] = field(default_factory=dict)

    def hear(self, received: Received) -> None:
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
            if name not in self.layers:
                self.layers[name] = CoverageLayer(name, finer(self.run.grid.spec))
            self.layers[name].add(
                replace(message, origin_x_m=message.origin_x_m + east_m, origin_y_m=message.origin_y_m + north_m)
            )

    def mean_risk(self, *roles: Role) -> float:
        """Mean residual risk over the area that the vehicles of these roles leave."""
        assert self.run is not None
        spec = finer(self.run.grid.spec)
        sums, largest = np.zeros(spec.shape, dtype=np.int64), np.zeros(spec.shape, dtype=np.int64)
        for one in self.run.vehicles:
            if one.role in roles and one.vehicle in self.layers:
                layer = self.layers[one.vehicle].layer
                sums += layer.sum_levels
                np.maximum(largest, layer.largest_levels, out=largest)
        inside = Region(self.run.outline, self.run.hole_outlines, self.run.keep_out_outlines).inside(spec)
        return float(risk_statistics(residual_risk(sums, largest, self.run.rho), sums > 0, inside).mean)


def finer(spec: GridSpec) -> GridSpec:
    """The same grid with the true map's cells."""
    times = spec.cell_m / CELL_M
    return GridSpec(spec.frame, CELL_M, round((spec.columns - 1) * times) + 1, round(spec.rows * times))


def fly(scenario: str, seed: int, error: str, size: int) -> tuple[float, float, float]:
    """Mean residual risk of the fleet's map, and by true positions that of the fleet and of the primaries alone."""
    helpers = load_scenario(scenario, (), seed).revisit_vehicles
    settings = [f"vehicles.{name}.{error}={size}" for name in helpers]
    truth = TrueMap()
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(Path(folder), "local", None, record=False, watch=truth.hear)
        told = run_mission(load_scenario(scenario, settings, seed), options)
    return told["risk"]["mean"], truth.mean_risk(Role.SURVEY, Role.REVISIT), truth.mean_risk(Role.SURVEY)


def main(scenario: str, seeds: int) -> None:
    """Prints the table."""
    rows = [("none", "position_error_m", 0)]
    rows += [(f"{size} {what}", key, size) for what, key in KEYS.items() for size in ERRORS_M]
    print(f"{scenario}, seeds 0 to {seeds - 1}")
    print(f"{'error':>13} {'told':>7} {'true':>7} {'gain':>7} {'lost':>7}   least and most lost")
    exact = np.zeros(0)
    for what, key, size in rows:
        told, true, alone = np.array([fly(scenario, seed, key, size) for seed in range(seeds)]).T
        gain = alone - true
        exact = gain if size == 0 else exact
        lost = 1 - gain / exact
        spread = f"{lost.min():7.1%} {lost.max():7.1%}"
        print(f"{what:>13} {told.mean():7.4f} {true.mean():7.4f} {gain.mean():7.4f} "
              f"{1 - gain.sum() / exact.sum():7.1%}   {spread}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "tellaro", int(sys.argv[2]) if len(sys.argv) > 2 else 4)
