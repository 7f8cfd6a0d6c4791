"""Measures missions in several processes side by side."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path

from secondlook.paper.measured import MeasuredMission, measure
from secondlook.paper.published import PublishedMission

SAFE_PATH = "PYTHONSAFEPATH"


def measure_all(
    missions: Sequence[tuple[PublishedMission, int]], progress: Callable[[int], None]
) -> list[MeasuredMission]:
    """Measures each mission with its seed; the results are in the order of the missions.

    `progress` is told how many are done. Those with the most components to fit, which take longest, go first. Raises
    RunFailedError, and BrokenProcessPool where a process of its own dies.
    """
    workers = min(os.cpu_count() or 1, len(missions))
    longest_first = sorted(range(len(missions)), key=lambda index: -missions[index][0].components)
    measured: dict[int, MeasuredMission] = {}
    with (
        tempfile.TemporaryDirectory(prefix="secondlook-paper-") as scratch,
        _safe_path(),
        ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_begin) as pool,
    ):
        try:
            jobs = {pool.submit(measure, *missions[index], Path(scratch)): index for index in longest_first}
            for job in as_completed(jobs):
                measured[jobs[job]] = job.result()
                progress(len(measured))
        except BaseException:
            # What they are at would take seconds to finish, and nobody wants it any more.
            for worker in multiprocessing.active_children():
                worker.kill()
            raise
    return [measured[index] for index in range(len(missions))]


@contextmanager
def _safe_path() -> Iterator[None]:
    """Processes started within search modules as with `-P`: a file of the user's in the working directory must not pass
    for one of ours."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before


def _begin() -> None:
    """A worker leaves Ctrl-C to the process that started it, and ends with that, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
