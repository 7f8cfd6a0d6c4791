"""How files are written: small ones whole or not at all, streams so that they are readable as far as they go. And what
a run's folder is, and whose."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import io
import os
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from comms.errors import FileError
from secondlook.errors import UserError

FLUSH_EVERY_S = 0.5  # of the wall clock
ROOM_BYTES = 1 << 18


class CannotWriteError(UserError, FileError):
    """A file that cannot be written; it ends a command with exit code 2, and a mission in flight with 1."""


@contextmanager
def whole_file(path: Path, *, lasts: bool = True) -> Iterator[BinaryIO]:
    """A file to write, which takes its place, and that of one that is there, when all is written: whoever reads it
    finds the old one or the new one, also after a loss of power where it `lasts`. Raises CannotWriteError."""
    there = Path(os.path.realpath(path))  # what a link leads to is written, and the link stays
    beside = there.with_name(f".{there.name}.{os.getpid()}.part")
    try:
        if there.is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        if there.exists() and not there.is_file():  # a pipe or a terminal: nothing can take its place
            with there.open("wb") as file:
                yield file
            return
        try:
            with beside.open("wb") as file:
                yield file
                if lasts:
                    file.flush()
                    os.fsync(file.fileno())
            beside.replace(there)
        except BaseException:
            with contextlib.suppress(OSError):
                beside.unlink()
            raise
    except OSError as error:
        raise CannotWriteError(path, error) from error


def write_whole(path: Path, content: str, *, lasts: bool = True) -> None:
    """Writes a text as a file, whole or not at all; see `whole_file`. Raises CannotWriteError."""
    with whole_file(path, lasts=lasts) as file:
        file.write(content.encode())


def check_run_folder(path: Path) -> None:
    """Raises UserError for what is no folder, and so not that of a run."""
    if path.is_file():
        raise UserError(f"{path}: is a file; must be the folder of a run, as secondlook run writes it")
    if not path.is_dir():
        raise UserError(f"{path}: there is no such folder; must be the folder of a run")


def make_folder(out: Path, mode: int = 0o777) -> None:
    """Makes the folder given with --out, if it is not there; `mode`: with which rights. Raises UserError where it
    cannot be."""
    try:
        out.mkdir(mode, parents=True, exist_ok=True)
    except OSError as error:
        why = "is a file" if out.is_file() else error.strerror
        raise UserError(f"--out {out}: {why}; must be a folder that can be written") from error


@contextmanager
def own_folder(out: Path) -> Iterator[None]:
    """Within it the folder given with --out, which is made if it is not there, is nobody else's who asks for it so.
    Raises UserError where it cannot be, or is another process's."""
    make_folder(out)
    try:
        lock = os.open(out, os.O_RDONLY)
    except OSError as error:
        raise UserError(f"--out {out}: {error.strerror}; must be a folder that can be written") from error
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise UserError(f"--out {out}: another process writes to it already; must be another folder") from error
        yield
    finally:
        os.close(lock)


@contextmanager
def passing_folder() -> Iterator[Path]:
    """A folder that is gone afterwards. Raises UserError where none can be made, as the disk is full for one."""
    try:
        made = tempfile.TemporaryDirectory(prefix="secondlook-")
    except OSError as error:
        raise UserError(f"a passing file cannot be made: {error.strerror}") from error
    with made as name:
        yield Path(name)


@contextmanager
def room_kept(folder: Path) -> Iterator[None]:
    """Within it a file without a name takes up room in a folder, as far as there is any: what is written afterwards,
    such as a summary which says that the disk was full, finds that free. Raises CannotWriteError."""
    try:
        room = tempfile.TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115 - closed below
    except OSError as error:
        raise CannotWriteError(folder, error) from error
    with room:
        with contextlib.suppress(OSError):
            room.write(os.urandom(ROOM_BYTES))  # which no file system makes smaller
        yield


class GrowingFile:
    """A file to which is written again and again. What was written is with the system half a second later, and so
    survives this process, also where nothing more comes.

    Raises CannotWriteError; nothing is written any more after that.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._error: OSError | None = None
        try:
            self._file = io.BufferedWriter(io.FileIO(path, "w"))
        except OSError as error:
            raise CannotWriteError(path, error) from error
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._flush_regularly, name=f"flush {path.name}", daemon=True)
        self._thread.start()

    def write(self, content: bytes) -> None:
        """Appends to it."""
        self._check()
        try:
            self._file.write(content)
        except OSError as error:
            self._error = error
            self._check()

    def close(self) -> None:
        """Ends it; raises what could not be told before."""
        self._closing.set()
        self._thread.join()
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or error
        self._check()

    def _check(self) -> None:
        if self._error is not None:
            raise CannotWriteError(self._path, self._error) from self._error

    def _flush_regularly(self) -> None:
        while self._error is None and not self._closing.wait(FLUSH_EVERY_S):
            try:
                self._file.flush()
            except OSError as error:
                self._error = error
