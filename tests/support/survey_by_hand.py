"""A survey agent in the hands of a test."""

from __future__ import annotations

from by_hand import PRIMARY, P_Detect, fly, nav, run_info, to_follow
from one_node import OneNode

from comms.said.announcement import Role, RunInfo
from planner.footprints.footprint import Footprint
from planner.footprints.side import SideLooking
from planner.spacing_planners import AdaptiveSpacing, SpacingPlanner
from planner.types import DetectionCurve, Point, SonarShape
from vehicle_agent.config import WHOLE, SurveyConfig
from vehicle_agent.survey import SurveyAgent

SMALL = run_info(360, 200, cell_m=10)


def survey(
    spacing: SpacingPlanner | None = None,
    *,
    nadir_gap_m: float = 40,
    range_m: float = 145,
    hotspot_risk: float = 0.6,
    footprint: Footprint | None = None,
    prior: DetectionCurve | None = None,
    share: tuple[float, float] = WHOLE,
    begin: Point | None = None,
) -> OneNode:
    """A survey agent that waits for the run."""
    config = SurveyConfig(
        vehicle=PRIMARY,
        spacing=spacing or AdaptiveSpacing(nadir_gap_m, range_m),
        footprint=footprint or SideLooking(SonarShape("side", nadir_gap_m, range_m)),
        nadir_gap_m=nadir_gap_m,
        range_m=range_m,
        threshold=0.05,
        hotspot_risk=hotspot_risk,
        run_in_m=20,
        endurance_ms=36_000_000,
        prior=prior,
        share=share,
        begin=begin,
    )
    return OneNode(SurveyAgent(config), Role.SURVEY)


def on_its_way(agent: OneNode | None = None, run: RunInfo = SMALL) -> OneNode:
    """The same, told of the run and of where its vehicle is."""
    agent = agent or survey()
    agent.hear("run", run, at_ms=1)
    agent.hear(f"veh/{PRIMARY}/nav", nav())
    return agent


def fly_all(agent: OneNode, p_detect: P_Detect, *, most: int = 60) -> None:
    """Flies every track that the agent asks for."""
    for _ in range(most):
        maneuver = to_follow(agent)
        if maneuver is None:
            return
        fly(agent, PRIMARY, maneuver, p_detect)
    raise AssertionError(f"the agent asks for more than {most} tracks")
