"""A Dask scheduler and its workers, each a process on this machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from flights import until


class DaskProcesses:
    """They are ended when it is left. `folder`: for their files."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stack = ExitStack()
        self._started = 0
        self.address = ""
        self.scheduler: subprocess.Popen[bytes]

    def __enter__(self) -> DaskProcesses:
        self.start_scheduler()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def start_scheduler(self) -> None:
        """Starts one, again at the address of the one before."""
        file = self._folder / f"scheduler-{self._started}.json"
        port = self.address.rpartition(":")[2] or "0"
        self.scheduler = self._start("scheduler", "--port", port, "--scheduler-file", str(file))
        assert until(lambda: file.exists() and file.read_text().endswith("}"))
        self.address = json.loads(file.read_text())["address"]

    def start_worker(self, *home: Path) -> subprocess.Popen[bytes]:
        """One more, with one thread and no other process that would start it anew. `home`: where its code lies, if not
        here."""
        return self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--death-timeout", "60", home=home)

    def _start(self, what: str, *arguments: str, home: Sequence[Path] = ()) -> subprocess.Popen[bytes]:
        self._started += 1
        work = self._folder / f"{what}-{self._started}"
        work.mkdir()
        where = ["--host", "127.0.0.1", "--no-dashboard"]
        if what == "worker":
            where += ["--local-directory", str(work)]
        paths = os.pathsep.join([*map(str, home), *filter(None, sys.path)])
        with (work / "log.txt").open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_" + what, *arguments, *where],
                stdout=log,
                stderr=log,
                cwd=work,
                env={**os.environ, "PYTHONPATH": paths},
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process
