"""What single tracks are worth where r_eff falls below 3 r_min: missions with them, and with pairs alone.

python -m bench.single_tracks [SCENARIO [SEEDS]]; prints one row a seed where they differ, and the means over those.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from planner.spacing_planners import AdaptiveSpacing, SpacingDecision
from secondlook.launch.mission import run_in_passing
from secondlook.scenario import load_scenario


class PairsAlone:
    """Adaptive spacing that lays no single tracks: below 3 r_min it plans with 3 r_min, and leaves gaps."""

    def __init__(self, nadir_gap_m: float, told_range_m: float) -> None:
        self._adaptive = AdaptiveSpacing(nadir_gap_m, told_range_m)

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """As the adaptive planner decides."""
        return self._adaptive.decide(width_m, covered_m, r_eff_m)


COLUMNS = ("tracks", "primary_s", "primary unseen", "primary mean", "fleet unseen", "fleet mean", "fleet worst 30 %")


def fly(scenario: str, seed: int, *settings: str) -> tuple[dict[str, Any], list[float]]:
    told = run_in_passing(load_scenario(scenario, settings, seed))
    alone, fleet = told["risk_primary_alone"], told["risk"]
    row = [
        float(sum(vehicle.get("tracks", 0) for vehicle in told["vehicles"].values())),
        told["time"]["primary_s"],
        100 * alone["uncovered_share"],
        alone["mean"],
        100 * fleet["uncovered_share"],
        fleet["mean"],
        fleet["worst30_mean"],
    ]
    return told, row


def main() -> None:
    scenario = sys.argv[1] if len(sys.argv) > 1 else "patchy"
    seeds = sys.argv[2] if len(sys.argv) > 2 else "30"
    differing = []
    print("seed  r_eff_m; singles, then pairs alone:", ", ".join(COLUMNS))
    for seed in range(int(seeds)):
        told, singles = fly(scenario, seed)
        _, pairs = fly(scenario, seed, "vehicles.primary.spacing=bench.single_tracks:PairsAlone")
        if singles != pairs:
            differing.append((singles, pairs))
            r_eff = next(vehicle["r_eff_m"] for vehicle in told["vehicles"].values() if "r_eff_m" in vehicle)
            print(f"{seed:4}  {r_eff}")
            for row in (singles, pairs):
                print("      " + "  ".join(f"{value:8.3f}" for value in row))
    print(f"{len(differing)} of {seeds} seeds differ; means over those, singles, pairs alone:")
    for row in np.mean(np.array(differing), axis=0):
        print("      " + "  ".join(f"{value:8.3f}" for value in row))


if __name__ == "__main__":
    main()
