"""What helpers' time is worth, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from coordinator.cut.worth import RISK_STEP, Supply, worth_later_m2ps, worth_risk

# Rates of 40, 30 and 10; 200 s, 2 x 100 s and 300 s.
SUPPLIES = [Supply(3000, 100, 2), Supply(8000, 200, 1), Supply(3000, 300, 1)]


@pytest.mark.parametrize(
    ("helpers_s", "rate"), [(0, 40), (199, 40), (201, 30), (399, 30), (401, 10), (699, 10), (700, 0), (9000, 0)]
)
def test_it_is_the_rate_of_the_last_strip_there_is_time_for(helpers_s: float, rate: float) -> None:
    assert worth_later_m2ps(SUPPLIES, helpers_s) == pytest.approx(rate)


def test_with_nothing_to_do_time_is_worth_nothing() -> None:
    assert worth_later_m2ps([], 100) == 0


class TestWorthRisk:
    RISK = np.array([0.9, 0.62, 0.62, 0.41, 0.3, 0.12, 0.01])

    @pytest.mark.parametrize(
        ("cells", "worth"),
        [(0, 0.9), (1, 0.6), (2.9, 0.6), (3, 0.4), (4, 0.3), (5, 0.1), (6, 0.05), (7, 0.05), (99, 0.05)],
    )
    def test_it_is_the_risk_of_the_first_cell_there_is_no_time_for_in_steps(self, cells: float, worth: float) -> None:
        assert worth_risk(self.RISK, cells) == pytest.approx(worth)

    def test_where_nothing_is_left_it_is_the_least(self) -> None:
        assert worth_risk(np.array([]), 0) == RISK_STEP
