"""A sweep's own process is killed at random moments and started again: is the table the same in the end, row for row,
as of one that was never disturbed?

    python -m bench.sweep_kills [--kills 50] [--seeds 60]
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from bench.flown import BRIEF
from secondlook.launch.supervisor import PROGRAM

BY_THE_WALL_CLOCK = ["time.wall_s", "time.real_time_factor"]
LATEST_S = 6.0


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.sweep_kills", description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seeds", type=int, default=60)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        sys.exit(kill_and_resume(Path(folder), arguments.kills, arguments.seeds, LATEST_S))


def kill_and_resume(folder: Path, kills: int, seeds: int, latest_s: float) -> int:
    """The exit code: 1 where a table differs. Sweeps are begun until so many processes have been killed, each
    `latest_s` after its start or sooner."""
    undisturbed = _table(folder / "undisturbed", seeds)
    chance, killed, sweeps, different, times = random.Random(1), 0, 0, 0, Counter[int]()
    while killed < kills:
        out = folder / f"killed-{sweeps}"
        sweeps += 1
        done, before = False, killed
        while not done:
            process = _start(out, seeds)
            try:
                done = process.wait(chance.uniform(0.5, latest_s) if killed < kills else None) == 0
                assert done, "it is not to fail by itself"
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
                killed += 1
        times[killed - before] += 1
        table = _read(out)
        different += not table.equals(undisturbed)
    print(f"{killed} kills, {sweeps} sweeps of {len(undisturbed)} missions, {different} with another table")
    print("killed so often were so many: " + ", ".join(f"{kills}: {count}" for kills, count in sorted(times.items())))
    return 1 if different else 0


def _table(out: Path, seeds: int) -> pa.Table:
    assert _start(out, seeds).wait() == 0
    return _read(out)


def _start(out: Path, seeds: int) -> subprocess.Popen[bytes]:
    asked = ["sweep", str(BRIEF), "--seeds", f"1..{seeds}", "--vary", "coordinator.allocator=plan,none"]
    paths = os.pathsep.join(filter(None, sys.path))
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *asked, "--out", str(out)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": paths},
    )


def _read(out: Path) -> pa.Table:
    return pq.read_table(out / "missions.parquet").drop_columns(BY_THE_WALL_CLOCK)


if __name__ == "__main__":
    main()
