"""A mission whose strips are laid for the routes over them leaves less than one with the strips as they are cut."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from coordinator.allocate.routes import RoutesAllocator
from secondlook.testing import Fleet


class AsCut(RoutesAllocator):
    """The default allocator, but strips stay as they are cut."""

    lays_strips: ClassVar[bool] = False


def test_it_leaves_less_by_the_coordinators_objective(tmp_path: Path) -> None:
    def left(allocator: type[RoutesAllocator]) -> float:
        overrides = {"coordinator.allocator": allocator}
        fleet = Fleet("tellaro", folder=tmp_path / allocator.__name__, record=False, overrides=overrides, seed=1001)
        risk = fleet.run().summary["risk"]
        return 0.7 * float(risk["mean"]) + 0.3 * float(risk["worst30_mean"])

    assert left(RoutesAllocator) < left(AsCut) - 0.002
