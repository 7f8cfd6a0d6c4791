"""Whole runs of `secondlook run` in processes of their own, watched from outside: by marker, pipe and file (Linux)."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

BRIEF = Path(__file__).with_name("brief.yaml")
TWO_PRIMARIES = Path(__file__).with_name("two-primaries.yaml")
# The same mission at a walking pace: it goes on for some seconds of wall time, long enough to be cut off.
SLOW = ("vehicles.primary.speed_mps=0.02", "vehicles.primary.endurance_s=360000", "mission.time_limit_s=100000")
LONG = tuple(word for one in SLOW for word in ("--set", one))  # 44,600 s of the mission, ten of wall time
MARKER = "SECONDLOOK_TEST_RUN"


def until(condition: Callable[[], bool], timeout_s: float = 60.0) -> bool:
    """Whether a condition that nothing announces comes true in time."""
    deadline_s = time.monotonic() + timeout_s
    pause = threading.Event()
    while not condition():
        if time.monotonic() > deadline_s:
            return False
        pause.wait(0.005)
    return True


def has_ended(pid: int, timeout_s: float) -> bool:
    """Whether a process, a child of ours or not, is gone or ends in time."""
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:
        return True
    try:
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        return bool(poll.poll(timeout_s * 1000))
    finally:
        os.close(handle)


def without_expected(out: str) -> str:
    """What `secondlook run` has printed after what it expects of the mission."""
    lines = out.splitlines(keepends=True)
    before = next((place for place, line in enumerate(lines, start=1) if line.startswith("the survey ends ")), 0)
    return "".join(lines[before:])


class Flight:
    """`secondlook run` as a user starts it, with standard output and error in pipes; or another program, which is given
    the folder and the arguments. `expected`: of what it prints the first lines, what is expected of the mission."""

    expected: tuple[str, ...] = ()

    def __init__(self, folder: Path, *arguments: str, program: Path | None = None) -> None:
        self.folder = folder
        self._mark = uuid.uuid4().hex
        ours: list[str | Path] = [Path(sys.executable).with_name("secondlook"), "run", BRIEF, "--out"]
        self.process = subprocess.Popen(
            [*(ours if program is None else [sys.executable, program]), folder, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, MARKER: self._mark, "COLUMNS": "120"},
            cwd=folder.parent,
            start_new_session=True,  # a process group of its own, for Ctrl-C
        )

    def press_ctrl_c(self) -> None:
        """What a terminal does: SIGINT to the whole process group."""
        os.killpg(self.process.pid, signal.SIGINT)

    def children(self) -> dict[str, int]:
        """The process ids of the run's children by host, whoever their parent is by now."""
        found = {}
        for entry in Path("/proc").iterdir():
            try:
                if f"{MARKER}={self._mark}".encode() in (entry / "environ").read_bytes():
                    found[(entry / "cmdline").read_bytes().split(b"\0")[-2].decode()] = int(entry.name)
            except (OSError, ValueError, IndexError):  # no process, not ours, or gone by now
                continue
        return {host: pid for host, pid in found.items() if pid != self.process.pid}

    def is_under_way(self) -> bool:
        """Whether the mission has come so far that events are written."""
        events = self.folder / "events.jsonl"
        return events.exists() and events.stat().st_size > 0

    def finish(self, timeout_s: float = 60.0) -> tuple[int, str, str]:
        """Waits for the end; exit code and what was printed, but for what is expected of the mission."""
        out, err = self.process.communicate(timeout=timeout_s)
        told = without_expected(out)
        self.expected = tuple(out.removesuffix(told).splitlines())
        return self.process.returncode, told, err


@contextmanager
def flight(folder: Path, *arguments: str, program: Path | None = None) -> Iterator[Flight]:
    """A flight that is gone afterwards, whatever has become of the test."""
    flying = Flight(folder, *arguments, program=program)
    try:
        yield flying
    finally:
        flying.process.kill()
        flying.process.communicate()
        for pid in flying.children().values():
            os.kill(pid, signal.SIGKILL)


def events(folder: Path) -> list[dict[str, Any]]:
    """The whole lines of events.jsonl."""
    lines = (folder / "events.jsonl").read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1]]
