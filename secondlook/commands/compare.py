"""`secondlook compare`: which allocator leaves the least risk?"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from comms.said.announcement import LARGEST_SEED
from secondlook.commands.given import AsJson, Set
from secondlook.commands.many_missions import Dask, Jobs, Tell, engine, fly_watched
from secondlook.commands.remarks import remark_on
from secondlook.compare.flights import Flown, contenders, fly_all
from secondlook.compare.paired import OBJECTIVES, objective_of, verdict
from secondlook.compare.standings import as_json as comparison_as_json
from secondlook.compare.standings import failures, standings, table
from secondlook.errors import FAILED, UserError
from secondlook.files import CannotWriteError, write_whole
from secondlook.fleet.build import build_fleet
from secondlook.launch.run_folder import own_new_folder
from secondlook.scenario import load_scenario
from secondlook.scenario.plug_ins import plug_ins_print_to_stderr
from secondlook.sweeps.plan import refuse_seed

MOST_SEEDS = 10_000
WIDEST = 500  # characters


def compare(
    scenario: Annotated[str, typer.Argument(help="A bundled scenario's name or a YAML file.")] = "tellaro",
    allocators: Annotated[
        str | None,
        typer.Option(
            metavar="A,B,...",
            help="Allocators; self and self-longer: no helper, primaries revisit themselves. All, if left out.",
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=MOST_SEEDS, help="How many seeds each flies with.")] = 10,
    first_seed: Annotated[
        int, typer.Option(min=0, max=LARGEST_SEED - MOST_SEEDS, help="The first of them; the others follow.")
    ] = 1,
    jobs: Jobs = None,
    dask: Dask = None,
    set_: Set = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for compare.json and the plot risk.png, new or empty.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fly the same seeds with several allocators, and compare what they leave."""
    refuse_seed(set_ or (), "--first-seed and --seeds")
    with plug_ins_print_to_stderr():
        mission = load_scenario(scenario, set_ or ())
        objective = objective_of(mission)
        chosen = contenders(mission, () if allocators is None else [name.strip() for name in allocators.split(",")])
        for contender in chosen:
            build_fleet(contender.scenario, record=False)
    if out is not None and find_spec("matplotlib") is None:
        raise UserError("--out: the plot needs matplotlib, not installed here; the extra secondlook[plots] has it")
    flown: Flown = {}
    numbers = range(first_seed, first_seed + seeds)
    shown = not as_json

    def fly(tell: Tell) -> None:
        def progress(flown: Flown) -> None:
            failed = len(failures(flown))
            tell(sum(len(by_seed) for by_seed in flown.values()), f"{failed} failed" if failed else "")

        fly_all(chosen, numbers, flies, flown, progress)

    with own_new_folder(out):
        remark_on([(mission, ())])  # allocators change nothing of it
        with engine(jobs, dask) as flies:
            failure = fly_watched("compare", "missions", seeds * len(chosen), fly, shown=shown)
        stood = standings(flown)
        reacting = verdict(chosen, {one.name: one.against_first for one in stood}, objective)
        title = f"{mission.name}, seeds {numbers[0]} to {numbers[-1]}"
        content = json.dumps(comparison_as_json(flown, stood, mission.name, objective, reacting), indent=2)
        if as_json:
            typer.echo(content)
        elif stood:
            judged = f"judged by {OBJECTIVES[objective].what} when the mission ends"
            told = table(stood, f"{title}, {judged}\nIt ends {mission.mission.deadline} at the latest.", objective)
            console = Console(soft_wrap=True, highlight=False)
            console.width = max(console.width, Console(width=WIDEST).measure(told).maximum)  # nothing is cut off
            console.print(told)
            if reacting is not None:
                typer.echo(reacting.sentence)
        if out is not None and stood:
            _write(content, flown, title, out)
            if not as_json:
                typer.echo(f"Files: {out / 'compare.json'}, {out / 'risk.png'}")
    sentences = [*failures(flown), *([failure] if failure else [])]
    if sentences:
        sys.stderr.write("".join(f"{sentence}\n" for sentence in sentences))
        raise typer.Exit(FAILED)


def _write(content: str, flown: Flown, title: str, folder: Path) -> None:
    try:
        write_whole(folder / "compare.json", content + "\n")
        # Only who draws needs matplotlib.
        import_module("secondlook.compare.plot").draw(flown, title, folder / "risk.png")
    except CannotWriteError as error:
        raise UserError(f"--out {error}") from error
