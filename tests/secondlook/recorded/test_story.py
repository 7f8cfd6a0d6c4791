"""Which messages are worth a line in the log, and what the line says."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from comms.node import Received
from comms.said.announcement import ClockMode, Grid, Hole, Role, RosterVehicle, RunInfo, Vertex
from comms.said.codec import Header
from comms.said.messages import (
    AgentState,
    Curve,
    Hotspot,
    HotspotState,
    ManeuverState,
    ManeuverStatus,
    Message,
    MissionOver,
    Mode,
    Plan,
    PlannedTrack,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import (
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
from secondlook.recorded.story import Line, Story
from tests.viz.mission_stream import mission

TIME_MS = 5000


def said(topic: Topic, message: Message, *, vehicle: str = "", number: int = 0, time_ms: int = TIME_MS) -> Received:
    return Received(topic.key(vehicle=vehicle, number=number), topic, vehicle, Header("x", 0, 0, time_ms), message)


def strip(state: StripState, reason: str = "") -> Received:
    return said(STRIP, StripStatus(1, state, 0, 0, 0, 200, 60, 1234.0, "", reason), number=3)


def test_of_a_strip_it_is_told_why_it_is_there() -> None:
    found = strip(StripState.OPEN)
    assert isinstance(found.message, StripStatus)
    foreseen = replace(found.message, why="expected beside track 5: nadir gap", foreseen=True)
    (line,) = Story().tell(found._replace(message=foreseen))
    words = "strip 3 open: expected beside track 5: nadir gap; 200 m x 60 m, 1234 m² of risk to remove"
    assert line.text == words


def test_strips_of_a_coordinator_that_is_gone_are_told_when_the_next_one_speaks() -> None:
    story = Story()
    story.tell(strip(StripState.OPEN))
    over = said(MISSION_OVER, MissionOver("survey over"))
    told = story.tell(over._replace(header=Header("x", 1, 0, TIME_MS)))
    assert told == [
        *line("strip 3 withdrawn: its coordinator is gone"),
        *line("the mission is over: survey over"),
    ]


def task(state: TaskState, reason: str = "") -> Received:
    return said(TASK_STATUS, TaskStatus(3, state, 90_400, reason), vehicle="helper", number=7)


def hotspot(number: int, state: HotspotState = HotspotState.ACTIVE, *, time_ms: int = TIME_MS) -> Received:
    message = Hotspot(1, state, (), 0.8123, 40, growing=True, merged_into=0)
    return said(HOTSPOT, message, vehicle="primary", number=number, time_ms=time_ms)


def track(number: int, *, flown: bool) -> PlannedTrack:
    return PlannedTrack(number, 0, 0, 0, 0, 100, flown)


def line(text: str, *, warns: bool = False, time_ms: int = TIME_MS) -> list[Line]:
    return [Line(time_ms, "x", text, warns)]


def test_the_run_is_introduced() -> None:
    area = tuple(Vertex(x, y) for x, y in ((0, 0), (1000, 0), (1000, 500), (0, 500)))
    vehicles = tuple(
        RosterVehicle(name, role, 1, 1, 1, 0, 100, 0.5, 1000)
        for name, role in (("primary", Role.SURVEY), ("helper", Role.REVISIT))
    )
    run = RunInfo(1, "tellaro", "0" * 64, 7, ClockMode.LOCKSTEP, area, Grid(0, 0, 0, 5, 2, 2), 0.0, vehicles)
    assert Story().tell(said(RUN, run)) == line(
        "mission tellaro, seed 7: a survey of 0.50 km² by primary, second looks by helper"
    )
    hole = Hole(tuple(Vertex(x_m, y_m) for x_m, y_m in ((100, 100), (300, 100), (300, 300), (100, 300))))
    assert Story().tell(said(RUN, replace(run, holes=(hole,)))) == line(
        "mission tellaro, seed 7: a survey of 0.46 km² by primary, second looks by helper"
    )


@pytest.mark.parametrize(
    ("received", "lines"),
    [
        (said(PLAN, Plan(2, (), (), (), "one track more"), vehicle="primary"), line("plan 2: one track more")),
        (
            said(PLAN, Plan(3, (track(1, flown=True), track(2, flown=False)), (138, 120), (), ""), vehicle="primary"),
            line("plan 3: 1 of 2 tracks still to fly, spaced for 120 m"),
        ),
        (
            said(PLAN, Plan(4, (track(1, flown=True),), (138,), (), ""), vehicle="primary"),
            line("plan 4: 0 of 1 tracks still to fly"),
        ),
        (
            said(CURVE, Curve(4, 5.0, np.array([0.0, 0.4312, 0.2]), 130), vehicle="primary"),
            line("track 4: r_eff 130 m, best P_d 0.43"),
        ),
        (
            said(CURVE, Curve(0, 1.0, np.array([0.0, 0.5]), 120), vehicle="primary"),
            line("earlier missions: r_eff 120 m, best P_d 0.50"),
        ),
        (
            said(CURVE, Curve(4, 5.0, np.array([]), 0), vehicle="primary"),
            line("track 4: no range is admissible", warns=True),
        ),
        (said(TASK, Task(TaskAction.TAKE, 3, 0, 0, 0, 1, 1), vehicle="helper"), line("helper, take strip 3")),
        (said(TASK, Task(TaskAction.GIVE_BACK, 3, 0, 0, 0, 1, 1), vehicle="helper"), line("helper, give back strip 3")),
        (
            said(MANEUVER_STATUS, ManeuverStatus(9, ManeuverState.REFUSED, 0, "too short"), vehicle="primary"),
            line("manoeuvre 9 refused: too short", warns=True),
        ),
        (said(MANEUVER_STATUS, ManeuverStatus(9, ManeuverState.DONE, 0, ""), vehicle="primary"), []),
        (said(STATE, AgentState(Mode.IDLE, 0, 1, 0, 0, 0, 0), vehicle="primary"), []),
        (said(MISSION_OVER, MissionOver("deadline")), line("the mission is over: deadline")),
    ],
)
def test_one_line_a_message(received: Received, lines: list[Line]) -> None:
    assert Story().tell(received) == lines


def test_only_changes_of_a_strip_are_told() -> None:
    story = Story()
    opened = line("strip 3 open: 200 m x 60 m, 1234 m² of risk to remove")
    assert story.tell(strip(StripState.OPEN)) == opened
    assert story.tell(strip(StripState.OPEN)) == []
    assert story.tell(strip(StripState.UNDER_WAY)) == []
    assert story.tell(strip(StripState.OPEN)) == opened
    assert story.tell(strip(StripState.FAILED, "helper lost")) == line("strip 3 failed: helper lost", warns=True)
    assert story.tell(strip(StripState.WITHDRAWN)) == line("strip 3 withdrawn")


def test_the_way_home_is_told_once_and_an_empty_battery_is_a_warning() -> None:
    story = Story()

    def state(mode: Mode, battery: float) -> list[str]:
        one = said(STATE, AgentState(mode, 0, battery, 0, 0, 0, 0), vehicle="helper")
        return [line.text for line in story.tell(one)]

    assert state(Mode.IDLE, 0.4) == []
    assert state(Mode.RETURNING, 0.3) == ["on the way home, 30% of the battery left"]
    assert state(Mode.RETURNING, 0.25) == []
    assert state(Mode.HOME, 0.2) == ["home, 20% of the battery left"]
    empty = said(MANEUVER_STATUS, ManeuverStatus(3, ManeuverState.EMPTY, 10, "the battery is empty"), vehicle="helper")
    (line,) = story.tell(empty)
    assert (line.text, line.warns) == ("helper: the battery is empty, it lies where it is", True)


def test_only_changes_of_a_task_are_told() -> None:
    story = Story()
    assert story.tell(task(TaskState.ACCEPTED)) == line("strip 3 accepted, done at about 90 s")
    assert story.tell(task(TaskState.UNDER_WAY)) == line("strip 3 under way")
    assert story.tell(task(TaskState.UNDER_WAY)) == []
    assert story.tell(task(TaskState.GIVEN_BACK)) == line("strip 3 given back")
    assert story.tell(task(TaskState.REFUSED, "battery")) == line("strip 3 refused: battery", warns=True)
    assert story.tell(task(TaskState.FAILED)) == line("strip 3 failed", warns=True)
    assert story.tell(task(TaskState.DONE)) == line("strip 3 done")


def test_hotspots_of_one_time_share_a_line() -> None:
    story = Story()
    for number in (5, 6, 5, 7, 8, 9):
        assert story.tell(hotspot(number)) == []
    each = ", ".join(f"{number} (40 cells, risk 0.81)" for number in (5, 6, 7))
    assert story.tell(hotspot(6, HotspotState.WITHDRAWN, time_ms=TIME_MS + 1)) == line(
        f"hotspots: new {each} and 2 more"
    )
    assert story.tell(hotspot(5, time_ms=TIME_MS + 1)) == []
    assert story.rest() == line("hotspots: withdrawn 6", time_ms=TIME_MS + 1)
    assert story.rest() == []


def test_of_other_messages_there_is_nothing_to_tell() -> None:
    messages = mission()

    def told(heard: list[Received]) -> list[Line]:
        story = Story()
        return [line for received in heard for line in story.tell(received)] + story.rest()

    telling = [one for one in messages if isinstance(one.message, Story.telling)]
    assert len(telling) < len(messages) / 10
    assert told(telling) == told(messages)


def test_telling_needs_nothing_that_takes_long_to_import() -> None:
    program = "import sys, secondlook.recorded.story; print(sorted({'pydantic', 'shapely', 'yaml'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"  # the recorder's process would be late


def test_a_strip_that_is_taken_from_a_vehicle_at_the_end_is_left() -> None:
    story = Story()
    story.tell(strip(StripState.UNDER_WAY))
    left = strip(StripState.OPEN, "left when the mission was over: helper has not ended it")
    assert story.tell(left) == line("strip 3 left: helper has not ended it")
    assert story.tell(left) == []


def test_that_the_mission_is_over_is_told_once_however_often_it_is_said() -> None:
    story = Story()
    over = [said(MISSION_OVER, MissionOver("nothing is left"), time_ms=TIME_MS + 1000 * place) for place in range(3)]
    told = [line for one in over for line in story.tell(one)]
    assert [(line.time_ms, line.text) for line in told] == [(TIME_MS, "the mission is over: nothing is left")]
