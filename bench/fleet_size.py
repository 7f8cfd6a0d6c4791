"""What a vehicle-hour costs in fleets of any size, and what it goes into.

    python -m bench.fleet_size [--shares 1 2 4 8 16] [--seconds 1200] [--cell 10] [--json]

A fleet has a share of 600 m by 2000 m for each primary, and three helpers beside it, so that area, cells, vehicles and
strips grow alike. Each is flown on the local bus for some time of the mission, from its beginning on. Told is the
processor time in seconds a vehicle-hour, by part (see `bench.local_speed`); and by what power of the fleet's size the
whole of it grows, by the least and the largest fleet.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import time
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from bench.local_speed import accounted, fly
from comms.node import Received
from secondlook.recorded.observer import RunStopped
from secondlook.scenario import Scenario, make_scenario
from secondlook.scenario.text import Value

WIDE_M, LONG_M, HELPERS = 600, 2000, 3
TOLD = {"coordinator": "coordinator", "survey agent": "agents", "revisit agent": "agents", "world": "world"}


def fleet_of(shares: int, cell_m: float) -> Scenario:
    """So many shares side by side, each with a primary and three helpers that start at its southern end."""
    vehicles: dict[str, Any] = {}
    for share in range(shares):
        west_m = share * WIDE_M
        vehicles[f"primary-{share + 1}"] = {
            "role": "survey",
            "speed_mps": 1.5,
            "turn_radius_m": 20,
            "start": {"x_m": west_m - 60 if share == 0 else west_m + 10, "y_m": -60},
            "endurance_s": 60_000,
            "nadir_gap_m": 40,
            "range_m": 145,
            "part": f"{share + 1} of {shares}",
            "sensor": {"curve": "muscle"},
        }
        for place in range(HELPERS):
            vehicles[f"helper-{share * HELPERS + place + 1}"] = {
                "role": "revisit",
                "start": {"x_m": west_m + 150 * (place + 1), "y_m": -60},
                "speed_mps": 2.0,
                "turn_radius_m": 6,
                "endurance_s": 60_000,
                "sensor": {"p_detect": 0.7, "range_m": 25},
            }
    if shares == 1:
        del vehicles["primary-1"]["part"]
    corners: list[Value] = [[0, 0], [shares * WIDE_M, 0], [shares * WIDE_M, LONG_M], [0, LONG_M]]
    return make_scenario(
        {
            "name": f"shares-{shares}",
            "area": {"polygon_m": corners, "track_heading_deg": 0, "cell_m": cell_m},
            "mission": {"time_limit_s": 60_000},
            "seabed": {"kind": "patchy", "ripple_fields": 2 * shares, "vegetation_patches": 4 * shares},
            "vehicles": vehicles,
        }
    )


def flown(scenario: Scenario, seconds: float) -> dict[str, Any]:
    """Flies so long with clocks in every part; the processor time by part, and what was said."""
    words, strips = 0, set[str]()

    def watch(one: Received) -> None:
        nonlocal words
        words += 1
        if one.key.startswith("coord/strip/"):
            strips.add(one.key)
        if one.t_s > seconds:
            raise RunStopped

    began_s = time.process_time()
    with accounted() as account, contextlib.suppress(RunStopped):
        fly(scenario, watch)
    by_part: dict[str, float] = {}
    for part, spent_s in account.seconds.items():
        told = TOLD.get(part.split(",")[0], "bus and files")
        by_part[told] = by_part.get(told, 0.0) + spent_s
    hours = len(scenario.vehicles) * seconds / 3600
    return {
        "vehicles": len(scenario.vehicles),
        "strips": len(strips),
        "messages": words,
        "cpu_s": round(time.process_time() - began_s, 2),
        "a_vehicle_hour_s": {part: round(spent_s / hours, 3) for part, spent_s in sorted(by_part.items())},
        "all_a_vehicle_hour_s": round(sum(account.seconds.values()) / hours, 3),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shares", type=int, nargs="+", default=[1, 2, 4, 8, 16])
    parser.add_argument("--seconds", type=float, default=1200.0)
    parser.add_argument("--cell", type=float, default=10.0)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    found = []
    flown(fleet_of(1, options.cell), 60.0)  # what is loaded and compiled the first time counts for none of them
    for shares in options.shares:
        scenario = fleet_of(shares, options.cell)
        cells = round(shares * WIDE_M * LONG_M / options.cell**2)
        found.append({"shares": shares, "cells": cells, **flown(scenario, options.seconds)})
    least, most = found[0], found[-1]
    power = (
        math.log(most["all_a_vehicle_hour_s"] / least["all_a_vehicle_hour_s"])
        / math.log(most["vehicles"] / least["vehicles"])
        if len(found) > 1
        else None
    )
    if options.json:
        print(json.dumps({"fleets": found, "power": power}, indent=2))
        return
    parts = sorted({part for one in found for part in one["a_vehicle_hour_s"]})
    table = Table("vehicles", "cells", "strips", "messages", *parts, "all", caption="CPU seconds a vehicle-hour")
    for one in found:
        told = [one["a_vehicle_hour_s"].get(part, 0.0) for part in parts]
        numbers = [one["vehicles"], one["cells"], one["strips"], one["messages"]]
        table.add_row(*map(str, numbers), *(f"{one:.2f}" for one in told), f"{one['all_a_vehicle_hour_s']:.2f}")
    Console(width=120).print(table)
    if power is not None:
        print(f"From the least to the largest a vehicle-hour costs the size to the power of {power:.2f}.")


if __name__ == "__main__":
    main()
