"""Whatever valid messages an agent gets, it never raises, and all it says fits the wire."""

from __future__ import annotations

from by_hand import HELPER, PRIMARY, nav, run_info
from deliver import deliver
from hypothesis import given, settings
from hypothesis import strategies as st
from one_node import OneNode

from comms.said.announcement import Role
from comms.said.messages import AgentState, CoverageTile, Mode, TaskState, TaskStatus
from comms.said.topics import LOOK, MANEUVER_STATUS, MISSION_OVER, NAV, TASK
from planner.footprints.side import SideLooking
from planner.profile_spacing import JointSpacing
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing
from planner.types import SonarShape
from secondlook.testing.checks.any_mail import Letter, letters
from vehicle_agent.config import RevisitConfig, SurveyConfig
from vehicle_agent.revisit import RevisitAgent
from vehicle_agent.survey import SurveyAgent

SURVEY_MAIL = [(topic, [PRIMARY]) for topic in (LOOK, LOOK, LOOK, MANEUVER_STATUS, MANEUVER_STATUS, NAV)]
REVISIT_MAIL = [(topic, [HELPER]) for topic in (LOOK, LOOK, MANEUVER_STATUS, MANEUVER_STATUS, NAV, TASK, TASK, TASK)]
OVER = [(MISSION_OVER, [""])]
SEES = SideLooking(SonarShape("side", 0, 25))
RUNS = [run_info(300, 200, cell_m=10), run_info(77, 55, cell_m=3, heading_rad=2.0, rho=0.5)]


def said_soundly(node: OneNode) -> None:
    """Versions rise, each is of one tile, and after FINISHED an agent does nothing else until its battery is empty."""
    versions = list(dict.fromkeys(tile.version for tile in node.all(CoverageTile)))
    assert versions == list(range(1, len(versions) + 1))
    assert len({(tile.version, tile.first_row, tile.first_column) for tile in node.all(CoverageTile)}) == len(versions)
    modes = [state.mode for state in node.all(AgentState)]
    if Mode.FINISHED in modes:
        assert set(modes[modes.index(Mode.FINISHED) :]) <= {Mode.FINISHED, Mode.EMPTY}


@settings(max_examples=40, deadline=None)
@given(
    spacing=st.sampled_from(
        [AdaptiveSpacing(40, 145), FixedSpacing(40, 145), AdaptiveSpacing(0, 30), JointSpacing(40, 145)]
    ),
    run=st.sampled_from(RUNS),
    before=letters([*SURVEY_MAIL, *OVER], 3),
    mail=letters(SURVEY_MAIL, 25),
    after=letters([*SURVEY_MAIL, *OVER], 5),
)
def test_the_survey_agent(
    spacing: AdaptiveSpacing | FixedSpacing,
    run: object,
    before: list[Letter],
    mail: list[Letter],
    after: list[Letter],
) -> None:
    config = SurveyConfig(PRIMARY, spacing, SEES, spacing.nadir_gap_m, spacing.told_range_m, 0.05, 0.6, 20, 36_000_000)
    node = OneNode(SurveyAgent(config), Role.SURVEY)
    deliver(node, before)
    assert node.said == []
    deliver(node, [Letter("run", run, 1, None, 0), *mail, *after])
    said_soundly(node)


@settings(max_examples=40, deadline=None)
@given(run=st.sampled_from(RUNS), mail=letters(REVISIT_MAIL, 25), after=letters([*REVISIT_MAIL, *OVER], 5))
def test_the_revisit_agent(run: object, mail: list[Letter], after: list[Letter]) -> None:
    config = RevisitConfig(HELPER, SEES, speed_mps=2, turn_radius_m=6, run_in_m=5, endurance_ms=14_400_000)
    node = OneNode(RevisitAgent(config), Role.REVISIT)
    deliver(node, [Letter("run", run, 1, None, 0), Letter(f"veh/{HELPER}/nav", nav(), 0, None, 0), *mail, *after])
    said_soundly(node)
    at_work = 0
    for status in node.all(TaskStatus):
        if status.state is TaskState.ACCEPTED:
            assert at_work in (0, status.strip)
            at_work = status.strip
        elif status.state in (TaskState.DONE, TaskState.FAILED, TaskState.GIVEN_BACK) and status.strip == at_work:
            at_work = 0
