"""What laying tracks by the whole P(y) is worth: `spacing: profile` and `joint` beside Algorithm 1.

python -m bench.profile_spacing [--seeds 20] [--set KEY=VALUE]
python -m bench.profile_spacing --scenario tellaro [--wanted-risk 0.65] [--seeds 20] [--set KEY=VALUE]

The first flies the paper's three experiments, the bundled scenario `paper` with the range that each was told, with both
over the same seas: the seeds are those of the adaptive missions of `secondlook paper --seeds`. Told are means, of the
difference its standard deviation and its least as well, and the cells that Algorithm 1 saw and `profile` did not, in
all seeds together. The second flies a scenario with its helpers, seeds 1001, 1002, ..., with each way of spacing, and
with `joint` for the fewest tracks from which it expects a wanted risk: tracks, the survey's duration and what the fleet
leaves.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from planner.types import BoolArray
from secondlook.commands.paper import seed_of
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.paper.published import published_missions
from secondlook.scenario import load_scenario

ALONE = ("adaptive", "profile")
HELPED = ("adaptive", "profile", "joint")
FIRST_SEED = 1001


@dataclass(frozen=True)
class Flown:
    """What a mission left: tracks of all primaries, duration of the survey, mean residual risk, that of the worst 30 %
    and which cells have a primary's look."""

    tracks: int
    survey_s: float
    mean: float
    worst30: float
    seen: BoolArray


def fly(scenario: str, seed: int, settings: Sequence[str]) -> Flown:
    """One mission on the local bus."""
    with tempfile.TemporaryDirectory() as folder:
        summary = run_mission(load_scenario(scenario, settings, seed), RunOptions(Path(folder), "local", record=False))
        primaries = [name for name, one in summary["vehicles"].items() if "tracks" in one]
        with np.load(Path(folder) / "risk.npz") as arrays:
            seen = np.any([arrays[f"{name}_sum_levels"] > 0 for name in primaries], axis=0)
    tracks = sum(summary["vehicles"][name]["tracks"] for name in primaries)
    risk = summary["risk"]
    return Flown(tracks, summary["time"]["primary_s"], risk["mean"], risk["worst30_mean"], seen)


def experiments(seeds: int, settings: Sequence[str]) -> Table:
    """The paper's, a row each."""
    table = Table(
        "experiment", "told", "tracks: adaptive, profile", "worst 30 %", "lower by", "least", "mean", "cells lost"
    )
    for index, mission in enumerate(published_missions()):
        if mission.strategy != "adaptive":
            continue
        told = [f"vehicles.primary.range_m={mission.told_range_m}", *settings]
        rows = [
            [fly("paper", seed_of(run, index), [*told, f"vehicles.primary.spacing={one}"]) for one in ALONE]
            for run in range(seeds)
        ]
        lower = np.array([theirs.worst30 - ours.worst30 for theirs, ours in rows])
        lost = sum(int(np.count_nonzero(theirs.seen & ~ours.seen)) for theirs, ours in rows)
        pairs = list(zip(*rows, strict=True))
        table.add_row(
            str(mission.experiment),
            f"{mission.told_range_m} m",
            ", ".join("/".join(str(count) for count in sorted({one.tracks for one in flown})) for flown in pairs),
            ", ".join(f"{np.mean([one.worst30 for one in flown]):.3f}" for flown in pairs),
            f"{lower.mean():.4f} ± {lower.std():.4f}",
            f"{lower.min():.4f}",
            ", ".join(f"{np.mean([one.mean for one in flown]):.3f}" for flown in pairs),
            str(lost),
        )
    return table


def helped(scenario: str, seeds: int, settings: Sequence[str], wanted_risk: float | None) -> Table:
    """A scenario with its helpers, a row for each way of spacing."""
    table = Table("spacing", "tracks", "survey, s", "mean", "worst 30 %", "worst 30 % lower by")
    primaries = load_scenario(scenario, settings).survey_vehicles
    ways = [[f"spacing={one}"] for one in HELPED]
    if wanted_risk is not None:
        ways.append(["spacing=joint", f"wanted_risk={wanted_risk}"])
    theirs: list[Flown] = []
    for way in ways:
        told = [*settings, *(f"vehicles.{name}.{setting}" for name in primaries for setting in way)]
        flown = [fly(scenario, FIRST_SEED + seed, told) for seed in range(seeds)]
        theirs = theirs or flown
        lower = np.array([one.worst30 - other.worst30 for one, other in zip(theirs, flown, strict=True)])
        table.add_row(
            ", ".join(way),
            f"{np.mean([one.tracks for one in flown]):.1f}",
            f"{np.mean([one.survey_s for one in flown]):.0f}",
            f"{np.mean([one.mean for one in flown]):.3f}",
            f"{np.mean([one.worst30 for one in flown]):.3f}",
            f"{lower.mean():.4f} ± {lower.std():.4f}",
        )
    return table


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario")
    parser.add_argument("--wanted-risk", type=float)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--set", dest="settings", action="append", default=[])
    args = parser.parse_args()
    if args.scenario is None:
        table = experiments(args.seeds, args.settings)
    else:
        table = helped(args.scenario, args.seeds, args.settings, args.wanted_risk)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
