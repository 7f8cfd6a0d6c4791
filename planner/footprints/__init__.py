"""What sonars see of the ground, a file for each kind, and the kinds by their names."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from planner.footprints.footprint import Footprint
from planner.footprints.side import SideLooking
from planner.footprints.wedge import ForwardLooking
from planner.types import SonarShape

FOOTPRINTS: dict[str, Callable[[SonarShape], Footprint]] = {"side": SideLooking, "wedge": ForwardLooking}


@lru_cache(maxsize=256)
def footprint_of(shape: SonarShape) -> Footprint:
    """The footprint of a sonar; raises ValueError where there is no such kind."""
    if shape.footprint not in FOOTPRINTS:
        raise ValueError(f"there is no footprint {shape.footprint}; must be {' or '.join(FOOTPRINTS)}")
    return FOOTPRINTS[shape.footprint](shape)
