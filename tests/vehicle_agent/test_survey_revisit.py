"""A primary that takes strips once it has surveyed all, driven by hand."""

from __future__ import annotations

from by_hand import PRIMARY, flat, fly, nav, run_info, tell_status, to_follow
from one_node import OneNode

from comms.said.announcement import Role
from comms.said.messages import (
    AgentState,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    MissionOver,
    Mode,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from planner.footprints.side import SideLooking
from planner.spacing_planners import AdaptiveSpacing
from planner.types import SonarShape
from vehicle_agent.config import RevisitConfig, SurveyConfig, SurveyRevisitConfig
from vehicle_agent.survey_revisit import SurveyRevisitAgent

RUN = run_info(360, 200, cell_m=10)
SEES_TO_130_M = flat(0.3, 25, 130)
STRIP = Task(TaskAction.TAKE, 3, 200, 50, 0, 100, 90)


def primary(endurance_ms: int = 36_000_000) -> OneNode:
    """It sees from 40 to 130 m to each side, and has been told of the run."""
    sonar = SideLooking(SonarShape("side", 40, 130))
    survey = SurveyConfig(PRIMARY, AdaptiveSpacing(40, 145), sonar, 40, 145, 0.05, 0.6, 20, endurance_ms)
    revisit = RevisitConfig(PRIMARY, sonar, 1.5, 20, 20, endurance_ms)
    agent = OneNode(SurveyRevisitAgent(SurveyRevisitConfig(survey, revisit)), Role.SURVEY_REVISIT)
    agent.hear("run", RUN, at_ms=1)
    agent.hear(f"veh/{PRIMARY}/nav", nav())
    return agent


def surveyed() -> OneNode:
    """The same, when it has flown every track."""
    agent = primary()
    for _ in range(10):
        maneuver = to_follow(agent)
        if maneuver is None:
            break
        fly(agent, PRIMARY, maneuver, SEES_TO_130_M)
    assert agent.last(AgentState).mode is Mode.FINISHED
    return agent


def offer(agent: OneNode, task: Task = STRIP) -> TaskStatus:
    said = agent.hear(f"coord/task/{PRIMARY}/1", task)
    (status,) = agent.all(TaskStatus, said)
    return status


def test_it_takes_no_strip_before_it_has_surveyed_all() -> None:
    agent = primary()
    under_way = agent.last(Maneuver)
    status = offer(agent)
    assert (status.state, status.reason) == (TaskState.REFUSED, "surveying")
    assert agent.last(Maneuver) == under_way


def test_afterwards_it_passes_beside_the_strip_on_the_nearer_side() -> None:
    agent = surveyed()
    agent.hear(f"veh/{PRIMARY}/nav", nav(130, 0))
    assert offer(agent).state is TaskState.ACCEPTED
    # The strip's middle lies 85 m, half way from 40 to 130 m, to starboard of a track at x = 115 to the north.
    last = agent.last(Maneuver)
    assert (last.kind, last.start_x_m, last.start_y_m, last.end_y_m) == (ManeuverKind.FOLLOW, 115, 50, 150)
    assert agent.last(AgentState).mode is Mode.TRANSIT
    fly(agent, PRIMARY, last, SEES_TO_130_M)
    assert [status.state for status in agent.all(TaskStatus)][-1] is TaskState.DONE
    assert [state.mode for state in agent.all(AgentState)][-1] is Mode.FINISHED


def test_its_looks_at_a_strip_are_coverage_and_add_no_track() -> None:
    agent = surveyed()
    flown, node = len(agent.node.flown), agent.node  # type: ignore[attr-defined]
    before = node.coverage.layer.sum_levels.sum()  # type: ignore[attr-defined]
    offer(agent)
    fly(agent, PRIMARY, agent.last(Maneuver), SEES_TO_130_M)
    assert node.coverage.layer.sum_levels.sum() > before  # type: ignore[attr-defined]
    assert len(node.flown) == flown  # type: ignore[attr-defined]


def test_at_the_end_it_leaves_what_it_is_at() -> None:
    agent = surveyed()
    offer(agent)
    tell_status(agent, PRIMARY, agent.last(Maneuver).number, ManeuverState.ON_TRACK)
    agent.hear("coord/mission_over", MissionOver("enough"))
    assert agent.last(TaskStatus).state is TaskState.FAILED
    assert agent.last(Maneuver).kind is ManeuverKind.HOLD
    assert agent.last(AgentState).mode is Mode.FINISHED


def test_a_strip_beyond_its_battery_is_refused() -> None:
    agent = surveyed()
    agent.now_ms = 36_000_000 - 10_000
    status = offer(agent)
    assert (status.state, status.reason) == (TaskState.REFUSED, "the battery does not last")
