"""A mission whose strips are laid for the routes over them leaves less than one with the strips as they are cut."""

from __future__ import annotations

from pathlib import Path

from secondlook.testing import Fleet


def test_it_leaves_less_by_the_coordinators_objective(tmp_path: Path) -> None:
    def left(allocator: str) -> float:
        overrides = (f"coordinator.allocator={allocator}",)
        fleet = Fleet("tellaro", folder=tmp_path / allocator[:4], record=False, overrides=overrides, seed=1001)
        risk = fleet.run().summary["risk"]
        return 0.7 * float(risk["mean"]) + 0.3 * float(risk["worst30_mean"])

    assert left("plan") < left("as_cut:AsCut") - 0.002
