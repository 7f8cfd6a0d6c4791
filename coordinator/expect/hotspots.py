"""Where primaries say that they saw badly: of each hotspot its newest word, drawn on the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comms.said.messages import Hotspot, HotspotState
from planner.fleet_map import MOST_STARTS
from planner.region import points_inside
from planner.types import BoolArray, FloatArray, GridSpec, Window
from planner.windows import NOWHERE, shared

MOST_CHANGED = 64  # windows that are drawn one by one
Place = tuple[str, int]
"""A hotspot's vehicle and number."""
Revision = tuple[int, int]
"""Incarnation of its sender, and its own revision."""


@dataclass(frozen=True)
class _Standing:
    revision: int
    mean_risk: float
    window: Window
    cells: BoolArray


class Hotspots:
    """Hears hotspots as they come; of one hotspot's revisions the newest counts.

    Each start of a vehicle numbers its hotspots anew, and takes none away that one before has told. Memory does not
    grow with each start: those of all but the newest MOST_STARTS stay as they are then, whatever comes of them later.
    """

    def __init__(self, grid: GridSpec, inside: BoolArray) -> None:
        self._grid = grid
        self._inside = inside
        self._starts: dict[str, dict[int, dict[int, _Standing]]] = {}  # by vehicle, incarnation and number
        self._closed: dict[str, int] = {}  # of each vehicle the newest incarnation that nothing is heard of any more
        self._changed = list[Window]()  # windows of the grid that are not drawn yet as hotspots are now
        self._hot: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
        self._told_risk: FloatArray = np.zeros(grid.shape)
        self._risk_of_closed: FloatArray = np.zeros(grid.shape)
        self._hot_of_closed: BoolArray = np.zeros(grid.shape, dtype=np.bool_)

    def hear(self, place: Place, revision: Revision, message: Hotspot) -> bool:
        """Hears a hotspot's newest word; returns whether it was news."""
        (vehicle, number), (incarnation, its_revision) = place, revision
        starts = self._starts.setdefault(vehicle, {})
        known = starts.get(incarnation, {}).get(number)
        if incarnation <= self._closed.get(vehicle, -1) or (known is not None and its_revision <= known.revision):
            return False
        window, cells = NOWHERE, np.zeros((0, 0), dtype=np.bool_)
        if message.state is HotspotState.ACTIVE and len(message.outline) >= 3:
            window, cells = self._cells_within([(corner.x_m, corner.y_m) for corner in message.outline])
        starts.setdefault(incarnation, {})[number] = _Standing(its_revision, message.mean_risk, window, cells)
        self._changed += [window] if known is None else [known.window, window]
        if len(self._changed) > MOST_CHANGED:  # nobody asks: who does has all of it drawn
            self._changed = [(slice(0, self._grid.rows), slice(0, self._grid.columns))]
        if len(starts) > MOST_STARTS:
            oldest = self._closed[vehicle] = min(starts)
            for one in starts.pop(oldest).values():
                _draw(one, self._hot_of_closed, self._risk_of_closed)
        return True

    def drawn(self) -> tuple[BoolArray, FloatArray]:
        """Which cells hotspots hold, and the worst mean risk told of each, 0 elsewhere; grid shape."""
        if self._changed:
            self._draw()
        return self._hot, self._told_risk

    def _draw(self) -> None:
        """Draws afresh what has changed, and the hotspots that lie there: what they hold, and the worst mean told of
        each cell."""
        changed, self._changed = self._changed, []
        for window in changed:
            self._hot[window] = self._hot_of_closed[window]
            self._told_risk[window] = self._risk_of_closed[window]
        for starts in self._starts.values():
            for hotspots in starts.values():
                for one in hotspots.values():
                    if any(shared(one.window, window) for window in changed):
                        _draw(one, self._hot, self._told_risk)

    def _cells_within(self, outline: list[tuple[float, float]]) -> tuple[Window, BoolArray]:
        """The cells inside the area whose centres lie in an outline, and the window of the grid that they fill."""
        grid = self._grid
        corners = np.asarray(outline)
        across, along = grid.frame.to_sweep(corners[:, 0], corners[:, 1])
        columns, rows = _from_first_to_last(grid.across_m, across), _from_first_to_last(grid.along_m, along)
        if columns.start == columns.stop or rows.start == rows.stop:
            return NOWHERE, np.zeros((0, 0), dtype=np.bool_)
        within = points_inside(across, along, grid.across_m[columns], grid.along_m[rows])
        return (rows, columns), within & self._inside[rows, columns]


def _draw(one: _Standing, hot: BoolArray, told_risk: FloatArray) -> None:
    hot[one.window] |= one.cells
    np.maximum(told_risk[one.window], one.mean_risk, out=told_risk[one.window], where=one.cells)


def _from_first_to_last(centres_m: FloatArray, corners_m: FloatArray) -> slice:
    """Which of these centres, ascending, lie among the corners."""
    first = int(centres_m.searchsorted(corners_m.min()))
    return slice(first, max(first, int(centres_m.searchsorted(corners_m.max(), side="right"))))
