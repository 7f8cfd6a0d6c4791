"""How near an allocator comes to who knows everything beforehand.

python -m bench.clairvoyant [SCENARIO] [--allocators A,B] [--seeds N] [--seconds S] [--jobs J] [--set KEY=VALUE]
python -m bench.clairvoyant --run RUN [--seconds S]      a recorded run; --json for programs, with either

For each seed: the bound on the residual risk (times m2) that a schedule can remove (`clairvoyant_bound` says why none
removes more), what the best schedule removes that was found (`clairvoyant_schedule`, which begins with the best that an
allocator flew), and what each allocator's legs remove; then the ratios. All three are counted alike, by the true P_d of
the helpers; what the mission's map told, from what the vehicles made of their P_d, is compared with that at the end.
S is the processor time of the search for the schedule, which a busy machine makes longer but not worse; the bound
takes some seconds more.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Mapping
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import secondlook
from bench.clairvoyant_bound import upper_bound
from bench.clairvoyant_schedule import best_schedule
from bench.flown_legs import FlownLegs
from bench.legs import Schedule, Simulator
from bench.removable import Clairvoyance, Removable
from secondlook.compare.flights import Failure, contenders, fly
from secondlook.errors import UserError
from secondlook.launch.processes import RunFailedError
from secondlook.launch.signals import signals_interrupt
from secondlook.scenario import Scenario, load_scenario
from secondlook.worker_pool import worker_pool

BOUND_S = 60.0
LARGEST_GRID_CELLS = 60_000
ROUNDING = 1e-9


@dataclass(frozen=True)
class Flown:
    """What an allocator flew, and what that removed as the mission's map told."""

    schedule: Schedule
    measured_m2: float


@dataclass(frozen=True)
class Row:
    """One seed. `removed_m2`: by allocator, what its legs remove, None for a mission that failed; `measured_m2`: the
    same as the mission's map told. `there_m2`: all the risk that the survey alone left. `search_s`: processor
    time of the search for a schedule.

    Raises ValueError where one of these contradicts another.
    """

    seed: int
    removed_m2: dict[str, float | None]
    measured_m2: dict[str, float | None]
    there_m2: float
    bound_m2: float
    best_m2: float
    started_m2: float
    legs: int
    bound_s: float
    search_s: float

    def __post_init__(self) -> None:
        steps = {"all that was there": self.there_m2, "the bound": self.bound_m2, "the best schedule": self.best_m2}
        for (more, most_m2), (less, least_m2) in pairwise(steps.items()):
            self._hold(more, most_m2, less, least_m2)
        for name, removed_m2 in self.removed_m2.items():
            self._hold("the best schedule", self.best_m2, name, removed_m2 or 0.0)

    def _hold(self, more: str, most_m2: float, less: str, least_m2: float) -> None:
        if least_m2 > most_m2 * (1 + ROUNDING):
            raise ValueError(
                f"seed {self.seed}: {less} removes {least_m2:.1f} m2, and {more} must be at least that, not "
                f"{most_m2:.1f} m2: legs are counted wrongly"
            )


def solve(mission: Removable, seed: int, flown: Mapping[str, Flown | None], seconds: float) -> Row:
    """Bound and best schedule of one mission; the search knows what was flown, by allocator, None for a failure."""
    if mission.risk.size > LARGEST_GRID_CELLS:
        raise ValueError(f"a map of {mission.risk.size} cells is too large; must have at most {LARGEST_GRID_CELLS}")
    began_s = time.monotonic()
    bound = upper_bound(mission, BOUND_S)
    bound_s = time.monotonic() - began_s
    best = best_schedule(mission, bound, seconds, seed, [one.schedule for one in flown.values() if one])
    simulator = Simulator(mission)
    return Row(
        seed=seed,
        removed_m2={name: simulator.removed_m2(one.schedule) if one else None for name, one in flown.items()},
        measured_m2={name: one.measured_m2 if one else None for name, one in flown.items()},
        there_m2=mission.total_m2,
        bound_m2=bound.removed_m2,
        best_m2=best.removed_m2,
        started_m2=best.started_m2,
        legs=sum(len(legs) for legs in best.schedule),
        bound_s=bound_s,
        search_s=seconds,
    )


def one_seed(scenario: Scenario, allocators: list[str], seconds: float) -> Row:
    """Flies the seed with each allocator, and solves it. The survey is the same with all of them."""
    clairvoyance = Clairvoyance(contenders(scenario, ["none"])[0].scenario)
    survey = fly(clairvoyance.scenario, clairvoyance.hear)
    if isinstance(survey, Failure):
        raise ValueError(f"seed {scenario.seed}: {survey.failure}")
    mission = clairvoyance.removable()
    flown: dict[str, Flown | None] = {}
    for contender in contenders(scenario, allocators):
        legs = FlownLegs()
        result = fly(contender.scenario, legs.hear)
        flown[contender.name] = (
            None
            if isinstance(result, Failure)
            else Flown(legs.schedule(mission.grid, mission.helpers), result.removed_m2)
        )
    return solve(mission, scenario.seed, flown, seconds)


def one_run(folder: Path, seconds: float) -> Row:
    """Solves a recorded run."""
    scenario = load_scenario(str(folder / "scenario.yaml"))
    clairvoyance, legs = Clairvoyance(scenario), FlownLegs()
    for received in secondlook.load(folder).received():
        clairvoyance.hear(received)
        legs.hear(received)
    alone, fleet = clairvoyance.metrics.risk_primary_alone(), clairvoyance.metrics.risk()
    if alone is None or fleet is None:
        raise UserError(f"{folder}: the run ended before the mission began")
    mission = clairvoyance.removable()
    flown = Flown(
        legs.schedule(mission.grid, mission.helpers), (alone.mean - fleet.mean) * alone.cells * scenario.area.cell_m**2
    )
    return solve(mission, scenario.seed, {scenario.coordinator.allocator: flown}, seconds)


def summary(rows: list[Row]) -> dict[str, Any]:
    """Means and worst cases of the ratios; `measured`: of what the map told to what the legs remove, where any do."""
    told: dict[str, Any] = {"best_to_bound": _ratios([row.best_m2 / row.bound_m2 for row in rows])}
    for name in rows[0].removed_m2:
        flown = [(removed, row) for row in rows if (removed := row.removed_m2[name]) is not None]
        if flown:
            measured = [row.measured_m2[name] or 0.0 for _, row in flown]
            told[name] = {
                "missions": len(flown),
                "to_best": _ratios([removed / row.best_m2 for removed, row in flown]),
                "to_bound": _ratios([removed / row.bound_m2 for removed, row in flown]),
                "measured": _ratios(
                    [by_map / removed if removed else 1.0 for by_map, (removed, _) in zip(measured, flown, strict=True)]
                ),
            }
    return told


def _ratios(values: list[float]) -> dict[str, float]:
    return {
        "mean": float(np.mean(values)),
        "least": min(values),
        "most": max(values),
        "deviation": float(np.std(values)),
    }


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench.clairvoyant", description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--allocators", default="", help="as for secondlook compare; the scenario's own if left out")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--run", type=Path)
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _solve_all(arguments: argparse.Namespace, rows: list[Row]) -> None:
    scenario = load_scenario(arguments.scenario, arguments.set)
    if not scenario.revisit_vehicles:
        raise UserError(f"{arguments.scenario}: has no helper whose schedule could be compared")
    allocators = arguments.allocators.split(",") if arguments.allocators else [scenario.coordinator.allocator]
    alone = next((one.name for one in contenders(scenario, allocators) if not one.scenario.revisit_vehicles), None)
    if alone is not None:
        raise UserError(f"--allocators: {alone} is not allowed; it flies without the helpers that are compared")
    columns = (TextColumn("clairvoyant"), BarColumn(), MofNCompleteColumn(), TextColumn("seeds"), TimeRemainingColumn())
    console = Console(stderr=True)
    with (
        signals_interrupt(),
        Progress(*columns, console=console, transient=True, disable=not sys.stderr.isatty()) as progress,
        worker_pool(min(arguments.jobs, arguments.seeds)) as pool,
    ):
        task = progress.add_task("", total=arguments.seeds)
        seeds = (scenario.model_copy(update={"seed": seed}) for seed in range(1, arguments.seeds + 1))
        for job in as_completed([pool.submit(one_seed, one, allocators, arguments.seconds) for one in seeds]):
            rows.append(job.result())
            progress.update(task, completed=len(rows))


def _print(rows: list[Row]) -> None:
    names = list(rows[0].removed_m2)
    width = max(12, *(len(name) for name in names))
    print(f"{'seed':>5} {'there':>8} {'bound':>8} {'best':>8} {'legs':>5}", *(f"{name:>{width}}" for name in names))
    for row in sorted(rows, key=lambda row: row.seed):
        removed = (f"{'failed' if m2 is None else f'{m2:.0f}':>{width}}" for m2 in row.removed_m2.values())
        print(f"{row.seed:5} {row.there_m2:8.0f} {row.bound_m2:8.0f} {row.best_m2:8.0f} {row.legs:5}", *removed)
    for name, ratios in summary(rows).items():
        if name == "best_to_bound":
            print(f"best schedule found, of the bound: mean {ratios['mean']:.3f}, least {ratios['least']:.3f}")
        else:
            best, bound, measured = ratios["to_best"], ratios["to_bound"], ratios["measured"]
            print(
                f"{name}: of the best schedule mean {best['mean']:.3f}, least {best['least']:.3f}; "
                f"of the bound mean {bound['mean']:.3f}, least {bound['least']:.3f}; "
                f"its map told {measured['least']:.3f} to {measured['most']:.3f} times as much"
            )
    bound_s = np.mean([row.bound_s for row in rows])
    print(f"m2 of residual risk; {rows[0].search_s:.0f} s of search a seed, {bound_s:.0f} s for the bound")


def main() -> None:
    """The command."""
    arguments = _arguments()
    rows: list[Row] = []
    failure = ""
    try:
        if arguments.run:
            rows.append(one_run(arguments.run, arguments.seconds))
        else:
            _solve_all(arguments, rows)
    except UserError as error:
        sys.exit(f"{error}")
    except (RunFailedError, ValueError) as error:
        failure = f"{error}"
    except KeyboardInterrupt:
        failure = "interrupted"
    if rows and arguments.json:
        print(json.dumps({"seeds": [asdict(row) for row in rows], "ratios": summary(rows)}, indent=2))
    elif rows:
        _print(rows)
    if failure:
        sys.exit(failure)


if __name__ == "__main__":
    main()
