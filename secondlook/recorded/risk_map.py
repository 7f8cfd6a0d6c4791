"""The residual-risk map at one moment, with the places of its cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.risk import RiskStatistics, risk_statistics
from planner.types import BoolArray, FloatArray, GridSpec


@dataclass(frozen=True, eq=False)
class RiskMap:
    """Residual risk per cell at `t_s`: 1 where nobody has looked.

    `risk`, `seen` (with at least one look) and `inside` (the area) have shape (rows, columns) of `grid`.
    """

    t_s: float
    grid: GridSpec
    risk: FloatArray
    seen: BoolArray
    inside: BoolArray

    @cached_property
    def x_m(self) -> FloatArray:
        """East of each cell's centre in the mission frame, shape (rows, columns)."""
        return self._centres[0]

    @cached_property
    def y_m(self) -> FloatArray:
        """North of each cell's centre in the mission frame, shape (rows, columns)."""
        return self._centres[1]

    @property
    def statistics(self) -> RiskStatistics:
        """Mean, mean over the worst 30 % and share not seen, over the cells inside the area."""
        return risk_statistics(self.risk, self.seen, self.inside)

    def at(self, x_m: FloatArray | float, y_m: FloatArray | float) -> FloatArray:
        """The risk of the cells that hold these places (mission frame); NaN outside the grid."""
        across_m, along_m = self.grid.frame.to_sweep(x_m, y_m)
        columns = np.floor(across_m / self.grid.cell_m + 0.5).astype(int)
        rows = np.floor(along_m / self.grid.cell_m).astype(int)
        on_grid = (columns >= 0) & (columns < self.grid.columns) & (rows >= 0) & (rows < self.grid.rows)
        return np.where(on_grid, self.risk[np.where(on_grid, rows, 0), np.where(on_grid, columns, 0)], np.nan)

    def mean_within(self, geometry: BaseGeometry) -> float:
        """Mean risk of the cells inside the area whose centres lie in a geometry (mission frame); NaN if none does."""
        cells = self.cells_within(geometry)
        return float(self.risk[cells].mean()) if cells[0].size else float("nan")

    def cells_within(self, geometry: BaseGeometry) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
        """Rows and columns of the cells inside the area whose centres lie in a geometry (mission frame)."""
        west, south, east, north = geometry.bounds
        near = self.inside & (self.x_m >= west) & (self.x_m <= east) & (self.y_m >= south) & (self.y_m <= north)
        rows, columns = np.nonzero(near)
        within = shapely.contains_xy(geometry, self.x_m[rows, columns], self.y_m[rows, columns])
        return rows[within], columns[within]

    @cached_property
    def _centres(self) -> tuple[FloatArray, FloatArray]:
        return self.grid.frame.to_mission(self.grid.across_m[np.newaxis, :], self.grid.along_m[:, np.newaxis])
