"""What share of their P_d the seabed leaves sonars, by place: what primaries have seen there against what their P(y)
curve tells of a pass at that range.

The curve is a track's mean, so that places are told from each other, and the clearest are taken to be clear.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from comms.messages import Curve, Plan, PlannedTrack
from planner.fleet_map import VehicleLayer
from planner.risk import HIGHEST_P_DETECT, NATS_PER_LEVEL
from planner.sweep import run_over
from planner.types import BoolArray, FloatArray, GridSpec, SweepFrame

ABOUT_M = 30.0
"""A place is judged with what lies so far beside it, as looks are noisy."""
CLEAR = 0.75
"""So much of the area seen is less clear than what is taken to be clear."""
LEAST_SHARE = 0.3
TELLS_NATS = 0.05
"""What looks must be expected to tell on average about a place, to judge it."""


class SeabedShare:
    """Learns from each track flown. `inside`: the area's cells, of grid shape."""

    def __init__(self, grid: GridSpec, inside: BoolArray) -> None:
        self.share: FloatArray = np.ones(grid.shape)
        """By cell, in [0.3, 1]; 1 where nobody has looked."""
        self._grid = grid
        self._inside = inside
        self._curves: dict[str, dict[int, Curve]] = {}  # by primary and track
        self._flown: set[tuple[str, float, float, float, float]] = set()
        self._expected_nats: FloatArray = np.zeros(grid.shape)

    def take_curve(self, vehicle: str, curve: Curve) -> None:
        """Takes a primary's curve: that of a track, or of earlier missions until the first track is flown."""
        if not curve.p_detect.size:
            return
        known = self._curves.setdefault(vehicle, {})
        known[curve.track] = curve
        if len(known) > 1:
            known.pop(0, None)

    def take_plan(self, vehicle: str, plan: Plan) -> bool:
        """Takes a primary's plan; returns whether it tells of another track flown."""
        news = False
        for track in plan.tracks:
            place = (vehicle, track.start_x_m, track.start_y_m, track.end_x_m, track.end_y_m)
            if track.flown and place not in self._flown and self._curves.get(vehicle):
                self._flown.add(place)
                self._expected_nats += self._nats_of(vehicle, track)
                news = True
        return news

    def learn(self, layers: Mapping[str, VehicleLayer]) -> None:
        """Compares what primaries' layers tell with what was expected of the tracks that they have flown."""
        passed = self._expected_nats > 0
        seen_levels = np.zeros(self._grid.shape)
        for layer in layers.values():
            seen_levels += layer.sum_levels
        cells = max(1, round(ABOUT_M / self._grid.cell_m))
        expected_nats = _sums_about(np.where(passed, self._expected_nats, 0.0), cells)
        seen_nats = NATS_PER_LEVEL * _sums_about(np.where(passed, seen_levels, 0.0), cells)
        tells = self._inside & (expected_nats >= TELLS_NATS * (2 * cells + 1) ** 2)
        if tells.any():
            share = seen_nats[tells] / expected_nats[tells]
            told = np.clip(share / max(np.quantile(share, CLEAR), 1e-9), LEAST_SHARE, 1.0)
            self.share = np.full(self._grid.shape, told.mean())
            self.share[tells] = told

    def _nats_of(self, vehicle: str, track: PlannedTrack) -> FloatArray:
        """What a pass along a track is expected to tell of each cell."""
        grid, curves = self._grid, list(self._curves[vehicle].values())
        run = run_over((track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m), 0.0)
        x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
        across_m, along_m = SweepFrame(*run.begin).to_sweep(x_m, y_m)
        points_m = np.unique(np.concatenate([_points_m(curve) for curve in curves]))
        by_range = [np.interp(points_m, _points_m(curve), curve.p_detect, right=0.0) for curve in curves]
        mean_nats = -np.log1p(-np.minimum(by_range, HIGHEST_P_DETECT)).mean(axis=0)
        nats: FloatArray = np.interp(np.abs(across_m), points_m, mean_nats, right=0.0)
        nats[(along_m < 0) | (along_m > run.length_m)] = 0.0
        return nats


def _points_m(curve: Curve) -> FloatArray:
    return curve.range_bin_m * np.arange(curve.p_detect.size, dtype=np.float64)


def _sums_about(values: FloatArray, cells: int) -> FloatArray:
    """Sums over the squares that reach so many cells to each side."""
    for axis in (0, 1):
        size = values.shape[axis]
        total = np.insert(values.cumsum(axis=axis), 0, 0.0, axis=axis)
        places = np.arange(size)
        behind, first = np.minimum(places + cells + 1, size), np.maximum(places - cells, 0)
        values = total.take(behind, axis=axis) - total.take(first, axis=axis)
    return values
