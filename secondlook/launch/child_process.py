"""A child process of a run, as its launcher sees it: started, heard, told, and ended."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from secondlook.launch.child_order import STATUS_FD, ChildOrder, write_order
from secondlook.launch.status_lines import StatusLines
from secondlook.launch.verdict import Fate


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
