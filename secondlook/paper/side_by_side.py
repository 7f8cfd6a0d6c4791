"""Measures missions in several processes side by side."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from pathlib import Path

from secondlook.paper.measured import MeasuredMission, measure
from secondlook.paper.published import PublishedMission
from secondlook.worker_pool import worker_pool


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
    with tempfile.TemporaryDirectory(prefix="secondlook-paper-") as scratch, worker_pool(workers) as pool:
        jobs = {pool.submit(measure, *missions[index], Path(scratch)): index for index in longest_first}
        for job in as_completed(jobs):
            measured[jobs[job]] = job.result()
            progress(len(measured))
    return [measured[index] for index in range(len(missions))]
