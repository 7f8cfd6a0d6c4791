"""Why a strip lies where it does, in words for people: beside which tracks, and what these do not see well there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from comms.said.messages import PlannedTrack
from coordinator.cut.strips import Cut
from coordinator.expect.tracks import curve_of
from coordinator.vehicles import KnownVehicle
from planner.types import BoolArray, DetectionCurve, FloatArray, GridSpec

MOST_CELLS = 12  # to a side of a strip that are looked at
NAMED_SHARE = 0.25  # of a strip's risk, from which a track or a cause is named
MOST_TRACKS = 3  # that are named
NADIR_GAP, RANGE_END, BEYOND, BEST = "nadir gap", "range's end", "ends of tracks", "even where tracks see best"
ACROSS = "across the tracks, as that leaves less"  # of a strip that is flown so
CAUSES = (BEYOND, NADIR_GAP, RANGE_END, BEST)  # of which the first that holds counts


class Reasons:
    """Why strips lie where they do, by the plans and curves of the `primaries` as they are now. `risk`: residual risk
    expected to be left, shape of the grid."""

    def __init__(self, grid: GridSpec, primaries: Mapping[str, KnownVehicle], risk: FloatArray) -> None:
        self._grid = grid
        self._primaries = primaries
        self._risk = risk
        self._known = [
            (name, track) for name, one in primaries.items() for track in (one.plan.tracks if one.plan else ())
        ]

    def why(self, cut: Cut) -> str:
        """What makes a cut's place worth a second look: "seen badly by track 3: nadir gap", or of one that is foreseen
        "expected beside tracks 5 and 6: range's end".

        Where P(y) is below half of its best, nearer than that or farther, is the nadir gap and the range's end.
        """
        beside = self._known if cut.foreseen else [one for one in self._known if one[1].flown] or self._known
        if not beside:
            return "expected to be badly seen" if cut.foreseen else "badly seen"
        x_m, y_m, weights = self._sampled(cut)
        apart_m, is_beyond = _apart(x_m, y_m, [track for _, track in beside])
        nearest = apart_m.argmin(axis=0)
        places = np.arange(nearest.size)
        apart_m, is_beyond = apart_m[nearest, places], is_beyond[nearest, places]
        near_m, far_m = np.array([self._seen_best_m[name] for name, _ in beside])[nearest].T
        holds = np.array([is_beyond, apart_m <= near_m, apart_m >= far_m, np.ones_like(is_beyond)])
        tracks = [beside[at] for at in _named(nearest, weights)[:MOST_TRACKS]]
        causes = [CAUSES[one] for one in _named(holds.argmax(axis=0), weights)]
        by = "expected beside" if cut.foreseen else "seen badly by"
        return f"{by} {self._in_words(tracks)}: {_listed(causes)}"

    @cached_property
    def _seen_best_m(self) -> dict[str, tuple[float, float]]:
        """Between which ranges each primary sees best."""
        curves = {name: curve_of(one, self._primaries.values()) for name, one in self._primaries.items()}
        return {name: _best_m(curve) for name, curve in curves.items()}

    def _sampled(self, cut: Cut) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Places of some of a cut's cells, and what each weighs: its risk."""
        window, grid = cut.window, self._grid
        rows = _evenly(window.first_row, window.end_row)
        columns = _evenly(window.first_column, window.end_column)
        x_m, y_m = grid.frame.to_mission(grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis])
        weights = self._risk[np.ix_(rows, columns)].ravel()
        return x_m.ravel(), y_m.ravel(), weights if weights.any() else np.ones_like(weights)

    def _in_words(self, beside: Sequence[tuple[str, PlannedTrack]]) -> str:
        """Their numbers; of several primaries with whose they are."""
        if len(self._primaries) == 1:
            numbers = sorted(track.number for _, track in beside)
            return f"track{'s' if len(numbers) > 1 else ''} {_listed([str(one) for one in numbers])}"
        return _listed(
            [f"{name}'s track {number}" for name, number in sorted((name, track.number) for name, track in beside)]
        )


def _evenly(first: int, end: int) -> list[int]:
    """Some of the numbers from the first one to before the end, evenly spread, both ends among them."""
    step = (end - 1 - first) / (MOST_CELLS - 1)
    return list(dict.fromkeys(round(place * step + first) for place in range(MOST_CELLS)))


def _apart(x_m: FloatArray, y_m: FloatArray, tracks: Sequence[PlannedTrack]) -> tuple[FloatArray, BoolArray]:
    """How far places are from each track, shape (tracks, places), and whether they lie beyond its ends."""
    ends = np.array([(one.start_x_m, one.start_y_m, one.end_x_m, one.end_y_m) for one in tracks])
    start_x, start_y, end_x, end_y = ends.T[:, :, np.newaxis]
    length = np.maximum(np.hypot(end_x - start_x, end_y - start_y), 1e-9)
    east, north = (end_x - start_x) / length, (end_y - start_y) / length
    along = (x_m - start_x) * east + (y_m - start_y) * north
    across = (x_m - start_x) * north - (y_m - start_y) * east
    over = np.maximum(np.maximum(-along, along - length), 0.0)
    return np.hypot(across, over), over > 0


def _best_m(curve: DetectionCurve) -> tuple[float, float]:
    """From beyond which range to before which P(y) is half of its best, or more."""
    best = int(curve.p_detect.argmax())
    is_low = 2 * curve.p_detect < curve.p_detect[best]
    near_m = float(curve.range_m[:best][is_low[:best]].max(initial=-1.0))
    return near_m, float(curve.range_m[best:][is_low[best:]].min(initial=curve.range_m[-1]))


def _named(values: np.ndarray, weights: FloatArray) -> list[int]:
    """Those values, whole numbers from 0 on, that have their share of the weight, the heaviest first; the heaviest in
    any case."""
    sums = np.bincount(values, weights).tolist()
    found = list(dict.fromkeys(values.tolist()))
    order = sorted(found, key=lambda one: -sums[one])
    least = NAMED_SHARE * sum(sums[one] for one in found)
    return [one for place, one in enumerate(order) if place == 0 or sums[one] >= least]


def _listed(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
