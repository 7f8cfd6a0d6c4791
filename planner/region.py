"""What is surveyed: a polygon that may be concave and may have holes, and which points of a lattice lie inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from planner.area import SurveyArea
from planner.rounding import rounded
from planner.types import BoolArray, FloatArray, GridSpec, Point, Strip


def points_inside(x: FloatArray, y: FloatArray, columns: FloatArray, rows: FloatArray) -> BoolArray:
    """The points inside a simple polygon, those on its boundary left out; shape (rows, columns).

    Along each row the points behind an odd number of crossings are inside. A general library takes twice as long, as it
    asks of each point by itself.

    Args:
        x: the polygon's corners, in either sense of rotation, the first not repeated.
        y: the same.
        columns: the lattice's x, ascending, at least one.
        rows: its y, ascending.
    """
    next_x, next_y = np.concatenate([x[1:], x[:1]]), np.concatenate([y[1:], y[:1]])
    row, side = ((y <= rows[:, np.newaxis]) != (next_y <= rows[:, np.newaxis])).nonzero()
    crossing = x[side] + (rows[row] - y[side]) * (next_x - x)[side] / (next_y - y)[side]
    inside = np.zeros((rows.size, columns.size + 1), dtype=np.bool_)
    np.logical_xor.at(inside, (row, np.searchsorted(columns, crossing)), True)
    inside = np.logical_xor.accumulate(inside, axis=1)[:, :-1]
    nearest = np.minimum(np.searchsorted(columns, crossing), columns.size - 1)
    met = columns[nearest] == crossing
    inside[row[met], nearest[met]] = False
    # A corner, and a side along a row, that no crossing tells of.
    for at, corner in np.argwhere(y == rows[:, np.newaxis]).tolist():
        ends = sorted((x[corner], next_x[corner] if next_y[corner] == y[corner] else x[corner]))
        inside[at, (columns >= ends[0]) & (columns <= ends[1])] = False
    return inside


ON_BOUNDARY_M = 1e-6
"""A cell whose centre is as near to the boundary as this is inside."""
NEAR_CELLS = 1.5
"""Nothing of a cell is farther from its centre, also of one in the last column, which holds what is beyond it."""


def share_within(strip: Strip, other: Strip) -> float:
    """Share of a strip's area that lies in another one; numbers are finite, and both have an area."""
    polygon = shapely.Polygon(strip.corners)
    return float(polygon.intersection(shapely.Polygon(other.corners)).area / polygon.area)


@dataclass(frozen=True)
class Region:
    """A simple polygon and the holes in it, which are not to be surveyed; mission frame, corners not repeated.

    `keep_out`: zones that no vehicle may enter; what of them lies in it is not to be surveyed either, and it may be of
    several parts.

    Raises:
        ValueError: a number is not finite, an outline has no area or crosses itself, a hole does not lie inside, or
            the zones leave nothing.
    """

    outline: tuple[Point, ...]
    holes: tuple[tuple[Point, ...], ...] = ()
    keep_out: tuple[tuple[Point, ...], ...] = ()

    def __post_init__(self) -> None:
        rings = (self.outline, *self.holes, *self.keep_out)
        if not all(math.isfinite(place_m) for ring in rings for point in ring for place_m in point):
            raise ValueError("an area's corners must be finite numbers")
        if not all(len(set(ring)) >= 3 for ring in rings):
            raise ValueError("an area and its holes need at least 3 different corners each")
        drawn = self._drawn
        if not (drawn.is_valid and drawn.area > ON_BOUNDARY_M * drawn.length):
            raise ValueError(
                "an area must have an inside, its sides must not cross, its holes must lie in it and apart"
            )

        if not all(shapely.Polygon(zone).is_valid for zone in self.keep_out):
            raise ValueError("the sides of a zone to keep out of must not cross")
        if self.keep_out and self.polygon.is_empty:
            raise ValueError("the zones to keep out of leave nothing of the area")

    @cached_property
    def _drawn(self) -> shapely.Polygon:
        return shapely.Polygon(self.outline, self.holes)

    @cached_property
    def polygon(self) -> shapely.Polygon | shapely.MultiPolygon:
        """The same as a polygon of shapely, or several where zones to keep out of divide it."""
        if not self.keep_out:
            return self._drawn
        left = self._drawn.difference(shapely.union_all([shapely.Polygon(zone) for zone in self.keep_out]))
        parts = [part for part in shapely.get_parts(left) if isinstance(part, shapely.Polygon)]
        return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)

    def about(self, track_heading_rad: float) -> SurveyArea:
        """The convex hull, to be swept along a heading: its frame and rectangle are those of the region.

        Raises:
            ValueError: the heading is not finite.
        """
        corners = shapely.get_coordinates(self.polygon.convex_hull)[:-1]
        return SurveyArea(tuple((x_m, y_m) for x_m, y_m in corners.tolist()), track_heading_rad)

    def share(self, begin: float, end: float, track_heading_rad: float) -> Region:
        """What of the region lies from one share of its width to another, in the order in which tracks are laid.

        Args:
            begin: share of the width across the tracks, 0 or more.
            end: the same, above `begin`, 1 or less.
            track_heading_rad: compass heading of the tracks.

        Raises:
            ValueError: the shares are not such, or what lies there is nothing or in several pieces.
        """
        if not 0 <= begin < end <= 1:
            raise ValueError(f"a share runs from one part of the width to a larger one, 0 to 1, not {begin} to {end}")
        whole = self.about(track_heading_rad)
        u_m, v_m = (begin * whole.width_m, end * whole.width_m), (-1.0, whole.length_m + 1.0)
        corners = [(u_m[0], v_m[0]), (u_m[1], v_m[0]), (u_m[1], v_m[1]), (u_m[0], v_m[1])]
        band = shapely.Polygon([whole.frame.to_mission(*corner) for corner in corners])
        cut = band.intersection(self._drawn)
        if not isinstance(cut, shapely.Polygon) or cut.is_empty:
            what = "nothing of the area" if cut.is_empty else "the area, in several pieces,"
            raise ValueError(f"{what} lies from {begin:.3g} to {end:.3g} of its width")
        rings = [cut.exterior, *cut.interiors]
        outline, *holes = (tuple((x_m, y_m) for x_m, y_m in ring.coords[:-1]) for ring in rings)
        return Region(outline, tuple(holes), self.keep_out)

    def meets(self, strip: Strip) -> bool:
        """Whether any of a strip, whose numbers are finite, lies in the region."""
        return bool(shapely.intersects(self.polygon, shapely.Polygon(strip.corners)))

    def inside(self, grid: GridSpec) -> BoolArray:
        """Which cells have their centre in the region or on its boundary, shape `grid.shape`."""
        return _centres_in(self.polygon.buffer(ON_BOUNDARY_M, join_style="mitre"), grid)

    def shares(self, within: BaseGeometry, grid: GridSpec) -> FloatArray:
        """How much of each cell lies in a valid geometry, mission frame; shape `grid.shape`.

        Of a cell that is inside, the share of what it holds of the region, by area, so that the shares in parts of the
        region add up to 1. Another one may hold some of the region at its edge: that, over a cell's area. What of the
        region lies beyond the last column is held by that.
        """
        parts = shapely.get_parts(shapely.intersection(self.polygon, within))
        ground = shapely.union_all([part for part in parts if isinstance(part, shapely.Polygon)])
        near_m = NEAR_CELLS * grid.cell_m
        wholly = _centres_in(ground.buffer(-near_m), grid)
        shares = wholly.astype(np.float64)
        rows, columns = (_centres_in(ground.buffer(near_m), grid) & ~wholly).nonzero()
        cells = _cells_drawn(grid, rows, columns)
        held_m2 = shapely.area(shapely.intersection(self.polygon, cells))
        held_m2 = np.where(self.inside(grid)[rows, columns], held_m2, grid.cell_area_m2)
        there_m2 = shapely.area(shapely.intersection(ground, cells))
        shares[rows, columns] = np.divide(there_m2, held_m2, out=np.zeros(rows.size), where=held_m2 > 0.0)
        return rounded(shares)


def _centres_in(ground: BaseGeometry, grid: GridSpec) -> BoolArray:
    """Which cells have their centre in polygons, shape `grid.shape`."""
    found: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
    # What a hole's ring holds is in the outline's, too.
    for ring in () if ground.is_empty else shapely.get_rings(shapely.get_parts(ground)):
        across_m, along_m = grid.frame.to_sweep(*shapely.get_coordinates(ring).T)
        found ^= points_inside(across_m[:-1], along_m[:-1], grid.across_m, grid.along_m)
    return found


def _cells_drawn(grid: GridSpec, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.object_]:
    """Some cells as polygons of shapely, mission frame; those of the last column reach half a cell farther."""
    cell_m = grid.cell_m
    left_m, near_m = (columns - 0.5) * cell_m, rows * cell_m
    right_m = np.where(columns == grid.columns - 1, columns + 1.0, columns + 0.5) * cell_m
    across_m = np.stack([left_m, right_m, right_m, left_m], axis=-1)
    along_m = np.stack([near_m, near_m, near_m + cell_m, near_m + cell_m], axis=-1)
    corners = np.stack(grid.frame.to_mission(across_m, along_m), axis=-1)
    return np.asarray(shapely.polygons(corners), dtype=np.object_)
