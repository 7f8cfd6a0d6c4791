"""The ledger: which changes a strip's state may make, and what each leaves behind."""

from __future__ import annotations

from itertools import product

import pytest
from by_hand import run_info
from coordinator_by_hand import PATIENCE
from hypothesis import given
from hypothesis import strategies as st
from one_node import received

from comms.said.messages import StripState
from coordinator.allocate.simple import NoAllocator
from coordinator.config import CoordinatorConfig
from coordinator.coordinator import Coordinator
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.ledger import TAKEN, WITH_A_VEHICLE, Ledger, StripRecord
from planner.types import Strip

OPEN, OFFERED, ACCEPTED, UNDER_WAY, DONE, FAILED, WITHDRAWN, NEXT = StripState
WINDOW = Window(0, 10, 0, 10)
CUT = Cut(WINDOW, 100, 100)
ALLOWED = {
    (OPEN, DONE),
    (OPEN, OFFERED),
    (OPEN, NEXT),
    (NEXT, ACCEPTED),
    (NEXT, UNDER_WAY),
    (NEXT, OPEN),
    (NEXT, DONE),
    (NEXT, FAILED),
    (OPEN, WITHDRAWN),
    (OFFERED, ACCEPTED),
    (OFFERED, UNDER_WAY),
    (OFFERED, OPEN),
    (OFFERED, DONE),
    (OFFERED, FAILED),
    (ACCEPTED, UNDER_WAY),
    (ACCEPTED, OPEN),
    (ACCEPTED, DONE),
    (ACCEPTED, FAILED),
    (UNDER_WAY, OPEN),
    (UNDER_WAY, DONE),
    (UNDER_WAY, FAILED),
}
WAYS_TO = {
    OPEN: [],
    OFFERED: [OFFERED],
    ACCEPTED: [OFFERED, ACCEPTED],
    UNDER_WAY: [OFFERED, ACCEPTED, UNDER_WAY],
    DONE: [OFFERED, DONE],
    FAILED: [OFFERED, FAILED],
    WITHDRAWN: [WITHDRAWN],
    NEXT: [NEXT],
}


def strip(number: int) -> Strip:
    return Strip(number, (0, 0), 0, 50, 50)


def opened(ledger: Ledger) -> StripRecord:
    return ledger.open(strip(ledger.next_number), CUT, 5, "badly seen")


def told(record: StripRecord) -> tuple[StripState, int, str, int, str]:
    return record.state, record.revision, record.vehicle, record.since_ms, record.reason


@pytest.mark.parametrize(("before", "after"), list(product(StripState, StripState)))
def test_every_change_is_allowed_or_leaves_everything_as_it_is(before: StripState, after: StripState) -> None:
    ledger = Ledger()
    record = opened(ledger)
    for state in WAYS_TO[before]:
        ledger.move(record, state, 10, "on the way", "alpha")
    was = told(record)
    assert was[0] is before
    if (before, after) in ALLOWED:
        ledger.move(record, after, 20, "because", "alpha")
        assert told(record) == (after, was[1] + 1, "" if after is OPEN else "alpha", 20, "because")
    else:
        with pytest.raises(ValueError, match=f"strip 1 cannot become {after.value}: it is {before.value}"):
            ledger.move(record, after, 20, "because", "alpha")
        assert told(record) == was


def test_a_vehicle_has_one_strip_at_most() -> None:
    ledger = Ledger()
    one, other = opened(ledger), opened(ledger)
    ledger.move(one, OFFERED, 10, "", "alpha")
    was = told(other)
    with pytest.raises(ValueError, match="strip 2 cannot become offered with alpha, which has strip 1"):
        ledger.move(other, OFFERED, 20, "", "alpha")
    assert told(other) == was
    assert ledger.strip_of("alpha") is one
    ledger.move(other, OFFERED, 20, "", "beta")
    ledger.move(one, ACCEPTED, 30, "", "alpha")
    assert (ledger.strip_of("alpha"), ledger.strip_of("beta")) == (one, other)
    ledger.move(one, DONE, 40, "", "alpha")
    ledger.leave(other, 40, "")
    assert (ledger.strip_of("alpha"), ledger.strip_of("beta")) == (None, None)
    ledger.move(other, OFFERED, 50, "", "alpha")
    assert ledger.strip_of("alpha") is other


def test_a_vehicle_has_one_next_strip_at_most_beside_its_present_one() -> None:
    ledger = Ledger()
    one, other, third = (opened(ledger) for _ in range(3))
    ledger.move(one, OFFERED, 10, "", "alpha")
    ledger.move(other, NEXT, 10, "", "alpha")
    assert (ledger.strip_of("alpha"), ledger.next_of("alpha"), ledger.next_of("beta")) == (one, other, None)
    with pytest.raises(ValueError, match="strip 3 cannot become next with alpha, which has strip 2"):
        ledger.move(third, NEXT, 20, "", "alpha")
    with pytest.raises(ValueError, match="strip 2 cannot become accepted with alpha, which has strip 1"):
        ledger.move(other, ACCEPTED, 20, "", "alpha")
    ledger.move(one, DONE, 30, "", "alpha")
    ledger.move(other, ACCEPTED, 30, "", "alpha")
    assert (ledger.strip_of("alpha"), ledger.next_of("alpha")) == (other, None)
    ledger.move(third, NEXT, 40, "", "alpha")
    assert ledger.next_of("alpha") is third


@pytest.mark.parametrize(
    ("before", "after", "vehicle", "why"),
    [
        ([], OFFERED, "", "offered with nobody"),
        ([], NEXT, "", "next with nobody"),
        ([NEXT], ACCEPTED, "beta", "accepted by beta: it is with alpha"),
        ([OFFERED], ACCEPTED, "", "accepted with nobody"),
        ([OFFERED], ACCEPTED, "beta", "accepted by beta: it is with alpha"),
        ([OFFERED, UNDER_WAY], DONE, "beta", "done by beta: it is with alpha"),
    ],
)
def test_a_strip_is_with_one_vehicle(before: list[StripState], after: StripState, vehicle: str, why: str) -> None:
    ledger = Ledger()
    record = opened(ledger)
    for state in before:
        ledger.move(record, state, 10, "", "alpha")
    was = told(record)
    with pytest.raises(ValueError, match=f"strip 1 cannot become {why}"):
        ledger.move(record, after, 20, "", vehicle)
    assert told(record) == was


def test_the_kinds_of_states_share_none_and_leave_out_open() -> None:
    assert {state for state in StripState if not state.has_ended} == {OPEN} | TAKEN
    assert {NEXT} == TAKEN - WITH_A_VEHICLE


def test_strips_are_numbered_from_1_and_never_taken_out() -> None:
    ledger = Ledger()
    records = [opened(ledger) for _ in range(3)]
    ledger.move(records[1], WITHDRAWN, 10, "seen well")
    assert [record.strip.number for record in ledger] == [1, 2, 3]
    assert ledger.next_number == 4
    assert ledger.get(2) is records[1]
    assert ledger.get(4) is None
    assert ledger.in_state(OPEN) == [records[0], records[2]]


@given(st.lists(st.tuples(st.integers(1, 4), st.sampled_from([None, *StripState]), st.integers(0, 2)), max_size=20))
def test_what_is_open_in_a_sector_is_told_whatever_became_of_it(
    changes: list[tuple[int, StripState | None, int]],
) -> None:
    ledger = Ledger(sector_of=lambda window: window.first_row)
    cuts = [Cut(Window(row, row + 1, 0, 10), 100, 100) for row in range(3)]
    for number, state, row in changes:
        record = ledger.get(number)
        if record is None:
            ledger.open(strip(ledger.next_number), cuts[row], 5, "badly seen")
        elif state is None and record.state is OPEN:
            ledger.revise(record, strip(number), cuts[row])
        elif state in WAYS_TO and (record.state, state) in ALLOWED:
            ledger.move(record, state, 10, "", record.vehicle or f"vehicle {number}")
        for sector in range(3):
            expected = [one for one in ledger.in_state(OPEN) if one.window.first_row == sector]
            assert ledger.open_in(sector) == expected


def test_numbers_may_begin_anywhere() -> None:
    ledger = Ledger(first_number=900_001)
    assert [opened(ledger).strip.number for _ in range(2)] == [900_001, 900_002]
    assert ledger.get(1) is None


@pytest.mark.parametrize("before", [OPEN, NEXT, OFFERED, ACCEPTED, UNDER_WAY])
def test_what_is_left_is_open_with_nobody_and_says_why(before: StripState) -> None:
    ledger = Ledger()
    record = opened(ledger)
    for state in WAYS_TO[before]:
        ledger.move(record, state, 10, "on the way", "alpha")
    revision = record.revision
    ledger.leave(record, 20, "it is over")
    left = (record.state, record.revision, record.vehicle, record.since_ms, record.reason)
    assert left == (OPEN, revision + 1, "", 20, "it is over")


@pytest.mark.parametrize("number", [1, 3, 0])
def test_a_number_is_given_once_and_in_order(number: int) -> None:
    ledger = Ledger()
    first = opened(ledger)
    with pytest.raises(ValueError, match="the next number is 2"):
        ledger.open(strip(number), CUT, 5, "")
    assert list(ledger) == [first]


def test_only_an_open_strip_is_revised() -> None:
    ledger = Ledger()
    record = opened(ledger)
    ledger.revise(record, Strip(1, (5, 5), 0, 60, 50), Cut(Window(1, 13, 0, 10), 120, 120))
    assert (record.strip.length_m, record.window.end_row, record.cut.removable_m2, record.revision) == (60, 13, 120, 2)
    ledger.move(record, OFFERED, 10, "", "alpha")
    with pytest.raises(ValueError, match="only an open one can be revised"):
        ledger.revise(record, strip(1), CUT)
    assert record.strip.length_m == 60


def test_a_revised_strip_keeps_its_number() -> None:
    ledger = Ledger()
    record = opened(ledger)
    with pytest.raises(ValueError, match="strip 1 cannot be revised as strip 2"):
        ledger.revise(record, strip(2), CUT)


@given(
    st.lists(st.tuples(st.sampled_from([1, 2, 3]), st.sampled_from(StripState), st.sampled_from(["", "alpha", "beta"])))
)
def test_whatever_is_asked_of_it_the_books_are_in_order(moves: list[tuple[int, StripState, str]]) -> None:
    ledger = Ledger()
    records = [opened(ledger) for _ in range(3)]
    for at_ms, (number, state, vehicle) in enumerate(moves):
        record = records[number - 1]
        was = told(record)
        try:
            ledger.move(record, state, at_ms, "", vehicle)
        except ValueError:
            assert told(record) == was
        else:
            assert not was[0].has_ended
        at_work = [one for one in records if one.state in WITH_A_VEHICLE]
        assert all(one.vehicle for one in at_work)
        assert len({one.vehicle for one in at_work}) == len(at_work)
        to_come = [one for one in records if one.state is NEXT]
        assert len({one.vehicle for one in to_come}) == len(to_come)
        for name in ("alpha", "beta"):
            assert ledger.strip_of(name) is next((one for one in at_work if one.vehicle == name), None)
            assert ledger.next_of(name) is next((one for one in to_come if one.vehicle == name), None)
        assert not any(one.vehicle for one in records if one.state is OPEN)


def test_a_coordinator_gives_numbers_from_a_thousand_for_each_second_on_that_it_was_started_after() -> None:
    node = Coordinator(CoordinatorConfig(NoAllocator(), 1.05, PATIENCE, 30, 400, 0.3, 0.2))
    node.start(7_900)
    node.on_message(received("run", run_info()), 8_000)
    assert node.ledger.next_number == 7001
