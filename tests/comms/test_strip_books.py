"""The strips as they stand when one coordinator comes after another."""

from __future__ import annotations

import pytest
from one_node import received

from comms.node import Received
from comms.said.messages import Message, MissionOver, StripState, StripStatus, Task, TaskAction
from comms.strip_books import GONE, StripBooks, state_in_words

LEFT = [state for state in StripState if not state.has_ended]
ENDED = [StripState.DONE, StripState.FAILED, StripState.WITHDRAWN]


def strip(number: int, state: StripState, t_s: float, incarnation: int = 0) -> Received:
    status = StripStatus(1, state, 10, 20, 0, 100, 30, 500, "helper", "as said", "why", foreseen=True)
    return said(f"coord/strip/{number}", status, t_s, incarnation)


def said(key: str, message: Message, t_s: float, incarnation: int = 0) -> Received:
    return received(key, message, sender="coordinator", sent_ms=round(t_s * 1000), incarnation=incarnation)


OVER = said("coord/mission_over", MissionOver(""), 50, 1)
TOLD_TO_GIVE_BACK = said("coord/task/helper/1", Task(TaskAction.GIVE_BACK, 1, 0, 0, 0, 0, 0), 50, 1)


def told(books: StripBooks, *messages: Received) -> list[tuple[float, int, StripState, str]]:
    words = [one for message in messages for one in books.hear(message)]
    return [(one.t_s, one.number, one.message.state, one.message.reason) for one in words]


@pytest.mark.parametrize("state", StripState)
def test_a_strip_stands_as_it_was_told(state: StripState) -> None:
    one = strip(3, state, 10)
    assert StripBooks().hear(one) == [one]


@pytest.mark.parametrize("first", [OVER, TOLD_TO_GIVE_BACK, strip(1001, StripState.OPEN, 50, 1)])
@pytest.mark.parametrize("state", LEFT)
def test_the_first_word_of_the_next_withdraws_what_is_left(state: StripState, first: Received) -> None:
    books = StripBooks()
    told(books, strip(1, StripState.OPEN, 10), strip(1, state, 20), strip(2, state, 30))
    told(books, *(strip(3 + number, ended, 40) for number, ended in enumerate(ENDED)))
    words = books.hear(first)
    assert [(one.number, one.t_s, one.message.state) for one in words[:2]] == [
        (1, 50, StripState.WITHDRAWN),
        (2, 50, StripState.WITHDRAWN),
    ]
    assert {(one.message.vehicle, one.message.reason, one.header.incarnation) for one in words[:2]} == {("", GONE, 1)}
    assert {(one.message.why, one.message.length_m, one.message.foreseen) for one in words[:2]} == {("why", 100, True)}
    assert words[2:] == ([first] if isinstance(first.message, StripStatus) else [])
    assert told(books, OVER) == []  # once


def test_what_the_one_before_has_said_and_comes_late_opens_nothing() -> None:
    books = StripBooks()
    told(books, strip(1, StripState.OPEN, 10), OVER)
    late = [strip(1, StripState.OFFERED, 45), strip(2, StripState.OPEN, 46), strip(1, StripState.DONE, 47)]
    assert told(books, *late) == [
        (45, 1, StripState.WITHDRAWN, GONE),
        (46, 2, StripState.WITHDRAWN, GONE),
        (47, 1, StripState.DONE, "as said"),
    ]


def test_one_that_goes_on_with_a_strip_has_it_open_again() -> None:
    books = StripBooks()
    told(books, strip(1, StripState.UNDER_WAY, 10))
    assert told(books, strip(1, StripState.OPEN, 50, 1)) == [
        (50, 1, StripState.WITHDRAWN, GONE),
        (50, 1, StripState.OPEN, "as said"),
    ]


@pytest.mark.parametrize(
    ("state", "reason", "words"),
    [
        (StripState.OPEN, "given back by helper", "open"),
        (StripState.OPEN, "left when the mission was over: nobody has served it", "left"),
        (StripState.UNDER_WAY, "as said", "under way"),
    ],
)
def test_a_strip_that_was_left_is_told_apart_from_one_that_is_open(state: StripState, reason: str, words: str) -> None:
    assert state_in_words(StripStatus(1, state, 10, 20, 0, 100, 30, 500, "", reason, "why", foreseen=True)) == words
