"""The ledger: which changes a strip's state may make, and what each leaves behind."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.said.messages import StripState
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.ledger import ENDED, WITH_A_VEHICLE, Ledger, StripRecord
from planner.types import Strip

OPEN, OFFERED, ACCEPTED, UNDER_WAY, DONE, FAILED, WITHDRAWN = StripState
WINDOW = Window(0, 10, 0, 10)
CUT = Cut(WINDOW, 100, 100)
ALLOWED = {
    (OPEN, OFFERED),
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
}


def strip(number: int) -> Strip:
    return Strip(number, (0, 0), 0, 50, 50)


def opened(ledger: Ledger) -> StripRecord:
    return ledger.open(strip(ledger.next_number), CUT, 5, "badly seen")


@pytest.mark.parametrize(("before", "after"), list(product(StripState, StripState)))
def test_every_change_is_allowed_or_leaves_everything_as_it_is(before: StripState, after: StripState) -> None:
    ledger = Ledger()
    record = opened(ledger)
    for state in WAYS_TO[before]:
        assert ledger.move(record, state, 10, "on the way", "alpha")
    was = (record.state, record.revision, record.vehicle, record.since_ms, record.reason)
    assert was[0] is before
    moved = ledger.move(record, after, 20, "because", "beta")
    assert moved is ((before, after) in ALLOWED)
    if moved:
        vehicle = "" if after is OPEN else "beta"
        assert (record.state, record.revision, record.vehicle) == (after, was[1] + 1, vehicle)
        assert (record.since_ms, record.reason) == (20, "because")
    else:
        assert (record.state, record.revision, record.vehicle, record.since_ms, record.reason) == was


def test_the_kinds_of_states_share_none_and_leave_out_open() -> None:
    assert set(StripState) == {OPEN} | WITH_A_VEHICLE | ENDED
    assert not WITH_A_VEHICLE & ENDED


def test_strips_are_numbered_from_1_and_never_taken_out() -> None:
    ledger = Ledger()
    records = [opened(ledger) for _ in range(3)]
    ledger.move(records[1], WITHDRAWN, 10, "seen well")
    assert [record.strip.number for record in ledger] == [1, 2, 3]
    assert ledger.next_number == 4
    assert ledger.get(2) is records[1]
    assert ledger.get(4) is None
    assert ledger.in_state(OPEN) == [records[0], records[2]]


def test_numbers_may_begin_anywhere() -> None:
    ledger = Ledger(first_number=900_001)
    assert [opened(ledger).strip.number for _ in range(2)] == [900_001, 900_002]
    assert ledger.get(1) is None


@pytest.mark.parametrize("before", [OPEN, OFFERED, ACCEPTED, UNDER_WAY])
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


@given(st.lists(st.sampled_from(StripState), max_size=30))
def test_a_strip_with_a_vehicle_names_it_and_the_end_is_the_end(states: list[StripState]) -> None:
    ledger = Ledger()
    record = opened(ledger)
    for at_ms, state in enumerate(states):
        ended = record.state in ENDED
        moved = ledger.move(record, state, at_ms, "", "alpha")
        assert not (ended and moved)
        assert (record.vehicle == "alpha") if record.state in WITH_A_VEHICLE else True
        assert record.vehicle == "" or record.state is not OPEN
