"""Starts the process of a node again when it dies by a signal or a failure, and is its only parent: what it is told to
do the process does, and where it is killed the process ends.

The process knows by a pipe of its own that it has a supervisor; through that it says where a start anew is of no use,
or of use although it was refused.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence

from secondlook.errors import FAILED, WRONG_USE
from secondlook.launch.restarts import Restarts
from secondlook.launch.signals import signals_ask

SUPERVISOR_FD, STARTS = "SECONDLOOK_SUPERVISOR_FD", "SECONDLOOK_STARTS"  # environment variables of the process
OVER, AGAIN = b"over\n", b"again\n"  # what it says
PROGRAM = "from secondlook.installed_command import main; main()"
"""What a Python of ours does to be the command `secondlook`."""


class Supervisor:
    """Of the command `secondlook` with these arguments; `name`: what it is called to people."""

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        self._name = name
        self._command = [sys.executable, "-P", "-c", PROGRAM, *arguments]
        self._restarts = Restarts()
        self._asked_to_end = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None

    def run(self) -> int:
        """Runs it until it has ended for good; returns the exit code."""
        with signals_ask(self._end):
            starts = 0
            while True:
                began_s = time.monotonic()
                code, said = self._run_once(starts)
                starts += 1
                is_refused = code == WRONG_USE and (AGAIN not in said or starts == 1)
                if code == 0 or OVER in said or is_refused or self._asked_to_end.is_set():
                    return code if code >= 0 else FAILED
                how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with exit code {code}"
                delay_s = self._restarts.again(time.monotonic() - began_s)
                if delay_s is None:
                    self._say(f"{how}, too often in a row; it is not started again")
                    return FAILED
                self._say(
                    f"{how}; it is started again{f' in {delay_s:g} s' if delay_s else ''}, {self._restarts.in_words}"
                )
                if self._asked_to_end.wait(delay_s):
                    return FAILED

    def _run_once(self, starts: int) -> tuple[int, bytes]:
        ours, its = socket.socketpair()
        with ours:
            with its:
                env = {**os.environ, SUPERVISOR_FD: str(its.fileno()), STARTS: str(starts)}
                # In a session of its own: Ctrl-C comes to it from here alone.
                self._process = subprocess.Popen(
                    self._command, env=env, pass_fds=(its.fileno(),), stdin=subprocess.DEVNULL, start_new_session=True
                )
            if self._asked_to_end.is_set():  # just before it was there
                self._process.send_signal(signal.SIGTERM)
            code = self._process.wait()
            ours.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                return code, ours.recv(4096)
        return code, b""

    def _end(self) -> None:
        self._asked_to_end.set()
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.send_signal(signal.SIGTERM)

    def _say(self, sentence: str) -> None:
        sys.stderr.write(f"{self._name}: {sentence}\n")
        sys.stderr.flush()


def starts_before() -> int:
    """In a process: how often its supervisor has started it before; 0 where it has none."""
    return int(os.environ.get(STARTS, "0"))


def tell_supervisor(word: bytes) -> None:
    """In a process: says a word to its supervisor, if it has one."""
    if SUPERVISOR_FD in os.environ:
        with contextlib.suppress(OSError):
            os.write(int(os.environ[SUPERVISOR_FD]), word)


def end_with_supervisor() -> None:
    """In a process: from now on it is interrupted when its supervisor, if it has one, is gone."""
    if SUPERVISOR_FD not in os.environ:
        return

    def wait() -> None:
        while os.read(int(os.environ[SUPERVISOR_FD]), 1):
            pass
        signal.raise_signal(signal.SIGTERM)

    threading.Thread(target=wait, name="supervisor", daemon=True).start()
