"""What a sweep costs beside its missions: rows of missions of no length, their rate, and the memory they take.

    python -m bench.sweep_rows [--rows 100000] [--jobs 2]

The overhead is the wall time a row takes, as a share of a mission of `tellaro` flown in the same run.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from bench.memory import rss_mb
from secondlook.engine.engine import own_processes
from secondlook.sweeps.fly import fly_missing
from secondlook.sweeps.plan import SweepPlan, SweptMission
from secondlook.sweeps.rows import fly
from secondlook.sweeps.standings import load_sweep

PARTS = 10


def of_no_length(mission: SweptMission) -> dict[str, Any]:
    return {"digest": mission.key * 4, "risk.mean": 0.5, "risk.worst30_mean": 0.7, "time.wall_s": 0.0}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.sweep_rows", description=__doc__.split("\n")[0])
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    plan = SweepPlan("tellaro", range(1, arguments.rows + 1))
    mission = next(iter(plan.missions()))
    fly(mission)
    began_s = time.perf_counter()
    fly(mission)
    mission_s = time.perf_counter() - began_s
    at: list[tuple[int, float]] = []

    def progress(done: int, failed: int) -> None:
        if done * PARTS // arguments.rows > len(at):
            at.append((done, rss_mb()))

    with tempfile.TemporaryDirectory() as folder, own_processes(arguments.jobs) as engine:
        began_s = time.perf_counter()
        fly_missing(plan, Path(folder), engine, progress, flies=of_no_length)
        took_s = time.perf_counter() - began_s
        rows = len(load_sweep(folder).table)
    print(f"{rows} rows in {took_s:.1f} s, {1e6 * took_s / rows:.0f} microseconds each")
    print(f"that is {took_s / rows / (mission_s / arguments.jobs):.2%} of a mission of tellaro, {mission_s:.2f} s")
    print("memory: " + ", ".join(f"{mb:.0f} MB after {done}" for done, mb in at))
    print(f"at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    import_module("bench.sweep_rows").main()  # by the name under which other processes find what they are to call
