"""Where things of the mission frame lie in a picture of the area from above: north up, a metre a unit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import shapely
from shapely.geometry.base import BaseGeometry

from planner.types import GridSpec
from secondlook.recorded import RiskMap
from secondlook.report.png import data_url, indexed_png
from secondlook.report.risk_colours import as_pixels, palette
from secondlook.report.svg import Element, element

MOST_PIXELS = 1600  # of a map's side; what has more cells is drawn with every so many of them


@dataclass(frozen=True)
class MapFrame:
    """The part of the mission frame that is shown."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float

    @classmethod
    def around(cls, geometry: BaseGeometry, margin_m: float) -> MapFrame:
        """What shows a geometry with some room around it."""
        west_m, south_m, east_m, north_m = geometry.bounds
        return cls(west_m - margin_m, south_m - margin_m, east_m + margin_m, north_m + margin_m)

    @property
    def width_m(self) -> float:
        """From west to east."""
        return self.east_m - self.west_m

    @property
    def height_m(self) -> float:
        """From south to north."""
        return self.north_m - self.south_m

    def place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A place of the mission frame in the picture."""
        return x_m - self.west_m, self.north_m - y_m

    def line(self, geometry: BaseGeometry) -> str:
        """The path data of a geometry: lines, or polygons with their holes, of one part or several."""
        rings: list[BaseGeometry] = []
        for part in shapely.get_parts(geometry):
            rings += [part.exterior, *part.interiors] if isinstance(part, shapely.Polygon) else [part]
        return " ".join(self._ring(ring) for ring in rings if not ring.is_empty)

    def risk(self, risk: RiskMap) -> Element:
        """The map of risk, turned as its grid is."""
        grid = risk.grid
        steps = (-(-grid.rows // MOST_PIXELS), -(-grid.columns // MOST_PIXELS))
        pixels = as_pixels(risk, steps)
        return element(
            "image",
            href=data_url(indexed_png(pixels, palette())),
            width=pixels.shape[1],
            height=pixels.shape[0],
            preserveAspectRatio="none",
            transform=self._of_pixels(grid, steps),
            class_="risk",
        )

    def _ring(self, ring: BaseGeometry) -> str:
        places = [self.place(x_m, y_m) for x_m, y_m in ring.coords]
        closed = "Z" if isinstance(ring, shapely.LinearRing) else ""
        return "M" + " ".join(f"{x:.1f},{y:.1f}" for x, y in places) + closed

    def _of_pixels(self, grid: GridSpec, steps: tuple[int, int]) -> str:
        """From pixels, of which the first row is at the near end, to the picture."""
        down_m, right_m = steps[0] * grid.cell_m, steps[1] * grid.cell_m
        sin, cos = math.sin(grid.frame.heading_rad), math.cos(grid.frame.heading_rad)
        # Columns are centred at whole multiples of the cell, rows begin there.
        x_m, y_m = grid.frame.to_mission(-grid.cell_m / 2, 0.0)
        left, top = self.place(float(x_m), float(y_m))
        numbers = (right_m * cos, right_m * sin, down_m * sin, -down_m * cos, left, top)
        return f"matrix({' '.join(f'{number:.6g}' for number in numbers)})"
