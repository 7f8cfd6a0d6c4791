"""Kinds of targets: what each looks like, the mixtures that a world draws its targets from, and how much better or
worse than the common one each target is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.risk import HIGHEST_P_DETECT
from planner.types import FloatArray

SIZES = (0.8, 1.2)
"""Assumed: a target is so many times as large as its kind tells, at least and at most, in all directions alike."""
MOST_BURIED = 0.5
"""Assumed: of a target's height at least nothing and at most this share lies in the seabed."""


@dataclass(frozen=True)
class Kind:
    """What targets of a kind measure: `length_m` over the ground, `width_m` across that, None for a round one, and
    `height_m`. Of one that tapers upwards it is what it measures on average over its height."""

    length_m: float
    width_m: float | None
    height_m: float

    def shown_m(self, turned_rad: FloatArray) -> FloatArray:
        """How wide it shows itself to a sonar that looks along a bearing turned so far from its long side."""
        if self.width_m is None:
            return np.full_like(turned_rad, self.length_m)
        return self.length_m * np.abs(np.sin(turned_rad)) + self.width_m * np.abs(np.cos(turned_rad))

    @property
    def mean_shown_m(self) -> float:
        """The mean of that over all bearings."""
        return self.length_m if self.width_m is None else 2.0 / math.pi * (self.length_m + self.width_m)


CYLINDER = Kind(2.0, 0.6, 0.6)
"""A ground mine Mk 25, found in the Kanmon Strait in 2013, was reported to be 2 m long and 60 cm across."""
TRUNCATED_CONE = Kind(0.75, None, 0.5)
"""Assumed: 1 m across at its foot and 0.5 m on top."""
WEDGE = Kind(1.0, 0.8, 0.3)
"""Assumed, and taken for a box."""

ALIKE = "alike"
MIXTURES: dict[str, tuple[Kind, ...]] = {
    ALIKE: (),
    "mines": (CYLINDER, TRUNCATED_CONE, WEDGE),
    "cylinders": (CYLINDER,),
    "truncated_cones": (TRUNCATED_CONE,),
    "wedges": (WEDGE,),
}
"""By its name what a mixture holds, each kind as often; `alike` has none: all targets are seen as P_d says."""


class Kinds(Protocol):
    """What the targets of a world are."""

    def p_detect(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """The P_d of each target itself, for that of the common one in its place, seen along a compass bearing."""


class Alike:
    """All targets are the common one."""

    def p_detect(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """The same."""
        return p_detect


class Mixture:
    """Targets of several kinds, each of its own kind, size, orientation and burial.

    A target's relative strength for a look is the area that it shows above the seabed, its width across the look times
    its height, over the mean of that in the mixture: so its mean over all targets and bearings is 1. The chance that
    the look misses it is that of the common target to the power of it. That strength goes with the area is assumed.
    """

    def __init__(self, kinds: tuple[Kind, ...], count: int, generator: np.random.Generator) -> None:
        self._kinds = kinds
        self._kind = generator.integers(0, len(kinds), count)
        self._heading_rad = generator.uniform(0.0, 2.0 * math.pi, count)
        size = generator.uniform(*SIZES, count)
        left = 1.0 - generator.uniform(0.0, MOST_BURIED, count)
        height_m = np.array([one.height_m for one in kinds])[self._kind]
        low, high = SIZES
        mean_m2 = np.mean([one.height_m * one.mean_shown_m for one in kinds])
        mean_m2 *= (high**3 - low**3) / (3.0 * (high - low)) * (1.0 - MOST_BURIED / 2.0)
        self._per_m: FloatArray = height_m * size**2 * left / mean_m2

    def strength(self, numbers: NDArray[np.intp], bearing_rad: FloatArray) -> FloatArray:
        """Relative strengths of targets, each seen along a compass bearing, > 0."""
        turned_rad = bearing_rad - self._heading_rad[numbers]
        shown_m: FloatArray = np.choose(self._kind[numbers], [one.shown_m(turned_rad) for one in self._kinds])
        return self._per_m[numbers] * shown_m

    def p_detect(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """1 - (1 - P_d) ** strength, at most 0.999."""
        own = -np.expm1(np.log1p(-p_detect) * self.strength(numbers, bearing_rad))
        return np.minimum(own, HIGHEST_P_DETECT)


def make_kinds(mixture: str, count: int, generator: np.random.Generator) -> Kinds:
    """The targets of a named mixture."""
    kinds = MIXTURES[mixture]
    return Mixture(kinds, count, generator) if kinds else Alike()
