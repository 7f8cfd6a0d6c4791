"""Why a strip lies where it does, in words for people: beside which tracks, and what these do not see well there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from comms.said.messages import PlannedTrack
from coordinator.cut.strips import Cut
from coordinator.expect.tracks import curve_of
from coordinator.vehicles import KnownVehicle
from planner.compiled import compiled
from planner.types import DetectionCurve, FloatArray, GridSpec, IntArray

MOST_CELLS = 12  # to a side of a strip that are looked at
NAMED_SHARE = 0.25  # of a strip's risk, from which a track or a cause is named
MOST_TRACKS = 3  # that are named
LEAST_M = 1e-9  # that a track is long
NADIR_GAP, RANGE_END, BEYOND, BEST = "nadir gap", "range's end", "ends of tracks", "even where tracks see best"
ACROSS = "across the tracks, as that leaves less"  # of a strip that is flown so
CAUSES = (BEYOND, NADIR_GAP, RANGE_END, BEST)  # of which the first that holds counts


class Beside(NamedTuple):
    """Tracks that a strip may lie beside, with whose they are. `ends`, shape (tracks, 4): where each starts and ends, x
    and y; `seen_best_m`, shape (tracks, 2): between which ranges it sees best."""

    tracks: Sequence[tuple[str, PlannedTrack]]
    ends: FloatArray
    seen_best_m: FloatArray


class Reasons:
    """Why strips lie where they do, by the plans and curves of the `primaries` as they are now. `risk`: residual risk
    expected to be left, shape of the grid."""

    def __init__(self, grid: GridSpec, primaries: Mapping[str, KnownVehicle], risk: FloatArray) -> None:
        frame = grid.frame
        turn = math.sin(frame.heading_rad), math.cos(frame.heading_rad)
        self._places = Places(risk, float(frame.origin_x_m), float(frame.origin_y_m), *turn, float(grid.cell_m))
        self._primaries = primaries

    def why(self, cut: Cut) -> str:
        """What makes a cut's place worth a second look: "seen badly by track 3: nadir gap", or of one that is foreseen
        "expected beside tracks 5 and 6: range's end".

        Where P(y) is below half of its best, nearer than that or farther, is the nadir gap and the range's end.
        """
        beside = self._all if cut.foreseen else self._flown
        if not beside.tracks:
            return "expected to be badly seen" if cut.foreseen else "badly seen"
        nearest, causes, weights = judged(self._places, cut.window.bounds, beside.ends, beside.seen_best_m)
        tracks = [beside.tracks[at] for at in _named(nearest, weights)[:MOST_TRACKS]]
        by = "expected beside" if cut.foreseen else "seen badly by"
        return f"{by} {self._in_words(tracks)}: {_listed([CAUSES[one] for one in _named(causes, weights)])}"

    @cached_property
    def _all(self) -> Beside:
        plans = ((name, one.plan) for name, one in self._primaries.items())
        return self._beside([(name, track) for name, plan in plans if plan for track in plan.tracks])

    @cached_property
    def _flown(self) -> Beside:
        """Those that are flown; all while none is."""
        flown = [one for one in self._all.tracks if one[1].flown]
        return self._beside(flown) if flown else self._all

    def _beside(self, tracks: Sequence[tuple[str, PlannedTrack]]) -> Beside:
        ends = [(one.start_x_m, one.start_y_m, one.end_x_m, one.end_y_m) for _, one in tracks]
        best_m = [self._seen_best_m[name] for name, _ in tracks]
        return Beside(tracks, np.array(ends, dtype=np.float64), np.array(best_m, dtype=np.float64))

    @cached_property
    def _seen_best_m(self) -> dict[str, tuple[float, float]]:
        """Between which ranges each primary sees best."""
        curves = {name: curve_of(one, self._primaries.values()) for name, one in self._primaries.items()}
        return {name: _best_m(curve) for name, curve in curves.items()}

    def _in_words(self, beside: Sequence[tuple[str, PlannedTrack]]) -> str:
        """Their numbers; of several primaries with whose they are."""
        if len(self._primaries) == 1:
            numbers = sorted(track.number for _, track in beside)
            return f"track{'s' if len(numbers) > 1 else ''} {_listed([str(one) for one in numbers])}"
        return _listed(
            [f"{name}'s track {number}" for name, number in sorted((name, track.number) for name, track in beside)]
        )


class Places(NamedTuple):
    """Where the cells of a map of `risk` lie in the mission frame: its origin, the heading's sine and cosine, and how
    large a cell is. As `GridSpec` tells it."""

    risk: FloatArray
    origin_x_m: float
    origin_y_m: float
    sin: float
    cos: float
    cell_m: float


@compiled
def judged(
    places: Places, window: tuple[int, int, int, int], ends: FloatArray, seen_best_m: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Of cells of a window, evenly spread: by its place the track that is nearest, which of `CAUSES` makes that it sees
    the cell badly, and what the cell weighs, its risk. `ends`, `seen_best_m`: see `Beside`."""
    rows, columns = _evenly(window[0], window[1]), _evenly(window[2], window[3])
    nearest, causes = np.empty(rows.size * columns.size, np.int64), np.empty(rows.size * columns.size, np.int64)
    weights, cell = np.empty(nearest.size), 0
    for row in rows:
        for column in columns:
            across_m, along_m = column * places.cell_m, (row + 0.5) * places.cell_m
            x_m = places.origin_x_m + across_m * places.cos + along_m * places.sin
            y_m = places.origin_y_m - across_m * places.sin + along_m * places.cos
            nearest[cell], (nearest_m, beyond_m) = 0, _apart(x_m, y_m, ends[0])
            for track in range(1, len(ends)):
                apart_m, over_m = _apart(x_m, y_m, ends[track])
                if apart_m < nearest_m:
                    nearest[cell], nearest_m, beyond_m = track, apart_m, over_m
            near_m, far_m = seen_best_m[nearest[cell]]
            if beyond_m > 0:
                causes[cell] = 0
            elif nearest_m <= near_m:
                causes[cell] = 1
            else:
                causes[cell] = 2 if nearest_m >= far_m else 3
            weights[cell] = places.risk[row, column]
            cell += 1
    return nearest, causes, weights if weights.any() else np.ones(weights.size)


@compiled
def _evenly(first: int, end: int) -> IntArray:
    """Some of the numbers from the first one to before the end, evenly spread, both ends among them."""
    step, found, count = (end - 1 - first) / (MOST_CELLS - 1), np.empty(MOST_CELLS, np.int64), 0
    for place in range(MOST_CELLS):
        number = np.int64(np.rint(place * step + first))
        if count == 0 or number > found[count - 1]:
            found[count] = number
            count += 1
    return found[:count]


@compiled
def _apart(x_m: float, y_m: float, ends: FloatArray) -> tuple[float, float]:
    """How far a place is from a track, and by how much it lies beyond its ends."""
    east_m, north_m = ends[2] - ends[0], ends[3] - ends[1]
    length_m = max(math.hypot(east_m, north_m), LEAST_M)
    east, north = east_m / length_m, north_m / length_m
    along_m = (x_m - ends[0]) * east + (y_m - ends[1]) * north
    across_m = (x_m - ends[0]) * north - (y_m - ends[1]) * east
    over_m = max(-along_m, along_m - length_m, 0.0)
    return math.hypot(across_m, over_m), over_m


judged.called_with(
    lambda: (Places(np.ones((1, 1)), 0.0, 0.0, 0.0, 1.0, 1.0), (0, 1, 0, 1), np.ones((1, 4)), np.ones((1, 2)))
)


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
