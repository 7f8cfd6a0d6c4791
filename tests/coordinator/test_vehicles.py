"""What is news of a vehicle, and what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_hand import PRIMARY, vehicle

from comms.said.announcement import Role
from comms.said.codec import Header
from comms.said.messages import AgentState, Curve, Mode, Plan, PlannedTrack
from coordinator.vehicles import KnownVehicle, expected_end_ms


def curve(track: int, p_detect: float, points: int = 2) -> Curve:
    return Curve(track, 10.0, np.full(points, p_detect), 0)


def test_of_a_track_s_curves_the_newest_is_news_and_counts() -> None:
    primary = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
    told = [
        (5, curve(1, 0.5), True),
        (4, curve(1, 0.4), False),
        (5, curve(1, 0.5), False),
        (4, curve(2, 0.3), True),
        (6, curve(1, 0.6), True),
        (7, curve(1, 0.7, points=1), False),  # no curve at all
    ]
    assert [primary.hear_survey(Header(PRIMARY, 0, number, 0), one) for number, one, _ in told] == [
        is_news for _, _, is_news in told
    ]
    assert {track: one.p_detect.tolist() for track, one in primary.curves.items()} == {1: [0.6, 0.6], 2: [0.3, 0.3]}


def test_of_plans_that_of_the_latest_revision_is_news_and_counts() -> None:
    primary = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
    plans = [Plan(one, (PlannedTrack(one, 0, 0, 0, 0, 400, False),), (), (), "") for one in (2, 1, 2, 3)]
    news = [primary.hear_survey(Header(PRIMARY, 0, number, 0), one) for number, one in enumerate(plans)]
    assert news == [True, False, False, True]
    assert primary.plan == plans[3]


@pytest.mark.parametrize(("drift_mps", "takes_s"), [(0.0, 240), (0.5, 180)])
def test_a_survey_ends_when_its_last_track_does_by_the_speed_over_the_ground(drift_mps: float, takes_s: float) -> None:
    # 40 m of way, 20 m of run-in and 300 m of track, all northwards at 1.5 m/s through the water.
    entry = replace(vehicle(PRIMARY, Role.SURVEY), drift_mps=drift_mps)
    plan = Plan(1, (PlannedTrack(1, 0, 0, 0, 0, 300, False),), (), (), "")
    state = AgentState(Mode.TRANSIT, 1, 1, 0, 0, -60, 0)
    assert expected_end_ms(entry, state, plan, 10_000) == 10_000 + takes_s * 1000
