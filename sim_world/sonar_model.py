"""What is asked of a sonar: its true P_d of one look, by range, bearing, altitude, place and time."""

from __future__ import annotations

from typing import Protocol

from planner.types import FloatArray

Position = tuple[FloatArray, FloatArray]
"""x and y, mission frame."""


class SonarModel(Protocol):
    """A sonar's true P_d."""

    def p_detect(
        self,
        range_m: FloatArray,
        look_bearing_rad: FloatArray | float,
        altitude_m: float,
        position_m: Position,
        time_s: float,
    ) -> FloatArray:
        """P_d in [0, 1) of what lies at `position_m` (mission frame, true), seen at the lateral range `range_m` >= 0
        along the compass bearing `look_bearing_rad` from `altitude_m` above the seabed at `time_s`. The arguments
        broadcast."""
