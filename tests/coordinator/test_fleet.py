"""Who is silent, lost and given up, and when that is to be looked at."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER, PRIMARY, run_info
from one_node import received

from comms.said.codec import Header
from comms.said.messages import AgentState, CoverageTile, Mode
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
