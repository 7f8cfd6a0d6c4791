"""How long planning the routes takes, and how that grows with strips and helpers.

python -m bench.planning_time [--seeds 5] [--json]

Strips lie at random over 5 km by 2 km, 400 m by 50 m; half of the helpers are free, the others at work. Told is the CPU
time of one `assign` in milliseconds, mean and worst over the seeds, best of three each; and beside it, for the same
situations, that of `cbba` and of `nearest`.
"""

from __future__ import annotations

import argparse
import json
import math
import time

import numpy as np
from rich.console import Console
from rich.table import Table

from coordinator.allocate.cbba import CbbaAllocator
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.service import expected_service
from coordinator.allocate.simple import NearestAllocator
from coordinator.allocate.situation import Allocator, Helper, OpenStrip, Situation
from planner.dubins import Pose
from planner.types import Strip

SIZES = ((10, 1), (50, 5), (100, 10), (200, 1), (200, 5), (200, 10), (200, 20), (400, 20))
"""Open strips and helpers."""
REPEATS = 3


def situation(strips: int, helpers: int, seed: int) -> Situation:
    """One at random, two hours before the deadline."""
    chance = np.random.default_rng(seed)

    def strip(number: int) -> OpenStrip:
        start = float(chance.uniform(0, 5000)), float(chance.choice([0, 400, 800, 1200, 1600]))
        return OpenStrip(Strip(number, start, 0.0, 400.0, 50.0), float(chance.uniform(5000, 15_000)))

    def helper(number: int) -> Helper:
        pose = Pose(float(chance.uniform(0, 5000)), float(chance.uniform(0, 2000)), float(chance.uniform(0, 6)))
        free = Helper(
            vehicle=f"helper_{number:02}",
            pose=pose,
            free_at=pose,
            free_s=0.0,
            task=None,
            speed_mps=float(chance.choice([1.5, 2.0, 2.5])),
            turn_radius_m=6.0,
            run_in_m=5.0,
            swath_m=50.0,
            p_detect=0.7,
            lasts_until_s=math.inf,
            refused=frozenset(),
        )
        if number % 2 == 0:
            return free
        task = strip(strips + number)
        served = expected_service(task, free)
        return Helper(**{**vars(free), "task": task, "free_at": served.free_at, "free_s": served.free_s})

    open_strips = tuple(strip(number) for number in range(1, strips + 1))
    found = tuple(helper(number) for number in range(helpers))
    return Situation(0.0, 7200.0, open_strips, found)


def milliseconds(allocator: Allocator, one: Situation) -> float:
    """CPU time of one revision, the best of some."""
    best = math.inf
    for _ in range(REPEATS):
        began_s = time.process_time()
        allocator.assign(one)
        best = min(best, time.process_time() - began_s)
    return best * 1000


def measure(seeds: int) -> list[dict[str, float]]:
    """A row for each size."""
    rows = []
    for strips, helpers in SIZES:
        situations = [situation(strips, helpers, seed) for seed in range(1, seeds + 1)]
        plan = [milliseconds(RoutesAllocator(), one) for one in situations]
        cbba = [milliseconds(CbbaAllocator(), one) for one in situations]
        nearest = [milliseconds(NearestAllocator(), one) for one in situations]
        rows.append(
            {
                "strips": strips,
                "helpers": helpers,
                "plan_ms": float(np.mean(plan)),
                "plan_worst_ms": max(plan),
                "cbba_ms": float(np.mean(cbba)),
                "nearest_ms": float(np.mean(nearest)),
            }
        )
    return rows


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = measure(arguments.seeds)
    if arguments.json:
        print(json.dumps(rows, indent=2))
        return
    table = Table("open strips", "helpers", "plan, ms", "worst", "cbba, ms", "nearest, ms")
    for row in rows:
        told = (f"{row[name]:.1f}" for name in ("plan_ms", "plan_worst_ms", "cbba_ms", "nearest_ms"))
        table.add_row(str(row["strips"]), str(row["helpers"]), *told)
    Console().print(table)


if __name__ == "__main__":
    main()
