"""What is known of the ground: where it was seen badly, what a second look is expected to find there, and what the
track under way is about to settle.

A seabed that hides mines from the primary hides them from a helper, too. Where a helper has looked, its next look is
expected to find what its best one did. Elsewhere cells of one column are compared, which a primary has passed at like
ranges: what it saw worse than others there lies on such a seabed.

Behind a primary cells settle row by row. The rows ahead of it, of columns that no later track reaches, are expected to
be seen as badly as those behind it, so that a helper can follow in its wake.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comms.said.messages import Hotspot, HotspotState, PlannedTrack
from coordinator.cut.window import Window
from planner.fleet_map import FleetMap, VehicleLayer
from planner.groups import neighbours
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
    growing: bool
    window: tuple[slice, slice]
    cells: BoolArray


class BadlySeen:
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
        self._hotspots[place] = _Standing(revision, message.mean_risk, message.growing, window, cells)
        self._is_new = True
        return True

    def risk(self, fleet: FleetMap, settled: BoolArray) -> FloatArray:
        """Residual risk that a second look may remove, 0 elsewhere: the joined map's where cells have settled, and on
        hotspots where tiles have come; where none have, the mean that the hotspot tells.

        `settled`: cells that a primary has declared so.
        """
        if self._is_new:
            self._draw()
        risk = np.where(fleet.seen() | settled, fleet.risk, self._told_risk)
        return np.where(self._inside & (settled | self._hot), risk, 0.0)

    def still_open(self, told: BoolArray, settled: BoolArray) -> BoolArray:
        """Cells that the survey may still improve: those that tiles of the primaries tell of and that have not settled;
        where no tile has come, those in and about hotspots that grow."""
        growing = np.zeros(self._grid.shape, dtype=np.bool_)
        for one in self._hotspots.values():
            if one.growing:
                growing[one.window] |= one.cells
        may_improve = told | growing | neighbours(growing) if growing.any() else told
        return self._inside & may_improve & ~settled

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


WELL_SEEN = 0.75
"""So many of a column's cells were seen no better than where the seabed hides nothing."""
CARRIES_OVER = 0.5
"""Power of a cell's share of that, as a helper looks from nearer and from other sides."""
LEAST_SHARE = 0.3
UNSEEN_RISK = 0.999
"""Residual risk from which a cell tells nothing of its seabed."""


class ExpectedLooks:
    """Factors of grid shape, worked out anew only in columns where something has changed."""

    def __init__(self, grid: GridSpec) -> None:
        self._found: FloatArray = np.full(grid.shape, np.nan)
        self._risk: FloatArray = np.zeros(grid.shape)
        self._factor: FloatArray = np.ones(grid.shape)
        self._has_news: BoolArray = np.zeros(grid.columns, dtype=np.bool_)

    def learn(self, window: Window, p_detect: FloatArray, typical: float) -> None:
        """Learns from a helper's looks at a window's cells.

        `p_detect`: of its best look at each, shape of the window, 0 where it did not look; `typical`: its P_d as the
        run tells it.
        """
        seen = p_detect > 0
        found = self._found[window.cells]
        found[seen] = np.fmax(found[seen], p_detect[seen] / typical)
        self._has_news[window.columns] = True

    def factor(self, risk: FloatArray) -> FloatArray:
        """The factor of each cell. `risk`: residual risk where a second look is thought of, 0 elsewhere."""
        columns = np.flatnonzero((risk != self._risk).any(axis=0) | self._has_news)
        self._factor[:, columns] = self._of_columns(risk[:, columns], self._found[:, columns])
        self._risk = risk
        self._has_news[:] = False
        return self._factor

    def _of_columns(self, risk: FloatArray, found: FloatArray) -> FloatArray:
        tells = (risk > 0) & (risk < UNSEEN_RISK)
        ranked = np.sort(np.where(tells, 1.0 - risk, np.inf), axis=0)
        last = np.maximum(0, tells.sum(axis=0) - 1)
        well_seen = ranked[(last * WELL_SEEN).astype(np.intp), np.arange(risk.shape[1])]
        share = np.clip((1.0 - risk) / well_seen, LEAST_SHARE, 1.0)
        return np.where(np.isnan(found), np.where(tells, share**CARRIES_OVER, 1.0), found)


SETTLED_ROWS = 10
"""So many rows of a column must have settled before anything is expected of the rest."""
REPORTED_WITHIN_S = 10.0
"""An agent reports its tiles so often."""


@dataclass(frozen=True)
class TrackUnderWay:
    """The track that a primary flies, when it ends, how fast the primary is, how far it sees to each side, and how much
    earlier than over the ground that it sees it flies the track."""

    track: PlannedTrack
    ends_s: float
    speed_mps: float
    range_m: float
    lead_m: float = 0.0


@dataclass(frozen=True)
class Growth:
    """Arrays over the grid. `risk`: the residual risk expected of cells about to settle, 0 elsewhere; `settles_s`: when
    they do, 0 elsewhere; `descending`: where that goes towards lower rows."""

    risk: FloatArray
    settles_s: FloatArray
    descending: BoolArray

    @classmethod
    def none(cls, grid: GridSpec) -> Growth:
        """Nothing is about to settle."""
        return cls(np.zeros(grid.shape), np.zeros(grid.shape), np.zeros(grid.shape, dtype=np.bool_))

    def add(
        self, grid: GridSpec, inside: BoolArray, risk: FloatArray, layer: VehicleLayer, under_way: TrackUnderWay
    ) -> None:
        """Adds what one primary is about to settle. `risk`: the residual risk where it was seen badly, 0 elsewhere."""
        track = under_way.track
        (across_m, _), (start_m, end_m) = grid.frame.to_sweep(
            np.array([track.start_x_m, track.end_x_m]), np.array([track.start_y_m, track.end_y_m])
        )
        descending = bool(end_m < start_m)
        far_m = under_way.range_m + 2 * grid.cell_m  # cells settle with a margin
        first, end = np.searchsorted(grid.across_m, [across_m - far_m, across_m + far_m]).tolist()
        beside = (slice(None, None, -1 if descending else 1), slice(first, end))
        settled, still_open = inside[beside] & layer.settled[beside], inside[beside] & ~layer.settled[beside]
        count = settled.sum(axis=0)
        last_settled = settled.shape[0] - 1 - settled[::-1].argmax(axis=0)
        columns = (count >= SETTLED_ROWS) & still_open.any(axis=0) & (last_settled < still_open.argmax(axis=0))
        expected = np.where(settled, risk[beside], 0.0).sum(axis=0) / np.maximum(count, 1)
        ahead = still_open & columns & (expected > 0)
        to_end_m = (float(end_m) - grid.along_m[beside[0]]) * (-1 if descending else 1) - under_way.lead_m
        to_end_m = np.maximum(0.0, to_end_m)
        settles_s = under_way.ends_s + REPORTED_WITHIN_S - to_end_m / under_way.speed_mps
        self.risk[beside][ahead] = np.broadcast_to(expected, ahead.shape)[ahead]
        self.settles_s[beside][ahead] = np.broadcast_to(settles_s[:, np.newaxis], ahead.shape)[ahead]
        self.descending[beside][ahead] = descending
