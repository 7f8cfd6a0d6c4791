"""The area that a scenario surveys."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator
from shapely import Polygon

from planner.types import SweepFrame
from secondlook.scenario.values import TOLERANCE, Bin, Coordinate, Heading, Mapping, check_pair, refused

LARGEST_GRID_CELLS = 20_000_000

Point = Annotated[tuple[Coordinate, Coordinate], BeforeValidator(check_pair), Field(strict=False)]


class Area(Mapping):
    """A convex polygon in the mission frame, the compass heading of the tracks, and the map's cell."""

    polygon_m: Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=1000)]
    track_heading_deg: Heading = 0.0
    cell_m: Bin = 5.0

    @property
    def extent_m(self) -> tuple[float, float]:
        """Extent across and along the tracks."""
        return _extent_m(self.polygon_m, self.track_heading_deg)

    @field_validator("polygon_m")
    @classmethod
    def _check_polygon(cls, polygon_m: tuple[Point, ...]) -> tuple[Point, ...]:
        for index, point in enumerate(polygon_m):
            if point in polygon_m[:index]:
                raise refused(f"must be the corners in order, each once, but ({point[0]:g}, {point[1]:g}) is repeated")
        polygon = Polygon(polygon_m)
        hull_m2 = polygon.convex_hull.area
        if hull_m2 < TOLERANCE:
            raise refused("must have an area, but all corners lie on one line")
        if not polygon.is_valid:
            raise refused("must be the corners in order, but its sides cross")
        if hull_m2 - polygon.area > TOLERANCE * hull_m2:
            raise refused("must be convex")
        return polygon_m

    @field_validator("cell_m")
    @classmethod
    def _check_cells(cls, cell_m: float, info: ValidationInfo) -> float:
        if "polygon_m" not in info.data or "track_heading_deg" not in info.data:
            return cell_m
        across_m, along_m = _extent_m(info.data["polygon_m"], info.data["track_heading_deg"])
        shorter_m = min(across_m, along_m)
        if cell_m > shorter_m + TOLERANCE:
            raise refused(f"must be at most the area's shorter side, {shorter_m:g}")
        if across_m * along_m / cell_m**2 > LARGEST_GRID_CELLS:
            raise refused(f"must be larger, the map would have more than {LARGEST_GRID_CELLS} cells")
        return cell_m


def _extent_m(polygon_m: tuple[Point, ...], track_heading_deg: float) -> tuple[float, float]:
    corners = np.array(polygon_m)
    across_m, along_m = SweepFrame(0, 0, math.radians(track_heading_deg)).to_sweep(corners[:, 0], corners[:, 1])
    return float(np.ptp(across_m)), float(np.ptp(along_m))
