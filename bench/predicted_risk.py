"""Is predicted risk true? `python -m bench.predicted_risk` flies many missions and counts the targets missed.

Each mission has a seed and targets of its own. A target's predicted chance of being missed is the fleet's residual risk
of the cell it lies in, as it was published; whether it was missed, the simulated world knows. Prints both shares, and
draws them by predicted risk.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from comms.lockstep.local_bus import run_local
from comms.node import Received
from comms.said.routing import Routing
from planner.types import BoolArray, FloatArray
from secondlook.fleet.build import build_fleet
from secondlook.recorded.metrics import Metrics
from secondlook.scenario import load_scenario

FIGURE_FILE = Path("docs/paper/predicted-risk.png")
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


def fly(scenario: str, seed: int) -> tuple[FloatArray, BoolArray]:
    """One mission: of each target its predicted risk, and whether it was missed."""
    fleet, watcher = build_fleet(load_scenario(scenario, (), seed), record=False), _Watcher()
    nodes = {node_id: spec.make for node_id, spec in fleet.specs.items()}
    run_local(Routing(fleet.roster), nodes, {"observer": watcher}, fleet.run_info, fleet.time_limit_ms)
    return watcher.metrics.targets_met()


def draw(risk: FloatArray, missed: BoolArray) -> Figure:
    """Share missed over predicted risk, in bins of as many targets each."""
    figure = Figure(figsize=(5, 4.2), layout="constrained")
    panel = figure.subplots()
    bins = np.array_split(np.argsort(risk, kind="stable"), BINS)
    predicted = np.array([risk[one].mean() for one in bins])
    shares = np.array([missed[one].mean() for one in bins])
    errors = np.array([STANDARD_ERRORS * np.sqrt(s * (1 - s) / one.size) for s, one in zip(shares, bins, strict=True)])
    panel.plot([0, 1], [0, 1], color="0.6", linewidth=0.8)
    panel.errorbar(predicted, shares, errors, fmt="o", markersize=4, capsize=2)
    panel.set(xlim=(0, 1), ylim=(0, 1), xlabel="predicted residual risk", ylabel="share of targets missed")
    panel.set_title(f"{risk.size} targets, two standard errors", fontsize=9)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenario", default="tellaro")
    parser.add_argument("--missions", type=int, default=200)
    parser.add_argument("--out", type=Path, default=FIGURE_FILE)
    options = parser.parse_args()

    with ProcessPoolExecutor(max_workers=2) as pool:
        flown = list(pool.map(partial(fly, options.scenario), range(1, options.missions + 1)))
    risk, missed = np.concatenate([one[0] for one in flown]), np.concatenate([one[1] for one in flown])
    share, predicted = float(missed.mean()), float(risk.mean())
    error = np.sqrt(share * (1 - share) / missed.size)
    print(f"{options.scenario}: {options.missions} missions, {missed.size} targets")
    print(f"missed {share:.4f} ± {error:.4f}, predicted {predicted:.4f}, difference {share - predicted:+.4f}")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    draw(risk, missed).savefig(options.out, dpi=110)


if __name__ == "__main__":
    main()
