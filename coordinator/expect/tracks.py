"""What a primary's tracks are expected to see, flown and to come: by the P(y) of its curves, or what it was told."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from comms.said.messages import Mode, Plan, PlannedTrack
from coordinator.expect.seabed import sliding_mean
from coordinator.vehicles import KnownVehicle
from planner.curve import NEWEST_CURVES, mean_curve
from planner.footprints import footprint_of
from planner.footprints.cells import EDGE_TOLERANCE_M
from planner.types import EVERYWHERE, BoolArray, DetectionCurve, FloatArray, GridSpec, SweepFrame, Window

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


_Ends = tuple[float, float, float, float]
_Track = tuple[_Ends, bytes]
"""From where to where a track runs, and its curve's points: what it makes of a grid follows from these alone."""
_Nats = tuple[FloatArray, FloatArray]
Value = TypeVar("Value")


class _Kept(Generic[Value]):
    """What was worked out by keys from which it follows; kept as long as it is asked for in each round."""

    def __init__(self) -> None:
        self._now, self._before = dict[Hashable, Value](), dict[Hashable, Value]()

    def begin_round(self) -> None:
        """What is not asked for until the next one is forgotten."""
        self._now, self._before = {}, self._now

    def value(self, key: Hashable, made: Callable[[], Value]) -> Value:
        """That of a key, made where it is not kept."""
        if key not in self._now:
            self._now[key] = self._before[key] if key in self._before else made()
        return self._now[key]


class ExpectedTracks:
    """What tracks of primaries are expected to make of a grid, which is worked out where a track or a curve is another
    than when it was asked before."""

    def __init__(self, grid: GridSpec) -> None:
        self._grid = grid
        self._ground = _Kept[_Ground]()
        self._beside = _Kept[_Beside]()
        self._whole = _Kept[_Nats]()
        self._laid = _Kept[_Nats | None]()

    def of(self, primaries: Mapping[str, KnownVehicle]) -> Tracks:
        """Of all primaries together; one that is given up flies no more tracks. One that has not measured P(y) yet is
        expected to see as others with the same kind of sonar do, and before anybody has, alike up to the range that
        its tracks are spaced for."""
        arrays = np.zeros((3, *self._grid.shape))
        found = Tracks(*arrays)
        self._ground.begin_round()
        self._beside.begin_round()
        self._whole.begin_round()
        self._laid.begin_round()
        for vehicle in primaries.values():
            if vehicle.plan is not None:
                self._add(found, vehicle, vehicle.plan, curve_of(vehicle, primaries.values()))
        return found

    def _add(self, found: Tracks, vehicle: KnownVehicle, plan: Plan, curve: DetectionCurve) -> None:
        """Adds one primary's."""
        points, lead_m = curve.range_m.tobytes() + curve.p_detect.tobytes(), footprint_of(vehicle.entry.sonar).lead_m
        tracks: list[_Track] = [(_ends(track), points) for track in plan.tracks]
        if tracks and not _comes_near(self._grid, tracks, float(curve.range_m[-1])):
            return
        reach_m = float(curve.range_m[-1]) + EDGE_TOLERANCE_M
        ground = [self._ground.value((one, reach_m), partial(_ground, self._grid, one, reach_m)) for one, _ in tracks]
        beside = [
            self._beside.value(one, partial(_beside, there, curve)) for one, there in zip(tracks, ground, strict=True)
        ]
        passed_m = [_passed_m(track, vehicle, lead_m) for track in plan.tracks]
        flown = [number for number, its_m in enumerate(passed_m) if its_m == np.inf]
        under_way = [number for number, its_m in enumerate(passed_m) if np.isfinite(its_m)]
        if flown:
            np.add(found.flown, self._of_whole(tracks, beside, flown)[0], out=found.flown)
        for number in under_way:
            found.flown[beside[number].window] += beside[number].flown(passed_m[number])
        if vehicle.finished_ms is not None:
            return
        known = len(tracks) - plan.tentative
        ahead = [number for number in range(known) if passed_m[number] == -np.inf]
        if ahead:
            _add_to((found.ahead, found.largest_ahead), EVERYWHERE, self._of_whole(tracks, beside, ahead))
        for number in under_way:
            if number < known:
                seen = beside[number].ahead(passed_m[number])
                _add_to((found.ahead, found.largest_ahead), beside[number].window, (seen, seen))
        key = tuple(tracks), plan.tentative, tuple(passed_m[known:])
        laid = self._laid.value(key, partial(self._wherever_laid, plan, beside[known:], passed_m[known:]))
        if laid is not None:
            _add_to((found.ahead, found.largest_ahead), EVERYWHERE, laid)

    def _of_whole(self, tracks: Sequence[_Track], beside: Sequence[_Beside], numbers: Sequence[int]) -> _Nats:
        """What some tracks see from end to end, summed, and the largest single look."""

        def made() -> _Nats:
            total, largest = np.zeros((2, *self._grid.shape))
            for one in numbers:
                _add_to((total, largest), beside[one].window, (beside[one].nats, beside[one].nats))
            return total, largest

        return self._whole.value(tuple(tracks[one] for one in numbers), made)

    def _wherever_laid(self, plan: Plan, beside: Sequence[_Beside], passed_m: Sequence[float]) -> _Nats | None:
        """Summed, and the largest single look, on average over where tracks may come to lie that are not settled yet:
        anywhere up to half of what tracks are apart to either side, all together. None where there are none."""
        total, largest = np.zeros((2, *self._grid.shape))
        for one, its_m in zip(beside, passed_m, strict=True):
            seen = one.ahead(its_m)
            _add_to((total, largest), one.window, (seen, seen))
        return (_shifted(self._grid, plan, total), _shifted(self._grid, plan, largest)) if total.any() else None


@dataclass(frozen=True, eq=False)
class _Ground:
    """A window of the grid beside a track: how far its cells lie from that and along it, and which ones lie between its
    ends."""

    window: Window
    lateral_m: FloatArray
    along_m: FloatArray
    is_beside: BoolArray


@dataclass(frozen=True, eq=False)
class _Beside:
    """What one track makes of a window of the grid: -ln(1 - P_d) of a look at each cell, and how far along the track
    each lies."""

    window: Window
    along_m: FloatArray
    nats: FloatArray

    def flown(self, passed_m: float) -> FloatArray:
        """What of it is seen where so much of the track is passed."""
        return np.where(self.along_m <= passed_m, self.nats, 0.0)

    def ahead(self, passed_m: float) -> FloatArray:
        """What of it is still to be seen then."""
        return np.where(self.along_m <= passed_m, 0.0, self.nats)


def _add_to(to: _Nats, window: Window, seen: _Nats) -> None:
    """Adds what is seen of a window to a sum, and to the largest single look."""
    (total, largest), (its_sum, its_largest) = to, seen
    total[window] += its_sum
    np.maximum(largest[window], its_largest, out=largest[window])


def _shifted(grid: GridSpec, plan: Plan, nats: FloatArray) -> FloatArray:
    """The mean over where tracks may lie, see `ExpectedTracks`."""
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
    beside = round(apart_m / 2 / grid.cell_m)
    left: FloatArray = sliding_mean(np.exp(-nats), -1 if run_along else beside, beside if run_along else -1)
    return -np.log(np.maximum(left, np.finfo(np.float64).tiny))  # of more looks than there are numbers for


def curve_of(vehicle: KnownVehicle, primaries: Iterable[KnownVehicle]) -> DetectionCurve:
    """P(y) that a primary's tracks are expected to have, by what it and the others have measured."""
    alike = (one.curves for one in primaries if one.curves and one.entry.footprint == vehicle.entry.footprint)
    measured = vehicle.curves or next(alike, {})
    if not measured:
        near_m, far_m = vehicle.entry.near_m, float(max(vehicle.plan.r_adpt_m, default=0) if vehicle.plan else 0)
        across = np.linspace(0.0, 1.0, 21)
        range_m = near_m + across * (max(far_m, near_m + 1.0) - near_m)
        return DetectionCurve(range_m, ASSUMED_P_DETECT * 4.0 * across * (1.0 - across))
    newest = [measured[track] for track in sorted(measured) if track > 0][-NEWEST_CURVES:] or [measured[0]]
    return mean_curve(newest)


def _comes_near(grid: GridSpec, tracks: Sequence[_Track], reach_m: float) -> bool:
    """Whether any of a grid lies within reach of tracks, or between them."""
    ends = np.array([one[0] for one in tracks])
    across_m, along_m = grid.frame.to_sweep(ends[:, ::2], ends[:, 1::2])
    beside_m = reach_m + grid.cell_m
    return bool(
        across_m.min() - beside_m <= grid.across_m[-1]
        and across_m.max() + beside_m >= grid.across_m[0]
        and along_m.min() - beside_m <= grid.along_m[-1]
        and along_m.max() + beside_m >= grid.along_m[0]
    )


def _passed_m(track: PlannedTrack, vehicle: KnownVehicle, lead_m: float) -> float:
    """How much of a track's ground is seen already, from its start."""
    if track.flown:
        return np.inf
    state = vehicle.state
    if state is None or state.mode is not Mode.SURVEY or state.works_on != track.number:
        return -np.inf
    _, along_m = _frame(_ends(track)).to_sweep(state.x_m, state.y_m)
    return float(along_m) + lead_m


def _frame(ends: _Ends) -> SweepFrame:
    start_x_m, start_y_m, end_x_m, end_y_m = ends
    return SweepFrame(start_x_m, start_y_m, float(np.arctan2(end_x_m - start_x_m, end_y_m - start_y_m)))


def _ends(track: PlannedTrack) -> _Ends:
    return track.start_x_m, track.start_y_m, track.end_x_m, track.end_y_m


def _ground(grid: GridSpec, ends: _Ends, reach_m: float) -> _Ground:
    """Where the window of the grid beside a track lies that a sonar of a reach may see."""
    start_x_m, start_y_m, end_x_m, end_y_m = ends
    frame = _frame(ends)
    length_m = float(np.hypot(end_x_m - start_x_m, end_y_m - start_y_m))
    ends_m = (-EDGE_TOLERANCE_M, length_m + EDGE_TOLERANCE_M)
    corners = grid.frame.to_sweep(*frame.to_mission(np.array([-reach_m, reach_m] * 2), np.repeat(ends_m, 2)))
    columns, rows = (
        slice(*np.searchsorted(centres_m, (corner_m.min(), corner_m.max())).tolist())
        for centres_m, corner_m in zip((grid.across_m, grid.along_m), corners, strict=True)
    )
    centres = grid.frame.to_mission(grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis])
    across_m, along_m = frame.to_sweep(*centres)
    return _Ground((rows, columns), np.abs(across_m), along_m, (along_m >= ends_m[0]) & (along_m <= ends_m[1]))


def _beside(ground: _Ground, curve: DetectionCurve) -> _Beside:
    """What a track with a curve makes of the ground beside it."""
    nats = -np.log1p(-curve.at(ground.lateral_m))
    return _Beside(ground.window, ground.along_m, np.where(ground.is_beside, nats, 0.0))
