"""What a primary expects helpers to look at, from what is announced."""

from __future__ import annotations

from dataclasses import replace

import pytest

from comms.said.announcement import Role
from planner.across import HelperLooks
from secondlook.fleet.roster import roster_vehicle
from secondlook.scenario import load_scenario
from vehicle_agent.helpers_ahead import helper_looks

PRIMARY, HELPER = (roster_vehicle(name, one) for name, one in load_scenario("tellaro").vehicles.items())


def test_a_helper_looks_at_its_swath_times_how_much_faster_it_is() -> None:
    # 25 m to either side at 2 m/s, while the primary flies at 1.5 m/s.
    looks = helper_looks([PRIMARY, HELPER], PRIMARY.vehicle)
    assert (looks.width_m, looks.p_detect) == pytest.approx((50 * 2 / 1.5, 0.7))


def test_primaries_share_helpers_and_helpers_add_up() -> None:
    other = replace(PRIMARY, vehicle="other", role=Role.SURVEY_REVISIT)
    shared = helper_looks([PRIMARY, other, HELPER], PRIMARY.vehicle)
    assert shared.width_m == pytest.approx(50 * 2 / 1.5 / 2)
    slow = replace(HELPER, vehicle="slow", speed_mps=1.0, p_detect=0.4)
    both = helper_looks([PRIMARY, HELPER, slow], PRIMARY.vehicle)
    assert (both.width_m, both.p_detect) == pytest.approx((50 * 3 / 1.5, (2 * 0.7 + 1 * 0.4) / 3))


def test_nobody_looks_where_there_is_no_helper() -> None:
    assert helper_looks([PRIMARY], PRIMARY.vehicle) == HelperLooks()


def test_nothing_is_expected_while_one_flies_that_cannot_or_is_not_announced() -> None:
    assert helper_looks([replace(PRIMARY, speed_mps=0.0), HELPER], PRIMARY.vehicle) == HelperLooks()
    assert helper_looks([PRIMARY, HELPER], "nobody") == HelperLooks()
