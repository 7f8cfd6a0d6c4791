"""Messages come out of the window in the order of their sending, each once, none too early."""

from __future__ import annotations

from fleets import state
from hypothesis import given
from hypothesis import strategies as st

from comms.node import Received
from comms.said.codec import Header
from comms.said.topics import STATE
from comms.wall.seats import OrderWindow

WINDOW_MS = 50


def message(sender: str, sequence: int, sent_ms: int) -> Received:
    return Received(STATE.key(vehicle="alpha"), STATE, "alpha", Header(sender, 0, sequence, sent_ms), state())


@given(st.lists(st.tuples(st.integers(0, 300), st.sampled_from("ab"), st.integers(0, WINDOW_MS - 1)), max_size=40))
def test_what_is_late_by_less_than_the_window_comes_in_order(sent: list[tuple[int, str, int]]) -> None:
    messages = [message(sender, number, sent_ms) for number, (sent_ms, sender, _) in enumerate(sent)]
    arrivals = sorted(
        ((sent_ms + late_ms, number) for number, (sent_ms, _, late_ms) in enumerate(sent)), key=lambda one: one[0]
    )
    window, heard = OrderWindow(WINDOW_MS), []
    for at_ms, number in arrivals:
        heard += window.due(at_ms - 1)
        window.add(messages[number])
        heard += window.due(at_ms)
        assert all(one.header.sent_ms + WINDOW_MS <= at_ms for one in heard)
    heard += window.due(None)
    assert [one.header.order for one in heard] == sorted(one.header.order for one in messages)


def test_what_is_later_than_the_window_is_passed_on_at_once() -> None:
    window = OrderWindow(WINDOW_MS)
    window.add(message("a", 1, 200))
    assert window.due_ms == 250
    assert [one.header.sequence for one in window.due(250)] == [1]
    window.add(message("a", 0, 100))
    assert window.due_ms == 150
    assert [one.header.sequence for one in window.due(250)] == [0]
    assert window.due_ms is None
