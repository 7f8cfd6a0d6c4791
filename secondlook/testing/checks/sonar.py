"""What a sonar model and a detection curve must hold to."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from planner.risk import HIGHEST_P_DETECT
from planner.types import DetectionCurve, SonarShape
from secondlook.scenario.plug_ins import CURVE, SONAR
from secondlook.testing.checks.examples import EXAMPLES, PATIENCE_S, Checked
from sim_world.config import SeabedConfig, SensorConfig
from sim_world.footprints import FOOTPRINTS
from sim_world.seabed import make_seabed


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


_AREA = ((0.0, 0.0), (400.0, 0.0), (400.0, 300.0), (0.0, 300.0))
_SEABEDS = (SeabedConfig(), SeabedConfig("patchy", ripple_fields=3, vegetation_patches=5))
_CURVES = (
    DetectionCurve(np.array([0.0, 70.0, 145.0]), np.array([0.0, 0.5, 0.05])),
    DetectionCurve(np.array([0.0, 25.0]), np.array([0.999, 0.999])),
)


def check_sonar_model(sonar: Any, *, examples: int = EXAMPLES, patience_s: float = PATIENCE_S) -> None:
    """Checks a sonar model: a class, what else makes one, or its name in a scenario.

    For every look it gives P_d from 0 to 0.999, no NaN among them, in the shape to which what it is told broadcasts;
    the same question gives the same answer, whatever it was asked before; it leaves what it is told as it is; and it
    comes back, within `patience_s` of wall time. AssertionError tells the first that it does not keep to.
    """
    __tracebackhide__ = True
    checked = Checked(SONAR, sonar, patience_s)

    def check(curve: DetectionCurve, seabed: SeabedConfig, questions: list[tuple[Any, ...]]) -> None:
        given = {"curve": curve, "seabed": make_seabed(seabed, _AREA, seed=1)}
        veteran = checked.make(**given)
        for question in questions:
            answer = _answer(checked, veteran, question)
            for other in (veteran, checked.make(**given)):
                if not np.array_equal(_answer(checked, other, question), answer):
                    asked = "is asked again" if other is veteran else "was asked nothing else before"
                    raise AssertionError(f"{checked.name} answers otherwise when it {asked}")

    checked.against(
        check,
        examples,
        curve=st.sampled_from(_CURVES),
        seabed=st.sampled_from(_SEABEDS),
        questions=st.lists(_looks() | _targets(), min_size=1, max_size=3),
    )


def _answer(checked: Checked, plug_in: Any, question: tuple[Any, ...]) -> Any:
    range_m, bearing_rad, altitude_m, position_m, time_s = question
    arrays = (range_m, bearing_rad, *position_m)
    before = [np.array(one) for one in arrays]
    answer = checked.ask(plug_in, "p_detect", *question)
    told = f"{checked.name}, at {time_s:g} s from {altitude_m:g} m above the seabed,"
    if any(not np.array_equal(was, one) for was, one in zip(before, arrays, strict=True)):
        raise AssertionError(f"{told} has changed what it was given")
    shape = np.broadcast_shapes(*(np.shape(one) for one in arrays))
    try:
        p_detect = np.asarray(answer, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise AssertionError(f"{told} must answer with an array of P_d; {error}") from error
    try:
        p_detect = np.broadcast_to(p_detect, shape)
    except ValueError as error:
        answered = f"{told} answers in the shape {p_detect.shape} to what has the shape {shape}"
        raise AssertionError(answered) from error
    wrong = ~((p_detect >= 0.0) & (p_detect <= HIGHEST_P_DETECT))
    if wrong.any():
        place = np.broadcast_to(range_m, shape)[wrong].flat[0]
        given = p_detect[wrong].flat[0]
        raise AssertionError(
            f"{told} gives a P_d of {given} at a range of {place:g} m; must be 0 to {HIGHEST_P_DETECT}"
        )
    return p_detect


def _looks() -> st.SearchStrategy[tuple[Any, ...]]:
    """What the world asks for the cells of a look."""

    def question(
        kind: str, x_m: float, heading_rad: float, bins: int, range_bins: int, altitude_m: float, time_s: float
    ) -> Any:
        shape = SonarShape(kind, 0.0, 5.0 * (range_bins - 1), math.pi / 4)
        swath = FOOTPRINTS[kind].over(shape, (x_m, 50.0), heading_rad, 20.0, bins, (5.0, 5.0))
        seen = swath.along_m, swath.lateral_m
        return swath.range_m(*seen), swath.bearing_rad(*seen), altitude_m, swath.cell_centres(), time_s

    return st.builds(
        question,
        st.sampled_from(list(FOOTPRINTS)),
        st.sampled_from([-100.0, 0.0, 200.0]),
        st.sampled_from([0.0, 1.0, math.pi, 6.2]),
        st.integers(1, 4),
        st.integers(2, 30),
        st.sampled_from([1.0, 5.0, 15.0]),
        st.sampled_from([0.0, 12.5, 30_000.0]),
    )


def _targets() -> st.SearchStrategy[tuple[Any, ...]]:
    """What the world asks for the targets that a look passes over."""

    def question(count: int, altitude_m: float, time_s: float) -> Any:
        lateral_m = np.linspace(-140.0, 140.0, count)
        places = lateral_m + 200.0, np.full(count, 150.0)
        return np.abs(lateral_m), np.copysign(math.pi / 2, lateral_m), altitude_m, places, time_s

    times_s = st.sampled_from([0.0, 12.5, 30_000.0])
    return st.builds(question, st.sampled_from([1, 2, 9]), st.sampled_from([5.0, 15.0]), times_s)
