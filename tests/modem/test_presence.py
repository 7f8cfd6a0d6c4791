"""Where a vehicle is taken to be between its states, worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from modems import RUN_INFO, config_of

from comms.said.announcement import Role
from comms.said.messages import AgentState, Mode, TaskState, TaskStatus
from modem.presence import ASTRAY_M, REPORT_MS, Presence, seldom_ms
from planner.types import Strip

ALPHA, BETA = RUN_INFO.vehicles  # 1.5 and 2 m/s
SURVEYING = AgentState(Mode.SURVEY, 3, 0.9, 100_000, 100.0, 50.0, math.pi / 2)
IDLE = AgentState(Mode.IDLE, 0, 0.9, 0, 100.0, 0.0, 0.0)
NORTH = Strip(7, (100.0, 40.0), 0.0, 200.0, 50.0)
SELDOM_MS = 150_000


def place(presence: Presence, now_ms: int) -> tuple[float, float]:
    """Where it is taken to be."""
    state = presence.at(now_ms)
    assert state is not None
    return state.x_m, state.y_m


def status(state: TaskState, strip: int = 7) -> TaskStatus:
    return TaskStatus(strip, state, 0, "")


def test_on_a_track_it_goes_straight_on_until_that_ends() -> None:
    presence = Presence(ALPHA)
    assert presence.at(0) is None
    presence.hear_state(SURVEYING, 0, 60_000)
    assert place(presence, 60_000) == (100.0, 50.0)
    assert place(presence, 80_000) == pytest.approx((130.0, 50.0))
    assert place(presence, 500_000) == pytest.approx((160.0, 50.0))
    presence.hear_state(replace(SURVEYING, mode=Mode.TRANSIT), 0, 70_000)
    assert place(presence, 500_000) == (100.0, 50.0)


def test_a_primary_started_anew_goes_to_a_track_and_not_to_the_strip_of_that_number() -> None:
    presence = Presence(replace(ALPHA, role=Role.SURVEY_REVISIT))
    presence.strips[7] = NORTH
    north = replace(IDLE, heading_rad=0.0)
    to_seven = replace(north, mode=Mode.TRANSIT, works_on=7)
    presence.hear_state(to_seven, 0, 0)
    assert place(presence, 20_000) == (100.0, 0.0)
    presence.hear_state(replace(north, mode=Mode.FINISHED), 0, 20_000)
    presence.hear_state(to_seven, 0, 30_000)  # and now it is on its way to the strip
    assert math.dist(place(presence, 40_000), (100.0, 0.0)) == pytest.approx(15.0, abs=1.0)
    for said_ms in (60_000, 80_000):
        presence.hear_state(to_seven, 1, said_ms)
        assert place(presence, said_ms + 10_000) == (100.0, 0.0)
    assert presence.hear_status(status(TaskState.ACCEPTED, strip=8), 100_000)  # it has surveyed since
    presence.hear_state(to_seven, 1, 110_000)
    assert math.dist(place(presence, 120_000), (100.0, 0.0)) == pytest.approx(15.0, abs=1.0)


@pytest.mark.parametrize("state_first", [True, False])
def test_a_primary_that_accepts_a_strip_has_surveyed_though_its_end_was_not_heard(state_first: bool) -> None:
    presence, state = Presence(replace(ALPHA, role=Role.SURVEY_REVISIT)), replace(IDLE, heading_rad=0.0)
    presence.strips[7] = NORTH
    to_seven, accepted = replace(state, mode=Mode.TRANSIT, works_on=7), status(TaskState.ACCEPTED)
    if state_first:
        presence.hear_state(to_seven, 0, 0)
    presence.hear_status(accepted, 1000)
    presence.hear_state(to_seven, 0, 30_000)
    assert math.dist(place(presence, 40_000), (100.0, 0.0)) == pytest.approx(15.0, abs=1.0)


def test_a_strip_that_is_asked_back_of_a_primary_started_anew_says_nothing_of_its_track() -> None:
    presence = Presence(replace(ALPHA, role=Role.SURVEY_REVISIT))
    presence.hear_state(replace(SURVEYING, works_on=7), 1, 0)
    assert not presence.hear_status(status(TaskState.GIVEN_BACK), 1000)
    known = presence.at(2000)
    assert known is not None
    assert (known.mode, known.works_on) == (Mode.SURVEY, 7)


def test_over_a_strip_it_goes_as_it_was_given() -> None:
    presence = Presence(BETA)
    presence.strips[7] = NORTH
    presence.hear_state(IDLE, 0, 0)
    assert presence.hear_status(status(TaskState.ACCEPTED), 10_000)
    assert not presence.hear_status(status(TaskState.ACCEPTED), 15_000)
    going = presence.at(20_000)
    assert going is not None
    assert (going.mode, going.works_on) == (Mode.TRANSIT, 7)
    assert place(presence, 20_000) == pytest.approx((100.0, 20.0))
    assert place(presence, 29_000) == pytest.approx((100.0, 38.0))  # on its run-in
    on_strip = presence.at(60_000)  # before it says so
    assert on_strip is not None
    assert (on_strip.mode, on_strip.works_on) == (Mode.REVISIT, 7)
    assert place(presence, 60_000) == pytest.approx((100.0, 100.0))
    # 30 m to the run-in, and with run-in and run-out 220 m, at 2 m/s.
    assert going.expected_end_ms == pytest.approx(10_000 + 125_000, abs=100)
    presence.hear_status(status(TaskState.UNDER_WAY), 40_000)
    assert place(presence, 40_000) == pytest.approx((100.0, 40.0))
    assert place(presence, 90_000) == pytest.approx((100.0, 140.0))
    assert not presence.hear_status(status(TaskState.UNDER_WAY), 90_000)  # said again: it does not begin again
    assert not presence.hear_status(status(TaskState.NEXT, 8), 90_000)
    assert place(presence, 90_000) == pytest.approx((100.0, 140.0))
    assert place(presence, 500_000) == pytest.approx((100.0, 240.0))
    presence.hear_status(status(TaskState.DONE), 150_000)
    done = presence.at(150_000)
    assert done is not None
    assert (done.mode, done.works_on, done.expected_end_ms) == (Mode.IDLE, 0, 0)
    assert place(presence, 150_000) == pytest.approx((100.0, 250.0))


def test_a_late_word_that_it_is_under_way_tells_by_its_end_since_when() -> None:
    presence, under_way = Presence(BETA), replace(status(TaskState.UNDER_WAY), ends_ms=141_000)
    presence.strips[7] = NORTH
    presence.hear_state(IDLE, 0, 0)
    presence.hear_status(status(TaskState.ACCEPTED), 10_000)
    presence.hear_status(under_way, 95_000)
    assert place(presence, 95_000) == pytest.approx((100.0, 148.0))  # 200 m take 100 s, so 54 s of them have passed
    there = presence.at(95_000)
    assert there is not None
    assert there.expected_end_ms == 141_000
    adrift = Presence(replace(BETA, drift_mps=0.2))  # which flies them in another time
    adrift.strips[7] = NORTH
    adrift.hear_state(IDLE, 0, 0)
    adrift.hear_status(replace(status(TaskState.ACCEPTED), ends_ms=150_000), 10_000)
    going = adrift.at(10_000)
    assert going is not None
    assert going.expected_end_ms == 150_000
    adrift.hear_status(under_way, 95_000)
    assert place(adrift, 95_000) == pytest.approx((100.0, 40.0))
    slow = Presence(BETA)
    slow.strips[7] = NORTH
    slow.hear_state(IDLE, 0, 0)
    slow.hear_status(status(TaskState.ACCEPTED), 10_000)
    slow.hear_status(replace(under_way, ends_ms=400_000), 95_000)  # it has not begun later than it says so
    assert place(slow, 95_000) == pytest.approx((100.0, 40.0))
    assert place(slow, 105_000) == pytest.approx((100.0, 60.0))


def test_it_goes_to_a_strip_from_where_it_says_that_it_is() -> None:
    presence = Presence(BETA)
    presence.strips[7] = NORTH
    presence.hear_state(replace(IDLE, mode=Mode.TRANSIT, works_on=7, y_m=10.0), 0, 10_000)
    assert place(presence, 15_000) == pytest.approx((100.0, 20.0))
    presence.hear_state(replace(IDLE, mode=Mode.TRANSIT, works_on=7, x_m=120.0), 0, 20_000)  # it is elsewhere
    assert place(presence, 20_000) == (120.0, 0.0)
    assert place(presence, 900_000) == pytest.approx((100.0, 240.0))
    presence.hear_state(replace(IDLE, mode=Mode.TRANSIT, works_on=8), 0, 30_000)  # a strip that nobody gave it here
    assert place(presence, 90_000) == (100.0, 0.0)


def test_where_words_do_not_tell_when_it_stands_still_until_it_is_heard_to_have_begun() -> None:
    presence = Presence(BETA, reckons_ways=False)
    presence.strips[7] = NORTH
    presence.hear_state(IDLE, 0, 0)
    presence.hear_status(status(TaskState.ACCEPTED), 10_000)
    going = presence.at(60_000)
    assert going is not None
    assert (going.mode, place(presence, 60_000)) == (Mode.TRANSIT, (100.0, 0.0))
    presence.hear_status(status(TaskState.UNDER_WAY), 60_000)
    assert place(presence, 70_000) == pytest.approx((100.0, 60.0))


def test_a_word_on_another_strip_changes_nothing() -> None:
    presence = Presence(BETA)
    presence.hear_state(replace(IDLE, mode=Mode.REVISIT, works_on=7), 0, 0)
    before = presence.at(0)
    for state, strip in (
        (TaskState.REFUSED, 8),
        (TaskState.GIVEN_BACK, 8),
        (TaskState.DONE, 8),
        (TaskState.REFUSED, 7),
    ):
        presence.hear_status(status(state, strip), 10_000)
        assert presence.at(10_000) == before


def test_who_goes_home_is_not_taken_to_work() -> None:
    presence = Presence(BETA)
    presence.hear_state(replace(IDLE, mode=Mode.RETURNING), 0, 0)
    presence.hear_status(status(TaskState.ACCEPTED), 10_000)
    assert presence.at(10_000) == replace(IDLE, mode=Mode.RETURNING)


@pytest.mark.parametrize(
    ("state", "incarnation", "now_ms", "is_news"),
    [
        (IDLE, 0, 20_000, False),
        (replace(IDLE, x_m=100.0 + ASTRAY_M), 0, 20_000, False),
        (replace(IDLE, x_m=101.0 + ASTRAY_M), 0, 20_000, True),
        (replace(IDLE, mode=Mode.RETURNING), 0, 20_000, True),
        (replace(IDLE, battery=0.1), 0, 20_000, False),
        (IDLE, 1, 20_000, True),
        (IDLE, 0, SELDOM_MS - 1, False),
        (IDLE, 0, SELDOM_MS, True),
    ],
)
def test_what_is_news(state: AgentState, incarnation: int, now_ms: int, is_news: bool) -> None:
    presence = Presence(BETA)
    assert presence.is_news(state, incarnation, 0, SELDOM_MS)
    presence.hear_state(IDLE, 0, 0)
    assert presence.is_news(state, incarnation, now_ms, SELDOM_MS) == is_news
    assert presence.is_news(state, incarnation, now_ms, REPORT_MS)


def test_states_take_a_tenth_of_what_a_slot_carries_at_most() -> None:
    cycle_ms = 3 * 4000
    assert seldom_ms(config_of("beta", frames=6)) == REPORT_MS
    assert seldom_ms(config_of("beta", frame_bits=256)) == 4 * cycle_ms  # 80 of 235 bits is more than a third
    assert seldom_ms(config_of("beta", frame_bits=34)) == 31 * cycle_ms  # 80 of 26
