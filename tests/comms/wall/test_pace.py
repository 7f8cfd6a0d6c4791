"""Whether a machine keeps a factor, from what hosts say of how late they were."""

from __future__ import annotations

import pytest

from comms.wall.pace import Pace


def pace(factor: float = 100.0, may_be_late_s: float = 30.0) -> Pace:
    found = Pace(factor, may_be_late_s * 1000)
    found.begin(10.0)
    return found


def test_who_keeps_up_is_never_too_fast() -> None:
    one = pace()
    for second in range(1, 60):
        one.hear("world", 30_000, second * 100_000, 10.0 + second)
        assert one.too_fast(10.0 + second, at_end=True) == ""


def test_who_falls_behind_is_told_once_that_lasts_with_what_could_be_kept() -> None:
    one, told = pace(), dict[int, str]()
    for second in range(1, 8):  # half of what it should: 50 s of the mission in each second
        one.hear("helper", 0, second * 100_000, 10.0 + second)
        one.hear("world", second * 50_000, second * 100_000, 10.0 + second)
        told[second] = one.too_fast(10.0 + second)
    assert [second for second, sentence in told.items() if sentence] == [4, 5, 6, 7]
    assert told[4] == (
        "too fast for this machine: with --real-time 100 world is 200 s of the mission late, and 30 s are allowed; it "
        "could keep --real-time 40"
    )


def test_one_hiccup_is_forgiven() -> None:
    one = pace()
    for second in range(1, 100):
        one.hear("world", 80_000 if second in (40, 41) else 0, second * 100_000, 10.0 + second)
        assert one.too_fast(10.0 + second) == ""
    assert one.too_fast(109.0, at_end=True) == ""


def test_a_short_run_that_was_late_all_along_is_told_at_its_end() -> None:
    one = pace(1000.0)
    one.hear("world", 900_000, 1_000_000, 11.0)
    assert one.too_fast(11.0) == ""
    assert one.too_fast(11.0, at_end=True).endswith(
        "world is 900 s of the mission late, and 30 s are allowed; it could keep --real-time 80"
    )


@pytest.mark.parametrize("kept_ms", [0, 1])
def test_who_does_nothing_in_time_is_promised_nothing(kept_ms: int) -> None:
    one = pace()
    for second in range(1, 6):
        one.hear("world", second * 100_000 - kept_ms, second * 100_000, 10.0 + second)
    told = one.too_fast(15.0)
    assert ("could keep" in told) is (kept_ms > 0)


def test_before_the_mission_begins_nobody_is_late() -> None:
    one = Pace(10.0, 1000.0)
    one.hear("world", 5000, 6000, 3.0)
    assert one.too_fast(9.0, at_end=True) == ""
