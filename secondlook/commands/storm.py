"""`secondlook storm`: does the fleet come through whatever goes wrong?"""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from comms.said.announcement import LARGEST_SEED
from secondlook.commands.given import Set
from secondlook.commands.many_missions import Jobs, Tell, fly_watched
from secondlook.engine.work_process import Lost, WorkProcess
from secondlook.errors import FAILED, UserError
from secondlook.files import write_whole
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import Bus
from secondlook.launch.run_folder import make_new_folder, own_new_folder
from secondlook.scenario import Scenario, load_scenario
from secondlook.storm.campaign import (
    STORM_LIMIT_S,
    Outcomes,
    agreement,
    fly_storms,
    storm_of,
    times_reached,
    without_end,
)
from secondlook.storm.canaries import CANARIES, Find, find_canaries
from secondlook.storm.fly import Outcome, fly_storm, latest_flight
from secondlook.storm.shrink import MOST_FLIGHTS, is_alike, violations_of, what_is_left
from secondlook.storm.shrink import shrink as make_smaller
from secondlook.storm.witness import Violation
from secondlook.sweeps.plan import refuse_seed, seed_range
from secondlook.testing.fleet import Fleet
from secondlook.testing.plan import TroublePlan, load_plan

PLAN = "plan.yaml"
MOST_STORMS = 1_000_000
MOST_NAMED = 20  # of what was never tried


def storm(
    scenario: Annotated[
        str | None, typer.Argument(help="A bundled scenario's name or a YAML file; left out, fleets are drawn, too.")
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(metavar="A..B", help="From which to which storm; 1..100, with --canaries 1..500, if left out."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=LARGEST_SEED, help="Fly this storm alone, with a recording.")
    ] = None,
    plan: Annotated[Path | None, typer.Option(help="Fly the storm of this plan file, with a recording.")] = None,
    shrink: Annotated[
        bool, typer.Option("--shrink", help="Leave out of this storm what it fails without, and fly what is left.")
    ] = False,
    flights: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST_STORMS, help=f"With --shrink, how often it is flown at most; {MOST_FLIGHTS} if left out."
        ),
    ] = None,
    bus: Annotated[Bus | None, typer.Option(help="Of a single storm; local if left out.")] = None,
    again: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Of many each Nth is flown twice, each 10 Nth over Zenoh, too; 0: none."),
    ] = 50,
    canaries: Annotated[
        bool, typer.Option("--canaries", help="Plant bugs, and fly storms with each until it is found.")
    ] = False,
    jobs: Jobs = None,
    set_: Set = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder: of storms that fail their plan files, of a single one its files.")
    ] = None,
) -> None:
    """Fly fleets through swarms of faults, drawn from a number each, and tell what did not hold."""
    if set_ and scenario is None:
        raise UserError("--set: not allowed without a scenario, as fleets are drawn then")
    refuse_seed(set_ or (), "--seed or --seeds")
    mission = None if scenario is None else load_scenario(scenario, set_ or ())
    if mission is not None:
        build_fleet(mission, record=False)  # refuses what makes none, before there is a folder
    if canaries and (plan is not None or seed is not None):
        raise UserError("--canaries: not allowed beside --plan or --seed; must be flown with a range, --seeds A..B")
    if seeds is not None and (plan is not None or seed is not None):
        raise UserError("--seeds: not allowed beside --plan or --seed; a range is flown without")
    if flights is not None and not shrink:
        raise UserError("--flights: not allowed without --shrink; says how often a storm is flown to shrink it")
    most_flights = (flights or MOST_FLIGHTS) if shrink else 0
    if plan is not None:
        if scenario is not None or seed is not None:
            raise UserError("--plan: not allowed beside a scenario or --seed; the plan holds both")
        _fly_one(load_plan(plan), out or Path("runs") / plan.stem, bus or "local", most_flights)
    elif seed is not None:
        _fly_one(storm_of(mission, seed), out or Path("runs") / f"storm-{seed}", bus or "local", most_flights)
    elif shrink:
        raise UserError("--shrink: not allowed without --seed or --plan; it shrinks a single storm")
    elif bus is not None:
        raise UserError("--bus: not allowed without --seed or --plan; of many storms --again says which fly over Zenoh")
    else:
        numbers, side_by_side = _range_of(seeds or ("1..500" if canaries else "1..100")), jobs or os.cpu_count() or 1
        with own_new_folder(out):
            if canaries:
                _look_for_canaries(mission, numbers, side_by_side, out)
            else:
                words = [*filter(None, [scenario]), *(word for one in set_ or () for word in ("--set", one))]
                _fly_many(mission, words, numbers, again, side_by_side, out)


def _range_of(seeds: str) -> range:
    numbers = seed_range(seeds)
    if not 0 < len(numbers) <= MOST_STORMS:
        raise UserError(
            f"--seeds: {seeds} is not allowed; must be A..B with A at most B, at most {MOST_STORMS} whole numbers"
        )
    return numbers


def _fly_one(plan: TroublePlan, folder: Path, bus: Bus, flights: int) -> None:
    Fleet.of_plan(plan, folder=folder)  # refuses trouble that does not fit the fleet, before there is a folder
    make_new_folder(folder, unless=PLAN)  # the folder of a storm takes one more flight
    if flights:
        plan = _shrunk(plan, folder, bus, flights)
    write_whole(folder / PLAN, plan.to_yaml())
    outcome = fly_storm(plan, bus=bus, folder=folder, record=True)
    for violation in outcome.violations:
        typer.echo(str(violation))
    if not outcome.violations:
        how = "was over" if outcome.digest else "has failed, as its disk was full,"
        typer.echo(f"All that must hold does; the mission {how} at {outcome.end_s:.0f} s.")
    typer.echo(f"Files: {folder}, the plan file {PLAN} among them")
    if outcome.violations:
        flown = shlex.quote(str(latest_flight(folder)))
        typer.echo(f"The moment: secondlook view {flown} --at {outcome.violations[0].t_s:g}")
        raise typer.Exit(FAILED)


def _shrunk(plan: TroublePlan, folder: Path, bus: Bus, flights: int) -> TroublePlan:
    """The smallest plan in which the same does not hold. It is written, too, where the search is broken off, which ends
    the command."""
    smallest = plan
    flown = 0

    def fly(tell: Tell) -> None:
        # In a process of its own, as Ctrl-C is to end the search and not to pass for a failure of the mission.
        with closing(WorkProcess()) as process:

            def violations(tried: TroublePlan) -> Sequence[Violation]:
                found = process.do(violations_of, tried, bus, limit_s=STORM_LIMIT_S)
                return [without_end(found.why)] if isinstance(found, Lost) else found

            first = next(iter(violations(plan)), None)
            if first is None:
                return

            def fails(tried: TroublePlan) -> bool:
                nonlocal flown
                flown += 1
                left = smallest
                tell(flown, f"{len(left.trouble)} faults and {len(left.scenario.vehicles)} vehicles left")
                return any(is_alike(one, first) for one in violations(tried))

            def found(smaller: TroublePlan) -> None:
                nonlocal smallest
                smallest = smaller

            make_smaller(plan, fails, most_flights=flights, found=found)

    failure = fly_watched("shrink", "flights", flights, fly, shown=True)
    if flown or failure:
        typer.echo(f"{what_is_left(plan, smallest)} {flown} flights.")
    if failure:
        write_whole(folder / PLAN, smallest.to_yaml())
        sys.stderr.write(f"{failure}; the smallest until then is {folder / PLAN}\n")
        raise typer.Exit(FAILED)
    return smallest


def _fly_many(
    mission: Scenario | None, words: Sequence[str], numbers: range, twice: int, jobs: int, out: Path | None
) -> None:
    """`words`: by which the command is told whose storms to fly."""
    outcomes: Outcomes = {}
    again = shlex.join(["secondlook", "storm", *words, "--seed"])

    def fly(tell: Tell) -> None:
        def progress(number: int, outcome: Outcome) -> None:
            tell(len(outcomes), "")
            if outcome.violations:
                typer.echo(f"seed {number}: {outcome.violations[0]}; again: {again} {number}")
                if out is not None:
                    write_whole(out / f"storm-{number}.yaml", storm_of(mission, number).to_yaml())

        fly_storms(mission, numbers, jobs, outcomes, progress, twice)

    failure = fly_watched("storm", "storms", len(numbers), fly, shown=True)
    failed = sorted(number for number, outcome in outcomes.items() if outcome.violations)
    reached = times_reached(outcomes)
    if out is not None:
        told = {number: [str(one) for one in outcomes[number].violations] for number in failed}
        content = {"first": numbers[0], "last": numbers[-1], "flown": len(outcomes), "failed": told, "reached": reached}
        write_whole(out / "storm.json", json.dumps(content, indent=2) + "\n")
    typer.echo(f"{len(outcomes)} storms flown; in {len(failed)} of them something did not hold.")
    never = [name for name, count in reached.items() if not count]
    if never:
        more = f"; and {len(never) - MOST_NAMED} more" if len(never) > MOST_NAMED else ""
        typer.echo(f"Never tried in these storms: {'; '.join(never[:MOST_NAMED])}{more}.")
    if failure:
        sys.stderr.write(f"{failure}\n")
    truth = agreement(outcomes)
    typer.echo(truth.told)
    if failed or failure or not truth.holds:
        raise typer.Exit(FAILED)


def _look_for_canaries(mission: Scenario | None, numbers: range, jobs: int, out: Path | None) -> None:
    finds: dict[str, Find] = {}

    def fly(tell: Tell) -> None:
        find_canaries(mission, numbers, jobs, finds, lambda: tell(len(finds), ""))

    failure = fly_watched("canaries", "planted bugs", len(CANARIES), fly, shown=True)
    width = max(map(len, CANARIES))
    for name in CANARIES:
        if name in finds:
            typer.echo(f"{name:{width}}  {_found(finds[name])}")
    if out is not None:
        told = {name: asdict(find) for name, find in finds.items()}
        write_whole(out / "canaries.json", json.dumps(told, indent=2) + "\n")
    found = sum(find.number is not None for find in finds.values())
    typer.echo(f"{found} of {len(CANARIES)} planted bugs found.")
    if failure:
        sys.stderr.write(f"{failure}\n")
    if found < len(CANARIES) or failure:
        raise typer.Exit(FAILED)


def _found(find: Find) -> str:
    if find.number is None:
        return f"not found in {find.storms} storms"
    return f"seed {find.number}, after {find.storms} storms: {find.invariant}"
