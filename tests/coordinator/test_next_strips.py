"""Where the link is slow a helper is offered its next strip before it ends the present one: by hand, to its end, and
where a word is lost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER
from coordinator_by_hand import (
    ACCEPTED,
    DONE,
    ELSEWHERE,
    NEXT,
    OPEN,
    TWO_HELPERS,
    UNDER_WAY,
    WITHDRAWN,
    InTurn,
    Told,
    coordinator,
    looked,
)

from comms.said.announcement import RosterVehicle
from comms.said.messages import Mode, StripStatus, Task, TaskAction, TaskState
from coordinator.outbox import NO_STRIP, Outbox

AHEAD_MS = 60_000


def under_way(ahead_ms: int = AHEAD_MS, *, separation_m: float = 0.0) -> Told:
    """Strip 1 is under way until 201 s, strip 2 is open."""
    told = coordinator(ahead_ms=ahead_ms, separation_m=separation_m)
    told.hotspot()
    told.settle()
    told.status(HELPER, 1, TaskState.ACCEPTED)
    told.status(HELPER, 1, TaskState.UNDER_WAY)
    told.hotspot(ELSEWHERE, number=2)
    told.state(HELPER, Mode.REVISIT, 1, ends_ms=201_000)
    told.settle()
    return told


def with_a_next(separation_m: float = 0.0) -> Told:
    """Strip 2 is the helper's next: it was told so at 141 s, and has agreed."""
    told = under_way(separation_m=separation_m)
    told.keep_alive((PRIMARY, HELPER), 145)
    told.status(HELPER, 2, TaskState.NEXT)
    return told


def with_a_next_at_once(ends_ms: int, vehicles: tuple[RosterVehicle, ...] = FLEET, **settings: Any) -> Told:
    """Strip 1 is under way until so soon that strip 2 is offered as the next one; no answer has come."""
    told = coordinator(vehicles, ahead_ms=AHEAD_MS, **settings)
    told.hotspot()
    told.settle()
    told.status(HELPER, 1, TaskState.UNDER_WAY)
    told.hotspot(ELSEWHERE, number=2)
    told.state(HELPER, Mode.REVISIT, 1, ends_ms=ends_ms)
    told.settle()
    assert told.states() == {1: UNDER_WAY, 2: NEXT}
    return told


def test_it_is_offered_the_next_so_long_before_the_end_and_not_before() -> None:
    told = under_way()
    told.keep_alive((PRIMARY, HELPER), 139)
    assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]
    assert told.states() == {1: UNDER_WAY, 2: OPEN}
    told.keep_alive((PRIMARY, HELPER), 3)
    assert told.tasks()[1:] == [(HELPER, TaskAction.TAKE_NEXT, 2)]
    assert told.states() == {1: UNDER_WAY, 2: NEXT}
    assert (told.strips()[2].vehicle, told.strips()[2].reason) == (HELPER, f"offered to {HELPER} as its next")


def test_where_everybody_hears_everybody_it_waits_for_the_end() -> None:
    told = under_way(ahead_ms=0)
    told.keep_alive((PRIMARY, HELPER), 195)
    assert told.states() == {1: UNDER_WAY, 2: OPEN}


@pytest.mark.parametrize("separation_m", [0.0, 12.0])
def test_it_goes_on_from_one_to_the_other(separation_m: float) -> None:
    told = with_a_next(separation_m)
    told.keep_alive((PRIMARY, HELPER), 50)
    assert told.states() == {1: UNDER_WAY, 2: NEXT}  # it has agreed: no answer is waited for
    told.layer(HELPER, looked())
    told.status(HELPER, 1, TaskState.DONE)
    told.status(HELPER, 2, TaskState.ACCEPTED)
    told.state(HELPER, Mode.TRANSIT, 2)
    told.settle()
    assert told.states() == {1: DONE, 2: ACCEPTED}
    offers = [(action, strip) for _, action, strip in told.tasks() if strip]
    assert offers == [(TaskAction.TAKE, 1), (TaskAction.TAKE_NEXT, 2)]
    history = [one.message.state for one in told.node.said if isinstance(one.message, StripStatus) and one.number == 2]
    assert history == [OPEN, NEXT, ACCEPTED]


def test_one_that_is_not_answered_is_open_again_and_the_helper_keeps_the_present_one() -> None:
    told = under_way()
    told.keep_alive((PRIMARY, HELPER), 142)
    told.keep_alive((PRIMARY, HELPER), 10)
    history = [one.message for one in told.node.said if isinstance(one.message, StripStatus) and one.number == 2]
    assert [one.state for one in history[:3]] == [OPEN, NEXT, OPEN]
    assert history[2].reason == f"no answer from {HELPER}"
    assert told.states()[1] is UNDER_WAY


def test_a_late_answer_makes_it_the_next_after_all() -> None:
    told = with_a_next_at_once(30_000, allocator=InTurn(1, 2))
    told.node.wait(10.0)
    assert told.states() == {1: UNDER_WAY, 2: OPEN}
    told.status(HELPER, 2, TaskState.NEXT)
    assert told.states() == {1: UNDER_WAY, 2: NEXT}
    assert told.strips()[2].reason == f"{HELPER} does it next after all"


def test_one_that_is_not_its_next_any_more_it_is_to_give_back() -> None:
    told = with_a_next()
    told.status(HELPER, 7, TaskState.NEXT)
    assert told.tasks()[-1] == (HELPER, TaskAction.GIVE_BACK, 7)


@pytest.mark.parametrize(("seen", "state", "why"), [(True, DONE, "seen by"), (False, OPEN, "is at strip 2")])
def test_where_its_word_on_the_one_before_is_lost_the_map_tells(seen: bool, state: object, why: str) -> None:
    told = with_a_next()
    if seen:
        told.layer(HELPER, looked())
    told.state(HELPER, Mode.TRANSIT, 2)
    first = [one.message for one in told.node.said if isinstance(one.message, StripStatus) and one.number == 1][-1]
    assert first.state is state
    assert why in first.reason
    assert told.states()[2] is ACCEPTED


def test_who_is_lost_has_no_next() -> None:
    told = with_a_next()
    told.keep_alive((PRIMARY,), 31)
    assert told.states() == {1: OPEN, 2: OPEN}
    assert told.strips()[2].reason == f"{HELPER} is lost: nothing heard of it"


def test_who_is_silent_keeps_both_until_it_is_lost() -> None:
    told = with_a_next_at_once(30_000, lost_after_ms=90_000)
    told.status(HELPER, 2, TaskState.NEXT)
    told.keep_alive((PRIMARY,), 85)
    assert told.states() == {1: UNDER_WAY, 2: NEXT}
    told.keep_alive((PRIMARY,), 10)
    assert told.states() == {1: OPEN, 2: OPEN}
    assert told.strips()[2].reason == f"{HELPER} is lost: nothing heard of it"


def test_who_is_silent_is_offered_nothing() -> None:
    told = coordinator(lost_after_ms=90_000)
    told.keep_alive((PRIMARY,), 40)
    told.hotspot()
    told.keep_alive((PRIMARY,), 40)
    assert (told.states(), told.tasks()) == ({1: OPEN}, [])
    told.state(HELPER, Mode.IDLE)
    told.settle()
    assert told.tasks() == [(HELPER, TaskAction.TAKE, 1)]


def test_who_is_heard_again_before_it_is_lost_goes_on_as_it_was() -> None:
    told = with_a_next_at_once(30_000, lost_after_ms=90_000)
    told.status(HELPER, 2, TaskState.NEXT)
    told.keep_alive((PRIMARY,), 60)
    told.layer(HELPER, looked())
    told.status(HELPER, 1, TaskState.DONE)
    told.status(HELPER, 2, TaskState.UNDER_WAY)
    assert told.states() == {1: DONE, 2: UNDER_WAY}


def test_one_that_it_refuses_after_all_is_open() -> None:
    told = with_a_next()
    told.status(HELPER, 2, TaskState.REFUSED, "the battery does not last")
    assert told.states() == {1: UNDER_WAY, 2: OPEN}


def test_who_has_no_work_has_forgotten_what_it_was_to_do_next() -> None:
    told = with_a_next()
    told.layer(HELPER, looked())
    told.status(HELPER, 1, TaskState.DONE)
    told.state(HELPER, Mode.IDLE)
    told.state(HELPER, Mode.IDLE)
    assert "its word on it was lost" in told.strips()[2].reason
    assert told.states()[2] is OPEN


def test_with_the_present_strip_the_next_is_given_back() -> None:
    told = with_a_next_at_once(20_000, TWO_HELPERS)
    told.status(HELPER, 2, TaskState.NEXT)
    told.keep_alive((PRIMARY, HELPER), 400)  # it is late with the first, and is told to give it back
    assert (HELPER, TaskAction.GIVE_BACK, 1) in told.tasks()
    second = [one.message for one in told.node.said if isinstance(one.message, StripStatus) and one.number == 2]
    assert any(one.reason == f"{HELPER} is told to give strip 1 back" for one in second)


def test_who_is_to_tell_again_is_told_of_no_strip() -> None:
    outbox = Outbox()
    outbox.add_task(TaskAction.TELL_AGAIN, HELPER)
    assert [one.message for one in outbox.empty()] == [Task(TaskAction.TELL_AGAIN, 0, 0, 0, 0, 0, 0)]


def test_a_next_that_is_taken_back_in_the_moment_of_its_offer_is_not_offered() -> None:
    outbox, strip = Outbox(), replace(NO_STRIP, number=2)
    outbox.add_task(TaskAction.TAKE_NEXT, HELPER, strip)
    outbox.add_task(TaskAction.TAKE_NEXT, SECOND_HELPER, strip)
    outbox.add_task(TaskAction.GIVE_BACK, HELPER, strip)
    outbox.unsay_offer(HELPER, 2)
    said = [(one.key.split("/")[2], one.message.action) for one in outbox.empty() if isinstance(one.message, Task)]
    assert said == [(SECOND_HELPER, TaskAction.TAKE_NEXT), (HELPER, TaskAction.GIVE_BACK)]


def test_the_end_leaves_it() -> None:
    told = with_a_next()
    told.state(PRIMARY, Mode.FINISHED)
    told.keep_alive((HELPER,), 60)
    assert told.states()[2] in (OPEN, WITHDRAWN)
    assert told.strips()[2].vehicle == ""


def test_a_next_one_that_is_late_by_itself_is_asked_back_and_open_again() -> None:
    told = with_a_next_at_once(20_000, lost_after_ms=10_000_000)
    told.status(HELPER, 2, TaskState.NEXT)
    told.layer(HELPER, looked())
    told.status(HELPER, 1, TaskState.DONE)  # and from then on is not heard
    told.keep_alive((PRIMARY,), 600)
    second = [one.message for one in told.node.said if isinstance(one.message, StripStatus) and one.number == 2]
    assert (HELPER, TaskAction.GIVE_BACK, 2) in told.tasks()
    assert any(one.reason == f"{HELPER} is told to give strip 2 back" for one in second)


def test_who_is_at_its_next_has_left_the_other_done_where_words_and_looks_take_their_time() -> None:
    told = with_a_next_at_once(30_000, looks_within_ms=100_000)
    told.state(HELPER, Mode.TRANSIT, 2, ends_ms=90_000)
    told.settle()
    assert told.states() == {1: DONE, 2: ACCEPTED}
    assert told.strips()[1].reason == f"left by {HELPER}, which is at strip 2; its looks are to come"
    told.status(HELPER, 1, TaskState.DONE, at_ms=0)
    told.layer(HELPER, looked())
    told.keep_alive((PRIMARY, HELPER), 50)
    assert told.states() == {1: DONE, 2: ACCEPTED}
