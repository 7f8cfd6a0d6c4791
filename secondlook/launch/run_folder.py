"""Where the files of a run go, the launcher's own log among them."""

from __future__ import annotations

import contextlib
import itertools
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from secondlook.errors import UserError
from secondlook.files import CannotWriteError, make_folder, own_folder


@contextmanager
def run_folder(out: Path | None, name: str) -> Iterator[Path]:
    """The folder for the files of a run: `out`, new or empty, or a new one in `runs`, named after scenario and time.
    Within it no other run goes to the same. Raises UserError."""
    out = _new_among_runs(name) if out is None else out
    with own_new_folder(out):
        yield out


def _new_among_runs(name: str) -> Path:
    runs, number = Path("runs"), 1
    make_folder(runs)
    name += datetime.now().astimezone().strftime("-%Y%m%d-%H%M%S")
    while True:
        out = runs / (name if number == 1 else f"{name}-{number}")
        try:
            out.mkdir()
        except FileExistsError:  # of a run that began in the same second
            number += 1
            continue
        except OSError:
            make_folder(out)  # says why it cannot be
        return out


def folder_beside(out: Path, start: int) -> Path:
    """The folder for the files of a later start, the second being 2, of what has written to `out`: OUT-2 and so on
    beside it, or the next of these that is not there. `out` may be no more than a way there, such as `.`."""
    there = Path(os.path.realpath(out)) if out.name in ("", "..") else out
    paths = (there.parent / f"{there.name}-{number}" for number in itertools.count(start))
    return next(path for path in paths if not os.path.lexists(path))


def make_new_folder(out: Path, unless: str = "") -> None:
    """Makes the folder given with --out, if it is not there. Raises UserError where it cannot be, or holds anything,
    unless that is, among others, the file `unless`."""
    make_folder(out)
    try:
        taken = next(out.iterdir(), None)
    except OSError as error:
        raise UserError(f"--out {out}: {error.strerror}; must be a folder that can be written") from error
    if taken is not None and not (unless and (out / unless).is_file()):
        raise UserError(f"--out {out}: holds {taken.name} already; must be a new or empty folder")


@contextmanager
def own_new_folder(out: Path | None) -> Iterator[None]:
    """Within it the folder given with --out is this process's alone; it is made as `make_new_folder` does. Without one
    there is nothing to do."""
    if out is None:
        yield
        return
    with own_folder(out):
        make_new_folder(out)
        yield


class _LogFile(logging.FileHandler):
    # It says nothing where the disk is full: of that the run's other files tell, in a sentence.
    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError):  # the file is opened here
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - its name there
        pass


TRACEBACK = "Traceback (most recent call last):"


def traceback_files(folder: Path) -> list[Path]:
    """Of the logs in a folder those in which somebody has failed and says where."""
    return [log for log in sorted(folder.glob("*.txt")) if TRACEBACK in log.read_text(errors="replace")]


@contextmanager
def log_to_file(path: Path) -> Iterator[None]:
    """Within it warnings and errors go to the file, which is made when there is one to write; its folder is taken away
    again if it stays empty."""
    try:
        path.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise CannotWriteError(path.parent, error) from error
    handler = _LogFile(path, delay=True, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    handler.setLevel(logging.WARNING)
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        with contextlib.suppress(OSError):  # what was not written until now does not fit either
            handler.close()
        with contextlib.suppress(OSError):
            path.parent.rmdir()
