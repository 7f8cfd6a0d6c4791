"""The installed command: makes sure that the rooms are ours before anything of them is imported."""

from __future__ import annotations

import errno
import gc
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from secondlook.errors import FAILED, WRONG_USE, UserError
from secondlook.rooms import check_rooms

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
    if sys.stderr is None:  # closed by who has called us: nobody wants to read what is told there
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
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
