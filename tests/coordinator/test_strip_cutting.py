"""By what strips are cut: the helpers' swath and turns, and what a look must be worth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from by_hand import FLEET, HELPER, PRIMARY, SECOND_HELPER, run_info, vehicle
from coordinator_by_hand import (
    ACCEPTED,
    ELSEWHERE,
    GRID,
    HOT_CELLS,
    OPEN,
    RUN,
    TWO_HELPERS,
    WITHDRAWN,
    Told,
    coordinator,
)
from one_node import OneNode

from comms.said.announcement import Role, RunInfo, Vertex, Zone
from comms.said.messages import Contact, Mode, TaskAction, TaskState
from coordinator.allocate.routes import RoutesAllocator
from coordinator.allocate.simple import GreedyAllocator
from coordinator.coordinator import Coordinator
from coordinator.cut.cutter import Cutter
from coordinator.cut.legs import Flier
from coordinator.cut.strips import CuttingRules


def cutter(worth_risk: float, objective: Literal["mean", "worst30", "both"] = "mean") -> Cutter:
    """Of a coordinator that was told of the run: cells of 5 m, a helper with a swath of 50 m, turns of 6 m, run-ins of
    5 m, whose P_d is 0.7."""
    return told_of_run(worth_risk=worth_risk, objective=objective)._cutting[0]._cutter


def told_of_run(run: RunInfo = RUN, **settings: Any) -> Coordinator:
    example = coordinator().node.node
    assert isinstance(example, Coordinator)
    node = Coordinator(replace(example.config, **settings))
    OneNode(node, Role.COORDINATOR).hear("run", run, at_ms=1)
    return node


def test_a_way_to_a_strip_is_reckoned_as_a_turn_about_a_swath_and_two_run_ins() -> None:
    rules = CuttingRules(swath_m=50, overhead_m=math.pi * 6 + 50 + 2 * 5, min_strip_m=30, max_strip_m=400)
    assert cutter(0.3)._kept._rules == rules


@pytest.mark.parametrize(
    ("objective", "worth_risk", "least"),
    [("mean", 0.3, 0.3 * 0.7), ("mean", 0.0, 0.001), ("both", 0.3, 0.7 * 0.3 * 0.7), ("worst30", 0.3, 0.001)],
)
def test_a_metre_costs_at_least_what_a_look_is_to_be_worth_over_its_swath(
    objective: Literal["mean", "worst30", "both"], worth_risk: float, least: float
) -> None:
    assert cutter(worth_risk, objective).price == pytest.approx(least * 50)


def test_where_there_is_ground_to_keep_out_of_strips_are_cut_so_that_the_helper_can_fly_them() -> None:
    assert told_of_run()._cutting[0]._cutter._room is None
    zone = Zone((Vertex(10, 10), Vertex(20, 10), Vertex(20, 30)))
    room = told_of_run(replace(RUN, keep_out=(zone,)))._cutting[0]._cutter._room
    assert room is not None
    assert (room.grid, room.helper, room.min_strip_m) == (GRID, FLEET[1], 30)
    assert len(room.keep_out.zones) == 1


class TestByWhoseRoutesStripsAreLaid:
    @staticmethod
    def fliers(node: Coordinator, mode: Mode = Mode.IDLE, of_helper: Any = (), **of_situation: Any) -> list[Flier]:
        """With the helper, and the situation, changed."""
        told = Told(OneNode(node, Role.COORDINATOR))
        told.state(HELPER, mode)
        situation = node._briefing.situation(5_000, node._sectors.all[0])
        helpers = tuple(replace(one, **dict(of_helper)) for one in situation.helpers)
        return node._cutting[0]._fliers(replace(situation, **{"helpers": helpers, "deadline_s": 900.0, **of_situation}))

    def test_those_of_the_helpers_in_the_grids_own_frame_until_the_deadline(self) -> None:
        node = told_of_run(allocator=RoutesAllocator())
        (flier,) = self.fliers(node)
        state = node.fleet.vehicles[HELPER].state
        assert state is not None
        across_m, along_m = GRID.frame.to_sweep(state.x_m, state.y_m)
        assert flier[:3] == pytest.approx((across_m, along_m, state.heading_rad - GRID.frame.heading_rad))
        assert flier[3:5] == (5.0, 900.0)
        entry = FLEET[1]
        assert flier[5:] == (entry.speed_mps, entry.turn_radius_m, entry.run_in_m, 0.0)

    def test_nobodys_while_nobody_is_to_be_sent_to_a_strip_or_where_what_is_worth_most_is_to_be_removed_first(
        self,
    ) -> None:
        assert self.fliers(told_of_run(allocator=RoutesAllocator()), Mode.SURVEY) == []
        assert self.fliers(told_of_run(allocator=RoutesAllocator()), soonest=True) == []

    def test_nobodys_while_nobody_can_tell_when_the_mission_ends(self) -> None:
        assert self.fliers(told_of_run(allocator=RoutesAllocator()), deadline_s=math.inf) == []

    @pytest.mark.parametrize(
        ("of_helper", "helpers"),
        [
            ({"lasts_until_s": 900.0, "way_home": None}, 1),
            ({"lasts_until_s": 899.0, "way_home": None}, 0),
            ({"lasts_until_s": 900.0}, 0),  # it must be home by then
            ({"beside_m": 5.0}, 0),
            ({"lead_m": 5.0}, 1),
        ],
    )
    def test_nobodys_where_a_battery_may_end_before_the_mission_or_a_leg_lies_beside_its_strip(
        self, of_helper: dict[str, Any], helpers: int
    ) -> None:
        assert len(self.fliers(told_of_run(allocator=RoutesAllocator()), of_helper=of_helper)) == helpers

    def test_nobodys_where_routes_are_fixed_beforehand_whoever_the_allocator_is(self) -> None:
        assert self.fliers(told_of_run(allocator=RoutesAllocator(), strips="beforehand")) == []

    def test_nobodys_where_the_allocator_does_not_say_so(self) -> None:
        assert self.fliers(told_of_run(allocator=GreedyAllocator())) == []

    def test_nobodys_where_there_is_ground_to_keep_out_of(self) -> None:
        zone = Zone((Vertex(10, 10), Vertex(20, 10), Vertex(20, 30)))
        assert self.fliers(told_of_run(replace(RUN, keep_out=(zone,)), allocator=RoutesAllocator())) == []


@pytest.mark.parametrize(("sectors", "turns_each"), [(1, 1), (3, 3), (6, 4)])
def test_of_as_many_cuts_as_there_are_sectors_and_four_at_most_one_tries_the_other_heading(
    sectors: int, turns_each: int
) -> None:
    helpers = (vehicle(f"helper-{number}", Role.REVISIT) for number in range(sectors))
    node = told_of_run(run_info(vehicles=(FLEET[0], *helpers)), helpers_a_team=1)
    assert [one._cutter._turns_each for one in node._cutting] == [turns_each] * sectors


@pytest.mark.parametrize(
    ("east_m", "north_m", "is_same"), [(30, 0, True), (0, 60, True), (40, 0, False), (0, 70, False)]
)
def test_what_shares_a_quarter_of_both_with_an_open_strip_is_that_revised(
    east_m: float, north_m: float, is_same: bool
) -> None:
    # 50 m by 100 m: moved by 30 m to the east, or by 60 m to the north, they have a quarter of all of it in common.
    told = coordinator(idle=())
    told.hotspot((97.5, 50, 147.5, 150))
    told.settle()
    assert told.states() == {1: OPEN}
    told.hotspot((97.5 + east_m, 50 + north_m, 147.5 + east_m, 150 + north_m), revision=2)
    told.settle()
    assert told.states() == ({1: OPEN} if is_same else {1: WITHDRAWN, 2: OPEN})
    last = told.strips()[1 if is_same else 2]
    assert (last.start_x_m, last.start_y_m, last.length_m, last.width_m) == (122.5 + east_m, 50 + north_m, 100, 50)


@pytest.mark.parametrize("is_there", [False, True])
def test_strips_run_across_the_tracks_where_helpers_fly_fewer_of_them_so_whether_they_are_there_yet_or_not(
    is_there: bool,
) -> None:
    # 300 m from west to east, 50 m from south to north: one strip across the tracks, six along them.
    told = Told(OneNode(told_of_run(across=True), Role.COORDINATOR))
    told.state(PRIMARY, Mode.SURVEY, 1)
    if is_there:
        told.state(HELPER, Mode.IDLE)
    told.settle()
    told.hotspot((47.5, 100, 347.5, 150))
    told.settle()
    (strip,) = told.strips().values()
    assert (strip.start_x_m, strip.start_y_m, strip.length_m, strip.width_m) == (47.5, 125, 300, 50)
    assert strip.heading_rad == pytest.approx(math.pi / 2, abs=1e-5)
    assert strip.why == "badly seen; across the tracks, as that leaves less"


@pytest.mark.parametrize(
    ("contacts", "told_of"), [(0, ""), (1, "; 1 contact that may be a mine"), (2, "; 2 contacts that may be mines")]
)
def test_why_a_strip_is_cut_tells_of_the_contacts_in_it_that_may_be_mines(contacts: int, told_of: str) -> None:
    told = coordinator(contacts=True, idle=())
    risk = np.full(GRID.shape, 0.05)
    risk[HOT_CELLS] = 0.9
    told.layer(PRIMARY, risk)
    others = [(20.0 * number, 380.0, 0.9) for number in range(20)] + [(20.0 * n, 20.0, 0.1) for n in range(20)]
    doubtful = [(122.5, 100.0 + 50.0 * number, 0.62) for number in range(contacts)] + [(350.0, 200.0, 0.62)]
    for number, (x_m, y_m, score) in enumerate(others + doubtful, 1):
        told.node.hear(f"agent/{PRIMARY}/contact/{number}", Contact(x_m, y_m, 1.0, score, number))
    told.plan(100.0, 300.0)
    told.keep_alive((PRIMARY,), 125)
    strip = told.strips()[1]
    assert abs(strip.start_x_m - 122.5) < 10
    assert strip.why.partition(";")[0] + told_of == strip.why


def test_how_many_helpers_are_there_and_whether_there_is_work_is_known_of_each_sector() -> None:
    told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER), helpers_a_team=1)
    told.hotspot(ELSEWHERE)
    told.settle()
    told.settle()
    node = told.node.node
    assert isinstance(node, Coordinator)
    assert [(one.present, one.is_worth) for one in node._sectors.all] == [(1, False), (1, True)]


def test_in_a_sector_what_a_helper_is_at_is_not_cut_again() -> None:
    told = coordinator(TWO_HELPERS, idle=(HELPER, SECOND_HELPER), helpers_a_team=1)
    told.hotspot((302.5, 50.0, 352.5, 350.0))  # in the eastern half
    told.settle()
    told.settle()
    assert told.tasks() == [(SECOND_HELPER, TaskAction.TAKE, 1)]
    told.status(SECOND_HELPER, 1, TaskState.ACCEPTED)
    told.state(SECOND_HELPER, Mode.TRANSIT, 1)
    told.hotspot((302.5, 50.0, 352.5, 351.0), revision=2)
    told.keep_alive((PRIMARY, HELPER, SECOND_HELPER), 150)
    assert told.states() == {1: ACCEPTED}


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
