"""Ground whose residual risk counts for more in the objective, or for less."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.region import Region
from planner.types import BoolArray, FloatArray, GridSpec, Point


@dataclass(frozen=True)
class Priority:
    """Ground, by its corners in the mission frame, whose residual risk counts `weight` times."""

    outline: tuple[Point, ...]
    weight: float


def weights_over(grid: GridSpec, inside: BoolArray, priorities: Iterable[Priority]) -> FloatArray:
    """The weight of each cell, shape of the grid, as a multiple of their mean over the area: 1, or that of the last
    priority that its centre lies in. `inside`: the area's cells."""
    weights: FloatArray = np.ones(grid.shape)
    for one in priorities:
        weights[Region(one.outline).inside(grid)] = one.weight
    mean = float(weights[inside].mean()) if inside.any() else 1.0
    return weights / mean if mean > 0 else weights
