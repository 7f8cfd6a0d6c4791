"""The area to survey: a convex polygon, the rectangle about it along the track heading, its grid and its legs, which
are flown to and fro like a lawnmower's."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely

from planner.types import BoolArray, GridSpec, Point, SweepFrame, Track

_TOLERANCE_M = 1e-6
"""Lengths that differ by no more are taken as equal."""


@dataclass(frozen=True)
class SurveyArea:
    """A convex, simple polygon that is surveyed on parallel tracks (paper, section II).

    `vertices`: mission frame, in either direction, not repeated at the end (a repeated first vertex is dropped).
    `track_heading_rad`: compass heading of the along axis; any finite angle, kept in [0, 2 pi).

    Raises:
        ValueError: fewer than 3 vertices, a number that is not finite, or a polygon that has no area, crosses itself
            or is not convex.
    """

    vertices: tuple[Point, ...]
    track_heading_rad: float

    def __post_init__(self) -> None:
        if not math.isfinite(self.track_heading_rad):
            raise ValueError(f"the track heading must be finite, not {self.track_heading_rad}")
        object.__setattr__(self, "track_heading_rad", self.track_heading_rad % math.tau % math.tau)
        object.__setattr__(self, "vertices", _checked(self.vertices))

    @cached_property
    def frame(self) -> SweepFrame:
        """The sweep frame: its origin is the corner, nearest along and across, of the rectangle about the area."""
        unshifted = SweepFrame(0.0, 0.0, self.track_heading_rad)
        across_m, along_m = unshifted.to_sweep(*np.array(self.vertices).T)
        x_m, y_m = unshifted.to_mission(float(across_m.min()), float(along_m.min()))
        return SweepFrame(x_m, y_m, self.track_heading_rad)

    @property
    def width_m(self) -> float:
        """Extent across the tracks."""
        return max(across_m for across_m, _ in self._corners)

    @property
    def length_m(self) -> float:
        """Extent along the tracks."""
        return max(along_m for _, along_m in self._corners)

    def grid(self, cell_m: float) -> GridSpec:
        """The grid of square cells over the rectangle about the area.

        Columns are centred at whole multiples of `cell_m` from 0 up to the width, rows lie from 0 until the length is
        reached.

        Raises:
            ValueError: `cell_m` is not finite and above 0.
        """
        if not (math.isfinite(cell_m) and cell_m > 0):
            raise ValueError(f"a cell's side must be finite and above 0, not {cell_m} m")
        columns = math.floor((self.width_m + _TOLERANCE_M) / cell_m) + 1
        rows = math.ceil((self.length_m - _TOLERANCE_M) / cell_m)
        return GridSpec(self.frame, cell_m, columns, rows)

    def inside(self, grid: GridSpec) -> BoolArray:
        """Which cells have their centre in the polygon or on its boundary, shape `grid.shape`."""
        x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
        inside = np.ones(grid.shape, dtype=np.bool_)
        for (x0_m, y0_m), (x1_m, y1_m) in pairwise((*self.vertices, self.vertices[0])):
            to_port_m2 = (x1_m - x0_m) * (y_m - y0_m) - (y1_m - y0_m) * (x_m - x0_m)
            inside &= to_port_m2 >= -_TOLERANCE_M * math.hypot(x1_m - x0_m, y1_m - y0_m)
        return inside

    def track(self, number: int, across_m: float, reverse: bool, reach_m: float) -> Track | None:
        """The leg at an offset, as long as the area within the swath about it, so that the sonar passes all of it.

        Args:
            number: the track's number, from 1 in the order of flying.
            across_m: its offset in the sweep frame; it may lie outside the area.
            reverse: flown against the track heading.
            reach_m: half the swath's width, > 0.

        Returns:
            The leg, or None where the area does not come within reach.

        Raises:
            ValueError: `reach_m` is not above 0 or a number not finite.
        """
        if not (math.isfinite(across_m) and math.isfinite(reach_m) and reach_m > 0):
            raise ValueError(f"a leg needs a finite offset and a reach above 0, not {across_m} and {reach_m} m")
        # Short of the swath's edges by the tolerance: an area that the swath only touches is out of reach.
        edges_m = (across_m - reach_m + _TOLERANCE_M, across_m + reach_m - _TOLERANCE_M)
        extent_m = []
        for (u0_m, v0_m), (u1_m, v1_m) in pairwise((*self._corners, self._corners[0])):
            if edges_m[0] <= u0_m <= edges_m[1]:
                extent_m.append(v0_m)
            extent_m += [
                v0_m + (v1_m - v0_m) * (edge_m - u0_m) / (u1_m - u0_m)
                for edge_m in edges_m
                if (u0_m - edge_m) * (u1_m - edge_m) < 0
            ]
        if not extent_m:
            return None
        ends_m = sorted((min(extent_m), max(extent_m)), reverse=reverse)
        start, end = (self.frame.to_mission(across_m, end_m) for end_m in ends_m)
        return Track(number, across_m, start, end)

    @cached_property
    def _corners(self) -> tuple[Point, ...]:
        """The vertices in the sweep frame: (across, along)."""
        across_m, along_m = self.frame.to_sweep(*np.array(self.vertices).T)
        return tuple(zip(across_m.tolist(), along_m.tolist(), strict=True))


def _checked(vertices: Sequence[Point]) -> tuple[Point, ...]:
    """The vertices counterclockwise and not repeated at the end, if they are those of a convex polygon."""
    points = [(float(x_m), float(y_m)) for x_m, y_m in vertices]
    if not all(math.isfinite(x_m) and math.isfinite(y_m) for x_m, y_m in points):
        raise ValueError("an area's vertices must be finite numbers")
    if len(points) > 1 and points[0] == points[-1]:
        points.pop()
    if len(set(points)) < 3:
        raise ValueError(f"an area needs at least 3 different vertices, not {len(set(points))}")
    polygon = shapely.Polygon(points)
    hull = polygon.convex_hull
    # An area narrower than the tolerance is none, and a dent shallower than that is no dent.
    least_m2 = _TOLERANCE_M * polygon.length
    if hull.area <= least_m2:
        raise ValueError("an area's vertices must not lie on one line: it has no area")
    if not polygon.is_valid:
        raise ValueError("an area's outline must not cross or touch itself")
    if hull.area - polygon.area > least_m2:
        raise ValueError("an area must be convex: split a concave one into convex parts")
    return tuple(points if polygon.exterior.is_ccw else points[::-1])


def lawnmower(
    area: SurveyArea,
    offsets_m: Iterable[float],
    reach_m: float,
    *,
    first_number: int = 1,
    first_reverse: bool = False,
) -> list[Track]:
    """The legs at the given offsets across an area, in their order and in alternating direction.

    An offset from which the area is out of reach gives no leg and takes neither a number nor a change of direction.

    Args:
        area: the area to survey.
        offsets_m: offsets across it, sweep frame, in the order of flying.
        reach_m: half the swath's width, > 0; a leg is as long as the area within it.
        first_number: number of the first leg.
        first_reverse: whether the first leg is flown against the track heading.

    Raises:
        ValueError: `reach_m` is not above 0 or an offset not finite.
    """
    tracks: list[Track] = []
    for across_m in offsets_m:
        reverse = first_reverse ^ (len(tracks) % 2 == 1)
        track = area.track(first_number + len(tracks), across_m, reverse, reach_m)
        if track is not None:
            tracks.append(track)
    return tracks
