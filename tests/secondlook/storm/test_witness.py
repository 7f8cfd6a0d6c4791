"""What a storm's witness finds in a coordinator that is told by hand what a fleet says."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY
from coordinator_by_hand import GRID, coordinator

from comms.said.messages import AgentState, MissionOver, Mode
from coordinator.fleet import KnownFleet
from planner.tiles import tiles
from secondlook.storm.witness import Witness

TILES = len(tiles(GRID))
ALL_TILES = sum(range(1, TILES + 1))  # what a state tells of all of them in their first version


@pytest.mark.parametrize("come", [TILES, TILES - 1])
def test_the_mission_is_over_when_all_has_come_of_which_states_tell(come: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(KnownFleet, "lacking", lambda self, now_ms: [])  # as if it waited for nothing
    told, witness = coordinator(), Witness()
    witness.made("coordinator", told.node.node)
    told.layer(HELPER, np.ones(GRID.shape))
    told.state(HELPER, Mode.IDLE, tiles_told=ALL_TILES + TILES - come)
    told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
    assert [type(one.message) for one in told.settle()] == [MissionOver]
    found = [] if come == TILES else ["the mission ends when all has come"]
    assert [one.invariant for one in witness.violations] == found


def test_what_comes_after_the_end_without_the_state_that_tells_of_it_is_no_lack() -> None:
    told, witness = coordinator(), Witness()
    witness.made("coordinator", told.node.node)
    told.layer(HELPER, np.ones(GRID.shape))
    told.state(HELPER, Mode.IDLE, tiles_told=ALL_TILES)
    told.state(PRIMARY, Mode.FINISHED, at_ms=10_000)
    assert [type(one.message) for one in told.settle()] == [MissionOver]
    told.layer(HELPER, np.full(GRID.shape, 0.5))
    assert [type(one.message) for one in told.node.wait_until(told.node.now_ms + 10)] == [MissionOver]
    assert witness.violations == []


def test_a_vehicle_stirs_when_it_is_first_heard_of_elsewhere_or_started_anew() -> None:
    told, witness = coordinator(), Witness()
    witness.made("coordinator", told.node.node)
    assert witness.stirred_s(PRIMARY) == 0

    def say(at_s: int, mode: Mode, x_m: float = 0.0, incarnation: int = 0) -> float:
        state = AgentState(mode, 1, 1.0, 0, x_m, 0.0, 0, 0, 0)
        told.node.hear(f"agent/{PRIMARY}/state", state, sent_ms=at_s * 1000, incarnation=incarnation)
        return witness.stirred_s(PRIMARY)

    assert say(10, Mode.TRANSIT) == 10
    assert say(20, Mode.TRANSIT) == 10
    assert say(30, Mode.TRANSIT, 5.0) == 30  # whenever it went there
    assert say(40, Mode.TRANSIT, 5.0) == 30
    assert say(50, Mode.TRANSIT, 5.0, incarnation=1) == 50
    assert say(60, Mode.FINISHED, 9.0, incarnation=1) == 50  # its survey is over: how long that was waited for is told
    assert witness.stirred_s(HELPER) == 0
