"""What the track under way is about to settle: where, when, and how badly seen it is expected to be.

Behind a primary cells settle row by row. The rows ahead of it, of columns that no later track reaches, are expected to
be seen as badly as those behind it, so that a helper can follow in its wake.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comms.said.messages import PlannedTrack
from planner.fleet_map import VehicleLayer
from planner.types import BoolArray, FloatArray, GridSpec

SETTLED_ROWS = 10
"""So many rows of a column must have settled before anything is expected of the rest."""
REPORTED_WITHIN_S = 10.0
"""An agent reports its tiles so often."""


@dataclass(frozen=True)
class TrackUnderWay:
    """The track that a primary flies, when it ends, how fast the primary is, and how far it sees to each side."""

    track: PlannedTrack
    ends_s: float
    speed_mps: float
    range_m: float


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
        far_m = under_way.range_m + 2 * grid.cell_m  # cells are taken for settled with a margin
        first, end = np.searchsorted(grid.across_m, [across_m - far_m, across_m + far_m]).tolist()
        beside = (slice(None, None, -1 if descending else 1), slice(first, end))
        settled, still_open = inside[beside] & layer.settled[beside], inside[beside] & ~layer.settled[beside]
        count = settled.sum(axis=0)
        last_settled = settled.shape[0] - 1 - settled[::-1].argmax(axis=0)
        columns = (count >= SETTLED_ROWS) & still_open.any(axis=0) & (last_settled < still_open.argmax(axis=0))
        expected = np.where(settled, risk[beside], 0.0).sum(axis=0) / np.maximum(count, 1)
        ahead = still_open & columns & (expected > 0)
        to_end_m = np.maximum(0.0, (float(end_m) - grid.along_m[beside[0]]) * (-1 if descending else 1))
        settles_s = under_way.ends_s + REPORTED_WITHIN_S - to_end_m / under_way.speed_mps
        self.risk[beside][ahead] = np.broadcast_to(expected, ahead.shape)[ahead]
        self.settles_s[beside][ahead] = np.broadcast_to(settles_s[:, np.newaxis], ahead.shape)[ahead]
        self.descending[beside][ahead] = descending
