"""A vehicle's coverage as the tiles that are on the bus, cell by cell: what `link.maps: tiles` lets cross in place of
stretches, to tell what these are worth.

A cell is told by how far it is from the one before it in its row, or above it in the first column, in steps of 0.1
nats: where a map is smooth it takes little more than a bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from comms.said.bits import folded, unfolded
from comms.said.messages import CoverageTile
from comms.said.over_water import Counted
from comms.said.wire import AtMost, Count, WireError
from modem.stretches import Told
from planner.tiles import TILE_CELLS, tiles
from planner.types import GridSpec

LEVELS_A_STEP = 5
"""Levels of a tile on the bus, 0.02 nats each, in a step as it crosses."""
MOST_STEPS = 255 // LEVELS_A_STEP


@dataclass(frozen=True, slots=True)
class PlainTile:
    """A tile by its place among the grid's: per cell, row by row, the sum of -ln(1 - P_d), and how much of that the
    largest look lacks, each as its difference, folded to a number from 0."""

    tile: Annotated[Count, Counted(6)]
    sums: Annotated[tuple[Annotated[Count, Counted(0)], ...], AtMost(TILE_CELLS**2)]
    lacking: Annotated[tuple[Annotated[Count, Counted(0)], ...], AtMost(TILE_CELLS**2)]


def plain(tile: CoverageTile, grid: GridSpec) -> PlainTile:
    """A tile of the grid as it crosses."""
    number = next(
        number
        for number, one in enumerate(tiles(grid))
        if (one.first_row, one.first_column) == (tile.first_row, tile.first_column)
    )
    sums, largest = (np.rint(one / LEVELS_A_STEP).astype(int) for one in (tile.sum_levels, tile.largest_levels))
    return PlainTile(number, _differences(sums), _differences(sums - largest))


def told(plain: PlainTile, grid: GridSpec, version: int) -> Told:
    """The tile that has crossed, under its name. Raises WireError where it is none of the grid's."""
    all_tiles = tiles(grid)
    if plain.tile >= len(all_tiles):
        raise WireError(f"the grid has no tile {plain.tile}")
    tile = all_tiles[plain.tile]
    shape = np.empty(grid.shape, dtype=np.bool_)[tile.window].shape
    if {len(plain.sums), len(plain.lacking)} != {shape[0] * shape[1]}:
        raise WireError(f"tile {plain.tile} has not so many cells")
    sums, lacking = (_sums(one, shape) for one in (plain.sums, plain.lacking))
    largest = np.clip(sums - lacking, 0, MOST_STEPS)
    levels, largest_levels = ((LEVELS_A_STEP * one).astype(np.uint8) for one in (sums, largest))
    settled = np.zeros(shape, dtype=np.bool_)
    return Told(tile.name, CoverageTile(version, tile.first_row, tile.first_column, levels, largest_levels, settled))


def _differences(steps: NDArray[np.int_]) -> tuple[int, ...]:
    off = np.diff(steps, axis=1, prepend=0)
    off[:, 0] = np.diff(steps[:, 0], prepend=0)
    return tuple(folded(one) for one in off.ravel().tolist())


def _sums(told: tuple[int, ...], shape: tuple[int, ...]) -> NDArray[np.int_]:
    off = np.array([unfolded(one) for one in told], dtype=np.int64).reshape(shape)
    off[:, 0] = np.cumsum(off[:, 0])
    return np.clip(np.cumsum(off, axis=1), 0, MOST_STEPS)
