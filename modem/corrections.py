"""What a vehicle's map tells beyond its stretches: where it has seen more, or less, than these let reckon.

Stretches tell of 100 m at a time. Where a packet has room left the vehicle's modem tells, of the tile that is farthest
off, by how much each block of 4 x 4 cells is, and where all blocks are right the same of single cells, a quarter of a
tile at a time: coarse before fine, what is most wrong first (`modem.correcting`). A correction tells how far the sum of
looks is off from that of all stretches until then. It is added to that sum, and the newest counts: what has come makes
the same map in whatever order and however often it came, any part of it is a map, and all of it is the vehicle's own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from comms.said.bits import folded, unfolded
from comms.said.over_water import Counted
from comms.said.wire import AtMost, Count, WireError
from planner.tiles import TILE_CELLS, Tile, tiles
from planner.types import FloatArray, GridSpec

BLOCK_CELLS = 4
"""To a side of a block."""
QUARTERS = 4
STEP_NATS = 0.1
"""In which it is told, -ln(1 - P_d)."""
MOST_STEPS = 100
Order = tuple[int, bool]
"""Of two corrections of a place the greater counts: by the stretches until then, and of those the fine one."""


@dataclass(frozen=True, slots=True)
class Correction:
    """Of a tile, by its place among the grid's, how far what stretches 1 to `after` tell is off from what was seen, in
    steps, folded to numbers from 0. `part`: 0 for all of it by blocks, row by row; 1 to 4 for a quarter of its rows,
    cell by cell."""

    tile: Annotated[Count, Counted(6)]
    part: Annotated[Count, Counted(0)]
    after: Annotated[Count, Counted(6)]
    off: Annotated[tuple[Annotated[Count, Counted(0)], ...], AtMost(TILE_CELLS**2)]

    @property
    def order(self) -> Order:
        """See `Order`."""
        return self.after, self.part > 0


def correction_of(tile: int, part: int, after: int, off_nats: FloatArray) -> Correction:
    """The correction of a whole tile's cells, or of a quarter's, where `part` tells one, by these nats."""
    off = off_nats if part else by_blocks(off_nats)
    steps = np.clip(np.rint(off / STEP_NATS), -MOST_STEPS, MOST_STEPS).astype(int)
    return Correction(tile, part, after, tuple(folded(one) for one in steps.ravel().tolist()))


@dataclass
class Corrections:
    """Those that have come of one layer over a grid."""

    grid: GridSpec
    _known: dict[tuple[Tile, int], tuple[Order, FloatArray]] = field(default_factory=dict)  # by quarter

    def take(self, correction: Correction) -> Tile | None:
        """Takes one; returns its tile where it is news. Raises WireError for one of no tile, or of other cells."""
        all_tiles = tiles(self.grid)
        if correction.tile >= len(all_tiles) or correction.part > QUARTERS:
            raise WireError(f"the grid has no tile {correction.tile}, or that no part {correction.part}")
        tile, is_news = all_tiles[correction.tile], False
        steps = np.array([unfolded(one) for one in correction.off])
        off, shape = np.clip(steps, -MOST_STEPS, MOST_STEPS) * STEP_NATS, shape_of(tile)
        rows_of = dict(enumerate(quarters(tile), 1))
        if correction.part == 0:
            cells = over_cells(off, shape)
            told = {quarter: cells[rows] for quarter, rows in rows_of.items()}
        else:
            rows = rows_of[correction.part]
            told = {correction.part: _as(off, (rows.stop - rows.start, shape[1]))}
        for quarter, off_nats in told.items():
            if correction.order > self.order(tile, quarter):
                self._known[tile, quarter], is_news = (correction.order, off_nats), True
        return tile if is_news else None

    def knows(self, tile: Tile) -> bool:
        """Whether anything of a tile is corrected."""
        return any((tile, quarter) in self._known for quarter in range(1, QUARTERS + 1))

    def order(self, tile: Tile, quarter: int) -> Order:
        """Of what is known of a quarter, 1 to 4, of a tile; below all others where that is nothing."""
        return self._known[tile, quarter][0] if (tile, quarter) in self._known else (-1, False)

    def corrected(self, tile: Tile, sums: FloatArray) -> FloatArray:
        """What was seen of a tile, by the sum over its stretches; nats, of the tile's shape. By blocks only where a
        stretch has seen anything."""
        seen = sums.copy()
        for quarter, rows in enumerate(quarters(tile), 1):
            if (tile, quarter) in self._known:
                (_, is_fine), off_nats = self._known[tile, quarter]
                seen[rows] += off_nats if is_fine else np.where(sums[rows] > 0.0, off_nats, 0.0)
        return np.maximum(seen, 0.0, out=seen)


def shape_of(tile: Tile) -> tuple[int, int]:
    """Its rows and columns."""
    rows, columns = tile.window
    return rows.stop - rows.start, columns.stop - columns.start


def quarters(tile: Tile) -> Iterator[slice]:
    """The rows of each quarter of a tile; those at the grid's edge may have none."""
    rows, _ = shape_of(tile)
    size = TILE_CELLS // QUARTERS
    for quarter in range(QUARTERS):
        yield slice(min(rows, quarter * size), min(rows, (quarter + 1) * size))


def by_blocks(off_nats: FloatArray) -> FloatArray:
    """The mean over each block of those cells of a tile that are off at all."""
    starts = [np.arange(0, size, BLOCK_CELLS) for size in off_nats.shape]
    sums, counts = (
        np.add.reduceat(np.add.reduceat(one, starts[0], axis=0), starts[1], axis=1)
        for one in (off_nats, (off_nats != 0.0).astype(np.float64))
    )
    means: FloatArray = sums / np.maximum(counts, 1.0)
    return means


def over_cells(off: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Figures of blocks, row by row, over a tile's cells. Raises WireError where there are more or fewer."""
    rows, columns = (-(-size // BLOCK_CELLS) for size in shape)
    blocks = _as(off, (rows, columns))
    return blocks.repeat(BLOCK_CELLS, axis=0).repeat(BLOCK_CELLS, axis=1)[: shape[0], : shape[1]]


def _as(off: FloatArray, shape: tuple[int, int]) -> FloatArray:
    if off.size != shape[0] * shape[1]:
        raise WireError(f"a correction of {off.size} cells or blocks, and not of {shape[0]} x {shape[1]}")
    return off.reshape(shape)
