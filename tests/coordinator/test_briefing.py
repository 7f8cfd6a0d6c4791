"""What an allocator is told helpers' time is worth, by hand."""

from __future__ import annotations

import pytest

from coordinator.briefing import Supply, worth_later_m2ps

# Rates of 40, 30 and 10; 200 s, 2 x 100 s and 300 s.
SUPPLIES = [Supply(3000, 100, 2), Supply(8000, 200, 1), Supply(3000, 300, 1)]


@pytest.mark.parametrize(
    ("helpers_s", "rate"), [(0, 40), (199, 40), (201, 30), (399, 30), (401, 10), (699, 10), (700, 0), (9000, 0)]
)
def test_it_is_the_rate_of_the_last_strip_there_is_time_for(helpers_s: float, rate: float) -> None:
    assert worth_later_m2ps(SUPPLIES, helpers_s) == pytest.approx(rate)


def test_with_nothing_to_do_time_is_worth_nothing() -> None:
    assert worth_later_m2ps([], 100) == 0
