"""A vehicle's coverage in few bytes: the stretches of track that it has looked along, and how much it saw there beside
what its P(y) lets expect. From these the coordinator's modem puts the vehicle's layer together again.

A stretch is said once and never changed, and its looks are added up: so layers that are put together from the same
stretches are the same, in whatever order and however often these come.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from comms.said.announcement import RosterVehicle
from comms.said.bits import folded, unfolded
from comms.said.messages import CoverageTile, Curve, Look
from comms.said.over_water import Counted, Heading, Length, PlaceX, PlaceY
from comms.said.wire import AtMost, Count, Metres, Radians
from modem.corrections import Correction, Corrections
from planner.footprints.cells import look_on_grid
from planner.risk import HIGHEST_P_DETECT, RiskLayer, to_levels
from planner.tiles import Tile, tiles, tiles_within
from planner.types import DetectionCurve, FloatArray, GridSpec, LookGeometry, SweepFrame

CHUNK_M = 100.0
"""Along a stretch; of each it is told how much was seen on either side."""
MOST_CHUNKS = 4
STRETCHES_A_START = 4096
MOST_AHEAD = 256
"""Corrections that wait for stretches; of more the oldest are forgotten."""
STEPS_TO_HALF = 4
"""Steps in which what was seen is told, down to half of what was expected."""
LEAST_STEPS = -20
"""Of a side on which all but nothing was seen: a thirty-second of what was expected."""


@dataclass(frozen=True, slots=True)
class Seen:
    """How much was seen on either side of a chunk, in nats (-ln(1 - P_d)) beside those expected, in steps of a
    logarithm, folded to a number from 0: 0 for just as much."""

    port: Annotated[Count, Counted(1)]
    starboard: Annotated[Count, Counted(1)]


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of track that was looked along: its first point, heading, length; the `curve` by which what was seen is
    told, as the number of its track plus 1, 0 for the sonar as it was announced; and what was seen, chunk by chunk."""

    number: Annotated[Count, Counted(5)]
    x_m: PlaceX
    y_m: PlaceY
    heading_rad: Annotated[Radians, Heading(13)]
    length_m: Annotated[Metres, Length(1.0)]
    curve: Annotated[Count, Counted(2)]
    seen: Annotated[tuple[Seen, ...], AtMost(MOST_CHUNKS)]


class Gathering:
    """Gathers a vehicle's looks to stretches. `entry`: the vehicle as it was announced; `start`: of its modem, each of
    which numbers its stretches by itself, as none may have the number of another."""

    def __init__(self, entry: RosterVehicle, start: int = 0) -> None:
        self._entry = entry
        self._looks: list[Look] = []
        self._curve: Curve | None = None
        self._number = start * STRETCHES_A_START

    def hear_curve(self, curve: Curve) -> Stretch | None:
        """From now on looks are told by this curve, if it is one; returns the stretch that was told by that before."""
        if curve.detection_curve is None:
            return None
        before = self.flush()
        self._curve = curve
        return before

    def add(self, look: Look) -> Stretch | None:
        """Takes a look; returns the stretch that has come to an end."""
        ended, counts = None, look.valid and look.makes_sense
        if self._looks and (not counts or not _goes_on(self._looks[-1], look)):
            ended = self.flush()
        if counts:
            self._looks.append(look)
            if ended is None and _length_m(self._looks) > MOST_CHUNKS * CHUNK_M - _length_m([look]):
                ended = self.flush()
        return ended

    def flush(self) -> Stretch | None:
        """The stretch that was gathered so far, None where there is none."""
        looks, self._looks = self._looks, []
        if not looks:
            return None
        self._number += 1
        first = looks[0]
        frame = SweepFrame(first.origin_x_m, first.origin_y_m, first.heading_rad)
        x_m, y_m = frame.to_mission(0.0, first.first_along_m)
        curve = self._curve
        return Stretch(
            number=self._number,
            x_m=x_m,
            y_m=y_m,
            heading_rad=first.heading_rad % math.tau,
            length_m=_length_m(looks),
            curve=0 if curve is None else curve.track + 1,
            seen=tuple(self._seen(looks)),
        )

    def _seen(self, looks: list[Look]) -> Iterable[Seen]:
        expected = p_expected(self._entry, self._curve)
        begin_m = looks[0].first_along_m
        sums = np.zeros((MOST_CHUNKS, 2, 2))  # chunk; seen, expected; side
        for look in looks:
            _, along_bins, range_bins = look.p_detect.shape
            nats = -np.log1p(-look.p_detect)
            hoped = -np.log1p(-expected.at(np.arange(range_bins, dtype=np.float64) * look.range_bin_m))
            chunk = min(int((look.first_along_m - begin_m) / CHUNK_M), MOST_CHUNKS - 1)
            sums[chunk, 0] += nats.sum(axis=(1, 2)) * look.along_bin_m * look.range_bin_m
            sums[chunk, 1] += float(hoped.sum()) * along_bins * look.along_bin_m * look.range_bin_m
        for seen, hoped in sums[: max(1, math.ceil(_length_m(looks) / CHUNK_M - 1e-6))]:
            yield Seen(*(folded(_steps(float(one), float(other))) for one, other in zip(seen, hoped, strict=True)))


def _steps(seen: float, expected: float) -> int:
    if expected <= 0.0:
        return 0
    return _within(round(STEPS_TO_HALF * math.log2(max(seen / expected, 1e-6))))


def _within(steps: int) -> int:
    return max(LEAST_STEPS, min(-LEAST_STEPS, steps))


def _goes_on(before: Look, look: Look) -> bool:
    """Whether a look is that of the next stretch of the same track."""
    _, along_bins, _ = before.p_detect.shape
    begin_m = before.first_along_m + along_bins * before.along_bin_m
    return (
        (before.maneuver, before.origin_x_m, before.origin_y_m, before.heading_rad)
        == (look.maneuver, look.origin_x_m, look.origin_y_m, look.heading_rad)
    ) and abs(look.first_along_m - begin_m) < 0.02


def _length_m(looks: list[Look]) -> float:
    last = looks[-1]
    _, along_bins, _ = last.p_detect.shape
    return last.first_along_m + int(along_bins) * last.along_bin_m - looks[0].first_along_m


def p_expected(entry: RosterVehicle, curve: Curve | None) -> DetectionCurve:
    """P(y) of a vehicle's looks: its curve, or else that of its sonar as it was announced, flat between its ranges."""
    if curve is not None and (measured := curve.detection_curve) is not None:
        return measured
    near_m, far_m = entry.near_m, entry.far_m
    range_m = np.array([0.0, max(0.0, near_m - 1e-3), near_m, far_m, far_m + 1e-3])
    p_detect = entry.p_detect * np.array([near_m <= 0.0, near_m <= 0.0, 1.0, 1.0, 0.0])
    keep = np.append(True, np.diff(range_m) > 0)
    return DetectionCurve(range_m[keep], p_detect[keep])


class Told(NamedTuple):
    """A tile under its name."""

    name: str
    tile: CoverageTile


class LayerOf:
    """The layer of one start of a vehicle, put together from its stretches and their corrections."""

    def __init__(self, entry: RosterVehicle, grid: GridSpec) -> None:
        self._entry = entry
        self._grid = grid
        self._tiles = tiles(grid)
        self._layer = RiskLayer(grid)
        self.corrections = Corrections(grid)
        self._curves: dict[int, Curve] = {}
        self._come: set[int] = set()
        self._waiting: list[Stretch] = []  # for their curves
        self._added: set[int] = set()
        self._last = 0  # stretches 1 to this were added
        self._ahead: list[Correction] = []  # of stretches that have not come
        self._version = 0

    def hear_curve(self, curve: Curve) -> list[Told]:
        """Takes a curve; returns the tiles that are others by the stretches that have waited for it."""
        self._curves[curve.track + 1] = curve
        waiting, self._waiting = self._waiting, []
        return [tile for stretch in waiting for tile in self._add(stretch)] + self._catch_up()

    def hear(self, stretch: Stretch) -> list[Told]:
        """Takes a stretch; returns the tiles that are others now, under their names."""
        if stretch.number in self._come:
            return []
        self._come.add(stretch.number)
        return self._add(stretch) + self._catch_up()

    def correct(self, correction: Correction) -> list[Told]:
        """Takes a correction; returns the tile that is another by it. It waits for the stretches that it corrects: so
        who was started anew, and knows of the first of them no more, corrects nothing twice. Raises WireError for one
        of no tile."""
        if correction.after > self._last:
            self._ahead = [*self._ahead[1 - MOST_AHEAD :], correction]
            return []
        tile = self.corrections.take(correction)
        return [] if tile is None else [self._told(tile)]

    def _catch_up(self) -> list[Told]:
        while self._last + 1 in self._added:
            self._last += 1
        ahead, self._ahead = self._ahead, []
        return [tile for correction in ahead for tile in self.correct(correction)]

    def sums(self, tile: Tile) -> FloatArray:
        """What its stretches have seen of a tile: the sum over looks in nats, of the tile's shape."""
        sums: FloatArray = self._layer.nats(tile.window)[0]
        return sums

    def _add(self, stretch: Stretch) -> list[Told]:
        if stretch.curve and stretch.curve not in self._curves:
            self._waiting.append(stretch)
            return []
        self._added.add(stretch.number)
        curve, changed = p_expected(self._entry, self._curves.get(stretch.curve)), set[Tile]()
        range_m = np.arange(0.0, max(self._entry.far_m, float(curve.range_m[-1])) + 1.0)
        nats = -np.log1p(-np.clip(curve.at(range_m), 0.0, HIGHEST_P_DETECT))
        for place, seen in enumerate(stretch.seen):
            first_m = place * CHUNK_M
            length_m = min(stretch.length_m - first_m, CHUNK_M if place < len(stretch.seen) - 1 else math.inf)
            if length_m <= 0:
                continue
            shares = [2.0 ** (_within(unfolded(steps)) / STEPS_TO_HALF) for steps in (seen.port, seen.starboard)]
            p_detect: FloatArray = -np.expm1(-np.outer(shares, nats))[:, np.newaxis, :]
            geometry = LookGeometry(
                (stretch.x_m, stretch.y_m), stretch.heading_rad, first_m, length_m, 1.0, 1, len(range_m)
            )
            look = look_on_grid(self._grid, geometry, np.minimum(p_detect, HIGHEST_P_DETECT))
            self._layer.add_look(*look)
            changed.update(tiles_within(self._grid, self._tiles, *look[:2]))
        return [self._told(tile) for tile in sorted(changed, key=lambda one: (one.first_row, one.first_column))]

    def _told(self, tile: Tile) -> Told:
        self._version += 1
        sum_levels, largest_levels = self._layer.sum_levels[tile.window], self._layer.largest_levels[tile.window]
        if self.corrections.knows(tile):
            sums, largest = self._layer.nats(tile.window)
            seen = self.corrections.corrected(tile, sums)
            # Of one look all that was seen is the largest; of several the largest has its share.
            share = np.where(sums > 0.0, largest / np.where(sums > 0.0, sums, 1.0), 1.0)
            sum_levels = to_levels(seen)
            largest_levels = to_levels(np.where(seen == sums, largest, share * seen))
        settled = np.zeros(sum_levels.shape, dtype=np.bool_)
        levels = sum_levels.copy(), largest_levels.copy()
        told = CoverageTile(self._version, tile.first_row, tile.first_column, *levels, settled)
        return Told(tile.name, told)
