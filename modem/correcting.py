"""What a vehicle's modem tells of its map beyond stretches, where there is room: what is most wrong first."""

from __future__ import annotations

import numpy as np

from comms.said.announcement import RosterVehicle
from comms.said.messages import CoverageTile, Curve
from modem.corrections import STEP_NATS, Correction, by_blocks, correction_of, quarters
from modem.stretches import LayerOf, Stretch
from planner.risk import MOST_LEVELS, NATS_PER_LEVEL
from planner.tiles import Tile, tiles
from planner.types import FloatArray, GridSpec

FINE_AFTER_MS = 120_000
"""Cell by cell a tile is told when it was not looked at for so long: the next look there would make it another."""


class Correcting:
    """Compares a vehicle's map with what the coordinator's modem makes of all that was said of it. `entry`: the vehicle
    as it was announced."""

    def __init__(self, entry: RosterVehicle, grid: GridSpec) -> None:
        self._told = LayerOf(entry, grid)
        self._after = 0
        self._numbers = {tile: number for number, tile in enumerate(tiles(grid))}
        self._by_place = {(tile.first_row, tile.first_column): tile for tile in self._numbers}
        self._seen: dict[Tile, tuple[int, FloatArray]] = {}  # when its vehicle told it, and nats per cell
        self._looked_ms: dict[Tile, int] = {}  # when the last of its looks was taken
        self._best: dict[Tile, tuple[float, Correction | None]] = {}  # of those that have not changed since

    def hear_curve(self, curve: Curve) -> None:
        """The vehicle's P(y), by which stretches are told from now on."""
        self._told.hear_curve(curve)

    def hear_stretch(self, stretch: Stretch, looked_ms: int) -> None:
        """A stretch as it is said. `looked_ms`: when the last of its looks was taken."""
        self._after = max(self._after, stretch.number)
        for told in self._told.hear(stretch):
            tile = self._by_place[told.tile.first_row, told.tile.first_column]
            self._looked_ms[tile] = looked_ms
            self._best.pop(tile, None)

    def hear_tile(self, told: CoverageTile, now_ms: int) -> None:
        """The vehicle's own map of a tile."""
        tile = self._by_place.get((told.first_row, told.first_column))
        if tile is not None:
            self._seen[tile] = now_ms, told.sum_levels.astype(np.float64) * NATS_PER_LEVEL
            self._best.pop(tile, None)

    def next(self, now_ms: int) -> Correction | None:
        """What is best told now, None where all is right; from then on it counts as known."""
        best_nats, best = 0.0, None
        for tile, (told_ms, seen) in self._seen.items():
            if tile not in self._looked_ms or told_ms <= self._looked_ms[tile]:
                continue  # there are looks of which its vehicle has not told yet
            if tile not in self._best:
                self._best[tile] = self._correction(tile, seen)
            off_nats, correction = self._best[tile]
            may_be_told = correction is not None and (
                correction.part == 0 or now_ms - self._looked_ms[tile] >= FINE_AFTER_MS
            )
            if may_be_told and off_nats > best_nats:
                best_nats, best = off_nats, correction
        if best is not None:
            for told in self._told.correct(best):
                self._best.pop(self._by_place[told.tile.first_row, told.tile.first_column], None)
        return best

    def _correction(self, tile: Tile, seen: FloatArray) -> tuple[float, Correction | None]:
        """How many nats a tile is off, all cells together, and what corrects most of that; by blocks twice as much
        counts, as it takes fewer bits."""
        known, number = self._told.corrections, self._numbers[tile]
        sums = self._told.sums(tile)
        is_full = seen >= MOST_LEVELS * NATS_PER_LEVEL
        off = np.where(is_full, np.maximum(seen - sums, 0.0), seen - sums)  # more than all is not told
        left = seen - known.corrected(tile, sums)
        left[is_full & (left < 0.0)] = 0.0
        stretched = np.where(sums > 0.0, left, 0.0)
        blocks = np.abs(by_blocks(stretched))
        orders = [known.order(tile, quarter) for quarter in range(1, 5)]
        if blocks.max(initial=0.0) >= STEP_NATS and (self._after, False) > max(orders):
            coarse = correction_of(number, 0, self._after, np.where(sums > 0.0, off, 0.0))
            return 2 * float(np.abs(stretched).sum()), coarse
        best_nats, best = 0.0, None
        for quarter, rows in enumerate(quarters(tile), 1):
            off_nats = float(np.abs(left[rows]).sum())
            is_right = not (np.abs(left[rows]) > STEP_NATS * 0.51).any()
            if not is_right and off_nats > best_nats and (self._after, True) > orders[quarter - 1]:
                best_nats, best = off_nats, correction_of(number, quarter, self._after, off[rows])
        return best_nats, best
