"""What a battery is reckoned to last for, by hand; and an agent of a vehicle that is told of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from by_hand import HELPER, PRIMARY, nav, run_info
from one_node import OneNode

from comms.said.announcement import Role, RunInfo, Vertex, Zone
from comms.said.messages import (
    AgentState,
    Hotspot,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Mode,
    Nav,
    Plan,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from planner.currents import Sailing
from planner.dubins import Pose
from planner.footprints.side import SideLooking
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing, SpacingPlanner
from planner.sweep import pass_over
from planner.types import SonarShape
from planner.way_home import WayHome
from vehicle_agent.config import Homing, RevisitConfig, SurveyConfig
from vehicle_agent.endurance import Endurance
from vehicle_agent.revisit import RevisitAgent
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


ADAPTIVE, RUN = AdaptiveSpacing(40, 145), run_info(300, 200)
HOME = Homing(WayHome((0, 0), Sailing(2.0), turn_radius_m=10.0), reserve_ms=0)


def survey(
    endurance_ms: int,
    homing: Homing | None = HOME,
    *,
    spacing: SpacingPlanner = ADAPTIVE,
    run: RunInfo = RUN,
) -> OneNode:
    """A primary of 2 m/s that is to come home to the origin, told of the run and of nothing else."""
    sonar = SideLooking(SonarShape("side", 40, 145))
    config = SurveyConfig(PRIMARY, spacing, sonar, 40, 145, 0.05, 0.6, 20, endurance_ms, homing=homing)
    node = OneNode(SurveyAgent(config), Role.SURVEY)
    node.hear("run", run)
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
    last_words = "the battery lasts for no further track and the way home: the survey ends, 100.00% of the area"
    assert node.last(Plan).note.startswith(last_words) is goes_home


def test_a_track_is_left_if_it_leaves_no_time_for_its_run_out_and_the_way_home_from_there() -> None:
    # The first one, beside the pair's second, which runs the other way.
    (first, second) = survey(1_000_000).last(Plan).tracks[:2]
    assert (first.end_y_m, second.end_y_m) == (200, 0)
    way_s, _ = HOME.way.from_pose(Pose(first.end_x_m, 220, NORTH))
    latest_ms = 1_000_000 - round(way_s * 1000) - 10_000
    for ends_ms, kind in ((latest_ms, ManeuverKind.FOLLOW), (latest_ms + 1, ManeuverKind.GOTO)):
        node = survey(1_000_000)
        node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.ACCEPTED, ends_ms, ""))
        assert node.last(Maneuver).kind is kind


def test_the_next_track_is_reckoned_from_the_end_of_the_last_one() -> None:
    node = survey(720_000, spacing=FixedSpacing(40, 145), run=run_info(600, 200))
    node.hear(f"veh/{PRIMARY}/nav", nav())
    for number, at_ms in ((1, 120_000), (2, 240_000)):
        node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(number, ManeuverState.DONE, 0, ""), at_ms=at_ms)
    # At 250 s it is behind the second one, at (250, -20). The third begins at (350, -20) and ends at (350, 220), 206 m
    # from home: some 55 s there, 120 s along it, some 220 s home. From the end of the first it would be 100 s more.
    assert [(track.end_x_m, track.end_y_m, track.flown) for track in node.last(Plan).tracks] == [
        (145, 200, True),
        (250, 0, True),
        (350, 200, False),
    ]
    assert node.last(Maneuver).number == 3
    assert node.last(Plan).tentative == 0


@pytest.mark.parametrize(("endurance_ms", "count", "tentative"), [(3_600_000, 7, 5), (900_000, 3, 1), (700_000, 2, 0)])
def test_tracks_for_which_the_battery_does_not_last_are_not_among_those_that_may_be_laid_elsewhere(
    endurance_ms: int, count: int, tentative: int
) -> None:
    # Each track takes 120 s, the ways to the second, at 236 m, and to the third, at 512 m, some 60 and 150 s. Home it
    # is some 120 s from behind the second one and 280 s from behind the third.
    node = survey(endurance_ms, run=run_info(1212, 200))
    node.hear(f"veh/{PRIMARY}/nav", nav())
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.DONE, 0, ""), at_ms=120_000)
    plan = node.last(Plan)
    assert (len(plan.tracks), plan.tentative) == (count, tentative)


@pytest.mark.parametrize(
    ("endurance_ms", "count", "tentative"), [(3_600_000, 7, 5), (1_000_000, 3, 1), (700_000, 2, 0), (200_000, 7, 5)]
)
def test_once_it_knows_where_it_is_its_first_plan_holds_the_tracks_for_which_its_battery_lasts(
    endurance_ms: int, count: int, tentative: int
) -> None:
    """As above. In 200 s it cannot fly the first one either, but the vehicle says so."""
    node = survey(endurance_ms, run=run_info(1212, 200))
    assert (len(node.last(Plan).tracks), node.last(Plan).tentative) == (7, 5)
    node.hear(f"veh/{PRIMARY}/nav", nav())
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.ACCEPTED, 20_000, ""))
    plan = node.last(Plan)
    assert (len(plan.tracks), plan.tentative) == (count, tentative)
    assert plan.note == (f"the battery lasts for {count} of 7 tracks" if count < 7 else node.all(Plan)[0].note)
    assert node.last(Maneuver).number == 1


def test_who_is_on_its_way_home_goes_on_when_the_mission_is_over() -> None:
    node = survey(150_000)
    node.hear(f"veh/{PRIMARY}/nav", Nav(0, 0, 0, 2, 15, 0))
    node.hear(f"veh/{PRIMARY}/maneuver_status", ManeuverStatus(1, ManeuverState.REFUSED, 0, "no rudder"))
    said = node.hear("coord/mission_over", MissionOver("enough"))
    assert node.all(Maneuver, said) == []
    assert node.last(AgentState).mode is Mode.RETURNING


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


def test_who_has_served_a_strip_goes_home_at_once_where_it_has_no_time_to_circle_until_its_next_report() -> None:
    # 500 m from home, 250 s, with 10 s to spare and 31 s for a circle: at 231 s it is time, by 22 s.
    sees = SideLooking(SonarShape("side", 0, 25))
    config = RevisitConfig(HELPER, sees, speed_mps=2, turn_radius_m=10, run_in_m=5, endurance_ms=500_000, homing=HOME)
    node = OneNode(RevisitAgent(config), Role.REVISIT)
    node.hear("run", RUN)
    node.hear(f"veh/{HELPER}/nav", nav(0, 0))
    node.hear(f"coord/task/{HELPER}/1", Task(TaskAction.TAKE, 7, 100, 50, 0.0, 100, 50))
    node.hear(f"veh/{HELPER}/nav", nav(0, 500), at_ms=231_000)
    node.hear(f"veh/{HELPER}/maneuver_status", ManeuverStatus(1, ManeuverState.DONE, 0, ""))
    assert node.last(TaskStatus).state is TaskState.DONE
    assert node.last(AgentState).mode is Mode.RETURNING
