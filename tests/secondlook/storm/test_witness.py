"""What a storm's witness finds in a coordinator that is told by hand what a fleet says."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY
from coordinator_by_hand import GRID, coordinator

from comms.said.messages import MissionOver, Mode
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
