"""What of planned tracks can be flown where there is ground to keep out of."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.dubins import Pose, shifted
from planner.keep_out import TOUCHES_M, KeepOut
from planner.region import ON_BOUNDARY_M, Region
from planner.sweep import pass_over
from planner.types import BoolArray, GridSpec, Point, Track

SHORTEST_PIECE_M = 20.0
"""A piece of a track that is shorter is not worth its turns."""
AROUND_M = 1000.0
"""Beyond all zones there is this much water."""
STEP_M = 1.0
"""So finely is looked for where a piece may begin and end."""


def flyable_pieces(
    tracks: Iterable[Track], keep_out: KeepOut, turn_radius_m: float, run_in_m: float, lead_m: float = 0.0
) -> list[Track]:
    """What of each track can be flown, with run-in and run-out and room to turn before and behind; in the order of
    flying, numbered through from the first track's number.

    `lead_m`: see `planner.footprints.footprint.Footprint`.
    """
    given = list(tracks)
    if not keep_out or not given:
        return given
    found = [piece for track in given for piece in _pieces(track, keep_out, turn_radius_m, run_in_m, lead_m)]
    return [replace(piece, number=number) for number, piece in enumerate(found, start=given[0].number)]


def _pieces(track: Track, keep_out: KeepOut, turn_radius_m: float, run_in_m: float, lead_m: float) -> list[Track]:
    begin, end = pass_over(track.start, track.end, run_in_m, lead_m)
    if keep_out.is_room(begin, end, turn_radius_m):
        return [track]
    length_m = math.dist(begin[:2], end[:2])
    at_m = np.append(np.arange(0.0, length_m, STEP_M), length_m)
    x_m = begin.x_m + at_m * math.sin(begin.heading_rad)
    y_m = begin.y_m + at_m * math.cos(begin.heading_rad)

    def pose(place: int) -> Pose:
        return Pose(float(x_m[place]), float(y_m[place]), begin.heading_rad)

    def has_room(place: int) -> bool:
        return keep_out.circling(pose(place), turn_radius_m) is not None

    found = []
    for first, last in _runs(keep_out.are_clear(shapely.points(x_m, y_m))):
        start = next((place for place in range(first, last + 1) if has_room(place)), None)
        stop = next((place for place in range(last, first - 1, -1) if has_room(place)), None)
        if start is None or stop is None or at_m[stop] - at_m[start] < 2 * run_in_m + SHORTEST_PIECE_M:
            continue
        heading_rad = begin.heading_rad
        on_m = shifted(pose(start)[:2], heading_rad, run_in_m + lead_m)
        off_m = shifted(pose(stop)[:2], heading_rad, lead_m - run_in_m)
        found.append(replace(track, start=on_m[:2], end=off_m[:2]))
    return found


def reachable(place: Point, ground: BaseGeometry, keep_out: KeepOut) -> BaseGeometry:
    """What of some ground lies where one can come from a place past the zones, as they are grown, or within reach of
    there. Turns are not asked for: a gap that is too narrow to turn in counts as a way."""
    if not keep_out:
        return ground
    about = shapely.box(*shapely.union_all([ground, keep_out.ground, shapely.Point(place)]).bounds).buffer(AROUND_M)
    here = shapely.Point(place)
    waters = [part for part in shapely.get_parts(about.difference(keep_out.ground)) if part.dwithin(here, TOUCHES_M)]
    # What lies in the margin is seen from where one can come.
    near = shapely.union_all(waters).buffer(2 * keep_out.margin_m).difference(keep_out.true_ground)
    return ground.intersection(near)


def reachable_cells(places: Iterable[Point], region: Region, grid: GridSpec, keep_out: KeepOut) -> BoolArray:
    """The region's cells that `reachable` finds from at least one of some places, shape of the grid."""
    cells = region.inside(grid)
    if keep_out:
        ground = shapely.union_all([reachable(place, region.polygon, keep_out) for place in places])
        rows, columns = np.nonzero(cells)
        x_m, y_m = grid.frame.to_mission(grid.across_m[columns], grid.along_m[rows])
        cells[rows, columns] = shapely.intersects_xy(ground.buffer(ON_BOUNDARY_M), x_m, y_m)
    return cells


def _runs(values: BoolArray) -> list[tuple[int, int]]:
    """First and last place of each run of true values."""
    edges = np.diff(np.concatenate([[0], values.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges > 0).tolist(), (np.flatnonzero(edges < 0) - 1).tolist(), strict=True))
