"""A child process of a run, as its launcher sees it: what it is told to hold, started, heard, and ended."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from comms.drive import Drive, Setup
from comms.errors import NodeError, one_line
from comms.keys import HostSpec
from secondlook.files import CannotWriteError
from secondlook.fleet.nodes import NodeSpec
from secondlook.launch.verdict import Fate

SIGN_OF_LIFE = b"."  # to the hub, from its launcher, some times a second
STATUS_FD = "SECONDLOOK_STATUS_FD"  # environment variable: the file descriptor for words to the launcher


@dataclass(frozen=True)
class ChildSetup:
    """What a child process is told: what all of the run are told alike, what makes its time go on, which process it is,
    with what it connects, and how to make its nodes. `passwords` and `hosts` are complete for the hub, empty for all
    others."""

    setup: Setup
    drive: Drive
    spec: HostSpec
    nodes: dict[str, NodeSpec]
    password: str = ""
    hosts: tuple[HostSpec, ...] = ()
    passwords: dict[str, str] = field(default_factory=dict)

    @property
    def host(self) -> str:
        """The process's name."""
        return self.spec.host

    @property
    def listens_only(self) -> bool:
        """Whether it holds a listener."""
        return any(one.listens_only for one in self.setup.roster if one.node_id in self.spec.nodes)


def send_setup(pipe: IO[bytes], setup: ChildSetup) -> None:
    """Tells a child at its standard input, with the launcher's import path: a user's own classes may lie there."""
    pickled = pickle.dumps((sys.path, pickle.dumps(setup)))
    pipe.write(len(pickled).to_bytes(8, "big") + pickled)
    pipe.flush()


def receive_setup(pipe: IO[bytes]) -> ChildSetup:
    """Waits for what the launcher tells."""
    size = int.from_bytes(pipe.read(8), "big")
    path, pickled = pickle.loads(pipe.read(size))
    # Behind our own path, so that nothing there can stand in a room's way.
    sys.path.extend(entry for entry in path if entry not in sys.path)
    with np.errstate():  # modules of the user's are imported, which may have numpy raise more errors than we do
        setup = pickle.loads(pickled)
    assert isinstance(setup, ChildSetup)
    return setup


CHUNK_BYTES = 65_536


class StatusLines:
    """The reading end of a pipe, which it takes over and closes."""

    def __init__(self, read_fd: int) -> None:
        os.set_blocking(read_fd, False)
        self._fd = read_fd
        self._unread = b""

    def fileno(self) -> int:
        """For `select`: readable when there are lines, or no more will come."""
        return self._fd

    def read(self) -> list[dict[str, Any]] | None:
        """The lines that have come since the last time; None when no more will come.

        A line without its end is kept until that comes; what a killed child has not finished is left out.
        """
        ended = False
        try:
            while chunk := os.read(self._fd, CHUNK_BYTES):
                self._unread += chunk
            ended = True
        except BlockingIOError:
            pass
        *lines, self._unread = self._unread.split(b"\n")
        return None if ended and not lines else [json.loads(line) for line in lines]

    def close(self) -> None:
        """Closes the pipe."""
        os.close(self._fd)


class ChildProcess:
    """Starts the program `secondlook.launch.child_program` as it is told. What it prints is added to
    `<folder>/<host>.txt`.

    `status` is what it says. Raises CannotWriteError where its log cannot be written, and NodeError where the system
    starts no more processes.
    """

    def __init__(self, setup: ChildSetup, folder: Path) -> None:
        self.host = setup.host
        self._began_s = time.monotonic()
        self._log = folder / f"{setup.host}.txt"
        read_fd, child_fd = os.pipe()
        self.status = StatusLines(read_fd)
        try:
            self._process = self._started(setup, child_fd)
        except BaseException:
            self.status.close()
            raise
        finally:
            os.close(child_fd)
        assert self._process.stdin is not None
        self._stdin = self._process.stdin
        with contextlib.suppress(OSError):  # a child that dies at once is noticed by its end
            send_setup(self._stdin, setup)

    def _started(self, setup: ChildSetup, status_fd: int) -> subprocess.Popen[bytes]:
        try:
            log = self._log.open("ab")
        except OSError as error:
            raise CannotWriteError(self._log, error) from error
        with log:
            try:
                return subprocess.Popen(
                    # -P: a file of the user's in the working directory must not shadow a room of the same name.
                    # Run and host are there for whoever looks at the list of processes.
                    [sys.executable, "-P", "-m", "secondlook.launch.child_program", setup.setup.run, setup.host],
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=log,
                    pass_fds=(status_fd,),
                    env={**os.environ, STATUS_FD: str(status_fd), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                    start_new_session=True,
                )
            except OSError as error:
                raise NodeError(f"{self.host} cannot be started: {error.strerror}") from error

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def lived_s(self) -> float:
        """How long ago it was started, in seconds of wall time."""
        return time.monotonic() - self._began_s

    def tell(self, line: str) -> None:
        """Writes a line to its standard input."""
        with contextlib.suppress(OSError):
            self._stdin.write(f"{line}\n".encode())
            self._stdin.flush()

    def show_life(self) -> None:
        """Tells it that the launcher is not stopped."""
        with contextlib.suppress(OSError):
            self._stdin.write(SIGN_OF_LIFE)
            self._stdin.flush()

    def fate(self) -> Fate | None:
        """How it has ended; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        if code < 0:
            return Fate(code, f"was killed by {signal.Signals(-code).name}")
        lines = self._log.read_text(errors="replace").strip().splitlines() if code else []
        return Fate(code, f"has ended with exit code {code}", one_line(lines[-1]) if lines else "")

    def kill(self) -> None:
        """Kills it and waits for its end."""
        self._process.kill()
        self._process.wait()

    def freeze(self) -> None:
        """Stops it until it is thawed."""
        self._process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Lets it go on."""
        self._process.send_signal(signal.SIGCONT)

    def let_go(self) -> None:
        """Closes its standard input: it ends by itself."""
        with contextlib.suppress(OSError):
            self._stdin.close()

    def wait(self, deadline_s: float) -> bool:
        """Waits for its end until a time of `time.monotonic`; whether it came."""
        try:
            self._process.wait(timeout=max(0.0, deadline_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
        return True

    def bury(self) -> None:
        """Kills it if it still runs, and takes away its log if that is empty."""
        self.kill()
        self.let_go()
        self.status.close()
        if self._log.exists() and self._log.stat().st_size == 0:
            self._log.unlink()
