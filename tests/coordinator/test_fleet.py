"""Who is silent, lost and given up, and when that is to be looked at."""

from __future__ import annotations

from by_hand import HELPER, PRIMARY, run_info

from comms.said.codec import Header
from comms.said.messages import AgentState, Mode
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
