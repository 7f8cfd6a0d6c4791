"""How well a sonar truly sees: what is asked of any, what it asks of the seabed, and the sonar whose P_d follows a
curve over range."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planner.types import DetectionCurve, FloatArray

Position = tuple[FloatArray, FloatArray]
"""x and y, mission frame."""


class Seabed(Protocol):
    """The share of P_d that the seabed leaves."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """Factor in (0, 1] at mission-frame positions seen along a compass bearing; the arguments broadcast."""


class SufferedSeabed:
    """A seabed as a sonar sees it that loses but a `share`, [0, 1], of what the seabed takes away."""

    def __init__(self, seabed: Seabed, share: float) -> None:
        self._seabed = seabed
        self._share = share

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """1 less that share of what is taken away, in the arguments' common shape."""
        return 1.0 - self._share * (1.0 - self._seabed.factor(x_m, y_m, bearing_rad))


class SonarModel(Protocol):
    """A sonar's true P_d, carried steadily: what turns and a current leave of it, `sim_world.steadiness` tells."""

    def p_detect(
        self,
        range_m: FloatArray,
        look_bearing_rad: FloatArray | float,
        altitude_m: float,
        position_m: Position,
        time_s: float,
    ) -> FloatArray:
        """P_d in [0, 1) of what lies at `position_m` (mission frame, true), seen at the range `range_m` >= 0 over the
        ground along the compass bearing `look_bearing_rad` from `altitude_m` above the seabed at `time_s`. The
        arguments broadcast."""


class CurveSonar:
    """A sonar whose P_d is one curve over range, weakened by the seabed (paper, section III-B).

    The curve holds for the altitude that the vehicle keeps and for the whole mission: altitude and time change nothing.
    """

    def __init__(self, curve: DetectionCurve, seabed: Seabed) -> None:
        self._curve = curve
        self._seabed = seabed

    def p_detect(
        self,
        range_m: FloatArray,
        look_bearing_rad: FloatArray | float,
        altitude_m: float,
        position_m: Position,
        time_s: float,
    ) -> FloatArray:
        """The curve at the range times the seabed's factor at the position."""
        return np.multiply(self._curve.at(range_m), self._seabed.factor(*position_m, look_bearing_rad))
