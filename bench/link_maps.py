"""How far the coordinator's map is off the vehicles' own when a mission by modem is over.

A mission with each modem profile and each way in which maps cross (`link.maps`), coordinator on the ship.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from bench.flown import Document, some
from bench.rows import Row, head, line
from secondlook.testing import Fleet

SCENARIO, SEED = "tellaro", 7
PROFILES = ("micromodem-0", "micromodem-1", "micromodem-6", "radio")
MAPS = ("stretches", "corrected")


def fly() -> Document:
    """A row for each mission."""
    return {"rows": [_flown(profile, maps) for profile, maps in product(PROFILES, MAPS)]}


def _flown(profile: str, maps: str) -> Row:
    overrides = (f"link.profile={profile}", f"link.maps={maps}", "coordinator.platform=ship")
    with tempfile.TemporaryDirectory() as folder:
        flight = Fleet(SCENARIO, folder=Path(folder), overrides=overrides, seed=SEED).run()
        assert flight.inside is not None
        known, seen = flight.inside.fleet_map("coordinator"), flight.risk_map
        assert known is not None
        assert seen is not None
        apart = np.abs(known.risk - seen.risk)
        risk = flight.summary["risk"]
        left = {f"risk.{name}": risk[name] for name in ("mean", "worst30_mean")}
        left |= {"link.bytes_per_s": flight.summary["link"]["bytes_per_s"]}
    off = {"off.mean": float(apart.mean()), "off.largest": float(apart.max())}
    told = {"scenario": SCENARIO, "overrides": list(overrides), "seed": SEED}
    return told | some(left | off, (*left, *off))


def table(rows: Sequence[Row]) -> list[str]:
    """A line for each: by how much the risk of a cell is off, the bytes a second, and what the fleet leaves."""
    titles = "link.profile", "link.maps", "off a cell, mean", "largest", "bytes a second", "mean residual risk"
    lines = head((), titles)
    for row in rows:
        profile, maps, _ = (one.partition("=")[2] for one in row["overrides"])
        off = f"{row['off.mean']:.3f}", f"{row['off.largest']:.2f}"
        lines.append(line((profile, maps), [*off, f"{row['link.bytes_per_s']:.1f}", f"{row['risk.mean']:.3f}"]))
    return lines
