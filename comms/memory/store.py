"""The file in which one node's memory lies: its last snapshot, and the journal of what it has handled since.

An SQLite database in WAL mode. What was committed is there after the process was killed at any moment; with `durable`
also after the host has lost its power. A file is looked at on a copy before it is written to, so that one which is
refused stays as it is, byte for byte.

Of a WAL that was cut short SQLite takes what is whole, without a word. So a small file beside it has the number of
steps, written after each is committed and before what was said in it goes out; a memory of fewer is refused. That file
is not synced: after a loss of power it may be behind, never ahead of what was `durable`.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import sqlite3
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import BinaryIO, NamedTuple

from comms.errors import NodeError, StoreRefusedError

SUFFIX = ".sqlite"
WAL = "-wal"  # what SQLite adds to the name of the file in which the newest commits lie
STEPS = "-steps"  # what is added for that which has the number of steps
_MADE_FOR = "PRAGMA user_version = 1"
_TABLES = (
    "CREATE TABLE identity (name TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE snapshot (only INTEGER PRIMARY KEY CHECK (only = 0), step INTEGER, state BLOB, checksum INTEGER)",
    "CREATE TABLE journal (step INTEGER PRIMARY KEY, now_ms INTEGER, inputs BLOB, said INTEGER, checksum INTEGER)",
)
_REMEDY = "must be moved away, or another folder given"


@dataclass(frozen=True)
class Identity:
    """Whose memory it is, and of which run and program: all of it must be the same for it to be taken up.

    The names of the fields are what a sentence calls them. Of several that differ the first is told: the digest of a
    scenario hangs on its seed.
    """

    node: str
    run: str
    seed: str
    scenario: str
    clock: str
    version: str
    schema: str


class Entry(NamedTuple):
    """A step of a node: its place among all, from 0, the time, what it was given, and a checksum of what it said."""

    step: int
    now_ms: int
    inputs: bytes
    said: int

    @property
    def checksum(self) -> int:
        """Over all of it."""
        return zlib.crc32(b"%d %d %d " % (self.step, self.now_ms, self.said) + self.inputs)


class Past(NamedTuple):
    """What is remembered: a state after so many steps, None where there is none, and the steps since."""

    steps: int
    state: bytes | None
    journal: tuple[Entry, ...]


class Store:
    """The memory of one node, in `<folder>/<name>.sqlite`; `past` is what is in it when it is opened, None where it is
    new.

    Raises StoreRefusedError for a file of another identity, for one that is damaged, cut short, of a mission that is
    over or in use, and where it cannot be written. `durable`: what is committed survives a loss of power too, at some
    milliseconds a step.
    """

    def __init__(self, folder: Path, name: str, identity: Identity, *, durable: bool = False) -> None:
        self.path = folder / f"{name}{SUFFIX}"
        self.past: Past | None = None
        with self._in_words(), contextlib.ExitStack() as opened:
            newest = Path(f"{self.path}{WAL}")
            is_left = newest.exists()  # looked for first: another process makes the file before that
            if not self.path.exists():
                if is_left:  # SQLite would put it into the new one
                    raise self.refuse(f"is missing, but not what belongs to it, {newest.name}, which {_REMEDY}")
                _create(self.path, identity)
            opened.enter_context(_locked(self.path))
            self.past = _read_copy(self.path, identity)
            self._is_empty = self.past is None
            self._steps = 0 if self.past is None else self.past.steps + len(self.past.journal)
            self._steps_file = opened.enter_context(Path(f"{self.path}{STEPS}").open("r+b", buffering=0))
            self._database = _connect(self.path)
            self._database.execute(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
            self._files = opened.pop_all()

    def add(self, entry: Entry) -> None:
        """Remembers a step; raises NodeError where it cannot be written."""
        with self._as_failure():
            self._database.execute("INSERT INTO journal VALUES (?, ?, ?, ?, ?)", (*entry, entry.checksum))
            self._count(entry.step + 1)

    def put(self, steps: int, state: bytes) -> None:
        """Puts a state in the place of the one before and of the journal. Raises NodeError."""
        self._is_empty = False
        with self._as_failure(), self._database:
            self._database.execute("BEGIN IMMEDIATE")
            row = (steps, state, zlib.crc32(state, steps))
            self._database.execute("INSERT OR REPLACE INTO snapshot VALUES (0, ?, ?, ?)", row)
            self._database.execute("DELETE FROM journal")

    def end(self) -> None:
        """The mission is over for this node: nobody is to take it up any more. Raises NodeError."""
        with self._as_failure():
            self._database.execute("INSERT OR REPLACE INTO identity VALUES ('over', '1')")
            self._count(self._steps + 1)  # as if it were a step, which may be cut off as well

    def close(self) -> None:
        """Closes the file; of one in which nothing was ever remembered nothing is left."""
        with contextlib.suppress(sqlite3.Error):
            self._database.close()
        if self._is_empty:
            with contextlib.suppress(OSError):
                for suffix in (WAL, "", STEPS):  # a number without a file is no memory, and refuses nobody
                    Path(f"{self.path}{suffix}").unlink(missing_ok=True)
        self._files.close()

    def refuse(self, why: str) -> StoreRefusedError:
        """The error that says why what is in it cannot be taken up."""
        return _refused(self.path, why)

    def _count(self, steps: int) -> None:
        self._steps, self._is_empty = steps, False
        os.pwrite(self._steps_file.fileno(), b"%020d\n" % steps, 0)  # all of it at once: of one length

    @contextmanager
    def _in_words(self) -> Iterator[None]:
        try:
            yield
        except (OSError, sqlite3.Error) as error:
            told = error.strerror if isinstance(error, OSError) else error
            raise StoreRefusedError(f"{self.path}: {told}; must be a file that can be written") from error

    @contextmanager
    def _as_failure(self) -> Iterator[None]:
        try:
            yield
        except (OSError, sqlite3.Error) as error:
            told = error.strerror if isinstance(error, OSError) else error
            raise NodeError(f"{self.path}: {told}; must be a file that can be written") from error


def _connect(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(path, timeout=0.0, isolation_level=None)
    database.execute("PRAGMA locking_mode = EXCLUSIVE")  # before WAL: then no shared memory is needed
    database.execute("PRAGMA journal_mode = WAL")
    return database


def _create(path: Path, identity: Identity) -> None:
    """Makes the file whole or not at all: an empty one is one that was cut short."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        os.close(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))  # what is in it is taken at its word
        database = _connect(beside)
        try:
            for command in (_MADE_FOR, *_TABLES):
                database.execute(command)
            values = zip((one.name for one in fields(identity)), astuple(identity), strict=True)
            database.executemany("INSERT INTO identity VALUES (?, ?)", values)
        finally:
            database.close()
        os.close(os.open(f"{path}{STEPS}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600))  # empty: none
        with contextlib.suppress(FileExistsError):  # somebody else was faster, and writes their number at each step
            os.link(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def _locked(path: Path) -> BinaryIO:
    """Keeps other processes from the file as long as it is open here. SQLite's own locks are of another kind."""
    file = path.open("r+b")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise _refused(path, "is in use by another process; of each node there may be one") from None
    return file


def _read_copy(path: Path, identity: Identity) -> Past | None:
    with tempfile.TemporaryDirectory(prefix="secondlook-") as folder:
        copy = Path(folder) / path.name
        for suffix in ("", WAL):
            with contextlib.suppress(FileNotFoundError):
                shutil.copyfile(f"{path}{suffix}", f"{copy}{suffix}")
        try:
            database = _connect(copy)
            try:
                return _read(database, path, identity)
            finally:
                database.close()
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise _damaged(path, str(error)) from error


def _read(database: sqlite3.Connection, path: Path, identity: Identity) -> Past | None:
    (verdict,) = database.execute("PRAGMA integrity_check(1)").fetchone()
    if verdict != "ok":
        raise _damaged(path, " ".join(str(verdict).split()))
    found: dict[str, str] = dict(database.execute("SELECT name, value FROM identity"))
    for name, ours in zip((one.name for one in fields(identity)), astuple(identity), strict=True):
        theirs = found.get(name, "none")
        if theirs != ours:
            raise _refused(path, f"is of another {name}, {_short(theirs)} and not {_short(ours)}; {_REMEDY}")
    if "over" in found:
        raise _refused(path, f"is of a mission that is over; {_REMEDY}")
    row = database.execute("SELECT step, state, checksum FROM snapshot").fetchone()
    steps: int = 0 if row is None else row[0]
    state: bytes | None = None if row is None else row[1]
    if state is not None and zlib.crc32(state, steps) != row[2]:
        raise _damaged(path, "its snapshot does not have its checksum")
    journal = []
    for place, (*parts, checksum) in enumerate(database.execute("SELECT * FROM journal ORDER BY step"), steps):
        entry = Entry(*parts)
        if entry.step != place or entry.checksum != checksum:
            raise _damaged(path, f"its step {place} is missing or does not have its checksum")
        journal.append(entry)
    there, taken = steps + len(journal), _steps_taken(path)
    if there < taken:
        raise _damaged(path, f"it holds {there} of the {taken} steps that were taken")
    return Past(steps, state, tuple(journal)) if journal or state is not None else None


def _steps_taken(path: Path) -> int:
    file = Path(f"{path}{STEPS}")
    try:
        return int(file.read_bytes().strip(b"\0\n") or b"0")
    except FileNotFoundError:
        raise _damaged(path, f"{file.name}, which belongs to it, is missing") from None
    except ValueError:
        raise _damaged(path, f"{file.name}, which belongs to it, holds no number") from None


def _short(value: str) -> str:
    return value if len(value) <= 40 else f"{value[:12]}..."


def _damaged(path: Path, why: str) -> StoreRefusedError:
    return _refused(path, f"is cut short or damaged: {why}; {_REMEDY}")


def _refused(path: Path, why: str) -> StoreRefusedError:
    return StoreRefusedError(f"{path}: {why}")
