"""`secondlook report`: what happened in a run, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from secondlook.report import write_report


def report(run: Annotated[Path, typer.Argument(help="The folder of a run.")]) -> None:
    """Write report.html into a run's folder: one page that explains the mission, and needs no other file."""
    typer.echo(str(write_report(run)))
