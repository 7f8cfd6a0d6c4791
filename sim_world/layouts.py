"""Where targets lie: spread evenly, in the rows of a minefield, in clusters, or at given places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import shapely

from planner.types import FloatArray, Point
from sim_world.area import MOST_BATCHES, Ground
from sim_world.channel_config import require

FARTHEST_APART_M = 1e5


class Layout(Protocol):
    """How targets are laid; whatever is out of its range raises ValueError with the field's name."""

    def places(self, ground: Ground, count: int, generator: np.random.Generator) -> FloatArray:
        """So many places in the ground, mission frame, shape (count, 2)."""


@dataclass(frozen=True)
class Uniform:
    """Spread evenly and independently."""

    def places(self, ground: Ground, count: int, generator: np.random.Generator) -> FloatArray:
        """Uniformly distributed."""
        return ground.uniform_points(count, generator)


@dataclass(frozen=True)
class Lines:
    """Rows along the compass heading `heading_rad`, `rows_apart_m` from each other, over the whole ground. In all rows
    together targets lie evenly, and each off its place by a normal error with the standard deviation `jitter_m` to the
    east and to the north. Where the first row and the first target lie is drawn."""

    heading_rad: float = 0.0
    rows_apart_m: float = 100.0
    jitter_m: float = 0.0

    def __post_init__(self) -> None:
        require(-7.0 <= self.heading_rad <= 7.0, "heading_rad", self.heading_rad, "-7 to 7")
        require(1.0 <= self.rows_apart_m <= FARTHEST_APART_M, "rows_apart_m", self.rows_apart_m, "1 to 100000 m")
        require(0.0 <= self.jitter_m <= FARTHEST_APART_M, "jitter_m", self.jitter_m, "0 to 100000 m")

    def places(self, ground: Ground, count: int, generator: np.random.Generator) -> FloatArray:
        """The places in their rows, each as far off as is drawn for it, drawn again where that is not in the ground.

        Rows are drawn again where none passes over the ground; raises ValueError where that happens every time.
        """
        along, across = _axes(self.heading_rad)
        drawn = (self._pieces(ground, generator) for _ in range(MOST_BATCHES))
        pieces = next((one for one in drawn if one.size), None)
        if pieces is None:
            raise ValueError("no row of targets passes over the ground")
        row_m, begins_m, ends_m = pieces.T
        until_m = np.cumsum(ends_m - begins_m)
        at_m = (np.arange(count) + generator.random()) * (until_m[-1] / max(count, 1))
        piece = np.searchsorted(until_m, at_m, side="right").clip(max=row_m.size - 1)
        along_m = ends_m[piece] - (until_m[piece] - at_m)
        rows = along_m[:, None] * along + row_m[piece, None] * across
        found, outside = rows.copy(), np.ones(count, dtype=np.bool_)
        for _ in range(MOST_BATCHES):
            found[outside] = rows[outside] + self.jitter_m * generator.standard_normal((int(outside.sum()), 2))
            outside = ~ground.holds(found)
            if not outside.any():
                break
        laid: FloatArray = np.where(outside[:, None], rows, found)
        return laid

    def _pieces(self, ground: Ground, generator: np.random.Generator) -> FloatArray:
        """What of the rows lies in the ground, row by row: how far across the heading each piece lies, and from where
        to where along it, shape (pieces, 3)."""
        along, across = _axes(self.heading_rad)
        corners = np.asarray(ground.outline)
        (south_m, north_m), (west_m, east_m) = (
            (float((corners @ axis).min()), float((corners @ axis).max())) for axis in (along, across)
        )
        first_m = west_m + generator.random() * min(self.rows_apart_m, east_m - west_m)
        found = []
        for row_m in np.arange(first_m, east_m, self.rows_apart_m).tolist():
            row = shapely.LineString([row_m * across + south_m * along, row_m * across + north_m * along])
            parts = shapely.get_parts(shapely.intersection(row, ground.polygon))
            ends_m = [sorted((shapely.get_coordinates(one) @ along).tolist()) for one in parts if shapely.length(one)]
            found += sorted((row_m, one[0], one[-1]) for one in ends_m)
        return np.array(found).reshape(-1, 3)


@dataclass(frozen=True)
class Clusters:
    """`count` clusters, whose middles are uniformly distributed. Each target lies in one of them, drawn at random, off
    its middle by a normal error with the standard deviation `spread_m` to the east and to the north."""

    count: int = 5
    spread_m: float = 50.0

    def __post_init__(self) -> None:
        require(1 <= self.count <= 1000, "count", self.count, "1 to 1000")
        require(0.1 <= self.spread_m <= FARTHEST_APART_M, "spread_m", self.spread_m, "0.1 to 100000 m")

    def places(self, ground: Ground, count: int, generator: np.random.Generator) -> FloatArray:
        """What of the clusters lies in the ground; evenly there, where they are so wide that next to nothing does."""
        middles = ground.uniform_points(self.count, generator)

        def draw(batch: int) -> FloatArray:
            chosen = middles[generator.integers(0, self.count, batch)]
            found: FloatArray = chosen + self.spread_m * generator.standard_normal((batch, 2))
            return found

        try:
            return ground.points(count, draw)
        except ValueError:
            return ground.uniform_points(count, generator)


@dataclass(frozen=True)
class Given:
    """Places that are given, mission frame."""

    places_m: tuple[Point, ...]

    def places(self, ground: Ground, count: int, generator: np.random.Generator) -> FloatArray:
        """Those, whatever the ground."""
        return np.array(self.places_m, dtype=np.float64).reshape(-1, 2)


def _axes(heading_rad: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors along a compass heading, and to the right of it."""
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    return np.array([sin, cos]), np.array([cos, -sin])
