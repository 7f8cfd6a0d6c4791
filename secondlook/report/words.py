"""The mission in words: what became of each strip, and the moments that changed the course of the mission."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry.base import BaseGeometry

from comms.said.messages import Hotspot, MissionOver, Mode, Plan, StripState
from planner.types import Point
from secondlook.geography import GeographicOrigin
from secondlook.recorded import RecordedMission, RiskMap, StripRecord
from secondlook.recorded.story import Line, Story

# The classes under which the style sheet knows the states.
FATE_CLASS = {
    StripState.OPEN: "left",
    StripState.NEXT: "left",
    StripState.OFFERED: "left",
    StripState.ACCEPTED: "begun",
    StripState.UNDER_WAY: "begun",
    StripState.DONE: "done",
    StripState.FAILED: "failed",
    StripState.WITHDRAWN: "withdrawn",
}
_IN_WORDS = {
    StripState.OPEN: "left",
    StripState.NEXT: "left",
    StripState.OFFERED: "left",
    StripState.ACCEPTED: "left: given to {vehicle}, not begun",
    StripState.UNDER_WAY: "left: begun by {vehicle}, and cut short",
    StripState.DONE: "seen again by {vehicle}",
    StripState.FAILED: "failed",
    StripState.WITHDRAWN: "withdrawn",
}
_TELLS_WHY = (StripState.FAILED, StripState.WITHDRAWN)


@dataclass(frozen=True)
class Fate:
    """A strip's line in the report. `risk_before` and `risk_after`: mean residual risk over it, by the primaries alone
    and by the whole fleet. Times are None where it never came so far. `ends_m`: of its centre line."""

    number: int
    css: str
    words: str
    vehicle: str
    cut_s: float
    begun_s: float | None
    ended_s: float | None
    length_m: float
    width_m: float
    risk_before: float
    risk_after: float
    history: list[tuple[float, str]]
    why: str
    foreseen: bool
    ends_m: tuple[Point, Point]


def fate_in_words(strip: StripRecord) -> str:
    """In a few words."""
    words = _IN_WORDS[strip.state].format(vehicle=strip.vehicle or "a helper")
    reason = strip.history[-1].reason
    return f"{words}: {reason}" if strip.state in _TELLS_WHY and reason else words


def fate(strip: StripRecord, before: RiskMap, after: RiskMap) -> Fate:
    """A strip's fate; `before` and `after`: the risk at the end by the primaries alone and by all."""
    last = strip.history[-1]
    cells = after.cells_within(strip.polygon)
    return Fate(
        number=strip.number,
        css=FATE_CLASS[strip.state],
        words=fate_in_words(strip),
        vehicle=strip.vehicle,
        cut_s=strip.history[0].t_s,
        begun_s=strip.first(StripState.UNDER_WAY),
        ended_s=last.t_s if last.state.has_ended else None,
        length_m=strip.strip.length_m,
        width_m=strip.strip.width_m,
        risk_before=before.mean_of(cells),
        risk_after=after.mean_of(cells),
        history=[(event.t_s, event.reason or event.state.value.replace("_", " ")) for event in strip.history],
        why=strip.why,
        foreseen=strip.foreseen,
        ends_m=(strip.strip.start, strip.strip.end),
    )


def place_in_words(origin: GeographicOrigin | None, x_m: float, y_m: float) -> str:
    """A place of the mission frame: its latitude and longitude where there is an origin, else its metres."""
    if origin is None:
        return f"x {x_m:.1f} m, y {y_m:.1f} m"
    longitude_deg, latitude_deg = (float(one) for one in origin.to_degrees(np.array(x_m), np.array(y_m)))
    longitude_deg = (longitude_deg + 180) % 360 - 180
    north, east = "N" if latitude_deg >= 0 else "S", "E" if longitude_deg >= 0 else "W"
    return f"{abs(latitude_deg):.6f}° {north} {abs(longitude_deg):.6f}° {east}"


def degrees_by_place(origin: GeographicOrigin, geometry: BaseGeometry) -> tuple[list[float], list[float]]:
    """Latitude and longitude over 1, x, y, x², xy and y², as they are over a geometry's bounding box: what differs
    within 10 km of the origin is less than a decimetre, but near the poles."""
    west_m, south_m, east_m, north_m = geometry.bounds
    x_m, y_m = (one.ravel() for one in np.meshgrid(np.linspace(west_m, east_m, 9), np.linspace(south_m, north_m, 9)))
    terms = np.column_stack([np.ones_like(x_m), x_m, y_m, x_m**2, x_m * y_m, y_m**2])
    scale = np.abs(terms).max(axis=0)
    longitude_deg, latitude_deg = origin.to_degrees(x_m, y_m)
    found = np.linalg.lstsq(terms / scale, np.column_stack([latitude_deg, longitude_deg]), rcond=None)[0]
    latitude, longitude = (found / scale[:, np.newaxis]).T.tolist()
    return latitude, longitude


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
    lines = [line for received in mission.received(*Story.telling) for line in story.tell(received)]
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
        goes_on = any(one.mode is Mode.SURVEY and one.begun_s > first.t_s for one in mission.activities)
        then = ", and goes on surveying" if goes_on else ""
        yield Moment(first.t_s, f"{first.vehicle} tells of the first badly seen place{then}")


def _begun_and_done(mission: RecordedMission) -> Iterator[Moment]:
    primaries, helpers = set(mission.primaries), set(mission.helpers)
    ends_s = over_s(mission)
    for one in mission.activities:
        if one.mode is Mode.REVISIT and one.vehicle in helpers:
            helpers.remove(one.vehicle)
            yield Moment(one.begun_s, f"{one.vehicle} begins its first second look, at strip {one.works_on}")
        if one.mode is Mode.FINISHED and one.vehicle in primaries and one.begun_s <= ends_s:
            primaries.remove(one.vehicle)
            yield Moment(one.begun_s, f"{one.vehicle} has finished the survey")
        if one.mode is Mode.RETURNING:
            primaries.discard(one.vehicle)
            yield Moment(one.begun_s, f"{one.vehicle} goes home, as its battery lasts for no more")
        if one.mode is Mode.HOME:
            yield Moment(one.begun_s, f"{one.vehicle} is home")
    for over in mission.said(MissionOver)[:1]:  # who has not heard it is told again
        yield Moment(over.t_s, f"the mission is over: {over.message.reason}")


def _warnings(mission: RecordedMission, log: Sequence[Line]) -> Iterator[Moment]:
    # What is given up because the mission is over went as planned.
    ends_s = over_s(mission)
    warnings = [line for line in log if line.warns and line.time_ms / 1000 <= ends_s]
    for line in warnings[:MOST_WARNINGS]:
        yield Moment(line.time_ms / 1000, f"{line.sender}: {line.text}", warns=True)
    if len(warnings) > MOST_WARNINGS:
        rest = len(warnings) - MOST_WARNINGS
        yield Moment(warnings[MOST_WARNINGS].time_ms / 1000, f"{rest} more warnings: see the log below", warns=True)


def over_s(mission: RecordedMission) -> float:
    """When the mission was over, or its last message, where nobody has said that it is. What is ended then is not
    finished; over a link vehicles may hear of it minutes later."""
    return min((over.t_s for over in mission.said(MissionOver)), default=mission.end_s)
