"""`secondlook paper`: the paper's experiments, its tables and figures beside ours."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from secondlook.commands.given import AsJson
from secondlook.commands.many_missions import Dask, Tell, engine, fly_watched
from secondlook.errors import FAILED, UserError
from secondlook.files import make_folder
from secondlook.launch.processes import RunFailedError
from secondlook.paper.measured import MeasuredMission, measure_all
from secondlook.paper.published import PublishedMission, published_missions
from secondlook.paper.report import as_json as entries_of
from secondlook.paper.report import conclusions, differing_decisions, tables

NEEDED = {"sklearn": "scikit-learn", "matplotlib": "matplotlib"}
"""What is imported, and what it is called where packages are installed from."""


def paper(
    out: Annotated[Path | None, typer.Option(help="Folder for the figures, as PNG; none are drawn without.")] = None,
    as_json: AsJson = False,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Runs of the six missions, to tell the spread.")] = 1,
    dask: Dask = None,
) -> None:
    """Fly the paper's three experiments. Prints its tables beside what came of them; needs secondlook[paper]."""
    _require_extra()
    if out is not None:
        make_folder(out)
    runs = _measure(seeds, dask, shown=not as_json)
    if as_json:
        typer.echo(json.dumps(entries_of(runs), indent=2))
    else:
        console = Console(soft_wrap=True, highlight=False)
        for table in tables(runs):
            console.print(table, "")
        for sentence in conclusions(runs):
            console.print(sentence)
    if out is not None:
        # Only who draws needs matplotlib.
        files = import_module("secondlook.paper.figures").draw_all(runs[0], out)
        if not as_json:
            typer.echo(f"Figures: {', '.join(str(file) for file in files)}")
    differing = differing_decisions(runs)
    if differing:
        sys.stderr.write("Decisions differ from the paper's:\n" + "".join(f"  {line}\n" for line in differing))
        raise typer.Exit(FAILED)


def seed_of(run: int, mission: int) -> int:
    """Every mission has a sea of its own: also those that fly the same tracks."""
    return 1 + run * len(published_missions()) + mission


def _measure(runs: int, dask: str | None, *, shown: bool) -> list[list[MeasuredMission]]:
    missions: list[tuple[PublishedMission, int]] = [
        (mission, seed_of(run, index)) for run in range(runs) for index, mission in enumerate(published_missions())
    ]
    measured: list[MeasuredMission] = []

    def fly(tell: Tell) -> None:
        measured.extend(measure_all(missions, flies, lambda done: tell(done, "")))

    try:
        with engine(None, dask) as flies:
            failure = fly_watched("paper", "missions", len(missions), fly, shown=shown)
    except RunFailedError as error:
        failure = str(error)
    if failure:
        sys.stderr.write(f"{failure}\n")
        raise typer.Exit(FAILED)
    each = len(published_missions())
    return [measured[start : start + each] for start in range(0, len(measured), each)]


def _require_extra() -> None:
    """Raises UserError, in one sentence, where a package of the extra `paper` is not installed."""
    missing = [name for module, name in NEEDED.items() if find_spec(module) is None]
    if missing:
        names = " and ".join(missing)
        raise UserError(
            f"secondlook paper needs {names}, not installed here; the extra secondlook[paper] has all of it"
        )
