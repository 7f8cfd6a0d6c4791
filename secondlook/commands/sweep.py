"""`secondlook sweep`: a table of many missions."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from secondlook.commands.many_missions import Dask, Jobs, Tell, engine, fly_watched
from secondlook.commands.remarks import remark_on
from secondlook.errors import FAILED, UserError
from secondlook.sweeps.fly import LIMIT_S, fly_missing
from secondlook.sweeps.page import write_page
from secondlook.sweeps.plan import SweepPlan, load_sweep_plan, seeds_of, varied
from secondlook.sweeps.rows import schema_of
from secondlook.sweeps.standings import SHOWN, check_figures, load_sweep, standings, table_of

WIDEST = 500  # characters
MOST_TOLD = 5  # failures


def sweep(
    scenario: Annotated[
        str | None,
        typer.Argument(help="A bundled scenario's name or a YAML file; with --show, a sweep's folder."),
    ] = None,
    seeds: Annotated[str | None, typer.Option(metavar="A..B", help="Seeds of each combination.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=V,V,...", help="Values of a key of the scenario, each with each of other keys."),
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key for all missions.")
    ] = None,
    plan: Annotated[Path | None, typer.Option(help="All of that from a YAML file instead.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder: new, empty, or of this sweep, which goes on.")] = None,
    jobs: Jobs = None,
    dask: Dask = None,
    limit_s: Annotated[
        float, typer.Option(min=1, max=1e6, help="Seconds of the wall clock after which a mission is ended.")
    ] = LIMIT_S,
    show: Annotated[
        bool, typer.Option("--show", help="Fly nothing; tell how it stands, and write sweep.html.")
    ] = False,
    figures: Annotated[str, typer.Option(metavar="NAME,NAME,...", help="Which columns are told.")] = ",".join(SHOWN),
) -> None:
    """Fly a scenario with many seeds and settings into a table; the same command goes on where it was broken off."""
    names = [name.strip() for name in figures.split(",")]
    if show:
        flies = {"--seeds": seeds, "--vary": vary, "--set": set_, "--plan": plan, "--jobs": jobs, "--dask": dask}
        for name, value in flies.items():
            if value is not None:
                raise UserError(f"{name}: not allowed beside --show, which flies nothing")
        if out is not None and scenario is not None:
            raise UserError(f"--out {out}: not allowed beside the folder {scenario}; one is shown")
        _show(out or Path(scenario or ""), names)
        return
    if out is None:
        raise UserError("--out: is needed; must be a folder for the rows")
    asked = _plan(scenario, seeds, vary, set_, plan)
    check_figures(schema_of(asked), names)  # all that is asked for, before anything is made
    remark_on([(one.scenario, one.settings) for one in asked.combinations])

    def fly(tell: Tell) -> None:
        def progress(done: int, failed: int) -> None:
            tell(done, f"{failed} failed" if failed else "")

        with engine(jobs, dask) as flies:
            fly_missing(asked, out, flies, progress, limit_s=limit_s)

    failure = fly_watched("sweep", "missions", asked.count, fly, shown=True)
    failed = _show(out, names, page=False)
    typer.echo(f"Files: {out}; how it stands: secondlook sweep {shlex.quote(str(out))} --show")
    if failure:
        sys.stderr.write(f"{failure}; the same command goes on\n")
    if failed or failure:
        raise typer.Exit(FAILED)


def _plan(
    scenario: str | None, seeds: str | None, vary: list[str] | None, set_: list[str] | None, plan: Path | None
) -> SweepPlan:
    if plan is None:
        if scenario is None or seeds is None:
            raise UserError("a scenario and --seeds A..B are needed, or --plan")
        return SweepPlan(scenario, seeds_of(seeds), tuple(set_ or ()), varied(vary or ()))
    given = {"a scenario": scenario, "--seeds": seeds, "--vary": vary, "--set": set_}
    for name, value in given.items():
        if value:
            raise UserError(f"--plan: not allowed beside {name}; the plan holds it")
    return load_sweep_plan(plan)


def _show(folder: Path, names: list[str], *, page: bool = True) -> int:
    """Tells how a sweep stands; returns how many of its missions have failed."""
    flown = load_sweep(folder)
    stood = standings(flown, names)
    if not stood:
        typer.echo(f"{flown.scenario}, 0 of {flown.missions} missions: none is done yet, so there is nothing to show")
        return 0
    told = table_of(flown, stood, names)
    console = Console(soft_wrap=True, highlight=False)
    console.width = max(console.width, Console(width=WIDEST).measure(told).maximum)  # nothing is cut off
    console.print(told)
    failures = [text for text in flown.table["failure"].to_pylist() if text is not None]
    for text in failures[:MOST_TOLD]:
        sys.stderr.write(f"failed: {text}\n")
    if page:
        typer.echo(f"Page: {write_page(flown, stood, names, folder)}")
    return len(failures)
