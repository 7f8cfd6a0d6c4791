"""How well a sonar truly sees: what is asked of any, what it asks of the seabed, and the sonar whose P_d follows a
curve over range. What a user's own model answers is checked."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planner.risk import HIGHEST_P_DETECT
from planner.types import DetectionCurve, FloatArray

Position = tuple[FloatArray, FloatArray]
"""x and y, mission frame."""


class Seabed(Protocol):
    """The share of P_d that the seabed leaves."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """Factor in (0, 1] at mission-frame positions seen along a compass bearing; the arguments broadcast."""


class UniformSeabed:
    """A seabed that weakens nothing."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        """1 everywhere, in the arguments' common shape."""
        return np.ones(np.broadcast(x_m, y_m, bearing_rad).shape)


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
        """P_d, 0 to 0.999, of what lies at `position_m` (mission frame, true), seen at the range `range_m` >= 0 over
        the ground along the compass bearing `look_bearing_rad` from `altitude_m` above the seabed at `time_s`. The
        arguments broadcast, and the answer does to their common shape."""


class CurveSonar:
    """A sonar whose P_d is one curve over range, weakened by the seabed (paper, section III-B).

    The curve holds for the altitude that the vehicle keeps and for the whole mission: altitude and time change nothing.
    """

    def __init__(self, curve: DetectionCurve, seabed: Seabed) -> None:
        self._curve = curve
        self._seabed = seabed

    @property
    def minds_range_alone(self) -> bool:
        """Whether P_d is the same wherever it looks."""
        return type(self._seabed) is UniformSeabed

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


class CheckedSonar:
    """A sonar model of a user's own, whose answers are looked at before the world goes on with them: a NaN among them
    would only show as a map that nobody can explain. `vehicle` is whose sonar it is."""

    def __init__(self, model: SonarModel, vehicle: str) -> None:
        self._model = model
        kind = type(model)
        self._told = f"the sonar model of {vehicle}, {kind.__module__}:{kind.__qualname__},"

    def p_detect(
        self,
        range_m: FloatArray,
        look_bearing_rad: FloatArray | float,
        altitude_m: float,
        position_m: Position,
        time_s: float,
    ) -> FloatArray:
        """The model's answer, in the arguments' common shape. Raises ValueError, which names the model, where it is no
        array of P_d, or does not broadcast to that shape."""
        answer = self._model.p_detect(range_m, look_bearing_rad, altitude_m, position_m, time_s)
        try:
            p_detect = np.asarray(answer, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{self._told} must answer with an array of P_d, not {answer!r}") from error
        shape = np.broadcast_shapes(*(np.shape(one) for one in (range_m, look_bearing_rad, *position_m)))
        try:
            p_detect = np.broadcast_to(p_detect, shape)
        except ValueError as error:
            answered = f"{self._told} answers in the shape {p_detect.shape} to what has the shape {shape}"
            raise ValueError(answered) from error
        wrong = ~((p_detect >= 0.0) & (p_detect <= HIGHEST_P_DETECT))  # a NaN is not in order with any number
        if wrong.any():
            place_m, given = np.broadcast_to(range_m, shape)[wrong].flat[0], p_detect[wrong].flat[0]
            raise ValueError(
                f"{self._told} gives a P_d of {given} at a range of {place_m:g} m; must be 0 to {HIGHEST_P_DETECT}"
            )
        return p_detect
