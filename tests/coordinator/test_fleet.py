"""Who is silent, lost and given up, and when that is to be looked at."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, run_info
from one_node import received

from comms.said.codec import Header
from comms.said.messages import AgentState, CoverageTile, Mode
from coordinator.config import Patience
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet

PATIENCE = Patience(silent_ms=30_000, lost_ms=90_000)
"""A primary is given up when it is silent for 300 s, or stands still for 900 s."""


def test_a_primary_is_waited_for_no_shorter_than_a_helper() -> None:
    for silent_ms, lost_ms, given_up_ms, stuck_ms in (
        (30_000, 30_000, 300_000, 300_000),  # where everybody hears everybody
        (30_000, 600_000, 600_000, 1_500_000),
        (100_000, 600_000, 1_000_000, 5_000_000),
        (240_000, 600_000, 2_400_000, 6_000_000),
        (700_000, 700_000, 7_000_000, 7_000_000),
    ):
        patience = Patience(silent_ms, lost_ms)
        assert (patience.given_up_ms, patience.stuck_ms) == (given_up_ms, stuck_ms)


def test_it_is_looked_at_when_somebody_will_be_silent_lost_or_given_up_and_not_again() -> None:
    # Silent after 30 s, lost after 90 s; a primary is given up after 300 s. The helper is heard at 20 s.
    fleet = KnownFleet(run_info(400, 400), PATIENCE, 0)
    fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 1, 20_000), AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0), 20_000)
    looked_at, now_ms = list[int](), 0
    while deadlines_ms := sorted(fleet.deadlines_ms()):
        assert deadlines_ms[0] > now_ms
        now_ms = deadlines_ms[0]
        fleet.find_lost(now_ms)
        looked_at.append(now_ms)
    assert looked_at == [30_000, 50_000, 90_000, 110_000, 300_000]
    assert all(one.silent and one.lost for one in fleet.vehicles.values())
    assert fleet.vehicles[PRIMARY].finished_ms == 300_000


def test_tiles_that_do_not_fit_are_told_of_once_for_each_vehicle(caplog: pytest.LogCaptureFixture) -> None:
    fleet, cells = KnownFleet(run_info(400, 400), PATIENCE, 0), np.ones((2, 2), dtype=np.uint8)
    for name, version in ((HELPER, 1), (HELPER, 2), (PRIMARY, 1)):
        beyond = CoverageTile(version, 9_000, 0, cells, cells, cells > 0)
        assert not fleet.hear_tile(received(f"agent/{name}/coverage/0-0", beyond), beyond)
    told = [one.getMessage() for one in caplog.records]
    assert [one.split(":")[0] for one in told] == [f"dropped a message from {name}" for name in (HELPER, PRIMARY)]


def test_who_is_lost_or_given_up_is_told_since_when_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    fleet = KnownFleet(run_info(400, 400), PATIENCE, 0)
    primary, idle = fleet.vehicles[PRIMARY], AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0)
    primary.hear_state(Header(PRIMARY, 0, 1, 10_499), idle, 10_499)
    fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 1, 20_499), idle, 20_499)
    assert fleet.find_lost(100_498) == []
    assert fleet.find_lost(100_499) == [PRIMARY]
    assert fleet.find_lost(110_499) == [HELPER]
    assert fleet.find_lost(110_500) == []
    primary.hear_state(Header(PRIMARY, 0, 2, 290_000), idle, 290_000)
    primary.hear_state(Header(PRIMARY, 0, 3, 880_000), idle, 880_000)
    assert fleet.find_lost(910_498) == fleet.find_lost(910_499) == []  # heard, but it does nothing
    assert [one.getMessage() for one in caplog.records] == [
        f"{PRIMARY} is lost: nothing heard of it since 10 s",
        f"{HELPER} is lost: nothing heard of it since 20 s",
        f"{PRIMARY} is given up: it has not stirred since 10 s",
    ]


@pytest.mark.parametrize("lost_ms", [90_000, 600_000])
def test_a_primary_that_is_silent_is_given_up_and_waited_for_again(
    lost_ms: int, caplog: pytest.LogCaptureFixture
) -> None:
    fleet = KnownFleet(run_info(400, 400), Patience(30_000, lost_ms), 0)
    primary, surveys = fleet.vehicles[PRIMARY], AgentState(Mode.SURVEY, 1, 1, 0, 0, 0, 0)
    primary.hear_state(Header(PRIMARY, 0, 1, 10_000), surveys, 10_000)
    given_up_ms = 10_000 + max(300_000, lost_ms)
    fleet.find_lost(given_up_ms - 1)
    assert fleet.surveying == [primary]
    fleet.find_lost(given_up_ms)
    assert fleet.surveying == []
    assert caplog.messages == [f"{PRIMARY} is given up: nothing heard of it since 10 s"]
    tell_tile(fleet, PRIMARY, 1, given_up_ms)  # which it may have sent before
    assert fleet.surveying == []
    tell_tile(fleet, PRIMARY, 2, given_up_ms + 1)
    fleet.find_lost(given_up_ms + 2)
    assert fleet.surveying == [primary]


def test_a_primary_that_tells_of_looks_does_not_stand_still() -> None:
    fleet = KnownFleet(run_info(400, 400), PATIENCE, 0)
    primary, stands = fleet.vehicles[PRIMARY], AgentState(Mode.SURVEY, 1, 1, 0, 0, 0, 0)

    def is_surveying(now_ms: int, sequence: int) -> bool:
        primary.hear_state(Header(PRIMARY, 0, sequence, now_ms), stands, now_ms)
        fleet.find_lost(now_ms)
        return primary in fleet.surveying

    assert is_surveying(0, 1)
    assert is_surveying(899_999, 2)
    tell_tile(fleet, PRIMARY, 1, 890_000)
    assert is_surveying(1_789_999, 3)
    tell_tile(fleet, PRIMARY, 1, 1_700_000)  # told before
    assert not is_surveying(1_790_000, 4)


def tell_tile(fleet: KnownFleet, name: str, version: int, sent_ms: int) -> None:
    cells = np.full((20, 20), version, dtype=np.uint8)
    tile = CoverageTile(version, 0, 0, cells, cells, cells > 0)
    fleet.hear_tile(received(f"agent/{name}/coverage/0-0", tile, sent_ms=sent_ms), tile)


def test_who_is_silent_for_ten_times_as_long_as_a_silent_vehicle_is_not_waited_for() -> None:
    fleet = KnownFleet(run_info(400, 400), PATIENCE, 0)
    helper, told = fleet.vehicles[HELPER], AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0)
    helper.hear_state(Header(HELPER, 0, 1, 20_000), replace(told, tiles_told=1), 20_000)
    assert fleet.lacking(319_999) == [helper]
    assert fleet.lacking(320_000) == []


def test_who_has_told_of_no_ground_has_seen_nothing_of_a_window() -> None:
    fleet = KnownFleet(run_info(400, 400), PATIENCE, 0)
    levels = fleet.levels(HELPER, Window(2, 5, 3, 10))
    assert levels.shape == (3, 7)
    assert not levels.any()
