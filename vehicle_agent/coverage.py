"""A vehicle's own coverage layer: looks in, tiles out: those that changed, and some again, as words may be lost."""

from __future__ import annotations

import numpy as np

from comms.node import Publication
from comms.said.messages import CoverageTile, Look
from comms.said.tally import tally
from comms.said.topics import COVERAGE
from planner.footprints.cells import look_on_grid, over_cells
from planner.risk import RiskLayer
from planner.tiles import Tile, tiles, tiles_about, tiles_holding, tiles_within
from planner.types import BoolArray, GridSpec, Strip
from planner.windows import NOWHERE

MOST_AGAIN = 200  # tiles that are said again at one time, as somebody asks
OFTEN_ENOUGH = 8  # times that a tile is said: where a fifth of all words is lost, 3 of 1,000,000 tiles stay unheard


class CoverageLayer:
    """Sums a vehicle's looks over the grid and publishes whole tiles, each under its next version.

    `rho`: see `planner.risk.residual_risk`. Where it is above 0 the best of several looks counts more than the others,
    and of noisy estimates the best is better by luck: there the noise of single bins is taken out first, by the mean
    over those on a cell. With independent looks the noise does no harm: on average their product is right.

    `settled`: the cells that are, shape `grid.shape`; to be replaced by another array, not changed in place. `newest`:
    the rows and columns of the grid that the last look may have seen.
    """

    def __init__(self, vehicle: str, grid: GridSpec, rho: float = 0.0) -> None:
        self.grid = grid
        self._best_counts = rho > 0.0
        self.layer = RiskLayer(grid)
        self.settled: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
        self.newest = NOWHERE
        self._vehicle = vehicle
        self._version = 0
        self._versions_told = 0  # the sum of the newest of all tiles
        self._tiles = tiles(grid)
        self._said: dict[Tile, tuple[int, int]] = {}  # of each tile how often it was said, and its version
        self._published_sum = np.zeros(grid.shape, dtype=np.uint8)
        self._published_largest = np.zeros(grid.shape, dtype=np.uint8)
        self._published_settled = self.settled
        self._looked_at: set[Tile] = set()  # since tiles were last published

    def add(self, look: Look) -> None:
        """Adds a valid look."""
        p_detect = over_cells(self.grid, look.geometry, look.p_detect) if self._best_counts else look.p_detect
        rows, columns, p_detect = look_on_grid(self.grid, look.geometry, p_detect)
        self.layer.add_look(rows, columns, p_detect)
        self._looked_at.update(tiles_within(self.grid, self._tiles, rows, columns))
        self.newest = rows, columns

    def changed_tiles(self) -> list[Publication]:
        """The tiles that differ from what was last published."""
        changed = {tile for tile in self._looked_at if self._copy_levels(tile)}
        self._looked_at.clear()
        if self.settled is not self._published_settled:
            changed.update(tiles_holding(self.grid, self._tiles, self.settled != self._published_settled))
            self._published_settled = self.settled
        published = []
        for tile in sorted(changed, key=lambda one: (one.first_row, one.first_column)):
            self._version += 1
            _, before = self._said.get(tile, (0, 0))
            self._versions_told += self._version - before
            self._said[tile] = (0, self._version)
            published.append(self._say(tile))
        return published

    def _copy_levels(self, tile: Tile) -> bool:
        """Copies a tile's levels to be published; returns whether they are others than before."""
        window, changed = tile.window, False
        for now, published in (
            (self.layer.sum_levels[window], self._published_sum[window]),
            (self.layer.largest_levels[window], self._published_largest[window]),
        ):
            if now.tobytes() != published.tobytes():
                published[:] = now
                changed = True
        return changed

    def told(self) -> int:
        """The tally of the newest versions of all tiles that were said."""
        return tally([self._versions_told])

    def again(self) -> list[Publication]:
        """Tiles as they were said last, as some have not arrived: up to MOST_AGAIN of those said the fewest times, the
        oldest first."""
        return [self._say(tile) for tile in sorted(self._said, key=self._said.__getitem__)[:MOST_AGAIN]]

    def again_at(self, strip: Strip) -> list[Publication]:
        """The tiles about a strip, as they were said last."""
        return [self._say(tile) for tile in tiles_about(self.grid, self._tiles, strip.corners) if tile in self._said]

    def all_again(self) -> list[Publication]:
        """All tiles, as they were said last, but for those that were said often enough since they changed."""
        return [self._say(tile) for tile, (times, _) in self._said.items() if times < OFTEN_ENOUGH]

    def _say(self, tile: Tile) -> Publication:
        times, version = self._said[tile]
        self._said[tile] = (times + 1, version)
        window = tile.window
        message = CoverageTile(
            version=version,
            first_row=tile.first_row,
            first_column=tile.first_column,
            sum_levels=self._published_sum[window].copy(),
            largest_levels=self._published_largest[window].copy(),
            settled=self._published_settled[window].copy(),
        )
        return Publication(COVERAGE.key(vehicle=self._vehicle, tile=tile.name), message)
