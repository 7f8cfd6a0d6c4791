"""The sonar's P_d: the curve and the seabed by hand, and answers of a user's model that are refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.types import DetectionCurve, FloatArray
from sim_world.sonar import CheckedSonar, CurveSonar, Position, SufferedSeabed

RANGE_M = np.array([10.0, 20.0, 30.0])
PLACE: Position = (np.array([1.0, 2.0, 3.0]), np.zeros(3))


class HalfBeyond:
    """A seabed that leaves half of P_d at x of 2 m and more."""

    def factor(self, x_m: FloatArray, y_m: FloatArray, bearing_rad: FloatArray | float) -> FloatArray:
        return np.where(x_m < 2, 1.0, 0.5)


class Answers:
    def __init__(self, *values: float) -> None:
        self.values = np.array(values)

    def p_detect(self, *asked: object) -> FloatArray:
        return self.values


def test_it_is_the_curve_times_what_the_seabed_leaves() -> None:
    sonar = CurveSonar(DetectionCurve(np.array([0.0, 40.0]), np.array([0.8, 0.0])), HalfBeyond())
    assert sonar.p_detect(RANGE_M, 0.0, 15, PLACE, 0) == pytest.approx([0.6, 0.2, 0.1])


@pytest.mark.parametrize(("share", "left"), [(0.0, [1, 1, 1]), (0.4, [1, 0.8, 0.8]), (1.0, [1, 0.5, 0.5])])
def test_a_sonar_suffers_a_share_of_what_the_seabed_takes(share: float, left: list[float]) -> None:
    assert SufferedSeabed(HalfBeyond(), share).factor(*PLACE, 0.0) == pytest.approx(left)


def test_an_answer_in_order_is_passed_on() -> None:
    answer = CheckedSonar(Answers(0.0, 0.5, 0.999), "primary").p_detect(RANGE_M, 0.0, 15, PLACE, 0)
    assert answer.tolist() == [0.0, 0.5, 0.999]


@pytest.mark.parametrize(
    ("wrong", "told"), [(1.0, r"1\.0"), (0.9990001, r"0\.9990001"), (-0.01, "-0.01"), (float("nan"), "nan")]
)
def test_one_value_out_of_order_is_told_with_its_range(wrong: float, told: str) -> None:
    sonar = CheckedSonar(Answers(0.5, wrong, 0.5), "primary")
    with pytest.raises(ValueError, match=rf"Answers, gives a P_d of {told} at a range of 20 m; must be 0 to 0\.999$"):
        sonar.p_detect(RANGE_M, 0.0, 15, PLACE, 0)


@pytest.mark.parametrize("answer", ["seen", {"p_detect": 0.5}])
def test_an_answer_that_holds_no_numbers_is_refused(answer: object) -> None:
    class Tells:
        def p_detect(self, *asked: object) -> FloatArray:
            return answer  # type: ignore[return-value]

    with pytest.raises(ValueError, match=r"^the sonar model of primary, .* must answer with an array of P_d, not "):
        CheckedSonar(Tells(), "primary").p_detect(RANGE_M, 0.0, 15, PLACE, 0)


def test_an_answer_is_taken_for_all_that_share_it() -> None:
    bearing_rad = np.array([[0.0], [1.0]])
    answer = CheckedSonar(Answers(0.1, 0.5, 0.9), "primary").p_detect(RANGE_M, bearing_rad, 15, PLACE, 0)
    assert answer.tolist() == [[0.1, 0.5, 0.9]] * 2
    assert CheckedSonar(Answers(0.5), "primary").p_detect(RANGE_M, 0.0, 15, PLACE, 0).tolist() == [0.5] * 3


def test_an_answer_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^the sonar model of primary, .* answers in the shape \(2,\) .* \(3,\)$"):
        CheckedSonar(Answers(0.5, 0.5), "primary").p_detect(RANGE_M, 0.0, 15, PLACE, 0)
