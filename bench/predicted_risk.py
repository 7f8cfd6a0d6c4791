"""Is predicted risk true? Many missions are flown, and the targets missed are counted.

Each mission has a seed and targets of its own. A target's predicted chance of being missed is the fleet's residual risk
of the cell it lies in, as it was published; whether it was missed, the simulated world knows. `python -m bench.figures
--fly reliability` flies them, and tells and draws both shares.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from comms.lockstep.local_bus import run_local
from comms.node import Received
from comms.said.routing import Routing
from planner.types import BoolArray, FloatArray
from secondlook.fleet.build import build_fleet
from secondlook.recorded.metrics import Metrics
from secondlook.scenario import load_scenario

BINS = 15
STANDARD_ERRORS = 2.0


class _Watcher:
    """Folds a mission into its figures."""

    def __init__(self) -> None:
        self.metrics = Metrics()

    def on_message(self, received: Received) -> None:
        self.metrics.hear(received)

    def close(self) -> None:
        self.metrics.close()


@dataclass(frozen=True)
class Met:
    """What came of a mission, or of several: of each target its predicted risk, and whether it was missed, both of
    shape (targets,); and of the first mission what it left, by column of a sweep."""

    risk: FloatArray
    missed: BoolArray
    left: Mapping[str, float]

    @cached_property
    def bins(self) -> list[Bin]:
        """By predicted risk, in bins of as many targets each."""
        parts = np.array_split(np.argsort(self.risk, kind="stable"), BINS)
        return [Bin(float(self.risk[one].mean()), float(self.missed[one].mean()), one.size) for one in parts]


class Bin(NamedTuple):
    """Some targets: the mean of their predicted risks, and the share of them that was missed."""

    predicted: float
    missed: float
    targets: int


def calibration_error(bins: Sequence[Bin]) -> float:
    """The mean over targets of how far in its bin the share missed is from the one predicted (M. P. Naeini, G. F.
    Cooper and M. Hauskrecht, AAAI 2015: the expected calibration error)."""
    count = sum(one.targets for one in bins)
    return sum(abs(one.missed - one.predicted) * one.targets for one in bins) / count


def fly(scenario: str, overrides: Sequence[str], seed: int) -> Met:
    """One mission."""
    fleet, watcher = build_fleet(load_scenario(scenario, overrides, seed), record=False), _Watcher()
    nodes = {node_id: spec.make for node_id, spec in fleet.specs.items()}
    run_local(Routing(fleet.roster), nodes, {"observer": watcher}, fleet.run_info, fleet.time_limit_ms)
    left = watcher.metrics.risk()
    assert left is not None
    risk, missed = watcher.metrics.targets_met()
    truth = {"truth.missed_share": float(missed.mean()), "truth.predicted_missed_share": float(risk.mean())}
    return Met(risk, missed, {"risk.mean": left.mean, "risk.worst30_mean": left.worst30_mean, **truth})


def fly_all(scenario: str, overrides: Sequence[str], missions: int) -> Met:
    """Missions with the seeds from 1 on."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        flown = list(pool.map(partial(fly, scenario, overrides), range(1, missions + 1)))
    risk, missed = (np.concatenate(parts) for parts in zip(*((one.risk, one.missed) for one in flown), strict=True))
    return Met(risk, missed, flown[0].left)


def draw(cases: Mapping[str, Sequence[Bin]], across: int = 1) -> Figure:
    """Of each case the share missed over predicted risk, so many cases beside each other."""
    rows = -(-len(cases) // across)
    figure = Figure(figsize=(4.2 * across if across > 1 else 5, 4.2 * rows), layout="constrained")
    panels = figure.subplots(rows, across, squeeze=False).ravel()
    for panel, (name, bins) in zip(panels, cases.items(), strict=False):
        predicted, shares = [one.predicted for one in bins], [one.missed for one in bins]
        errors = [STANDARD_ERRORS * math.sqrt(one.missed * (1 - one.missed) / one.targets) for one in bins]
        panel.plot([0, 1], [0, 1], color="0.6", linewidth=0.8)
        panel.errorbar(predicted, shares, errors, fmt="o", markersize=4, capsize=2)
        panel.set(xlim=(0, 1), ylim=(0, 1), xlabel="predicted residual risk", ylabel="share of targets missed")
        panel.set_title(f"{name}{sum(one.targets for one in bins)} targets, two standard errors", fontsize=9)
    for panel in panels[len(cases) :]:
        panel.set_visible(False)
    return figure
