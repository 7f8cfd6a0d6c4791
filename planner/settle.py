"""Which cells are settled: no remaining planned track can improve them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from planner.types import BoolArray, FloatArray, GridSpec, SweepFrame


@dataclass(frozen=True)
class Reach:
    """From which lateral range to which the sonar sees, either side. 0 <= `near_m` <= `far_m`."""

    near_m: float
    far_m: float


@dataclass(frozen=True)
class Ahead:
    """What is still to be looked at of a track: its offset and from where to where along, in the grid's sweep frame."""

    across_m: float
    from_m: float
    to_m: float


def settled_cells(grid: GridSpec, ahead: Iterable[Ahead], reach: Reach) -> BoolArray:
    """Cells that none of these can see, shape grid.shape. One cell of margin is kept about what they see."""
    settled = np.ones(grid.shape, dtype=np.bool_)
    for one in ahead:
        distance_m = np.abs(grid.across_m - one.across_m)
        columns = (distance_m >= reach.near_m - grid.cell_m) & (distance_m <= reach.far_m + grid.cell_m)
        first = np.searchsorted(grid.along_m, one.from_m - grid.cell_m, side="right")
        behind_last = np.searchsorted(grid.along_m, one.to_m + grid.cell_m)
        settled[first:behind_last, columns] = False
    return settled


def cells_within(
    grid: GridSpec, frame: SweepFrame, across_m: tuple[float, float], along_m: tuple[float, float]
) -> BoolArray:
    """Cells with their centre in a rectangle of another sweep frame, without its sides; shape grid.shape."""
    u_m, v_m = _centres_in(frame, grid)
    within: BoolArray = (u_m > across_m[0]) & (u_m < across_m[1]) & (v_m > along_m[0]) & (v_m < along_m[1])
    return within


@lru_cache(maxsize=16)
def _centres_in(frame: SweepFrame, grid: GridSpec) -> tuple[FloatArray, FloatArray]:
    """The cells' centres in another sweep frame, each of shape grid.shape."""
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    return frame.to_sweep(x_m, y_m)
