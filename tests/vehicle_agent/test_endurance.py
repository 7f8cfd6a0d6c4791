"""What a battery is reckoned to last for, by hand; and an agent of a vehicle that is told of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from by_hand import PRIMARY, nav, run_info
from one_node import OneNode

from comms.said.announcement import Role, Vertex, Zone
from comms.said.messages import (
    AgentState,
    Hotspot,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    Mode,
    Nav,
    Plan,
)
from planner.currents import Sailing
from planner.dubins import Pose
from planner.footprints.side import SideLooking
from planner.spacing_planners import AdaptiveSpacing
from planner.sweep import pass_over
from planner.types import SonarShape
from planner.way_home import WayHome
from vehicle_agent.config import Homing, SurveyConfig
from vehicle_agent.endurance import Endurance
from vehicle_agent.survey import SurveyAgent

NORTH = 0.0
# 1000 s at 2 m/s, of which 100 s are kept; home is 600 m to the north of the origin.
LASTS = Endurance(1_000_000, Homing(WayHome((0, 600), Sailing(2.0), turn_radius_m=10.0), reserve_ms=100_000))
FOR_EVER = Endurance(1_000_000, None)


def test_the_share_that_is_left_falls_evenly_and_stays_where_the_vehicle_lies() -> None:
    endurance = Endurance(1_000_000, None)
    assert [endurance.left(now_ms) for now_ms in (0, 250_000, 1_000_000, 2_000_000)] == [1.0, 0.75, 0.0, 0.0]
    endurance.rest(250_000)
    assert endurance.left(900_000) == 0.75


@pytest.mark.parametrize(("at_ms", "lasts"), [(600_000, True), (600_001, False)])
def test_it_lasts_from_a_place_if_it_is_home_with_its_reserve(at_ms: int, lasts: bool) -> None:
    assert LASTS.lasts_from(Pose(0, 0, NORTH), at_ms) is lasts  # 300 s home, at 900 s
    assert FOR_EVER.lasts_from(Pose(0, 0, NORTH), at_ms)


def test_nothing_is_begun_that_leaves_less_than_ten_seconds_beside() -> None:
    passes = [pass_over((0, 0), (0, 100), 0.0), pass_over((0, 100), (0, 200), 0.0)]
    # Each takes 50 s towards home: 300 s in all for both and home from there.
    for now_ms, count in ((589_999, 2), (590_001, 0)):
        assert LASTS.lasts_for(Pose(0, 0, NORTH), passes, now_ms) == count
    away = [pass_over((0, 0), (0, -100), 0.0)]
    assert LASTS.lasts_for(Pose(0, 0, math.pi), away, 400_000) == 1
    assert LASTS.lasts_for(Pose(0, 0, math.pi), away, 520_000) == 0
    assert FOR_EVER.lasts_for(Pose(0, 0, NORTH), passes, 10**9) == 2


def test_who_waits_goes_home_while_it_may_circle_once_more() -> None:
    circle_ms = round(2 * math.pi * 10 / 2 * 1000)
    latest_ms = 600_000 - 10_000 - circle_ms
    here = Pose(0, 0, NORTH)
    assert [LASTS.is_low(here, now_ms, circles=True) for now_ms in (latest_ms, latest_ms + 1)] == [False, True]
    assert [LASTS.is_low(here, now_ms, circles=False) for now_ms in (600_000, 600_001)] == [False, True]
    assert not FOR_EVER.is_low(here, 10**9, circles=True)


HOME = Homing(WayHome((0, 0), Sailing(2.0), turn_radius_m=10.0), reserve_ms=0)


def survey(endurance_ms: int, homing: Homing | None = HOME) -> OneNode:
    """A primary of 2 m/s that is to come home to the origin, told of the run and of nothing else."""
    sonar = SideLooking(SonarShape("side", 40, 145))
    config = SurveyConfig(PRIMARY, AdaptiveSpacing(40, 145), sonar, 40, 145, 0.05, 0.6, 20, endurance_ms, homing=homing)
    node = OneNode(SurveyAgent(config), Role.SURVEY)
    node.hear("run", run_info(300, 200))
    return node


@pytest.mark.parametrize(
    ("ends_ms", "homing", "goes_home"),
    [(100_000, HOME, False), (900_000, HOME, True), (1_100_000, None, False)],
    ids=["it lasts", "too long", "it need not come home"],
)
def test_a_track_that_takes_too_long_is_left_for_home_wherever_that_is_left_from(
    ends_ms: int, homing: Homing | None, goes_home: bool
) -> None:
    node = survey(1_000_000, homing)
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.ACCEPTED, ends_ms, ""))
    orders = [one.message for one in node.said if isinstance(one.message, Maneuver)]
    assert [one.kind for one in orders] == [ManeuverKind.FOLLOW, ManeuverKind.GOTO][: 1 + goes_home]
    assert not goes_home or (orders[-1].end_x_m, orders[-1].end_y_m) == (0, 0)
    # What is left is for helpers, at once: all of the area, 61 columns of 40 cells.
    assert [hotspot.cells for hotspot in node.all(Hotspot)] == [61 * 40] * goes_home


def test_no_track_is_begun_that_the_battery_does_not_last_for() -> None:
    node = survey(150_000)
    node.hear(f"veh/{PRIMARY}/nav", Nav(0, 0, 0, 2, 15, 0))
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.REFUSED, 0, "no rudder"))
    # Each track of 200 m, with 20 m before and after it, takes 120 s and ends 200 m from home or more, or begins there.
    assert [one.message.kind for one in node.said if isinstance(one.message, Maneuver)][-1] is ManeuverKind.GOTO
    assert node.all(Plan)[-1].tracks == ()
    assert node.all(AgentState)[-1].mode is Mode.RETURNING


@pytest.mark.parametrize(("later_ms", "kind"), [(9_999, ManeuverKind.GOTO), (10_000, ManeuverKind.FOLLOW)])
def test_who_sails_on_behind_a_track_is_reckoned_from_where_that_ends_and_then_from_where_it_says_it_is(
    later_ms: int, kind: ManeuverKind
) -> None:
    # The first track ends 220 m to the north at 120 s, its run-out 10 s later. The second is refused, the third begins
    # at (180, -20): for 120 s along it and some 160 s home the battery lasts, not for a way of 250 m before.
    node = survey(500_000)
    node.hear(f"veh/{PRIMARY}/nav", nav())
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.DONE, 0, ""), at_ms=120_000)
    node.hear(f"veh/{PRIMARY}/nav", nav(180, -20))
    refused = ManeuverStatus(2, ManeuverState.REFUSED, 0, "no rudder")
    node.hear(f"veh/{PRIMARY}/maneuver_status", refused, at_ms=120_000 + later_ms)
    order = node.last(Maneuver)
    assert (order.number, order.kind) == (3, kind)
    assert kind is ManeuverKind.GOTO or order.start_x_m == 180


def test_round_ground_to_keep_out_of_it_is_farther_home_and_who_is_refused_asks_again() -> None:
    # A zone of 100 m across lies between the vehicle and home, which is the origin.
    zone = Zone((Vertex(50, -100), Vertex(150, -100), Vertex(150, 100), Vertex(50, 100)))
    sonar = SideLooking(SonarShape("side", 40, 145))
    config = SurveyConfig(PRIMARY, AdaptiveSpacing(40, 145), sonar, 40, 145, 0.05, 0.6, 20, 150_000, homing=HOME)
    node = OneNode(SurveyAgent(config), Role.SURVEY)
    node.hear("run", replace(run_info(300, 200), keep_out=(zone,), keep_out_margin_m=2.0))
    # By the beeline it lasts for 100 s home, round two corners of the zone for 2 * hypot(100, 100) + 100 m or so.
    node.hear(f"veh/{PRIMARY}/nav", Nav(200, 0, 1.5 * math.pi, 0, 15, 0))
    node.wait_until(10_000)
    state = node.all(AgentState)[-1]
    assert state.mode is Mode.RETURNING
    taut_s = (2 * math.hypot(48, 102) + 104) / 2
    assert 10 + taut_s < state.expected_end_ms / 1000 < 10 + taut_s + 15
    number = [one.message.number for one in node.said if isinstance(one.message, Maneuver)][-1]
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(number, ManeuverState.REFUSED, 0, "no way"))
    node.wait_until(20_000)
    again = [one.message for one in node.said if isinstance(one.message, Maneuver)][-1]
    assert (again.number, again.kind) == (number + 1, ManeuverKind.GOTO)
    assert (again.end_x_m, again.end_y_m) == (0, 0)
    assert node.all(AgentState)[-1].mode is Mode.RETURNING
