"""The moments that mattered: what changed the course of the mission."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from comms.said.messages import Hotspot, MissionOver, Mode, Plan
from secondlook.recorded import RecordedMission
from viz.story import TELLING, Line, Story

MOST_WARNINGS = 6


@dataclass(frozen=True)
class Moment:
    """What happened when, in words; `warns` where something did not go as planned."""

    t_s: float
    text: str
    warns: bool = False


def log_lines(mission: RecordedMission) -> list[Line]:
    """The whole mission in plain words, as the recording has it."""
    story = Story()
    lines = [line for received in mission.received(*TELLING) for line in story.tell(received)]
    return sorted([*lines, *story.rest()], key=lambda line: line.time_ms)


def moments(mission: RecordedMission, log: Sequence[Line]) -> list[Moment]:
    """In the order of time. `log`: the mission's lines."""
    found = [*_plans(mission), *_found(mission), *_begun_and_done(mission), *_warnings(mission, log)]
    return sorted(found, key=lambda moment: moment.t_s)


def _plans(mission: RecordedMission) -> Iterator[Moment]:
    for plan in mission.said(Plan):
        if plan.message.note:
            yield Moment(plan.t_s, f"{plan.vehicle} plans: {plan.message.note}")


def _found(mission: RecordedMission) -> Iterator[Moment]:
    for first in mission.said(Hotspot)[:1]:
        yield Moment(first.t_s, f"{first.vehicle} tells of the first badly seen place, and goes on surveying")


def _begun_and_done(mission: RecordedMission) -> Iterator[Moment]:
    primaries, helpers = set(mission.primaries), set(mission.helpers)
    for one in mission.activities:
        if one.mode is Mode.REVISIT and one.vehicle in helpers:
            helpers.remove(one.vehicle)
            yield Moment(one.begun_s, f"{one.vehicle} begins its first second look, at strip {one.works_on}")
        if one.mode is Mode.FINISHED and one.vehicle in primaries:
            primaries.remove(one.vehicle)
            yield Moment(one.begun_s, f"{one.vehicle} has finished the survey")
    for over in mission.said(MissionOver):
        yield Moment(over.t_s, f"the mission is over: {over.message.reason}")


def _warnings(mission: RecordedMission, log: Sequence[Line]) -> Iterator[Moment]:
    # What is given up because the mission is over went as planned.
    over_s = min((over.t_s for over in mission.said(MissionOver)), default=mission.end_s)
    warnings = [line for line in log if line.warns and line.time_ms / 1000 <= over_s]
    for line in warnings[:MOST_WARNINGS]:
        yield Moment(line.time_ms / 1000, f"{line.sender}: {line.text}", warns=True)
    if len(warnings) > MOST_WARNINGS:
        rest = len(warnings) - MOST_WARNINGS
        yield Moment(warnings[MOST_WARNINGS].time_ms / 1000, f"{rest} more warnings: see the log below", warns=True)
