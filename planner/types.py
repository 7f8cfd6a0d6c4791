"""Shapes that planning and messages share: the sweep frame, the grid, tracks, strips, sonars, looks, detection curves.

Frozen, without algorithms. The mission frame is ENU metres (x east, y north). The sweep frame of an area has its
origin at the area's corner; `along` (v) points along the tracks, `across` (u) to the right of that, the direction in
which tracks are laid side by side. Headings are compass headings: radians, clockwise from north.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Point = tuple[float, float]
Window = tuple[slice, slice]
"""Some rows and columns of a grid."""
EVERYWHERE: Window = (slice(None), slice(None))
OneOrMany = TypeVar("OneOrMany", float, FloatArray)


def whole_number(given: Any) -> int | None:
    """What somebody else's code has given as a whole number, an int or one of numpy's, as an int; None for anything
    else, such as 1.0 or True."""
    try:
        return None if isinstance(given, bool) else operator.index(given)
    except TypeError:
        return None


@dataclass(frozen=True)
class SweepFrame:
    """Where the sweep frame lies in the mission frame.

    `origin_x_m`, `origin_y_m`: the sweep frame's origin, mission frame. `heading_rad`: compass heading of the along
    axis, [0, 2 pi).
    """

    origin_x_m: float
    origin_y_m: float
    heading_rad: float

    def to_sweep(self, x_m: OneOrMany, y_m: OneOrMany) -> tuple[OneOrMany, OneOrMany]:
        """Mission-frame points as (across_m, along_m); one as plain numbers, many as arrays."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        dx, dy = x_m - self.origin_x_m, y_m - self.origin_y_m
        return dx * cos - dy * sin, dx * sin + dy * cos

    def to_mission(self, across_m: OneOrMany, along_m: OneOrMany) -> tuple[OneOrMany, OneOrMany]:
        """Sweep-frame points as (x_m, y_m), likewise."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        return (
            self.origin_x_m + across_m * cos + along_m * sin,
            self.origin_y_m - across_m * sin + along_m * cos,
        )


@dataclass(frozen=True)
class GridSpec:
    """The residual-risk map's cells.

    Arrays over the grid have shape (rows, columns): row j is centred at `along = (j + 0.5) * cell_m`, column i at
    `across = i * cell_m`, so that with whole-metre track offsets a cell's range is a whole multiple of the grid's step
    (the paper's map, section V). `columns`, `rows` >= 1; `cell_m` > 0.
    """

    frame: SweepFrame
    cell_m: float
    columns: int
    rows: int

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows, self.columns

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell."""
        return self.cell_m * self.cell_m

    def cells_of(self, x_m: FloatArray, y_m: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the cells in which points of the mission frame lie, also beyond the grid. An area may end
        up to a cell beyond the centres of its map's last column: what lies there is held by that."""
        across_m, along_m = self.frame.to_sweep(x_m, y_m)
        rows, columns = np.floor(along_m / self.cell_m), np.rint(across_m / self.cell_m)
        columns -= (columns == self.columns) & (across_m <= self.columns * self.cell_m)
        return rows.astype(np.intp), columns.astype(np.intp)

    def part(self, first_row: int, end_row: int, first_column: int, end_column: int) -> GridSpec:
        """The grid of some of its rows and columns; the same one where these are all."""
        if (first_row, end_row, first_column, end_column) == (0, self.rows, 0, self.columns):
            return self
        x_m, y_m = self.frame.to_mission(first_column * self.cell_m, first_row * self.cell_m)
        frame = SweepFrame(x_m, y_m, self.frame.heading_rad)
        return GridSpec(frame, self.cell_m, end_column - first_column, end_row - first_row)

    @cached_property
    def across_m(self) -> FloatArray:
        """Centres of the columns, sweep frame, shape (columns,)."""
        return np.arange(self.columns, dtype=np.float64) * self.cell_m

    @cached_property
    def along_m(self) -> FloatArray:
        """Centres of the rows, sweep frame, shape (rows,)."""
        return (np.arange(self.rows, dtype=np.float64) + 0.5) * self.cell_m


@dataclass(frozen=True)
class Track:
    """A straight leg on which the sonar looks, from start to end in the mission frame.

    `number` counts from 1 in the order of flying; `across_m` is the track's offset in the sweep frame.
    """

    number: int
    across_m: float
    start: Point
    end: Point

    @property
    def length_m(self) -> float:
        """Length of the leg."""
        return math.dist(self.start, self.end)

    @property
    def heading_rad(self) -> float:
        """Compass heading from start to end, [0, 2 pi)."""
        return math.atan2(self.end[0] - self.start[0], self.end[1] - self.start[1]) % (2 * math.pi)


@dataclass(frozen=True)
class Strip:
    """A rectangle worth a second look: `width_m` wide about a centre line that starts at `start` (mission frame) and
    runs `length_m` along `heading_rad`. `number` is stable for the strip's life."""

    number: int
    start: Point
    heading_rad: float
    length_m: float
    width_m: float

    @property
    def end(self) -> Point:
        """The centre line's other end, mission frame."""
        return (
            self.start[0] + self.length_m * math.sin(self.heading_rad),
            self.start[1] + self.length_m * math.cos(self.heading_rad),
        )

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """The corners in order, mission frame."""
        east_m = self.width_m / 2 * math.cos(self.heading_rad)
        north_m = -self.width_m / 2 * math.sin(self.heading_rad)
        (x0_m, y0_m), (x1_m, y1_m) = self.start, self.end
        return (
            (x0_m - east_m, y0_m - north_m),
            (x0_m + east_m, y0_m + north_m),
            (x1_m + east_m, y1_m + north_m),
            (x1_m - east_m, y1_m - north_m),
        )


@dataclass(frozen=True)
class PriorityGround:
    """Ground whose residual risk counts `weight` times, >= 0, in second looks: what lies within an odd number of the
    outlines, whose corners are in the mission frame, not repeated."""

    outlines_m: tuple[tuple[Point, ...], ...]
    weight: float


@dataclass(frozen=True, eq=False)
class DetectionCurve:
    """P(y): probability of detection over lateral range (paper, section III-B).

    `range_m`: ascending, >= 0, shape (n,), n >= 2. `p_detect`: in [0, 1), same shape; linear in between, 0 outside.
    """

    range_m: FloatArray
    p_detect: FloatArray

    def at(self, range_m: FloatArray | float) -> FloatArray:
        """P_d at the given ranges; 0 outside the curve."""
        return np.asarray(np.interp(range_m, self.range_m, self.p_detect, left=0.0, right=0.0))


@dataclass(frozen=True)
class SonarShape:
    """What ground a sonar sees at a time, as its footprint is made of it (`planner.footprints.footprint_of`).

    `footprint`: the kind of that, by name. `near_m`, `far_m`: from which range to which it sees, 0 <= near < far.
    `half_angle_rad`: how far to either side of where it looks, 0 to pi/2; 0 for a sonar that looks along a line.
    `look_m`: the length of track that one look stands for, > 0.
    """

    footprint: str
    near_m: float
    far_m: float
    half_angle_rad: float = 0.0
    look_m: float = 20.0


@dataclass(frozen=True)
class LookGeometry:
    """A look's frame and bins.

    `origin` (mission frame) and `heading_rad` (compass) are the track's; along bin i covers
    `first_along_m + [i, i + 1) * along_bin_m` from the origin; range bin k is centred at `k * range_bin_m` to a side.
    """

    origin: Point
    heading_rad: float
    first_along_m: float
    along_bin_m: float
    range_bin_m: float
    along_bins: int
    range_bins: int
