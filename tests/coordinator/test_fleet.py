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
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet


def test_it_is_looked_at_when_somebody_will_be_silent_lost_or_given_up_and_not_again() -> None:
    # Silent after 30 s, lost after 90 s; a primary is given up after ten times 30 s. The helper is heard at 20 s.
    fleet = KnownFleet(run_info(400, 400), 30_000, 90_000, 0)
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
    fleet, cells = KnownFleet(run_info(400, 400), 30_000, 90_000, 0), np.ones((2, 2), dtype=np.uint8)
    for name, version in ((HELPER, 1), (HELPER, 2), (PRIMARY, 1)):
        beyond = CoverageTile(version, 9_000, 0, cells, cells, cells > 0)
        assert not fleet.hear_tile(received(f"agent/{name}/coverage/0-0", beyond), beyond)
    told = [one.getMessage() for one in caplog.records]
    assert [one.split(":")[0] for one in told] == [f"dropped a message from {name}" for name in (HELPER, PRIMARY)]


def test_who_is_lost_or_given_up_is_told_since_when_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    fleet = KnownFleet(run_info(400, 400), 30_000, 90_000, 0)
    primary, idle = fleet.vehicles[PRIMARY], AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0)
    primary.hear_state(Header(PRIMARY, 0, 1, 10_499), idle, 10_499)
    fleet.vehicles[HELPER].hear_state(Header(HELPER, 0, 1, 20_499), idle, 20_499)
    assert fleet.find_lost(100_498) == []
    assert fleet.find_lost(100_499) == [PRIMARY]
    assert fleet.find_lost(110_499) == [HELPER]
    assert fleet.find_lost(110_500) == []
    primary.hear_state(Header(PRIMARY, 0, 2, 290_000), idle, 290_000)
    assert fleet.find_lost(310_498) == fleet.find_lost(310_499) == []  # heard, but it does nothing
    assert [one.getMessage() for one in caplog.records] == [
        f"{PRIMARY} is lost: nothing heard of it since 10 s",
        f"{HELPER} is lost: nothing heard of it since 20 s",
        f"{PRIMARY} is given up: it has not stirred since 10 s",
    ]


def test_who_is_silent_for_ten_times_as_long_as_a_silent_vehicle_is_not_waited_for() -> None:
    fleet = KnownFleet(run_info(400, 400), 30_000, 90_000, 0)
    helper, told = fleet.vehicles[HELPER], AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0)
    helper.hear_state(Header(HELPER, 0, 1, 20_000), replace(told, tiles_told=1), 20_000)
    assert fleet.lacking(319_999) == [helper]
    assert fleet.lacking(320_000) == []


def test_who_has_told_of_no_ground_has_seen_nothing_of_a_window() -> None:
    fleet = KnownFleet(run_info(400, 400), 30_000, 90_000, 0)
    levels = fleet.levels(HELPER, Window(2, 5, 3, 10))
    assert levels.shape == (3, 7)
    assert not levels.any()
