"""One of the paper's missions flown by our survey agent in the simulated world, and what it says in the terms of the
paper's tables; many missions side by side."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.risk import LevelArray, residual_risk
from planner.types import DetectionCurve, FloatArray
from secondlook.engine.engine import Engine, do_all
from secondlook.engine.work_process import Lost
from secondlook.files import passing_folder
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.paper.fit import Mixture, fit_mixture
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


@dataclass(frozen=True, eq=False)
class MeasuredMission:
    """One flown mission beside the published one."""

    published: PublishedMission
    survey: Survey
    mixture: Mixture

    @property
    def figures(self) -> dict[str, float]:
        """The figures of Tables 1 and 2, by the names of `PublishedMission`."""
        return {
            "no_coverage_share": self.survey.no_coverage_share,
            "tracks": len(self.survey.offsets_m),
            "mean": float(self.survey.risk_seen.mean()),
            "rc_mean": self.mixture.means[-1],
            "rc_std": self.mixture.stds[-1],
            "rc_n": self.mixture.rightmost_cells,
        }

    @property
    def decisions(self) -> dict[str, int]:
        """The decisions that the paper tells of, by the names of `PublishedMission`.

        A control decides once, for all its tracks. r_eff is that of the first pair, as its second track measured it.
        """
        spaced_for = self.survey.r_adpt_m
        return {
            "first_r_adpt_m": spaced_for[0],
            "next_r_adpt_m": spaced_for[1] if len(spaced_for) > 1 else spaced_for[0],
            "r_eff_m": self.survey.r_eff_m[1],
            "tracks": len(self.survey.offsets_m),
        }

    @property
    def decides_as_published(self) -> bool:
        """Whether every decision is the paper's, and stays so to the last track."""
        published = {name: getattr(self.published, name) for name in self.decisions}
        later = {*self.survey.r_adpt_m[1:]} <= {self.published.next_r_adpt_m}
        return self.decisions == published and later and {*self.survey.r_eff_m} == {self.published.r_eff_m}

    def as_json(self) -> dict[str, Any]:
        """For programs."""
        figures = self.figures
        return {
            "experiment": self.published.experiment,
            "strategy": self.published.strategy,
            "tracks": figures.pop("tracks"),
            "r_adpt_m": list(self.survey.r_adpt_m),
            "r_eff_m": list(self.survey.r_eff_m),
            **figures,
            "cells": self.survey.sum_levels.size,
        }


def measure(published: PublishedMission, seed: int) -> MeasuredMission:
    """Flies one mission and fits its mixture; its files are gone afterwards. Raises RunFailedError."""
    with passing_folder() as folder:
        survey = fly(scenario_of(published, seed), folder)
    return MeasuredMission(published, survey, fit_mixture(survey.risk_seen, published.components))


def measure_all(
    missions: Sequence[tuple[PublishedMission, int]], engine: Engine, progress: Callable[[int], None]
) -> list[MeasuredMission]:
    """Measures each mission with its seed; the results are in the order of the missions.

    `progress` is told how many are done. Those with the most components to fit, which take longest, go first. Raises
    RunFailedError and EngineError.
    """
    longest_first = sorted(range(len(missions)), key=lambda index: -missions[index][0].components)
    measured: dict[int, MeasuredMission] = {}
    pieces = ((index, *missions[index]) for index in longest_first)
    for (index, published, seed), result in do_all(_measure, pieces, engine, count=len(missions)):
        if isinstance(result, Lost):
            raise RunFailedError(f"{published.experiment}, {published.strategy}, seed {seed}: {result.why}")
        measured[index] = result
        progress(len(measured))
    return [measured[index] for index in range(len(missions))]


def _measure(piece: tuple[int, PublishedMission, int]) -> MeasuredMission:
    _, published, seed = piece
    return measure(published, seed)
