"""`secondlook report`: what happened in a run, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from secondlook.commands.reading import REPORT, reading
from secondlook.report import write_report


def report(run: Annotated[Path, typer.Argument(help="The folder of a run.")]) -> None:
    """Write report.html into a run's folder: one page that explains the mission, and needs no other file."""
    with reading("report", REPORT) as on_read:
        path = write_report(run, on_read)
    typer.echo(str(path))
