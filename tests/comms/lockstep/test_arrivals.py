"""What arrives is counted, and who sends more than the clock can know of is named before memory is full."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import NodeError
from comms.lockstep.arrivals import MOST_AHEAD_BYTES, Arrivals
from comms.runner import OVERHEAD_BYTES

LARGE = 1 << 20
MOST = MOST_AHEAD_BYTES // (LARGE + OVERHEAD_BYTES)


def arrived(count: int, size: int) -> Arrivals:
    """So many messages of so many bytes have come of the world, and the clock has told of none."""
    arrivals = Arrivals("alpha")
    for _ in range(count):
        arrivals.add("world", size)
    return arrivals


def test_it_has_all_when_as_many_have_come_as_the_clock_tells_of() -> None:
    arrivals = Arrivals("alpha")
    assert arrivals.has_all({})
    arrivals.add("world", 40)
    assert arrivals.has_all({"world": 1, "beta": 0})
    assert not arrivals.has_all({"world": 1, "beta": 1})
    assert not arrivals.has_all({"world": 2})


def test_who_is_too_far_ahead_of_what_the_clock_tells_is_named() -> None:
    arrivals = arrived(MOST, LARGE)
    arrivals.add("beta", LARGE)
    with pytest.raises(NodeError, match=rf"^world floods alpha: {MOST + 1} messages have come of which the clock has"):
        arrivals.add("world", LARGE)


@pytest.mark.parametrize("size", [0, LARGE])
def test_small_messages_and_large_ones_are_too_many_alike(size: int) -> None:
    most = MOST_AHEAD_BYTES // (size + OVERHEAD_BYTES)
    arrivals = arrived(most, size)
    with pytest.raises(NodeError):
        arrivals.add("world", size)


@given(st.lists(st.integers(0, 5), max_size=60), st.data())
def test_who_says_no_more_than_the_clock_tells_of_a_little_later_says_it_for_ever(
    rounds: list[int], data: st.DataObject
) -> None:
    arrivals, said = Arrivals("alpha"), 0
    for count in rounds:
        told = {"world": said}  # what is said meanwhile may come before the word of what was said before
        early = data.draw(st.integers(0, count))
        for _ in range(early):
            arrivals.add("world", LARGE * 6)
        assert arrivals.has_all(told)
        arrivals.are_told(told)
        for _ in range(count - early):
            arrivals.add("world", LARGE * 6)
        said += count
    arrivals.are_told({"world": said})
    for _ in range(MOST):
        arrivals.add("world", LARGE)


def test_what_the_clock_has_told_of_frees_no_room_for_what_it_has_not() -> None:
    arrivals = Arrivals("alpha")
    for number in range(MOST - 1):  # two come for each that is told of
        arrivals.add("world", LARGE)
        arrivals.add("world", LARGE)
        arrivals.are_told({"world": number + 1})
    arrivals.add("world", LARGE)
    with pytest.raises(NodeError, match=r"^world floods alpha: "):
        arrivals.add("world", LARGE)
