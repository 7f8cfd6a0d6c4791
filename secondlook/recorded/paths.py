"""Where the vehicles have been."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from comms.said.messages import Nav
from planner.types import FloatArray
from secondlook.recorded.said import Said


@dataclass(frozen=True, eq=False)
class PathRecord:
    """Where a vehicle has been by its own account, mission frame; arrays of shape (n,), n >= 1, over time.

    `heading_rad`: compass heading.
    """

    vehicle: str
    t_s: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray

    @property
    def line(self) -> shapely.LineString:
        """The way from the first position to the last; empty where there is but one."""
        places = np.column_stack([self.x_m, self.y_m])
        return shapely.LineString(places if len(places) > 1 else None)

    @property
    def length_m(self) -> float:
        """Length of the way."""
        return float(self.line.length)


def paths(positions: Iterable[Said[Nav]]) -> dict[str, PathRecord]:
    """The path of each vehicle that told where it is."""
    rows: dict[str, list[tuple[float, float, float, float]]] = {}
    for one in positions:
        nav = one.message
        rows.setdefault(one.vehicle, []).append((one.t_s, nav.x_m, nav.y_m, nav.heading_rad))
    return {vehicle: PathRecord(vehicle, *np.array(found).T) for vehicle, found in rows.items()}
