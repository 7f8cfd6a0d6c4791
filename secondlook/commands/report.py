"""`secondlook report`: what happened in a run, as a page."""

from __future__ import annotations

import typer

from secondlook.commands.given import Run
from secondlook.commands.reading import REPORT, reading
from secondlook.report import write_report


def report(run: Run) -> None:
    """Write report.html into a run's folder: one page that explains the mission, and needs no other file."""
    with reading("report", REPORT) as on_read:
        path = write_report(run, on_read)
    typer.echo(str(path))
