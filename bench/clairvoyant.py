"""How near an allocator comes to who knows everything beforehand.

python -m bench.clairvoyant [SCENARIO] [--allocators A,B] [--seeds N] [--first-seed N] [--steps S] [--jobs J]
                            [--set KEY=VALUE] [--objective mean|worst30|both] [--told]
python -m bench.clairvoyant --run RUN [--steps S]        a recorded run; --json for programs, with either

For each seed: the bound on the residual risk (times m2) that a schedule can remove (`clairvoyant_bound` says why none
removes more), the most that was removed by the best schedule found (`clairvoyant_schedule`, which begins with what the
contenders flew) or by a contender, and what each contender removed; then what mean residual risk that leaves, and the
ratios: to the best by the objective, to the bound by the mean. All are counted alike, by the true P_d of the helpers,
contenders look by look as they were flown; what the mission's map told, from what the vehicles made of their P_d, is
compared with that at the end. The schedule is searched by the mean, or by another of the coordinator's objectives; what
it and each contender leave of the worst 30 % stands in a table of its own. S is the number of steps in which a schedule
is searched, some 3,000 a second; the same steps find the same. With `--told` the first contender flies once more, its
coordinator told beforehand what the survey leaves: what is lacking then is not knowledge.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import secondlook
from bench.clairvoyant_bound import upper_bound
from bench.clairvoyant_schedule import best_schedule
from bench.flown_looks import FlownLooks, legs_flown
from bench.legs import Schedule, Simulator
from bench.removable import Clairvoyance, Removable
from bench.told import told_beforehand
from comms.node import Received
from coordinator.cut.ground import OBJECTIVES
from secondlook.compare.flights import Failure, contenders, fly
from secondlook.engine.engine import do_all, own_processes
from secondlook.engine.work_process import Lost
from secondlook.errors import UserError
from secondlook.launch.processes import RunFailedError
from secondlook.launch.signals import signals_interrupt
from secondlook.scenario import Scenario, load_scenario

ROUNDING = 1e-9
TOLD = "told"


@dataclass(frozen=True)
class Flown:
    """What a contender flew: what its looks removed, and left of the worst 30 %, what the mission's map told that they
    removed, and the legs that a search may begin with."""

    removed_m2: float
    worst30: float
    measured_m2: float
    schedule: Schedule


@dataclass(frozen=True)
class Row:
    """One seed. `removed_m2`: by contender, what its looks removed, None for a mission that failed; `measured_m2`: the
    same as the mission's map told. `there_m2`: all the risk that the survey alone left on `area_m2`. `found_m2`: what
    the best schedule found removes, of so many `legs`; `started_m2`: by how much the schedule that the search began
    with made the objective less. `worst30`: the residual risk of the worst 30 % that the survey, that schedule and
    each contender leave. `steps`: of the search, by the `objective`.

    Raises ValueError where one of these contradicts another.
    """

    seed: int
    area_m2: float
    there_m2: float
    bound_m2: float
    found_m2: float
    started_m2: float
    legs: int
    removed_m2: dict[str, float | None]
    measured_m2: dict[str, float | None]
    worst30: dict[str, float | None]
    steps: int
    objective: str = "mean"

    def __post_init__(self) -> None:
        self._hold("all that was there", self.there_m2, "the bound", self.bound_m2)
        self._hold("the bound", self.bound_m2, self.best_by, self.best_m2)

    @property
    def best_m2(self) -> float:
        """The most that anybody removed, the search or a contender."""
        return self._all_m2[self.best_by]

    @property
    def best_by(self) -> str:
        """Who did."""
        return max(self._all_m2, key=lambda name: self._all_m2[name])

    @property
    def reached_m2(self) -> dict[str, float | None]:
        """What the bound allows, the best of all removed, and each contender."""
        return {"bound": self.bound_m2, "best": self.best_m2, **self.removed_m2}

    @property
    def left(self) -> dict[str, float | None]:
        """The mean residual risk that the survey alone leaves, and what each of these does."""
        reached_m2 = {"survey": 0.0, "schedule": self.found_m2, **self.reached_m2}
        return {name: None if m2 is None else (self.there_m2 - m2) / self.area_m2 for name, m2 in reached_m2.items()}

    @property
    def gained(self) -> dict[str, float | None]:
        """By how much less the objective is than the survey alone leaves it, with that schedule and by contender."""
        weights, survey_worst = OBJECTIVES[self.objective], self.worst30["survey"] or 0.0
        found = dict[str, float | None]()
        for name in ("schedule", *self.removed_m2):
            mean, worst, found[name] = self.left[name], self.worst30[name], None
            if mean is not None and worst is not None:
                fell = self.there_m2 / self.area_m2 - mean, survey_worst - worst
                found[name] = weights.mean * fell[0] + weights.worst * fell[1]
        return found

    @property
    def best_gained(self) -> float:
        """The most of these."""
        return max(gained for gained in self.gained.values() if gained is not None)

    @property
    def _all_m2(self) -> dict[str, float]:
        flown = {name: m2 for name, m2 in self.removed_m2.items() if m2 is not None}
        return {"the best schedule": self.found_m2, **flown}

    def _hold(self, more: str, most_m2: float, less: str, least_m2: float) -> None:
        if least_m2 > most_m2 * (1 + ROUNDING):
            raise ValueError(
                f"seed {self.seed}: {less} removes {least_m2:.1f} m2, and {more} must be at least that, not "
                f"{most_m2:.1f} m2: looks are counted wrongly"
            )


def solve(mission: Removable, seed: int, flown: Mapping[str, Flown | None], steps: int, objective: str) -> Row:
    """Bound and best schedule of one mission; the search knows what was flown, by contender, None for a failure."""
    bound = upper_bound(mission)
    known = [one.schedule for one in flown.values() if one]
    best = best_schedule(mission, bound, steps, seed, known, OBJECTIVES[objective])
    left = Simulator(mission).left(best.schedule)
    return Row(
        seed=seed,
        area_m2=float(np.count_nonzero(mission.inside)) * mission.grid.cell_area_m2,
        there_m2=mission.total_m2,
        bound_m2=bound.removed_m2,
        found_m2=mission.gain_m2(left, OBJECTIVES["mean"]),
        started_m2=best.started_m2,
        legs=sum(len(legs) for legs in best.schedule),
        removed_m2={name: one.removed_m2 if one else None for name, one in flown.items()},
        measured_m2={name: one.measured_m2 if one else None for name, one in flown.items()},
        worst30={
            "survey": mission.left(mission.risk).worst30_mean,
            "schedule": mission.left(left).worst30_mean,
            **{name: one.worst30 if one else None for name, one in flown.items()},
        },
        steps=steps,
        objective=objective,
    )


@dataclass
class Heard:
    """What a mission of the scenario tells a clairvoyant."""

    scenario: Scenario

    def __post_init__(self) -> None:
        self.clairvoyance, self.looks = Clairvoyance(self.scenario), FlownLooks(self.scenario)

    def hear(self, received: Received) -> None:
        """Takes one message, in the order of sending."""
        self.clairvoyance.hear(received)
        self.looks.hear(received)

    def flown(self, measured_m2: float) -> Flown:
        """What the helpers flew."""
        mission = self.clairvoyance.removable()
        left, legs = self.looks.left(mission), legs_flown(self.looks.looks, mission)
        return Flown(mission.gain_m2(left, OBJECTIVES["mean"]), mission.left(left).worst30_mean, measured_m2, legs)


def one_seed(
    scenario: Scenario, names: Sequence[str], steps: int, objective: str = "mean", *, told: bool = False
) -> Row:
    """Flies the seed with each contender, with the first one `told` as well, and solves it."""
    alone = Heard(contenders(scenario, ["none"])[0].scenario)
    survey = fly(alone.scenario, alone.hear)
    if isinstance(survey, Failure):
        raise ValueError(f"seed {scenario.seed}: {survey.failure}")
    mission = alone.clairvoyance.removable()
    flown: dict[str, Flown | None] = {}
    rivals = contenders(scenario, names)
    for name, contender in [*((one.name, one) for one in rivals), *([(TOLD, rivals[0])] if told else [])]:
        heard = Heard(contender.scenario)
        with told_beforehand(mission) if name == TOLD else nullcontext():
            result = fly(contender.scenario, heard.hear)
        if isinstance(result, Failure):
            flown[name] = None
            continue
        if not np.array_equal(heard.clairvoyance.removable().risk, mission.risk):
            raise ValueError(f"seed {scenario.seed}: with {name} the survey is another than without helpers")
        flown[name] = heard.flown(result.removed_m2)
    return solve(mission, scenario.seed, flown, steps, objective)


def one_run(folder: Path, steps: int, objective: str) -> Row:
    """Solves a recorded run."""
    scenario = load_scenario(str(folder / "scenario.yaml"))
    heard = Heard(scenario)
    for received in secondlook.load(folder).received():
        heard.hear(received)
    metrics = heard.clairvoyance.metrics
    alone, fleet = metrics.risk_primary_alone(), metrics.risk()
    if alone is None or fleet is None:
        raise UserError(f"{folder}: the run ended before the mission began")
    flown = heard.flown((alone.mean - fleet.mean) * alone.cells * scenario.area.cell_m**2)
    removable = heard.clairvoyance.removable()
    return solve(removable, scenario.seed, {scenario.coordinator.allocator: flown}, steps, objective)


def summary(rows: list[Row]) -> dict[str, Any]:
    """Means and worst cases of the ratios; `to_best`: by the objective; `measured`: of what the map told to what the
    looks remove, where any do."""
    told: dict[str, Any] = {"best_to_bound": _ratios([row.best_m2 / row.bound_m2 for row in rows])}
    for name in rows[0].removed_m2:
        flown = [(removed, row) for row in rows if (removed := row.removed_m2[name]) is not None]
        if flown:
            measured = [row.measured_m2[name] or 0.0 for _, row in flown]
            told[name] = {
                "missions": len(flown),
                "to_best": _ratios([(row.gained[name] or 0.0) / row.best_gained for _, row in flown]),
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
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--objective", choices=["mean", "worst30", "both"], default="mean")
    parser.add_argument("--told", action="store_true", help="the first of them once more, told what the survey leaves")
    parser.add_argument("--run", type=Path)
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _solve_all(arguments: argparse.Namespace, rows: list[Row]) -> None:
    scenario = load_scenario(arguments.scenario, arguments.set)
    if not scenario.revisit_vehicles:
        raise UserError(f"{arguments.scenario}: has no helper whose schedule could be compared")
    Clairvoyance(scenario)  # refuses what it does not count
    allocators = arguments.allocators.split(",") if arguments.allocators else [scenario.coordinator.allocator]
    alone = next((one.name for one in contenders(scenario, allocators) if not one.scenario.revisit_vehicles), None)
    if alone is not None:
        raise UserError(f"--allocators: {alone} is not allowed; it flies without the helpers that are compared")
    columns = (TextColumn("clairvoyant"), BarColumn(), MofNCompleteColumn(), TextColumn("seeds"), TimeRemainingColumn())
    console = Console(stderr=True)
    with (
        signals_interrupt(),
        Progress(*columns, console=console, transient=True, disable=not sys.stderr.isatty()) as progress,
        own_processes(min(arguments.jobs, arguments.seeds)) as engine,
    ):
        task = progress.add_task("", total=arguments.seeds)
        seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
        missions = (scenario.model_copy(update={"seed": seed}) for seed in seeds)
        objective, told = arguments.objective, arguments.told
        solve = partial(one_seed, names=allocators, steps=arguments.steps, objective=objective, told=told)
        for mission, row in do_all(solve, missions, engine, count=arguments.seeds):
            if isinstance(row, Lost):
                raise RunFailedError(f"seed {mission.seed}: {row.why}")
            rows.append(row)
            progress.update(task, completed=len(rows))


def _print_table(title: str, rows: list[tuple[int, dict[str, float | None]]], form: str) -> None:
    """A line for each seed, and one for their mean."""
    names = list(rows[0][1])
    print(title)
    print(" seed", *(f"{name:>{max(8, len(name))}}" for name in names))
    missions = {name: [m2 for _, values in rows if (m2 := values[name]) is not None] for name in names}
    means = {name: float(np.mean(flown)) if flown else None for name, flown in missions.items()}
    for seed, values in [*((f"{seed}", values) for seed, values in rows), ("mean", means)]:
        told = {name: "failed" if value is None else format(value, form) for name, value in values.items()}
        print(f"{seed:>5}", *(f"{told[name]:>{max(8, len(name))}}" for name in names))


def _print(rows: list[Row]) -> None:
    rows = sorted(rows, key=lambda row: row.seed)
    _print_table("residual risk removed, m2", [(row.seed, row.reached_m2) for row in rows], ".0f")
    _print_table("mean residual risk left", [(row.seed, row.left) for row in rows], ".4f")
    _print_table("residual risk left of the worst 30 %", [(row.seed, row.worst30) for row in rows], ".4f")
    for name, ratios in summary(rows).items():
        if name == "best_to_bound":
            print(f"best, of the bound: mean {ratios['mean']:.3f}, least {ratios['least']:.3f}")
        else:
            best, bound, measured = ratios["to_best"], ratios["to_bound"], ratios["measured"]
            print(
                f"{name}: of the best mean {best['mean']:.3f}, least {best['least']:.3f}; "
                f"of the bound mean {bound['mean']:.3f}, least {bound['least']:.3f}; "
                f"its map told {measured['least']:.3f} to {measured['most']:.3f} times as much"
            )
    print(f"{rows[0].steps:,} steps of search a seed")


def main() -> None:
    """The command."""
    arguments = _arguments()
    rows: list[Row] = []
    failure = ""
    try:
        for name, least in (("seeds", 1), ("first_seed", 0), ("jobs", 1), ("steps", 0)):
            if getattr(arguments, name) < least:
                key = name.replace("_", "-")
                raise UserError(f"--{key}: {getattr(arguments, name)} is not allowed; must be at least {least}")
        if arguments.run:
            if arguments.told or arguments.allocators or arguments.set:
                raise UserError("--run: is not allowed with --told, --allocators or --set; a run is as it was flown")
            rows.append(one_run(arguments.run, arguments.steps, arguments.objective))
        else:
            _solve_all(arguments, rows)
    except UserError as error:
        sys.exit(f"{error}")
    except (RunFailedError, ValueError) as error:
        failure = f"{error}"
    except KeyboardInterrupt:
        failure = "interrupted"
    if rows and arguments.json:
        told = [{**asdict(row), "best_m2": row.best_m2, "best_by": row.best_by, "left": row.left} for row in rows]
        print(json.dumps({"seeds": told, "ratios": summary(rows)}, indent=2))
    elif rows:
        _print(rows)
    if failure:
        sys.exit(failure)


if __name__ == "__main__":
    import_module("bench.clairvoyant").main()  # by the name under which other processes find what they are to call
