"""A sonar whose true P_d follows a curve over lateral range, weakened by the seabed."""

from __future__ import annotations

import numpy as np

from planner.types import DetectionCurve, FloatArray
from sim_world.seabed import Seabed
from sim_world.sonar_model import Position


class CurveSonar:
    """A sonar whose P_d is one curve over lateral range, weakened by the seabed (paper, section III-B).

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
