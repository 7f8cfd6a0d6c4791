"""Hidden strengths of targets: what the looks at one target have in common, so that what one has missed others miss.

A target hides by an exponential of mean 1, its strength E. A look that misses it with the chance q misses it if E is
above -c ln q, which has the chance q^c, and its own draw misses it, too, which has the chance q^(1-c). So q is the
chance of each look, and all of several looks miss it with the chance

    (min q)^c * product of q^(1-c),

the residual risk of `planner.risk.residual_risk` for rho = c. It is the copula of Cuadras and Auge, a special case of
the shocks of Marshall and Olkin.

Where aspects matter E hangs on the bearing t along which the target is seen. About it lies a ring of directions with an
independent exponential Z_k each, and E(t) is the least of Z_k / w_k(t) over those within a window about t, w_k(t) being
the share of the window that lies in direction k. Such a process is min-stable: each E(t) is an exponential of mean 1
again, and all of several looks miss it with the chance

    product of q^(1-c) * exp(c * sum over k of the least of w_k(t) ln q over the looks).

Two looks along one bearing share all, and the farther apart the bearings are the less, evenly down to nothing where
their windows have no direction in common. From behind a target is another than from before.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.types import FloatArray

DIRECTIONS = 360
"""In the ring."""


class Strengths(Protocol):
    """What the looks at each target have in common."""

    def chances(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """With which chance a look along compass bearings detects targets with these P_d, all of shape (n,), for whom
        their strengths are known: looks are independent then."""


class Unshared:
    """Looks have nothing in common."""

    def chances(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """P_d itself."""
        return p_detect


class Shared:
    """A strength for each of `count` targets, which their looks share as far as `correlation`, (0, 1], says.

    `aspect_rad`: how far apart the bearings of two looks are where they share nothing any more, more than two
    directions of the ring, up to pi; None where bearings do not matter.
    """

    def __init__(
        self, correlation: float, aspect_rad: float | None, count: int, generator: np.random.Generator
    ) -> None:
        self._correlation = correlation
        # Windows that begin and end within one direction have it in common: they are a direction narrower.
        self._window = None if aspect_rad is None else aspect_rad / (2.0 * math.pi) * DIRECTIONS - 1.0
        self._strengths = generator.standard_exponential((count, 1 if aspect_rad is None else DIRECTIONS))

    def chances(self, numbers: NDArray[np.intp], p_detect: FloatArray, bearing_rad: FloatArray) -> FloatArray:
        """1 where the strength does not hide the target, else what its own draw leaves the look."""
        nats = -np.log1p(-p_detect)
        hidden_up_to = (self._correlation * nats)[:, None] * self._shares(bearing_rad)
        hides = (self._strengths[numbers] > hidden_up_to).all(axis=1)
        return np.where(hides, -np.expm1((self._correlation - 1.0) * nats), 1.0)

    def _shares(self, bearing_rad: FloatArray) -> FloatArray:
        """Of the windows about bearings the share that lies in each direction, shape (n, directions)."""
        if self._window is None:
            return np.ones((bearing_rad.size, 1))
        begins = bearing_rad / (2.0 * math.pi) * DIRECTIONS - self._window / 2.0
        from_there = np.mod(np.arange(DIRECTIONS) - begins[:, None], DIRECTIONS)
        within = np.clip(self._window - from_there, 0.0, 1.0)
        within += np.clip(from_there - (DIRECTIONS - 1), 0.0, 1.0)  # the one in which the window begins
        return within / self._window


def make_strengths(
    correlation: float, aspect_rad: float | None, count: int, generator: np.random.Generator
) -> Strengths:
    """The strengths of so many targets; `correlation`: [0, 1]."""
    return Shared(correlation, aspect_rad, count, generator) if correlation > 0.0 else Unshared()
