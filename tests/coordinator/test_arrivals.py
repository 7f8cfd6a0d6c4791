"""What has arrived of a vehicle's tiles and hotspots, beside what its states tell."""

from __future__ import annotations

import pytest

from comms.said.messages import AgentState, Mode
from coordinator.arrivals import Arrivals


def told(tiles: int = 0, hotspots: int = 0) -> AgentState:
    return AgentState(Mode.IDLE, 0, 1.0, 0, 0, 0, 0, tiles, hotspots)


@pytest.fixture
def arrivals() -> Arrivals:
    """Of two tiles versions 3 and 4 have come, of a hotspot revision 2."""
    arrivals = Arrivals()
    for version in (3, 1):
        arrivals.note_tile(0, "0-0", version)
    arrivals.note_tile(0, "0-1", 4)
    arrivals.note_hotspot(0, "1", 2)
    return arrivals


def test_all_is_there_when_the_newest_of_each_add_up_to_what_is_told(arrivals: Arrivals) -> None:
    assert not arrivals.lack(0, told(7, 2))
    assert arrivals.lack(0, told(8, 2))
    assert arrivals.lack(0, told(7, 3))
    arrivals.note_tile(0, "0-0", 5)
    assert not arrivals.lack(0, told(9, 2))


def test_what_was_replaced_need_not_come(arrivals: Arrivals) -> None:
    arrivals.note_tile(0, "0-1", 6)  # in version 5, which is lost, it was another
    assert not arrivals.lack(0, told(9, 2))


def test_nothing_is_missing_of_who_tells_of_nothing(arrivals: Arrivals) -> None:
    assert not arrivals.lack(0, told())
    assert not Arrivals().lack(0, told())
    assert Arrivals().lack(0, told(1))


def test_each_start_counts_for_itself(arrivals: Arrivals) -> None:
    assert arrivals.lack(1, told(2))
    arrivals.note_tile(1, "0-0", 2)
    assert not arrivals.lack(1, told(2))
    assert not arrivals.lack(0, told(8, 2))  # nobody can be asked for that any more
    arrivals.note_tile(0, "0-1", 9)
    assert not arrivals.lack(1, told(2))


def test_a_sum_is_counted_round_from_2_to_the_31(arrivals: Arrivals) -> None:
    arrivals.note_tile(0, "1-1", 2**31 - 1)
    assert not arrivals.lack(0, told(6, 2))
