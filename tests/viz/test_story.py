from __future__ import annotations

import numpy as np
import pytest

from comms.codec import Header
from comms.messages import (
    AgentState,
    ClockMode,
    Curve,
    Grid,
    Hotspot,
    HotspotState,
    ManeuverState,
    ManeuverStatus,
    Message,
    MissionOver,
    Mode,
    Plan,
    Role,
    RosterVehicle,
    RunInfo,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
    Vertex,
)
from comms.node import Received
from comms.topics import (
    CURVE,
    HOTSPOT,
    MANEUVER_STATUS,
    MISSION_OVER,
    PLAN,
    RUN,
    STATE,
    STRIP,
    TASK,
    TASK_STATUS,
    Topic,
)
from viz.story import Line, Story, number_of


def said(topic: Topic, message: Message, *, vehicle: str = "", number: int = 0) -> Received:
    return Received(topic.key(vehicle=vehicle, number=number), topic, vehicle, Header("x", 0, 0, 0), message)


def strip(state: StripState, reason: str = "") -> Received:
    return said(STRIP, StripStatus(1, state, 0, 0, 0, 200, 60, 1234.0, "", reason), number=3)


def task(state: TaskState, reason: str = "", progress: float = 0.0) -> Received:
    return said(TASK_STATUS, TaskStatus(3, state, progress, 90_400, reason), vehicle="helper", number=7)


def hotspot(state: HotspotState, merged_into: int = 0) -> Received:
    message = Hotspot(1, state, (), 0.8123, 40, growing=True, merged_into=merged_into)
    return said(HOTSPOT, message, vehicle="primary", number=5)


def test_the_run_is_introduced() -> None:
    area = tuple(Vertex(x, y) for x, y in ((0, 0), (1000, 0), (1000, 500), (0, 500)))
    vehicles = tuple(
        RosterVehicle(name, role, 1, 1, 1, 0, 100, 0.5, 1000)
        for name, role in (("primary", Role.SURVEY), ("helper", Role.REVISIT))
    )
    run = RunInfo(1, "tellaro", "0" * 64, 7, ClockMode.LOCKSTEP, area, Grid(0, 0, 0, 5, 2, 2), 0.0, vehicles)
    assert Story().tell(said(RUN, run)) == Line(
        "mission tellaro, seed 7: a survey of 0.50 km² by primary, second looks by helper"
    )


@pytest.mark.parametrize(
    ("received", "line"),
    [
        (said(PLAN, Plan(2, (), (), (), "one track more"), vehicle="primary"), Line("plan 2: one track more")),
        (said(PLAN, Plan(3, (), (), (), ""), vehicle="primary"), Line("plan 3")),
        (
            said(CURVE, Curve(4, 5.0, np.array([0.0, 0.4312, 0.2]), 130), vehicle="primary"),
            Line("track 4: r_eff 130 m, best P_d 0.43"),
        ),
        (
            said(CURVE, Curve(4, 5.0, np.array([]), 0), vehicle="primary"),
            Line("track 4: no range is admissible", warns=True),
        ),
        (said(TASK, Task(TaskAction.TAKE, 3, 0, 0, 0, 1, 1), vehicle="helper"), Line("helper, take strip 3")),
        (said(TASK, Task(TaskAction.GIVE_BACK, 3, 0, 0, 0, 1, 1), vehicle="helper"), Line("helper, give back strip 3")),
        (
            said(MANEUVER_STATUS, ManeuverStatus(9, ManeuverState.REFUSED, 0, "too short"), vehicle="primary"),
            Line("manoeuvre 9 refused: too short", warns=True),
        ),
        (said(MANEUVER_STATUS, ManeuverStatus(9, ManeuverState.DONE, 0, ""), vehicle="primary"), None),
        (said(STATE, AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0), vehicle="primary"), None),
        (said(MISSION_OVER, MissionOver("deadline")), Line("the mission is over: deadline")),
    ],
)
def test_one_line_a_message(received: Received, line: Line | None) -> None:
    assert Story().tell(received) == line


def test_only_changes_of_a_strip_are_told() -> None:
    story = Story()
    opened = Line("strip 3 open: 200 m x 60 m, 1234 m² of risk to remove")
    assert story.tell(strip(StripState.OPEN)) == opened
    assert story.tell(strip(StripState.OPEN)) is None
    assert story.tell(strip(StripState.UNDER_WAY)) is None
    assert story.tell(strip(StripState.OPEN)) == opened
    assert story.tell(strip(StripState.FAILED, "helper lost")) == Line("strip 3 failed: helper lost", warns=True)
    assert story.tell(strip(StripState.WITHDRAWN)) == Line("strip 3 withdrawn")


def test_only_changes_of_a_task_are_told() -> None:
    story = Story()
    assert story.tell(task(TaskState.ACCEPTED)) == Line("strip 3 accepted, done at about 90 s")
    assert story.tell(task(TaskState.UNDER_WAY)) == Line("strip 3 under way")
    assert story.tell(task(TaskState.UNDER_WAY, progress=0.5)) is None
    assert story.tell(task(TaskState.GIVEN_BACK)) == Line("strip 3 given back")
    assert story.tell(task(TaskState.REFUSED, "battery")) == Line("strip 3 refused: battery", warns=True)
    assert story.tell(task(TaskState.FAILED)) == Line("strip 3 failed", warns=True)
    assert story.tell(task(TaskState.DONE)) == Line("strip 3 done")


def test_only_changes_of_a_hotspot_are_told() -> None:
    story = Story()
    assert story.tell(hotspot(HotspotState.ACTIVE)) == Line("hotspot 5: 40 cells badly seen, mean residual risk 0.81")
    assert story.tell(hotspot(HotspotState.ACTIVE)) is None
    assert story.tell(hotspot(HotspotState.WITHDRAWN, merged_into=2)) == Line("hotspot 5 withdrawn, merged into 2")
    assert Story().tell(hotspot(HotspotState.WITHDRAWN)) == Line("hotspot 5 withdrawn")


def test_numbers_come_from_the_key() -> None:
    assert number_of(strip(StripState.OPEN)) == 3
    assert number_of(hotspot(HotspotState.ACTIVE)) == 5
