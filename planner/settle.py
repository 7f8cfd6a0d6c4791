"""Which cells are settled: no remaining planned track can improve them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.types import BoolArray, GridSpec


@dataclass(frozen=True)
class Reach:
    """From which lateral range to which the sonar sees, either side. 0 <= `near_m` <= `far_m`."""

    near_m: float
    far_m: float


@dataclass(frozen=True)
class UnderWay:
    """The track being flown: its offset, how far along (sweep frame) it has been looked, and whether it runs towards
    larger along positions."""

    across_m: float
    looked_to_m: float
    ascending: bool


def settled_cells(
    grid: GridSpec,
    remaining_across_m: Sequence[float],
    reach: Reach,
    under_way: UnderWay | None = None,
    frontier_m: float | None = None,
) -> BoolArray:
    """Cells that neither the remaining tracks nor the rest of the one under way can see, shape grid.shape.

    Tracks run along the grid. `remaining_across_m`: offsets of the tracks not begun. `frontier_m`: columns beyond it
    are not settled even where no planned track reaches, because the plan is still to be revised there. One cell of
    margin is kept about the reach.
    """
    columns_open = np.zeros(grid.columns, dtype=np.bool_)
    for across_m in remaining_across_m:
        columns_open |= _in_reach(grid, across_m, reach)
    if frontier_m is not None:
        columns_open |= grid.across_m > frontier_m
    settled = np.broadcast_to(~columns_open, grid.shape).copy()
    if under_way is not None:
        if under_way.ascending:
            ahead = grid.along_m > under_way.looked_to_m - grid.cell_m
        else:
            ahead = grid.along_m < under_way.looked_to_m + grid.cell_m
        settled[np.ix_(ahead, _in_reach(grid, under_way.across_m, reach))] = False
    return settled


def _in_reach(grid: GridSpec, across_m: float, reach: Reach) -> BoolArray:
    distance_m = np.abs(grid.across_m - across_m)
    inside: BoolArray = (distance_m >= reach.near_m - grid.cell_m) & (distance_m <= reach.far_m + grid.cell_m)
    return inside
