"""A vehicle's own coverage layer: looks in, tiles that changed out."""

from __future__ import annotations

import numpy as np

from comms.messages import CoverageTile, Look
from comms.node import Publication
from comms.topics import COVERAGE
from planner.footprint import LookGeometry, look_on_grid
from planner.risk import RiskLayer
from planner.tiles import Tile, tiles, tiles_within
from planner.types import BoolArray, GridSpec


class CoverageLayer:
    """Sums a vehicle's looks over the grid and publishes whole tiles, each under its next version."""

    def __init__(self, vehicle: str, grid: GridSpec) -> None:
        self.grid = grid
        self.layer = RiskLayer(grid)
        self.settled: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
        self._vehicle = vehicle
        self._version = 0
        self._tiles = tiles(grid)
        self._touched: set[Tile] = set()
        self._published_sum = np.zeros(grid.shape, dtype=np.uint8)
        self._published_largest = np.zeros(grid.shape, dtype=np.uint8)
        self._published_settled = np.zeros(grid.shape, dtype=np.bool_)

    def add(self, look: Look) -> None:
        """Adds a valid look."""
        _, along_bins, range_bins = look.p_detect.shape
        geometry = LookGeometry(
            origin=(look.origin_x_m, look.origin_y_m),
            heading_rad=look.heading_rad,
            first_along_m=look.first_along_m,
            along_bin_m=look.along_bin_m,
            range_bin_m=look.range_bin_m,
            along_bins=along_bins,
            range_bins=range_bins,
        )
        rows, columns, p_detect = look_on_grid(self.grid, geometry, look.p_detect)
        self.layer.add_look(rows, columns, p_detect)
        self._touched.update(tiles_within(self.grid, self._tiles, rows, columns))

    def changed_tiles(self) -> list[Publication]:
        """The tiles that differ from what was last published."""
        sums, largest = self.layer.sum_levels(), self.layer.largest_levels()
        resettled = self.settled != self._published_settled
        some_resettled = bool(resettled.any())
        published = []
        for tile in self._tiles:
            window = tile.window
            changed = (some_resettled and resettled[window].any()) or (
                tile in self._touched
                and (
                    (sums[window] != self._published_sum[window]).any()
                    or (largest[window] != self._published_largest[window]).any()
                )
            )
            if not changed:
                continue
            self._version += 1
            message = CoverageTile(
                version=self._version,
                first_row=tile.first_row,
                first_column=tile.first_column,
                sum_levels=sums[window],
                largest_levels=largest[window],
                settled=self.settled[window],
            )
            published.append(Publication(COVERAGE.key(vehicle=self._vehicle, tile=tile.name), message))
            self._published_sum[window] = sums[window]
            self._published_largest[window] = largest[window]
            self._published_settled[window] = self.settled[window]
        self._touched.clear()
        return published
