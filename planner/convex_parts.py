"""A region cut into convex parts, each of which is surveyed by itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import shapely

from planner.area import SurveyArea
from planner.region import Region
from planner.types import FloatArray, SweepFrame

SHALLOW_M = 10.0
"""A dent that is no deeper is surveyed with the part about it."""
LEAST_PART_M2 = 1.0
"""What a cut leaves that is smaller is surveyed with nobody: rounding."""
ON_A_LINE_M = 1e-6
"""Lengths that differ by no more are taken as equal."""
BEYOND_M = 1e-3
"""So far a cut reaches beyond the boundary, so that rounding does not leave it short."""
GRID_M = 1e-4
"""Corners of what is cut lie on a grid as fine as this: nearer ones would keep further cuts from dividing it."""
MANY_CORNERS = 12
"""Where more point inward, cuts are tried through those alone that lie deepest: so many,"""
FEW_CORNERS = 4
"""and so many of a search that is not thorough."""
MOST_TO_BRANCH = 40
"""Cuts from which only the one that promises most is followed to its end; of fewer the best two are."""

TracksFor = Callable[[float], int]
"""How many tracks a width in metres takes."""
_Cost = tuple[int, float]
"""Tracks, and their length in metres."""
_Parts = tuple[_Cost, list[shapely.Polygon]]
_Corner = tuple[FloatArray, FloatArray, FloatArray]
"""A corner, the side that leads to it and the side that leads on; (across, along) each."""


def convex_parts(
    region: Region, track_heading_rad: float, tracks_for: TracksFor, *, thorough: bool = True
) -> list[SurveyArea]:
    """Convex parts that cover a region, to be swept along a heading: a convex region is its own only part.

    Cuts are straight, through a corner that points inward: along the tracks, across them, or along a side. Of these
    those are taken that lead to the fewest tracks, then to the shortest, by a search that follows the most promising;
    of many corners the deepest are cut first. A part may reach beyond the region by dents of up to
    `SHALLOW_M`.

    Args:
        region: what to survey.
        track_heading_rad: compass heading of the tracks.
        tracks_for: how many tracks a width takes, never fewer for a larger one.
        thorough: follow more than one cut at a time, where there are not too many.

    Returns:
        The parts, in no particular order.

    Raises:
        ValueError: the heading is not finite.
    """
    if not region.holes and not region.keep_out and _is_convex(region.polygon):
        return [SurveyArea(region.outline, track_heading_rad)]
    frame = region.about(track_heading_rad).frame
    found = []
    for polygon in shapely.get_parts(region.polygon):
        if not region.keep_out or polygon.area > LEAST_PART_M2:
            _, pieces = _Cutting(tracks_for, thorough=thorough).best(_to(frame, polygon))
            found += [_part(frame, piece, track_heading_rad) for piece in pieces]
    return found


class _Cutting:
    """The search for one number of tracks by width. What is left after several cuts is the same in whatever order these
    were made, and is cut further only once."""

    def __init__(self, tracks_for: TracksFor, *, thorough: bool) -> None:
        self._tracks_for = tracks_for
        self._thorough = thorough
        self._known: dict[bytes, _Parts] = {}

    def best(self, polygon: shapely.Polygon) -> _Parts:
        """The parts of a polygon in the sweep frame, and what they cost."""
        name = polygon.normalize().wkb
        if name not in self._known:
            self._known[name] = self._cut(polygon)
        return self._known[name]

    def _cut(self, polygon: shapely.Polygon) -> _Parts:
        if is_all_but_convex(polygon):
            return self._whole(polygon)
        cuts = _cuts(polygon, MANY_CORNERS if self._thorough else FEW_CORNERS)
        divided = [pieces for pieces in _split(polygon, cuts) if len(pieces) > 1]
        promising = sorted(divided, key=lambda pieces: _sum([self._cost(piece) for piece in pieces]))
        if not promising:  # no cut divides it
            return self._whole(polygon)
        found = []
        for pieces in promising[: 2 if self._thorough and len(cuts) <= MOST_TO_BRANCH else 1]:
            parts = [self.best(piece) for piece in pieces]
            found.append((_sum([cost for cost, _ in parts]), [piece for _, some in parts for piece in some]))
        return min(found, key=lambda one: one[0])

    def _whole(self, polygon: shapely.Polygon) -> _Parts:
        """Its convex hull as the only part."""
        return self._cost(polygon), [_hull(polygon)]

    def _cost(self, polygon: shapely.Polygon) -> _Cost:
        """What that costs."""
        from_across_m, from_along_m, to_across_m, to_along_m = polygon.bounds
        tracks = self._tracks_for(to_across_m - from_across_m)
        return tracks, round(tracks * (to_along_m - from_along_m), 3)


def _sum(costs: list[_Cost]) -> _Cost:
    return sum(tracks for tracks, _ in costs), sum(length_m for _, length_m in costs)


def _hull(polygon: shapely.Polygon | shapely.MultiPolygon) -> shapely.Polygon:
    hull = polygon.convex_hull
    assert isinstance(hull, shapely.Polygon)
    return hull


def _split(polygon: shapely.Polygon, lines: Sequence[shapely.LineString]) -> list[list[shapely.Polygon]]:
    """What each of some lines cuts a polygon into, but for what is too small to be a part. All at once, as GEOS takes
    less for a line than it takes to call it."""
    nets = [shapely.polygonize(shapely.get_parts(one)) for one in shapely.union(polygon.boundary, lines)]
    meshes, of_line = shapely.get_parts(np.array(nets, dtype=object), return_index=True)
    shapely.prepare(polygon)
    is_within = shapely.contains(polygon, shapely.point_on_surface(meshes))
    pieces, of_mesh = shapely.get_parts(shapely.set_precision(meshes[is_within], GRID_M), return_index=True)
    found: list[list[shapely.Polygon]] = [[] for _ in lines]
    for number, piece, area_m2 in zip(of_line[is_within][of_mesh].tolist(), pieces, shapely.area(pieces), strict=True):
        if area_m2 > LEAST_PART_M2:
            found[number].append(piece)
    return found


def is_all_but_convex(polygon: shapely.Polygon | shapely.MultiPolygon) -> bool:
    """Whether no dent, and no hole, is deeper than `SHALLOW_M`: it is surveyed in one part."""
    left_out = _hull(polygon).difference(polygon)
    return bool(left_out.buffer(-SHALLOW_M / 2).is_empty)


def _is_convex(polygon: shapely.Polygon | shapely.MultiPolygon) -> bool:
    """Whether it is a `SurveyArea` as it stands."""
    return bool(_hull(polygon).area - polygon.area <= ON_A_LINE_M * polygon.length)


def _cuts(polygon: shapely.Polygon, most_corners: int) -> list[shapely.LineString]:
    """Lines through each corner that points inward: right across the polygon, and as far as the next boundary only."""
    from_across_m, from_along_m, to_across_m, to_along_m = polygon.bounds
    reach_m = 2 * math.hypot(to_across_m - from_across_m, to_along_m - from_along_m)
    deepest = _deepest(_inward_corners(polygon), polygon, most_corners)
    if not deepest:
        return []
    corners = np.repeat([corner for corner, _, _ in deepest], 4, axis=0)
    directions = np.array([way for _, *sides in deepest for way in ((0.0, 1.0), (1.0, 0.0), *sides)])
    directions /= np.hypot(*directions.T)[:, np.newaxis]
    reach = directions * reach_m
    lines = np.asarray(shapely.linestrings(np.stack([corners - reach, corners + reach], axis=1)))
    chords, of_line = shapely.get_parts(shapely.intersection(polygon, lines), return_index=True)
    is_touching = shapely.distance(chords, shapely.points(corners[of_line])) < ON_A_LINE_M
    found = []
    for number, line in enumerate(lines):
        own = of_line == number
        ends = shapely.get_coordinates(chords[own & is_touching])
        if not is_touching[own].all() and len(ends) > 1:
            along = directions[number]
            places = (ends - corners[number]) @ along
            reached = corners[number] + np.outer([places.min() - BEYOND_M, places.max() + BEYOND_M], along)
            found.append(shapely.LineString(reached))
        found.append(line)
    return found


def _inward_corners(polygon: shapely.Polygon) -> list[_Corner]:
    exterior_first = shapely.orient_polygons(polygon)
    found: list[_Corner] = []
    for ring in (exterior_first.exterior, *exterior_first.interiors):
        corners = np.array(ring.coords[:-1])
        before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
        inward = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0
        found += zip(corners[inward], before[inward], after[inward], strict=True)
    return found


def _deepest(corners: list[_Corner], polygon: shapely.Polygon, most: int) -> list[_Corner]:
    """Of many corners those farthest from the convex hull's sides, in the order given."""
    if len(corners) <= MANY_CORNERS:
        return corners
    places = shapely.points([corner for corner, _, _ in corners])
    depth_m = shapely.distance(_hull(polygon).exterior, places)
    kept = np.sort(np.argsort(-depth_m, kind="stable")[:most])
    return [corners[index] for index in kept.tolist()]


def _to(frame: SweepFrame, polygon: shapely.Polygon) -> shapely.Polygon:
    """A polygon of the mission frame in a sweep frame."""
    return shapely.transform(polygon, lambda points: np.column_stack(frame.to_sweep(points[:, 0], points[:, 1])))


def _part(frame: SweepFrame, piece: shapely.Polygon, track_heading_rad: float) -> SurveyArea:
    x_m, y_m = frame.to_mission(*shapely.get_coordinates(piece)[:-1].T)
    # Its corners, turned, may no longer be those of a convex polygon to the last bit.
    corners = shapely.get_coordinates(shapely.MultiPoint(np.column_stack([x_m, y_m])).convex_hull)[:-1]
    return SurveyArea(tuple((x, y) for x, y in corners.tolist()), track_heading_rad)
