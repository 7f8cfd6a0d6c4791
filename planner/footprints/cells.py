"""Which cells of the grid a look falls on, which ones tracks see, and which ones tracks to come may still improve."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.footprints.footprint import Reach
from planner.risk import HIGHEST_P_DETECT
from planner.types import EVERYWHERE, BoolArray, FloatArray, GridSpec, LookGeometry, SweepFrame, Track, Window

EDGE_TOLERANCE_M = 1e-3
"""A cell centre this close before a bin's edge, or to the edge of what is seen, counts as on it: positions travel in
centimetres, headings in microradians."""


def look_on_grid(grid: GridSpec, geometry: LookGeometry, p_detect: FloatArray) -> tuple[slice, slice, FloatArray]:
    """The window of the grid that a look may touch, and the P_d that each of its cells gets, 0 where it is not seen.

    `p_detect`: shape (2, along_bins, range_bins), port first. A cell is seen if its centre is (paper, section V). A
    centre on the edge between two bins belongs to the one that begins there, which of two range bins is the outer; one
    right under the track belongs to starboard. Of consecutive looks of one track exactly one sees a cell.
    """
    # Rounded, so that one look's end is the next one's begin to the last bit, however each was computed.
    first_m, along_bin_m, range_bin_m = map(float, (geometry.first_along_m, geometry.along_bin_m, geometry.range_bin_m))
    begin_m, end_m = round(first_m, 6), round(first_m + geometry.along_bins * along_bin_m, 6)
    reach_m = (geometry.range_bins - 0.5) * range_bin_m
    turn_rad = geometry.heading_rad - grid.frame.heading_rad
    sin, cos = math.sin(turn_rad), math.cos(turn_rad)
    origin_across, origin_along = grid.frame.to_sweep(*geometry.origin)
    corners = [(lateral_m, along_m) for lateral_m in (-reach_m, reach_m) for along_m in (begin_m, end_m)]
    columns = _window([origin_across + u_m * cos + v_m * sin for u_m, v_m in corners], grid.across_m)
    rows = _window([origin_along - u_m * sin + v_m * cos for u_m, v_m in corners], grid.along_m)
    look = _Look(origin_across, origin_along, sin, cos, begin_m, end_m, along_bin_m, range_bin_m)
    own = np.array(p_detect, dtype=np.float64, order="C")  # one that may be written to, as not every message's may
    return rows, columns, _seen_by(look, grid.across_m[columns], grid.along_m[rows], own)


class _Look(NamedTuple):
    """A look in the grid's sweep frame: where its track begins, sine and cosine of its heading there; from where to
    where along the track it looks, and how large its bins are."""

    across_m: float
    along_m: float
    sin: float
    cos: float
    begin_m: float
    end_m: float
    along_bin_m: float
    range_bin_m: float


@compiled
def _seen_by(look: _Look, across_m: FloatArray, along_m: FloatArray, p_detect: FloatArray) -> FloatArray:
    """The P_d that each cell gets, by the middles of columns and rows; shape (rows, columns)."""
    _, along_bins, range_bins = p_detect.shape
    found = np.zeros((along_m.size, across_m.size))
    for row in range(along_m.size):
        for column in range(across_m.size):
            du, dv = across_m[column] - look.across_m, along_m[row] - look.along_m
            lateral_m = du * look.cos - dv * look.sin
            ahead_m = du * look.sin + dv * look.cos + EDGE_TOLERANCE_M
            range_bin = math.floor((abs(lateral_m) + EDGE_TOLERANCE_M) / look.range_bin_m + 0.5)
            if look.begin_m <= ahead_m < look.end_m and range_bin < range_bins:
                along_bin = min(math.floor((ahead_m - look.begin_m) / look.along_bin_m), along_bins - 1)
                side = 1 if lateral_m >= -EDGE_TOLERANCE_M else 0
                found[row, column] = p_detect[side, along_bin, range_bin]
    return found


_seen_by.called_with(lambda: (_Look(*np.ones(8).tolist()), np.ones(1), np.ones(1), np.ones((2, 1, 1))))


def over_cells(grid: GridSpec, geometry: LookGeometry, p_detect: FloatArray) -> FloatArray:
    """Of each range bin the mean P_d of those that a cell about its middle is wide, as far as they were seen; 0 where
    the bin itself was not. `p_detect`: shape (2, along_bins, range_bins)."""
    seen = p_detect > 0.0
    total, count = p_detect.copy(), seen.astype(np.float64)
    beside = round((grid.cell_m / geometry.range_bin_m - 1.0) / 2.0)
    for bins in range(1, min(beside, geometry.range_bins - 1) + 1):
        for many, one in ((total, p_detect), (count, seen)):
            many[..., bins:] += one[..., :-bins]
            many[..., :-bins] += one[..., bins:]
    mean = np.minimum(total / np.maximum(count, 1.0), HIGHEST_P_DETECT)  # of such it may be above by rounding
    return np.where(seen, mean, 0.0)


def _window(corners_m: list[float], centres_m: FloatArray) -> slice:
    """The cells along one axis of the grid with their centres between a look's corners, all in the sweep frame."""
    margin_m = 2 * EDGE_TOLERANCE_M  # one that a bin may begin early, one for rounding
    ends_m = min(corners_m) - margin_m, max(corners_m) + margin_m
    first, behind_last = centres_m.searchsorted(ends_m).tolist()
    return slice(first, behind_last)


def seen_cells(grid: GridSpec, tracks: Iterable[Track], reach: Reach) -> BoolArray:
    """Cells whose centre lies beside one of the tracks, within the reach of the sonar; shape grid.shape."""
    seen = np.zeros(grid.shape, dtype=np.bool_)
    for track in tracks:
        frame = SweepFrame(*track.start, track.heading_rad)
        reach_m, ends_m = reach.far_m + EDGE_TOLERANCE_M, (-EDGE_TOLERANCE_M, track.length_m + EDGE_TOLERANCE_M)
        corners_m = grid.frame.to_sweep(*frame.to_mission(np.array([-reach_m, reach_m] * 2), np.repeat(ends_m, 2)))
        columns, rows = (_between(*axis) for axis in zip((grid.across_m, grid.along_m), corners_m, strict=True))
        centres_m = grid.frame.to_mission(grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis])
        across_m, along_m = frame.to_sweep(*centres_m)
        lateral_m = np.abs(across_m)
        seen[rows, columns] |= (
            (lateral_m >= reach.near_m - EDGE_TOLERANCE_M)
            & (lateral_m <= reach_m)
            & (along_m >= ends_m[0])
            & (along_m <= ends_m[1])
        )
    return seen


def _between(centres_m: FloatArray, corners_m: FloatArray) -> slice:
    """Those along one axis that lie among the corners, and one more on either side."""
    first, behind_last = np.searchsorted(centres_m, (corners_m.min(), corners_m.max())).tolist()
    return slice(max(first - 1, 0), behind_last + 1)


@dataclass(frozen=True)
class Ahead:
    """What is still to be looked at of a track: its offset and from where to where along, in the grid's sweep frame."""

    across_m: float
    from_m: float
    to_m: float


def settled_cells(grid: GridSpec, ahead: Iterable[Ahead], reach: Reach, window: Window = EVERYWHERE) -> BoolArray:
    """Cells of a window of the grid that none of these can see, shape of the window. One cell of margin is kept about
    what they see."""
    its_along_m, its_across_m = grid.along_m[window[0]], grid.across_m[window[1]]
    settled = np.ones((its_along_m.size, its_across_m.size), dtype=np.bool_)
    for one in ahead:
        distance_m = np.abs(its_across_m - one.across_m)
        beyond = (distance_m < reach.near_m - grid.cell_m) | (distance_m > reach.far_m + grid.cell_m)
        first = its_along_m.searchsorted(one.from_m - grid.cell_m, side="right")
        behind_last = its_along_m.searchsorted(one.to_m + grid.cell_m)
        settled[first:behind_last] &= beyond
    return settled


def cells_within(
    grid: GridSpec,
    frame: SweepFrame,
    across_m: tuple[float, float],
    along_m: tuple[float, float],
    window: Window = EVERYWHERE,
) -> BoolArray:
    """Cells of a window of the grid with their centre in a rectangle of another sweep frame, without its sides; shape
    of the window."""
    u_m, v_m = (one[window] for one in _centres_in(frame, grid))
    within: BoolArray = (u_m > across_m[0]) & (u_m < across_m[1]) & (v_m > along_m[0]) & (v_m < along_m[1])
    return within


@lru_cache(maxsize=16)
def _centres_in(frame: SweepFrame, grid: GridSpec) -> tuple[FloatArray, FloatArray]:
    """The cells' centres in another sweep frame, each of shape grid.shape."""
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    return frame.to_sweep(x_m, y_m)
