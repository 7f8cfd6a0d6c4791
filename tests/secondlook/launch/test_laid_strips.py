"""A mission whose strips are laid for the routes over them leaves less than one with the strips as they are cut, and is
the same each time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from secondlook.testing import Fleet

LAID = "coordinator.allocate.routes:LaidRoutesAllocator"


def left(summary: Mapping[str, Any]) -> float:
    """By the coordinator's objective."""
    return 0.7 * float(summary["risk"]["mean"]) + 0.3 * float(summary["risk"]["worst30_mean"])


def flown(folder: Path, allocator: str) -> Mapping[str, Any]:
    overrides = (f"coordinator.allocator={allocator}",)
    fleet = Fleet("tellaro", folder=folder, record=False, overrides=overrides, seed=1001)
    return fleet.run().summary


def test_it_leaves_less_and_is_the_same_each_time(tmp_path: Path) -> None:
    laid, cut = flown(tmp_path / "laid", LAID), flown(tmp_path / "cut", "plan")
    assert left(laid) < left(cut) - 0.002
    assert flown(tmp_path / "again", LAID)["risk"] == laid["risk"]
