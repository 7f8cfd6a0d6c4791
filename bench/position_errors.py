"""What is lost where helpers are not where they believe they are: the gain of second looks by true positions.

python -m bench.position_errors [SCENARIO [SEEDS]] prints the table, `python -m bench.figures --fly position-errors`
writes that of docs/faults.md. The error is a constant distance in a random direction, or a drift that grows by so much
an hour; the primaries' positions are right. Told is the mean residual risk of the fleet's map, which holds what helpers
believe to have seen; truly it is that of a map with cells of 1 m in which each look lies where it was taken. The gain
is what second looks take off the primaries' mean there.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from statistics import fmean

import numpy as np

from bench.flown import DIGITS, Document
from bench.rows import Row, by, head, line
from comms.node import Received
from comms.said.announcement import Role, RunInfo
from comms.said.messages import Look, Nav, TruthPose
from planner.region import Region
from planner.risk import residual_risk, risk_statistics
from planner.types import FloatArray, GridSpec, Point
from secondlook.launch.mission import run_in_passing
from secondlook.scenario import load_scenario
from vehicle_agent.coverage import CoverageLayer

ERRORS_M = (5, 10, 20)
CELL_M = 1.0  # of the true map: a swath's edges fall on whole cells nowhere
KEYS = ("position_error_m", "position_drift_m_per_h")


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


def fly(scenario: str, overrides: Sequence[str], seed: int) -> Row:
    """One mission: beside its own figures the mean residual risk by true positions, that which the fleet leaves, and
    the primaries alone."""
    truth = TrueMap()
    told = run_in_passing(load_scenario(scenario, overrides, seed), watch=truth.hear)["risk"]
    true, alone = truth.mean_risk(Role.SURVEY, Role.REVISIT), truth.mean_risk(Role.SURVEY)
    figures = {"risk.mean": told["mean"], "risk.worst30_mean": told["worst30_mean"]}
    figures |= {"true.mean": true, "true_alone.mean": alone}
    row = {"scenario": scenario, "overrides": list(overrides), "seed": seed, "failure": None}
    return row | {name: round(value, DIGITS) for name, value in figures.items()}


def fly_all(scenario: str = "tellaro", seeds: int = 6) -> Document:
    """All missions: each error of all helpers, with the seeds from 0 on."""
    helpers = load_scenario(scenario).revisit_vehicles
    errors = [f"{key}={size}" for key in KEYS for size in ERRORS_M]
    cases = [(), *(tuple(f"vehicles.{name}.{error}" for name in helpers) for error in errors)]
    with ProcessPoolExecutor(max_workers=2) as pool:
        return {"rows": list(pool.map(partial(fly, scenario), *zip(*product(cases, range(seeds)), strict=True)))}


def table(rows: Sequence[Row]) -> list[str]:
    """The lines of the table, as Markdown."""
    lines = head(KEYS, ("mean risk told", "truly", "gain", "of it lost", "least and most"))
    found = by(rows, KEYS, "true.mean")
    exact = _gains(found["-", "-"])
    for values, missions in found.items():
        gains = _gains(missions)
        figures = [f"{fmean(row[name] for row in missions):.3f}" for name in ("risk.mean", "true.mean")]
        figures += [f"{gains.mean():.3f}", "", ""]
        if set(values) != {"-"}:
            lost = 1 - gains / exact
            figures[3:] = f"{1 - gains.sum() / exact.sum():.1%}", f"{lost.min():.1%} to {lost.max():.1%}"
        lines.append(line(values, figures))
    return lines


def _gains(missions: Sequence[Row]) -> FloatArray:
    """Of each mission what second looks take off."""
    return np.array([row["true_alone.mean"] - row["true.mean"] for row in missions])


def main(scenario: str, seeds: int) -> None:
    """Prints the table."""
    print("\n".join(table(fly_all(scenario, seeds)["rows"])))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "tellaro", int(sys.argv[2]) if len(sys.argv) > 2 else 4)
