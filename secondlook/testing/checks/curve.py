"""What every detection curve has to keep to."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.types import DetectionCurve
from secondlook.scenario.plug_ins import CURVE
from secondlook.testing.checks.examples import PATIENCE_S, Checked
from sim_world.config import SensorConfig


def check_detection_curve(curve: Any, *, patience_s: float = PATIENCE_S) -> None:
    """Checks a detection curve, or a class or function that makes one when it is called without arguments.

    At least two ranges, ascending from 0 m or more; as many values of P_d from 0 to 0.999, not all of them 0; the same
    each time it is made; and made within `patience_s` of wall time. AssertionError tells the first that it does not
    keep to.
    """
    __tracebackhide__ = True
    if isinstance(curve, DetectionCurve):
        _check(curve, "the curve")
        return
    checked = Checked(CURVE, curve, patience_s)
    made: list[Any] = []
    checked.watched(lambda: made.extend(checked.make() for _ in range(2)))
    for one in made:
        if not isinstance(one, DetectionCurve):
            raise AssertionError(f"{checked.name} must make a planner.types.DetectionCurve, not {one!r}")
        _check(one, checked.name)
    first, second = made
    if not all(np.array_equal(getattr(first, name), getattr(second, name)) for name in ("range_m", "p_detect")):
        raise AssertionError(f"{checked.name} makes another curve each time")


def _check(curve: DetectionCurve, name: str) -> None:
    try:
        range_m, p_detect = (np.asarray(values, dtype=np.float64) for values in (curve.range_m, curve.p_detect))
        SensorConfig(DetectionCurve(range_m, p_detect))
    except (TypeError, ValueError) as error:
        raise AssertionError(f"{name}: {error}") from error
    if not p_detect.any():
        raise AssertionError(f"{name}: its values are 0 everywhere: nothing would ever be seen")
