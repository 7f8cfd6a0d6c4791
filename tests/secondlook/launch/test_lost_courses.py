"""A mission in which each second course is lost to the agents: they know where they are again within a heartbeat."""

from __future__ import annotations

import math
from bisect import bisect_right
from pathlib import Path

from flights import BRIEF

from comms.said.messages import AgentState, Nav
from planner.reckoning import Course
from secondlook.testing import Fleet, Flight, assert_kept_apart, assert_no_strip_lost


def off_m(flight: Flight, vehicle: str) -> list[float]:
    """How far from where it was a vehicle's agent took it to be, report by report."""
    courses = [Course.of(one.message, one.header.sent_ms) for one in flight.said(Nav) if one.vehicle == vehicle]
    begun_ms = [one.begun_ms for one in courses]
    found = []
    for one in flight.said(AgentState):
        if one.vehicle == vehicle:
            now_ms = one.header.sent_ms
            here = courses[bisect_right(begun_ms, now_ms) - 1].pose_at(now_ms)
            found.append(math.dist(here[:2], (one.message.x_m, one.message.y_m)))
    return found


def test_where_none_is_lost_agents_know_where_they_are_to_a_hand(tmp_path: Path) -> None:
    flight = Fleet(BRIEF, folder=tmp_path).run()
    for vehicle in ("primary", "helper"):
        assert max(off_m(flight, vehicle)) < 0.1


def test_where_each_second_is_lost_they_soon_know_again(tmp_path: Path) -> None:
    fleet = Fleet(BRIEF, folder=tmp_path)
    fleet.drop("veh/*/nav", probability=0.5, to="helper")
    flight = fleet.run()
    assert_no_strip_lost(flight)
    assert_kept_apart(flight)
    off = off_m(flight, "helper")
    assert max(off) > 1.0  # it was struck
    assert sum(one < 0.1 for one in off) > len(off) / 3
    assert max(off_m(flight, "primary")) < 0.1
