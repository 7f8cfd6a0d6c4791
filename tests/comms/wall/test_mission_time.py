"""Mission time by time signals: never ahead of the clock's, never back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.wall.clock import SIGNALS_KEPT, MissionTime


def test_it_runs_by_the_factor_from_what_a_signal_tells() -> None:
    time = MissionTime()
    assert not time.known
    time.hear(2_000, 10.0, 100.0)
    assert time.known
    assert (time.now_ms(100.0), time.now_ms(101.5)) == (2_000, 17_000)
    assert time.local_s(22_000) == pytest.approx(102.0)


def test_the_signal_that_was_least_under_way_counts() -> None:
    time = MissionTime()
    time.hear(1_000, 10.0, 0.3)  # sent at 0.1 s, 0.2 s under way
    assert time.now_ms(1.0) == 8_000
    time.hear(5_000, 10.0, 0.51)  # sent at 0.5 s, 10 ms under way
    assert time.now_ms(1.0) == 9_900
    time.hear(9_000, 10.0, 1.5)
    assert time.now_ms(2.0) == 19_900


@given(
    st.floats(0.01, 1000.0),
    st.lists(st.tuples(st.floats(0.001, 2.0), st.floats(0.0, 0.5)), min_size=1, max_size=3 * SIGNALS_KEPT),
)
def test_it_never_goes_back_and_is_behind_by_the_latest_signals_way_at_most(
    factor: float, signals: list[tuple[float, float]]
) -> None:
    time = MissionTime()
    sent_s = heard_s = 0.0
    before_ms = 0
    for pause_s, under_way_s in signals:
        sent_s += pause_s
        heard_s = max(heard_s, sent_s + under_way_s)
        time.hear(sent_s * 1000 * factor, factor, heard_s)
        now_ms = time.now_ms(heard_s)
        assert now_ms >= before_ms
        assert (sent_s * 1000 * factor) - 1.001 <= now_ms <= heard_s * 1000 * factor + 0.001
        before_ms = now_ms


def test_it_does_not_go_back_when_all_signals_come_late() -> None:
    time = MissionTime()
    time.hear(0, 1.0, 0.0)
    told_ms = []
    for second in range(1, 2 * SIGNALS_KEPT):
        told_ms.append(time.now_ms(float(second)))
        time.hear(second * 1000 - 500, 1.0, float(second))  # half a second under way
        told_ms.append(time.now_ms(float(second)))
    assert told_ms == sorted(told_ms)
    assert told_ms[-1] == (2 * SIGNALS_KEPT - 1) * 1000 - 500


def test_a_local_clock_that_runs_fast_is_put_right_by_and_by() -> None:
    time = MissionTime()
    for second in range(3 * SIGNALS_KEPT):  # the local clock loses a millisecond each second
        time.hear(second * 1000, 1.0, second * 0.999)
    last_s = (3 * SIGNALS_KEPT - 1) * 0.999
    assert time.now_ms(last_s) == (3 * SIGNALS_KEPT - 1) * 1000
    fast = MissionTime()
    for second in range(3 * SIGNALS_KEPT):  # and here it gains one
        fast.hear(second * 1000, 1.0, second * 1.001)
    last_s = (3 * SIGNALS_KEPT - 1) * 1.001
    assert 0 <= fast.now_ms(last_s) - (3 * SIGNALS_KEPT - 1) * 1000 <= SIGNALS_KEPT
