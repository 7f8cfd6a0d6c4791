"""By what strips are cut: the helpers' swath and turns, and what a look must be worth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from by_hand import FLEET, PRIMARY, run_info, vehicle
from coordinator_by_hand import GRID, RUN, coordinator
from one_node import OneNode

from comms.said.announcement import Role
from comms.said.messages import Contact
from coordinator.coordinator import Coordinator
from coordinator.cut.cutter import Cutter
from coordinator.cut.strips import CuttingRules


def cutter(worth_risk: float) -> Cutter:
    """Of a coordinator that was told of the run: cells of 5 m, a helper with a swath of 50 m, turns of 6 m, run-ins of
    5 m, whose P_d is 0.7."""
    example = coordinator().node.node
    assert isinstance(example, Coordinator)
    node = Coordinator(replace(example.config, worth_risk=worth_risk))
    OneNode(node, Role.COORDINATOR).hear("run", RUN, at_ms=1)
    return node._cutting[0]._cutter


def test_a_way_to_a_strip_is_reckoned_as_a_turn_about_a_swath_and_two_run_ins() -> None:
    rules = CuttingRules(swath_m=50, overhead_m=math.pi * 6 + 50 + 2 * 5, min_strip_m=30, max_strip_m=400)
    assert cutter(0.3)._kept._rules == rules


@pytest.mark.parametrize(("worth_risk", "least"), [(0.3, 0.3 * 0.7), (0.0, 0.001)])
def test_a_metre_costs_at_least_what_a_look_is_to_be_worth_over_its_swath(worth_risk: float, least: float) -> None:
    assert cutter(worth_risk).price == pytest.approx(least * 50)


@pytest.mark.parametrize(("sectors", "turns_each"), [(1, 1), (3, 3), (6, 4)])
def test_of_as_many_cuts_as_there_are_sectors_and_four_at_most_one_tries_the_other_heading(
    sectors: int, turns_each: int
) -> None:
    example = coordinator().node.node
    assert isinstance(example, Coordinator)
    node = Coordinator(replace(example.config, helpers_a_team=1))
    helpers = (vehicle(f"helper-{number}", Role.REVISIT) for number in range(sectors))
    OneNode(node, Role.COORDINATOR).hear("run", run_info(vehicles=(FLEET[0], *helpers)), at_ms=1)
    assert [one._cutter._turns_each for one in node._cutting] == [turns_each] * sectors


@pytest.mark.parametrize(("x_m", "strips"), [(200.0, 1), (320.0, 0)])
def test_for_contacts_where_no_second_look_goes_no_strip_is_cut(x_m: float, strips: int) -> None:
    # The survey's area ends 250 m to the east; the ground is too well seen for any other look to be worth flying there.
    told = coordinator(contacts=True, idle=(), area=((0, 0), (250, 0), (250, 400), (0, 400)))
    told.layer(PRIMARY, np.full(GRID.shape, 0.05))
    contacts = [(20.0 * number, 300.0, 0.9) for number in range(10)]
    contacts += [(12.0 * number, 350.0, 0.1) for number in range(20)]
    contacts += [(x_m + 3.0 * number, 100.0 + 20.0 * number, 0.62) for number in range(4)]
    for number, (east_m, north_m, score) in enumerate(contacts, 1):
        told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(east_m, north_m, 1.0, score, number))
    told.plan(100.0, 200.0)
    told.keep_alive((PRIMARY,), 125)
    assert len(told.strips()) == strips
    assert all(one.why.endswith("; 4 contacts that may be mines") for one in told.strips().values())
