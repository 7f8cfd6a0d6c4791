"""The fleet's map: every vehicle's newest tiles, joined.

A vehicle that is started anew begins a layer of its own, so that its layer is that of all its starts, each known by its
incarnation: their looks are looks as any others. Sums add and maxima take the maximum over starts and over vehicles; of
one start's tiles the newest version wins. So joining is commutative, associative and idempotent: lost, repeated, late
and reordered tiles converge to one map.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.risk import MOST_LEVELS, NATS_PER_LEVEL, LevelArray, residual_risk, risk_of_levels
from planner.tiles import tile_shape
from planner.types import EVERYWHERE, BoolArray, FloatArray, GridSpec, Window
from planner.windows import NOWHERE, around, shared, whole, within

PARTS = 16  # of a level: half of one is less than a thousandth of the residual risk
MOST_STARTS = 8  # that are told apart, of each tile
CLOSED = 2**31  # a version above all that are told: nothing newer is taken

Place = tuple[int, int]
"""A tile's first row and column."""


@dataclass
class VehicleLayer:
    """What one vehicle has published, over all its starts: levels and settled cells, all of grid shape; sums of its
    starts saturate as those of one do.

    `told`: the rows and columns of the grid that hold all tiles of which it has told, of a large fleet's area few.
    `versions`: of each tile, by incarnation, the newest version that has come. Memory does not grow with each start:
    of a tile of which more than MOST_STARTS starts have told, the oldest are held as one, whose version is CLOSED.
    What one of those has told counts on, and what comes of it later is not taken.
    """

    sum_levels: LevelArray
    largest_levels: LevelArray
    settled: BoolArray
    told: Window = NOWHERE
    versions: dict[Place, dict[int, int]] = field(default_factory=dict)
    _apart: dict[Place, dict[int, _Told]] = field(default_factory=dict)  # where more than one start has told

    @classmethod
    def empty(cls, grid: GridSpec) -> VehicleLayer:
        """That of a vehicle that has told of nothing yet."""
        return cls(
            sum_levels=np.zeros(grid.shape, dtype=np.uint8),
            largest_levels=np.zeros(grid.shape, dtype=np.uint8),
            settled=np.zeros(grid.shape, dtype=np.bool_),
        )

    def take(self, place: Place, window: Window, incarnation: int, tile: ToldTile) -> bool:
        """Takes a start's tile, whose cells are the window's; returns whether it was news."""
        if place not in self.versions:
            self.told = around(self.told, window)
        versions = self.versions.setdefault(place, {})
        oldest = min(versions, default=incarnation)
        if tile.version <= versions.get(incarnation, -1) or (incarnation < oldest and versions[oldest] == CLOSED):
            return False
        told: ToldTile | _Told = tile
        if len(versions) > (incarnation in versions):  # others have told of it, too
            told = self._with_other_starts(place, window, incarnation, tile)
        versions[incarnation] = tile.version
        if len(versions) > MOST_STARTS:
            self._hold_oldest_as_one(place)
        self.sum_levels[window] = told.sum_levels
        self.largest_levels[window] = told.largest_levels
        self.settled[window] = told.settled
        return True

    def _with_other_starts(self, place: Place, window: Window, incarnation: int, told: ToldTile) -> _Told:
        """What a start has told, now, joined with what the others have."""
        apart = self._apart.get(place)
        if apart is None:  # so far one alone has told of it
            (other,) = self.versions[place]
            before = _Told(self.sum_levels[window], self.largest_levels[window], self.settled[window])
            apart = self._apart[place] = {other: before.copy()}
        apart[incarnation] = _Told(told.sum_levels, told.largest_levels, told.settled).copy()
        return reduce(_Told.joined, apart.values())

    def _hold_oldest_as_one(self, place: Place) -> None:
        versions, apart = self.versions[place], self._apart[place]
        oldest, second = sorted(versions)[:2]
        apart[second] = apart.pop(oldest).joined(apart[second])
        del versions[oldest]
        versions[second] = CLOSED


@dataclass(frozen=True, eq=False)
class _Told:
    """What a start of a vehicle, or several together, have told of a tile."""

    sum_levels: LevelArray
    largest_levels: LevelArray
    settled: BoolArray

    def copy(self) -> _Told:
        return _Told(self.sum_levels.copy(), self.largest_levels.copy(), self.settled.copy())

    def joined(self, other: _Told) -> _Told:
        sums = np.minimum(self.sum_levels.astype(np.uint16) + other.sum_levels, MOST_LEVELS).astype(np.uint8)
        largest = np.maximum(self.largest_levels, other.largest_levels)
        return _Told(sums, largest, self.settled | other.settled)


class ToldTile(Protocol):
    """One of the grid's tiles, as its vehicle has told of it; the arrays have the shape of the tile."""

    @property
    def version(self) -> int:
        """Counts what the vehicle has told, within one incarnation."""

    @property
    def first_row(self) -> int:
        """The tile's first row in the grid."""

    @property
    def first_column(self) -> int:
        """Its first column."""

    @property
    def sum_levels(self) -> LevelArray:
        """The sum over the vehicle's looks."""

    @property
    def largest_levels(self) -> LevelArray:
        """The largest single look."""

    @property
    def settled(self) -> BoolArray:
        """Which cells are settled."""


class FleetMap:
    """Joins tiles as they come. `rho`: see `planner.risk.residual_risk`."""

    def __init__(self, grid: GridSpec, rho: float = 0.0) -> None:
        self.grid = grid
        self.rho = rho
        self.layers: dict[str, VehicleLayer] = {}
        self.changes = 0
        self._unseen: LevelArray = np.broadcast_to(np.uint8(0), grid.shape)  # takes no memory
        self._risk: FloatArray | None = None  # that of a large map is only held where it is asked for
        self._changed: dict[Place, Window] = {}  # windows of tiles that _risk does not tell yet

    @property
    def risk(self) -> FloatArray:
        """The fleet's residual risk, 1 where nobody has looked; shape `grid.shape`."""
        if self._risk is None:
            self._risk = np.ones(self.grid.shape)
        for place, window in self._changed.items():
            layers = [one for one in self.layers.values() if place in one.versions]  # the others tell nothing of it
            self._risk[window], _ = self._joined(window, layers)
        self._changed.clear()
        return self._risk

    def join(self, vehicle: str, incarnation: int, tile: ToldTile) -> bool:
        """Joins one tile, told by an incarnation of a vehicle; returns whether it was news.

        What is not one of the grid's tiles, whole and in its place, raises ValueError and changes nothing: pieces that
        overlap would make the map depend on the order in which they come.
        """
        place = (tile.first_row, tile.first_column)
        rows, columns = shape = tile_shape(self.grid, *place)
        if not tile.sum_levels.shape == tile.largest_levels.shape == tile.settled.shape == shape:
            told = f"{tile.sum_levels.shape}, {tile.largest_levels.shape} and {tile.settled.shape}"
            raise ValueError(f"the tile at {place[0]}, {place[1]} has {shape} cells, not {told}")
        layer = self.layers.get(vehicle)
        if layer is None:
            layer = self.layers[vehicle] = VehicleLayer.empty(self.grid)
        window = (slice(place[0], place[0] + rows), slice(place[1], place[1] + columns))
        if not layer.take(place, window, incarnation, tile):
            return False
        self._changed[place] = window
        self.changes += 1
        return True

    def nats_at(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """What all looks have seen where points of the mission frame lie, -ln(1 - P_d) summed over them, 0 beyond the
        grid; of the points' shape."""
        rows, columns = self.grid.cells_of(x_m, y_m)
        here = (rows >= 0) & (rows < self.grid.rows) & (columns >= 0) & (columns < self.grid.columns)
        nats = np.zeros(here.shape)
        for layer in self.layers.values():
            nats[here] += NATS_PER_LEVEL * layer.sum_levels[rows[here], columns[here]]
        return nats

    def seen(self) -> BoolArray:
        """Cells with at least one look by anyone."""
        seen = np.zeros(self.grid.shape, dtype=np.bool_)
        for layer in self.layers.values():
            seen |= layer.sum_levels > 0
        return seen

    def settled_by(self, vehicles: Iterable[str], window: Window = EVERYWHERE) -> BoolArray:
        """Cells of a window that one of these vehicles has declared settled."""
        settled: BoolArray = np.zeros(self._unseen[window].shape, dtype=np.bool_)
        layers = [self.layers[vehicle] for vehicle in vehicles if vehicle in self.layers]
        for layer, to, its in self._shared(window, layers):
            settled[to] |= layer.settled[its]
        return settled

    def sums(self, window: Window, vehicles: Iterable[str]) -> NDArray[np.unsignedinteger]:
        """Levels in a window of which these vehicles have told, summed over their looks."""
        return self._sums(window, [self.layers[vehicle] for vehicle in vehicles])

    def largest(self, window: Window) -> LevelArray:
        """The largest single look of all at each cell of a window, in levels."""
        return self._largest(window, self.layers.values())

    def risk_of_layers(self, layers: Iterable[VehicleLayer]) -> tuple[FloatArray, BoolArray]:
        """Residual risk, and which cells are seen, from these layers alone, of this map or as they once were."""
        risk, sums = self._joined(EVERYWHERE, list(layers))
        return risk, sums > 0

    def levels_within(self, window: Window, vehicles: Iterable[str]) -> tuple[NDArray[np.intp], FloatArray]:
        """Levels in a window of which these vehicles alone have told, and the residual risk of each level from 0 on:
        `risk` there, worked out anew, in a form that is quickly counted and coloured.

        With a `rho` above 0 levels count less the more of them tell the same; they are then in parts of a level.
        """
        layers = [self.layers[vehicle] for vehicle in vehicles]
        sums, largest = self._summed(window, layers)
        most = MOST_LEVELS * len(layers)
        if self.rho == 0.0:
            return sums.astype(np.intp), risk_of_levels(most)
        counting = self.rho * largest + (1.0 - self.rho) * sums
        return np.rint(PARTS * counting).astype(np.intp), risk_of_levels(most, PARTS)

    def _joined(self, window: Window, layers: Sequence[VehicleLayer]) -> tuple[FloatArray, NDArray[np.unsignedinteger]]:
        """Residual risk and summed levels from these layers."""
        sums, largest = self._summed(window, layers)
        return residual_risk(sums, largest, self.rho), sums

    def _summed(
        self, window: Window, layers: Sequence[VehicleLayer]
    ) -> tuple[NDArray[np.unsignedinteger], NDArray[np.unsignedinteger]]:
        """Sums and maxima of these layers' levels; without a `rho` the sums alone count, and stand for both."""
        sums = self._sums(window, layers)
        return sums, sums if self.rho == 0.0 else self._largest(window, layers)

    def _sums(self, window: Window, layers: Sequence[VehicleLayer]) -> NDArray[np.unsignedinteger]:
        sums = self._unseen[window].astype(np.min_scalar_type(MOST_LEVELS * len(layers)))
        for layer, to, its in self._shared(window, layers):
            sums[to] += layer.sum_levels[its]
        return sums

    def _largest(self, window: Window, layers: Iterable[VehicleLayer]) -> LevelArray:
        largest = self._unseen[window].copy()
        for layer, to, its in self._shared(window, layers):
            np.maximum(largest[to], layer.largest_levels[its], out=largest[to])
        return largest

    def _shared(self, window: Window, layers: Iterable[VehicleLayer]) -> Iterator[tuple[VehicleLayer, Window, Window]]:
        """The layers that may have told of some of a window, of a large fleet's few, and what that is, within the
        window and within the map."""
        window = whole(window, self.grid.shape)
        for layer in layers:
            its = shared(window, layer.told)
            if its is not None:
                yield layer, within(its, window), its
