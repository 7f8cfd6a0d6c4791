"""Where primaries say that they saw badly: of each hotspot its newest word, drawn on the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comms.said.messages import Hotspot, HotspotState
from planner.region import points_inside
from planner.types import BoolArray, FloatArray, GridSpec

Place = tuple[str, int]
"""A hotspot's vehicle and number."""
Revision = tuple[int, int]
"""Incarnation of its sender, and its own revision."""


@dataclass(frozen=True)
class _Standing:
    revision: Revision
    mean_risk: float
    window: tuple[slice, slice]
    cells: BoolArray


class Hotspots:
    """Hears hotspots as they come; of one hotspot's revisions the newest counts."""

    def __init__(self, grid: GridSpec, inside: BoolArray) -> None:
        self._grid = grid
        self._inside = inside
        self._hotspots: dict[Place, _Standing] = {}
        self._is_new = False
        self._hot: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
        self._told_risk: FloatArray = np.zeros(grid.shape)

    def hear(self, place: Place, revision: Revision, message: Hotspot) -> bool:
        """Hears a hotspot's newest word; returns whether it was news."""
        known = self._hotspots.get(place)
        if known is not None and revision <= known.revision:
            return False
        window, cells = (slice(0, 0), slice(0, 0)), np.zeros((0, 0), dtype=np.bool_)
        if message.state is HotspotState.ACTIVE and len(message.outline) >= 3:
            window, cells = self._cells_within([(corner.x_m, corner.y_m) for corner in message.outline])
        self._hotspots[place] = _Standing(revision, message.mean_risk, window, cells)
        self._is_new = True
        return True

    def drawn(self) -> tuple[BoolArray, FloatArray]:
        """Which cells hotspots hold, and the worst mean risk told of each, 0 elsewhere; grid shape."""
        if self._is_new:
            self._draw()
        return self._hot, self._told_risk

    def _draw(self) -> None:
        """Draws all hotspots afresh: which cells they hold, and the worst mean told of each cell."""
        self._is_new = False
        self._hot[:] = False
        self._told_risk[:] = 0.0
        for one in self._hotspots.values():
            self._hot[one.window] |= one.cells
            np.maximum(self._told_risk[one.window], one.mean_risk, out=self._told_risk[one.window], where=one.cells)

    def _cells_within(self, outline: list[tuple[float, float]]) -> tuple[tuple[slice, slice], BoolArray]:
        """The cells inside the area whose centres lie in an outline, and the window of the grid that they fill."""
        grid = self._grid
        corners = np.asarray(outline)
        across, along = grid.frame.to_sweep(corners[:, 0], corners[:, 1])
        columns, rows = _from_first_to_last(grid.across_m, across), _from_first_to_last(grid.along_m, along)
        if columns.start == columns.stop or rows.start == rows.stop:
            return (slice(0, 0), slice(0, 0)), np.zeros((0, 0), dtype=np.bool_)
        within = points_inside(across, along, grid.across_m[columns], grid.along_m[rows])
        return (rows, columns), within & self._inside[rows, columns]


def _from_first_to_last(centres_m: FloatArray, corners_m: FloatArray) -> slice:
    """Which of these centres, ascending, lie among the corners."""
    first = int(centres_m.searchsorted(corners_m.min()))
    return slice(first, max(first, int(centres_m.searchsorted(corners_m.max(), side="right"))))
