"""Points of what is drawn, mission frame, and the order in which drawings lie on top of each other."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from comms.said.announcement import RunInfo, Vertex
from planner.types import FloatArray, Strip

# Heights in metres, far enough apart for the depth buffer, too little to shift anything seen from above.
OUTLINE_Z_M, PLAN_Z_M, HOTSPOT_Z_M, STRIP_Z_M, FLOWN_Z_M, POINT_Z_M, VEHICLE_Z_M = (0.2 * step for step in range(2, 9))

Line = npt.NDArray[np.float32]  # as the viewer takes them, so that it need not look at each point

GOLDEN_SHARE = (math.sqrt(5.0) - 1.0) / 2.0  # its multiples, whole parts left out, keep apart from each other


@dataclass(frozen=True)
class Extent:
    """A box in the mission frame."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float

    @property
    def width_m(self) -> float:
        """From west to east."""
        return self.east_m - self.west_m

    @property
    def height_m(self) -> float:
        """From south to north."""
        return self.north_m - self.south_m

    @property
    def centre(self) -> tuple[float, float]:
        """The box's middle."""
        return (self.west_m + self.east_m) / 2, (self.south_m + self.north_m) / 2


def extent_of(run: RunInfo) -> Extent:
    """The box around the area and its grid."""
    spec = run.grid.spec
    width_m, length_m = (spec.columns - 0.5) * spec.cell_m, spec.rows * spec.cell_m
    x_m, y_m = spec.frame.to_mission(
        np.array([-0.5 * spec.cell_m, width_m, width_m, -0.5 * spec.cell_m]), np.array([0.0, 0.0, length_m, length_m])
    )
    xs, ys = [*x_m, *(v.x_m for v in run.area)], [*y_m, *(v.y_m for v in run.area)]
    return Extent(float(min(xs)), float(min(ys)), float(max(xs)), float(max(ys)))


def ring(outline: Iterable[Vertex], z_m: float) -> Line:
    """A closed outline, shape (corners + 1, 3); shape (0, 3) for no corner."""
    corners = [(vertex.x_m, vertex.y_m, z_m) for vertex in outline]
    return np.array([*corners, *corners[:1]], dtype=np.float32).reshape(-1, 3)


def strip_ring(strip: Strip, z_m: float) -> Line:
    """A strip's closed outline, shape (5, 3)."""
    first, *others = strip.corners
    return np.array([(*corner, z_m) for corner in (first, *reversed(others), first)], dtype=np.float32)


def label_place(strip: Strip, z_m: float) -> tuple[float, float, float]:
    """Where a strip's label hangs on its centre line: at another share of its length for each number, because strips
    often lie side by side and the labels are wider than they."""
    along_m = strip.length_m * (0.1 + 0.8 * (strip.number * GOLDEN_SHARE % 1.0))
    return (*replace(strip, length_m=along_m).end, z_m)


def glyph(size_m: float) -> tuple[FloatArray, list[tuple[int, int, int]]]:
    """A vehicle's arrowhead in its body frame (y forward): corners of shape (4, 3), and its two triangles."""
    corners = np.array([[0.0, 0.6, 0.0], [0.38, -0.4, 0.0], [0.0, -0.2, 0.0], [-0.38, -0.4, 0.0]])
    return corners * size_m, [(0, 1, 2), (0, 2, 3)]


def body_quaternions(heading_rad: FloatArray) -> FloatArray:
    """Compass headings as rotations of a body frame (y forward) into the mission frame, shape (n, 4), xyzw."""
    half = -heading_rad / 2
    none = np.zeros_like(half)
    return np.column_stack([none, none, np.sin(half), np.cos(half)])
