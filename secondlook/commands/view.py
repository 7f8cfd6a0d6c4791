"""`secondlook view`: a recorded mission in Rerun."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from secondlook.commands.given import Run
from secondlook.errors import UserError
from secondlook.files import check_run_folder
from secondlook.progress import shown_progress
from viz.recording_viewer import RecordingViewer, is_empty, is_recording, is_whole, repair
from viz.viewer_program import ViewerError, check_display

LONGEST_S = 10_000_000  # no mission is longer


def view(
    run: Run,
    web: Annotated[bool, typer.Option("--web", help="In a browser on this machine, not in a window.")] = False,
    at: Annotated[
        float | None,
        typer.Option(
            min=0, max=LONGEST_S, metavar="SECONDS", help="Simulated time at which the window shows it, paused."
        ),
    ] = None,
) -> None:
    """Open the recording of a run in Rerun. Ends with the window, or with Ctrl-C."""
    if web and at is not None:
        raise UserError("--at: not allowed beside --web; a browser's page begins where it chooses")
    recordings = _recordings(run)
    try:
        if not web:
            check_display()
        with contextlib.suppress(KeyboardInterrupt), ExitStack() as stack:
            whole = [stack.enter_context(_whole(one)) for one in recordings]
            viewer = stack.enter_context(_opened(whole, web=web, at_s=at))
            if web:
                typer.echo(f"The mission is shown, until Ctrl-C, at\n{viewer.page}")
            viewer.wait()
    except ViewerError as error:
        raise UserError(str(error)) from error


def _opened(recordings: Iterable[Path], *, web: bool, at_s: float | None) -> RecordingViewer:
    with shown_progress("view", begins="opening"):
        return RecordingViewer(recordings, web=web, at_s=at_s)


def _recordings(run: Path) -> list[Path]:
    """The run's recording: its parts, of which each but the first is of a recorder that was started again."""
    check_run_folder(run)
    later = sorted(run.glob("mission-*.rrd"), key=lambda one: (len(one.name), one.name))
    parts = [run / "mission.rrd", *later]
    holding = [one for one in parts if _holds_something(one)]
    if not holding:
        why = "its recorder was killed before it had written anything, or is about to write"
        raise UserError(f"{parts[0]}: holds nothing yet: {why}")
    return holding


def _holds_something(recording: Path) -> bool:
    try:
        if is_empty(recording):
            return False
        if is_recording(recording):
            return True
    except FileNotFoundError as error:
        told = f"{recording.parent}: holds no {recording.name}; must be the folder of a run without --no-record"
        raise UserError(told) from error
    except OSError as error:
        raise UserError(f"{recording}: cannot be read: {error.strerror}") from error
    raise UserError(f"{recording}: is not a recording; must be as the run wrote it")


@contextmanager
def _whole(recording: Path) -> Iterator[Path]:
    """A recording that is whole: this one, after a repair if its run has ended, or else a copy of what there is."""
    if is_whole(recording):
        yield recording
        return
    run = recording.parent
    # A recorder that still writes would go on writing into the file that is no longer there.
    if (run / "summary.json").exists() and os.access(run, os.W_OK):
        repaired = recording.with_name(f"{recording.name}.repaired")
        _repair(recording, repaired)
        repaired.replace(recording)
        typer.echo(f"{recording} had lost its end; it is repaired, with all that was written", err=True)
        yield recording
        return
    with tempfile.TemporaryDirectory(prefix="secondlook-view-") as folder:
        copy = Path(folder) / recording.name
        _repair(recording, copy)
        typer.echo(f"{recording} has no end yet; what is there until now is shown from a copy", err=True)
        yield copy


def _repair(recording: Path, repaired: Path) -> None:
    with shown_progress("view", begins=f"repairing {recording}"):
        repair(recording, repaired)
