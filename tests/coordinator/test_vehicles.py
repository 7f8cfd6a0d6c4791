"""What is news of a vehicle, and what is not."""

from __future__ import annotations

import numpy as np
from by_hand import PRIMARY, vehicle

from comms.said.announcement import Role
from comms.said.codec import Header
from comms.said.messages import Curve, Plan, PlannedTrack
from coordinator.vehicles import KnownVehicle


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
