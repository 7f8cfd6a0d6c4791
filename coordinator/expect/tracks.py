"""What a primary's tracks are expected to see, flown and to come: by the P(y) of its curves, or what it was told."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from comms.said.messages import Mode, Plan, PlannedTrack
from coordinator.expect.seabed import sliding_mean
from coordinator.vehicles import KnownVehicle
from planner.curve import NEWEST_CURVES, mean_curve
from planner.footprints import footprint_of
from planner.footprints.cells import EDGE_TOLERANCE_M
from planner.types import DetectionCurve, FloatArray, GridSpec, SweepFrame

ASSUMED_P_DETECT = 0.5
"""Of a pass, midway between the nadir gap and the range that tracks are spaced for, before anybody has measured any; it
falls to 0 at both, as P(y) of side-looking sonars does."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """What tracks are expected to make of the grid's cells: -ln(1 - P_d), arrays of grid shape. `flown`: what was flown
    so far, `ahead`: what is still to be; of the latter also `largest_ahead`, the largest single look."""

    flown: FloatArray
    ahead: FloatArray
    largest_ahead: FloatArray


def expected_tracks(grid: GridSpec, primaries: Mapping[str, KnownVehicle]) -> Tracks:
    """Of all primaries together; one that is given up flies no more tracks. One that has not measured P(y) yet is
    expected to see as others with the same kind of sonar do, and before anybody has, alike up to the range that
    its tracks are spaced for."""
    arrays = np.zeros((3, *grid.shape))
    found = Tracks(*arrays)
    for vehicle in primaries.values():
        if vehicle.plan is None:
            continue
        curve = curve_of(vehicle, primaries.values())
        lead_m = footprint_of(vehicle.entry.sonar).lead_m
        places_known = len(vehicle.plan.tracks) - vehicle.plan.tentative
        settled, tentative = (found.ahead, found.largest_ahead), np.zeros((2, *grid.shape))
        for number, track in enumerate(vehicle.plan.tracks):
            passed_m = _passed_m(track, vehicle, lead_m)
            window, along_m, nats = _beside(grid, track, curve)
            has_passed = along_m <= passed_m
            found.flown[window] += np.where(has_passed, nats, 0.0)
            if vehicle.finished_ms is None:
                to_come = np.where(has_passed, 0.0, nats)
                total, largest = settled if number < places_known else tentative
                total[window] += to_come
                np.maximum(largest[window], to_come, out=largest[window])
        if tentative[0].any():
            total, largest = (_wherever_laid(grid, vehicle.plan, nats) for nats in tentative)
            np.add(found.ahead, total, out=found.ahead)
            np.maximum(found.largest_ahead, largest, out=found.largest_ahead)
    return found


def _wherever_laid(grid: GridSpec, plan: Plan, nats: FloatArray) -> FloatArray:
    """-ln(1 - P_d) on average over where tracks may come to lie that are not settled yet: anywhere up to half of what
    tracks are apart to either side, all together."""
    starts, ends = (
        np.array(grid.frame.to_sweep(*np.array(places).T))
        for places in (
            [(one.start_x_m, one.start_y_m) for one in plan.tracks],
            [(one.end_x_m, one.end_y_m) for one in plan.tracks],
        )
    )
    run_along = bool(np.abs(ends - starts)[1].sum() >= np.abs(ends - starts)[0].sum())
    offsets_m = ((starts + ends) / 2)[0 if run_along else 1]
    apart_m = float(np.ptp(offsets_m)) / max(1, len(plan.tracks) - 1)
    left = sliding_mean(np.exp(-nats), round(apart_m / 2 / grid.cell_m), 1 if run_along else 0)
    return -np.log(np.maximum(left, np.finfo(np.float64).tiny))  # of more looks than there are numbers for


def curve_of(vehicle: KnownVehicle, primaries: Iterable[KnownVehicle]) -> DetectionCurve:
    """P(y) that a primary's tracks are expected to have, by what it and the others have measured."""
    alike = [vehicle, *(one for one in primaries if one.entry.footprint == vehicle.entry.footprint)]
    measured = next((one.curves for one in alike if one.curves), None)
    if measured is None:
        near_m, far_m = vehicle.entry.near_m, float(max(vehicle.plan.r_adpt_m, default=0) if vehicle.plan else 0)
        across = np.linspace(0.0, 1.0, 21)
        range_m = near_m + across * (max(far_m, near_m + 1.0) - near_m)
        return DetectionCurve(range_m, ASSUMED_P_DETECT * 4.0 * across * (1.0 - across))
    newest = [measured[track] for track in sorted(measured) if track > 0][-NEWEST_CURVES:] or [measured[0]]
    return mean_curve(newest)


def _passed_m(track: PlannedTrack, vehicle: KnownVehicle, lead_m: float) -> float:
    """How much of a track's ground is seen already, from its start."""
    if track.flown:
        return np.inf
    state = vehicle.state
    if state is None or state.mode is not Mode.SURVEY or state.works_on != track.number:
        return -np.inf
    _, along_m = _frame(track).to_sweep(state.x_m, state.y_m)
    return float(along_m) + lead_m


def _frame(track: PlannedTrack) -> SweepFrame:
    heading_rad = np.arctan2(track.end_x_m - track.start_x_m, track.end_y_m - track.start_y_m)
    return SweepFrame(track.start_x_m, track.start_y_m, float(heading_rad))


def _beside(
    grid: GridSpec, track: PlannedTrack, curve: DetectionCurve
) -> tuple[tuple[slice, slice], FloatArray, FloatArray]:
    """The window of the grid beside a track, how far along the track its cells lie, and -ln(1 - P_d) there."""
    frame = _frame(track)
    length_m = float(np.hypot(track.end_x_m - track.start_x_m, track.end_y_m - track.start_y_m))
    reach_m = float(curve.range_m[-1]) + EDGE_TOLERANCE_M
    ends_m = (-EDGE_TOLERANCE_M, length_m + EDGE_TOLERANCE_M)
    corners = grid.frame.to_sweep(*frame.to_mission(np.array([-reach_m, reach_m] * 2), np.repeat(ends_m, 2)))
    columns, rows = (
        slice(*np.searchsorted(centres_m, (corner_m.min(), corner_m.max())).tolist())
        for centres_m, corner_m in zip((grid.across_m, grid.along_m), corners, strict=True)
    )
    centres = grid.frame.to_mission(grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis])
    across_m, along_m = frame.to_sweep(*centres)
    nats = -np.log1p(-curve.at(np.abs(across_m)))
    return (rows, columns), along_m, np.where((along_m >= ends_m[0]) & (along_m <= ends_m[1]), nats, 0.0)
