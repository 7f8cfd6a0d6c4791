"""One of the paper's missions, flown: the survey agent in the simulated world, and the map it leaves."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.risk import LevelArray, residual_risk
from planner.types import DetectionCurve, FloatArray
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.paper.published import PublishedMission
from secondlook.scenario import Scenario, load_scenario

SCENARIO = "paper"
VEHICLE = "primary"
COLUMNS_LEFT_OUT = 5
ROWS_LEFT_OUT = 4
"""Of the map's edge, at either side and either end (paper, section V: "we excluded the outermost perimeter area")."""


@dataclass(frozen=True, eq=False)
class Survey:
    """What a mission left.

    `offsets_m`: where its tracks lay across the area, as flown. `r_adpt_m`: one a decision; `r_eff_m`: one a track.
    `curve`: P(y) as estimated from the first track. `sum_levels`: the map in levels of `planner.risk`, without the
    outermost perimeter, shape (rows, columns), of cells centred at `along_m` and `across_m`.
    """

    seed: int
    offsets_m: tuple[float, ...]
    r_adpt_m: tuple[int, ...]
    r_eff_m: tuple[int, ...]
    curve: DetectionCurve
    sum_levels: LevelArray
    across_m: FloatArray
    along_m: FloatArray

    @property
    def risk(self) -> FloatArray:
        """Residual risk, looks taken as independent (paper, equation 2); 1 where no look fell."""
        return residual_risk(self.sum_levels, self.sum_levels)

    @property
    def no_coverage_share(self) -> float:
        """Share of the cells without any look."""
        return float(np.mean(self.sum_levels == 0))

    @property
    def risk_seen(self) -> FloatArray:
        """Residual risk of the cells with a look, shape (n,)."""
        seen: FloatArray = self.risk[self.sum_levels > 0]
        return seen


def scenario_of(mission: PublishedMission, seed: int) -> Scenario:
    """The bundled scenario with what the paper varies."""
    spacing = "fixed" if mission.strategy == "control" else "adaptive"
    settings = (f"vehicles.{VEHICLE}.range_m={mission.told_range_m}", f"vehicles.{VEHICLE}.spacing={spacing}")
    return load_scenario(SCENARIO, settings, seed)


def fly(scenario: Scenario, folder: Path) -> Survey:
    """Flies a survey on the local bus; the run's files go into `folder`, which exists.

    Raises RunFailedError.
    """
    summary = run_mission(scenario, RunOptions(folder, bus="local", record=False))
    vehicle = summary["vehicles"][VEHICLE]
    plan, first_curve = _said(folder / "events.jsonl")
    with np.load(folder / "risk.npz") as arrays:
        inner = (slice(ROWS_LEFT_OUT, -ROWS_LEFT_OUT), slice(COLUMNS_LEFT_OUT, -COLUMNS_LEFT_OUT))
        return Survey(
            seed=scenario.seed,
            offsets_m=tuple(track["across_m"] for track in plan["tracks"] if track["flown"]),
            r_adpt_m=tuple(vehicle["r_adpt_m"]),
            r_eff_m=tuple(vehicle["r_eff_m"]),
            curve=first_curve,
            sum_levels=arrays[f"{VEHICLE}_sum_levels"][inner],
            across_m=arrays["across_m"][inner[1]],
            along_m=arrays["along_m"][inner[0]],
        )


def _said(events: Path) -> tuple[dict[str, list[dict[str, float]]], DetectionCurve]:
    """The survey agent's last plan, and P(y) after its first track."""
    plan, curve = {}, {}
    with events.open(encoding="utf-8") as lines:
        for line in lines:
            if f"agent/{VEHICLE}/plan" in line:
                plan = json.loads(line)
            elif f"agent/{VEHICLE}/curve" in line:
                said = json.loads(line)
                if said["track"] == 1:
                    curve = said
    p_detect = np.array(curve["p_detect"])
    return plan, DetectionCurve(np.arange(p_detect.size) * curve["range_bin_m"], p_detect)
