"""Writes the report of a run."""

from __future__ import annotations

import os
from pathlib import Path

from secondlook.errors import UserError
from secondlook.recorded import load_run
from secondlook.report.page import report_page

REPORT = "report.html"


def write_report(run: str | os.PathLike[str]) -> Path:
    """Writes report.html into the folder of a run, in place of one that is there; its path.

    Raises UserError, in one sentence, for what is no recorded run and where the file cannot be written.
    """
    mission = load_run(run)
    path = mission.folder / REPORT
    page = report_page(mission)
    try:
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; must be a file that can be written") from error
    return path
