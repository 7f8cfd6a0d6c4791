"""The installed command: makes sure that the rooms are ours before anything of them is imported.

Their names are plain words, and a folder or file of the user's with such a name could take a room's place.
"""

from __future__ import annotations

import errno
import gc
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from secondlook.errors import UserError

ROOMS = ("comms", "coordinator", "modem", "planner", "sim_world", "vehicle_agent", "viz")


HOME = Path(__file__).resolve().parent.parent
"""The folder that holds the rooms."""


def check_rooms() -> None:
    """Raises UserError, in one sentence, for a room that comes from elsewhere."""
    for room in ROOMS:
        spec = find_spec(room)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin is None:
            raise UserError(
                f"the package {room!r} is not found, which must be at {HOME / room}: install secondlook anew"
            )
        if origin != HOME / room / "__init__.py":
            raise UserError(
                f"your {origin} hides ours, the package {room!r} at {HOME / room}: it must have another name, "
                "or not lie where this is called, in the working directory or on PYTHONPATH"
            )


def hidden_in(folder: Path) -> Path | None:
    """A file or package of a user's in this folder that is called like a room, so that either of them hides the other
    from what lies there; None if there is none."""
    for room in (*ROOMS, "secondlook"):
        for place in (folder / f"{room}.py", folder / room / "__init__.py"):
            if place.is_file() and place.resolve() != HOME / room / "__init__.py":
                return place
    return None


FAILED, WRONG_USE = 1, 2
"""Exit codes: of a mission that failed, of wrong use and bad input; 0 is done."""
NOT_WRITABLE = (errno.ENOSPC, errno.EPIPE, errno.EIO, errno.EBADF)
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
NO_FOLDER = "No usable temporary directory"  # as tempfile says where the disk is full


@contextmanager
def _ended_by_ctrl_c() -> Iterator[None]:
    """Within it Ctrl-C ends the process as it does any program: what is being imported could make an error of its own
    of an exception. One that is ignored stays so."""
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _all_kept() -> Iterator[None]:
    """Within it nobody looks for garbage: what is loaded stays, and to look through it takes a tenth of the time."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def main() -> None:
    """Checks the rooms, then runs the command line. Ctrl-C while that is still being loaded ends it without a word,
    standard output that cannot be written, and a full disk that nobody else has told of, with a sentence."""
    try:
        check_rooms()
        with _ended_by_ctrl_c(), _all_kept():
            run = import_module("secondlook.cli").command_line(sys.argv[1:])
        run()
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(WRONG_USE)
    except OSError as error:
        told = str(error.strerror)
        if error.filename is None and error.errno in NOT_WRITABLE:
            sys.stderr.write(f"standard output cannot be written: {told}\n")
            sys.stdout = None  # nothing is left to be written when the interpreter ends
        elif error.errno in NO_ROOM or told.startswith(NO_FOLDER):
            sys.stderr.write(f"{error.filename or 'a passing file cannot be made'}: {told}\n")
        else:
            raise
        sys.exit(FAILED)
