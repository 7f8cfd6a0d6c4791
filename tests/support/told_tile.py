"""A tile of a map, as a vehicle has told of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.risk import LevelArray
from planner.types import BoolArray


@dataclass(frozen=True, eq=False)
class Tile:
    """See `planner.fleet_map.ToldTile`."""

    version: int
    first_row: int
    first_column: int
    sum_levels: LevelArray
    largest_levels: LevelArray
    settled: BoolArray


def whole_map(sum_levels: LevelArray, largest_levels: LevelArray) -> Tile:
    """The only tile of a small map, all of it settled."""
    return Tile(1, 0, 0, sum_levels, largest_levels, np.ones(sum_levels.shape, dtype=np.bool_))
