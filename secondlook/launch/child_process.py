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

from comms.control import HostPlan
from comms.lockstep.events import NodeEvent
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.said.messages import RunInfo
from comms.said.routing import RosterNode
from secondlook.fleet.node_spec import NodeSpec
from secondlook.launch.verdict import Fate

STATUS_FD = "SECONDLOOK_STATUS_FD"  # environment variable: the file descriptor for words to the launcher


@dataclass(frozen=True)
class ChildOrder:
    """What a child process is to hold. `passwords` and `hosts` are complete for the hub, which also has the clock and
    the planned `events`. `patience_s`: wall time after which someone silent is given up. `factor`: by how much mission
    time runs faster than the wall clock; None for lockstep."""

    run: str
    plan: HostPlan
    password: str
    roster: tuple[RosterNode, ...]
    specs: dict[str, NodeSpec]
    patience_s: float
    faults: Faults = NO_FAULTS
    is_hub: bool = False
    is_listener: bool = False
    hosts: tuple[HostPlan, ...] = ()
    passwords: dict[str, str] = field(default_factory=dict)
    run_info: RunInfo | None = None
    time_limit_ms: int = 0
    events: tuple[NodeEvent, ...] = ()
    factor: float | None = None

    @property
    def host(self) -> str:
        """The process's name."""
        return self.plan.host


def write_order(pipe: IO[bytes], order: ChildOrder) -> None:
    """Sends an order to a child's standard input, with the launcher's import path: a user's own parts may lie there."""
    pickled = pickle.dumps((sys.path, pickle.dumps(order)))
    pipe.write(len(pickled).to_bytes(8, "big") + pickled)
    pipe.flush()


def read_order(pipe: IO[bytes]) -> ChildOrder:
    """Waits for the launcher's order."""
    size = int.from_bytes(pipe.read(8), "big")
    path, pickled = pickle.loads(pipe.read(size))
    # Behind our own path, so that nothing there can stand in a room's way.
    sys.path.extend(entry for entry in path if entry not in sys.path)
    order = pickle.loads(pickled)
    assert isinstance(order, ChildOrder)
    return order


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
    """Starts the program `secondlook.launch.child_program` with an order. What it prints goes to `<folder>/<host>.txt`.

    `status` is what it says.
    """

    def __init__(self, order: ChildOrder, folder: Path) -> None:
        self.host = order.host
        self._log = folder / f"{order.host}.txt"
        read_fd, child_fd = os.pipe()
        self.status = StatusLines(read_fd)
        try:
            with self._log.open("wb") as log:
                self._process = subprocess.Popen(
                    # -P: a file of the user's in the working directory must not shadow a room of the same name.
                    # Run and host are there for whoever looks at the list of processes.
                    [sys.executable, "-P", "-m", "secondlook.launch.child_program", order.run, order.host],
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=log,
                    pass_fds=(child_fd,),
                    env={**os.environ, STATUS_FD: str(child_fd), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                    start_new_session=True,
                )
        finally:
            os.close(child_fd)
        assert self._process.stdin is not None
        self._stdin = self._process.stdin
        with contextlib.suppress(OSError):  # a child that dies at once is noticed by its end
            write_order(self._stdin, order)

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def tell(self, line: str) -> None:
        """Writes a line to its standard input."""
        with contextlib.suppress(OSError):
            self._stdin.write(f"{line}\n".encode())
            self._stdin.flush()

    def fate(self) -> Fate | None:
        """How it has ended; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        if code < 0:
            return Fate(code, f"was killed by {signal.Signals(-code).name}")
        lines = self._log.read_text(errors="replace").strip().splitlines() if code else []
        return Fate(code, f"has ended with exit code {code}", lines[-1] if lines else "")

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
