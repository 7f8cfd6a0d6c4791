"""How far the coordinator's map is off the vehicles' own when a mission by modem is over.

python -m bench.link_maps [SCENARIO] [--profiles a,b] [--maps x,y]

Flies the scenario with each modem profile and each way in which maps cross (`link.maps`), coordinator on the ship, on
the local bus. A line tells by how much the residual risk of a cell is off, on average and at most, the bytes a second
across the water, and the mean residual risk that the fleet leaves.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from secondlook.testing import Fleet


def off(scenario: str, profile: str, maps: str) -> tuple[float, float, float, float]:
    """Flies one mission. Returns by how much a cell's risk is off on average and at most, bytes a second, and what the
    fleet leaves."""
    overrides = {"link.profile": profile, "link.maps": maps, "coordinator.platform": "ship"}
    with tempfile.TemporaryDirectory() as folder:
        flight = Fleet(scenario, folder=Path(folder), overrides=overrides).run()
        assert flight.inside is not None
        known, seen = flight.inside.fleet_map("coordinator"), flight.risk_map
        assert known is not None
        assert seen is not None
        apart = np.abs(known.risk - seen.risk)
        bytes_per_s, left = flight.summary["link"]["bytes_per_s"], flight.summary["risk"]["mean"]
    return float(apart.mean()), float(apart.max()), float(bytes_per_s), float(left)


def main(arguments: Sequence[str] | None = None) -> None:
    """Flies all that the command line names, and prints the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.link_maps", description=__doc__)
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--profiles", default="micromodem-0,micromodem-1,micromodem-6,radio")
    parser.add_argument("--maps", default="stretches,corrected")
    told = parser.parse_args(arguments)
    print("| link.profile | link.maps | off a cell, mean | largest | bytes a second | mean residual risk |")
    print(f"|{'---|' * 6}")
    for profile in told.profiles.split(","):
        for maps in told.maps.split(","):
            mean, largest, bytes_per_s, left = off(told.scenario, profile, maps)
            line = f"{mean:.3f} | {largest:.2f} | {bytes_per_s:.1f} | {left:.3f}"
            print(f"| `{profile}` | `{maps}` | {line} |", flush=True)


if __name__ == "__main__":
    main()
