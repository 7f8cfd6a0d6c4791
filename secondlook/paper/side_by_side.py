"""Measures missions in several processes side by side."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed

from secondlook.paper.measured import MeasuredMission, measure
from secondlook.paper.published import PublishedMission

SAFE_PATH = "PYTHONSAFEPATH"


def measure_all(
    missions: Sequence[tuple[PublishedMission, int]], progress: Callable[[int], None]
) -> list[MeasuredMission]:
    """Measures each mission with its seed; the results are in the order of the missions.

    `progress` is told how many are done. Those with the most components to fit, which take longest, go first. Raises
    RunFailedError.
    """
    # A file of the user's in the working directory must not pass for a module of ours: as with every child process.
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    workers = min(os.cpu_count() or 1, len(missions))
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        longest_first = sorted(range(len(missions)), key=lambda index: -missions[index][0].components)
        jobs = {pool.submit(measure, *missions[index]): index for index in longest_first}
        measured: dict[int, MeasuredMission] = {}
        for job in as_completed(jobs):
            measured[jobs[job]] = job.result()
            progress(len(measured))
        return [measured[index] for index in range(len(missions))]
    finally:
        pool.shutdown(cancel_futures=True)
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
