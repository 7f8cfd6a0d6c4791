"""The ground that one look is of, cut into its cells: what all kinds of sonar have in common."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np

from planner.types import BoolArray, FloatArray, Point, SonarShape

SIDES = np.array([-1.0, 1.0])[:, None, None]
"""Port, then starboard, as the signs of the lateral range."""


@dataclass(frozen=True)
class Swath(ABC):
    """Cells to both sides of a straight track, mission frame; which of them are seen, and how, each kind says.

    The track starts at `origin_x_m`, `origin_y_m` and heads along `heading_rad`. The cells begin `first_along_m` down
    the track, where the stretch begins that the look stands for, in `bins` along-track bins of `along_bin_m`; each side
    has `range_bins` cells centred at whole multiples of `range_bin_m`. Arrays over the cells have shape
    (2, bins, range_bins), or one that broadcasts to it, side 0 being port. Places are told by how far they lie along
    the track, and to its side, negative to port.
    """

    origin_x_m: float
    origin_y_m: float
    heading_rad: float
    first_along_m: float
    along_bin_m: float
    bins: int
    range_bin_m: float
    range_bins: int
    shape: SonarShape

    @classmethod
    def over(
        cls,
        shape: SonarShape,
        origin: Point,
        heading_rad: float,
        first_along_m: float,
        stretch_bins: int,
        bins_m: tuple[float, float],
    ) -> Self:
        """The look over a stretch of track of so many bins. `bins_m`: along the track and over lateral range."""
        bins, range_bins = cls.bins_of(shape, stretch_bins, bins_m)
        return cls(*origin, heading_rad, first_along_m, bins_m[0], bins, bins_m[1], range_bins, shape)

    @staticmethod
    @abstractmethod
    def bins_of(shape: SonarShape, stretch_bins: int, bins_m: tuple[float, float]) -> tuple[int, int]:
        """How many bins a look has along the track, and how many to each side, for a stretch of so many bins."""

    @abstractmethod
    def sees(self, along_m: FloatArray, lateral_m: FloatArray) -> BoolArray:
        """Which places are seen."""

    def seen(self, p_detect: FloatArray) -> FloatArray:
        """P_d of the cells, 0 where they are not seen."""
        return np.where(self.sees(self.along_m, self.lateral_m), p_detect, 0.0)

    def askew(
        self, along_m: FloatArray, lateral_m: FloatArray, crab_rad: float, track_m: float
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Range and bearing of places for a vehicle that crabs, and whether it sees them from its track of `track_m` at
        all. `crab_rad`: how far its bow points off the track, to starboard above 0. Here it makes no difference."""
        return self.range_m(along_m, lateral_m), self.bearing_rad(along_m, lateral_m), np.array(True)

    @abstractmethod
    def seen_from_m(self, along_m: FloatArray) -> FloatArray:
        """How far down the track the vehicle is as it sees places that lie so far along it."""

    @abstractmethod
    def range_m(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """From how far they are seen."""

    @abstractmethod
    def bearing_rad(self, along_m: FloatArray, lateral_m: FloatArray) -> FloatArray:
        """Along which compass bearing they are seen."""

    @abstractmethod
    def area_m2(self, near_m: float, far_m: float) -> float:
        """How large the ground is that is seen from one range to another."""

    @abstractmethod
    def scattered(
        self, count: int, near_m: float, far_m: float, generator: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Places spread evenly over that ground, along and lateral, each of shape (count,)."""

    @property
    def end_along_m(self) -> float:
        """Where the cells end, down the track."""
        return self.first_along_m + self.bins * self.along_bin_m

    @property
    def reach_m(self) -> float:
        """Lateral range of the outermost cells' centres."""
        return (self.range_bins - 1) * self.range_bin_m

    @property
    def along_m(self) -> FloatArray:
        """How far down the track the cells' centres lie, shape (bins, 1); read-only."""
        return _along_m(self.first_along_m, self.bins, self.along_bin_m)

    @property
    def lateral_m(self) -> FloatArray:
        """How far to the side the cells' centres lie, shape (2, 1, range_bins); read-only."""
        return _lateral_m(self.range_bins, self.range_bin_m)

    def cell_centres(self) -> tuple[FloatArray, FloatArray]:
        """The x and y of the cells' centres."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        along, lateral = self.along_m, self.lateral_m
        return self.origin_x_m + along * sin + lateral * cos, self.origin_y_m + along * cos - lateral * sin

    def to_track(self, x_m: FloatArray, y_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mission-frame points as (along, lateral) of the track; lateral is negative to port."""
        sin, cos = math.sin(self.heading_rad), math.cos(self.heading_rad)
        dx, dy = x_m - self.origin_x_m, y_m - self.origin_y_m
        return dx * sin + dy * cos, dx * cos - dy * sin


@lru_cache(maxsize=256)  # the looks along a track begin where those along another do
def _along_m(first_along_m: float, bins: int, along_bin_m: float) -> FloatArray:
    along_m: FloatArray = first_along_m + (np.arange(bins, dtype=np.float64)[:, None] + 0.5) * along_bin_m
    along_m.setflags(write=False)
    return along_m


@lru_cache(maxsize=16)
def _lateral_m(range_bins: int, range_bin_m: float) -> FloatArray:
    lateral_m: FloatArray = SIDES * (np.arange(range_bins) * range_bin_m)
    lateral_m.setflags(write=False)
    return lateral_m
