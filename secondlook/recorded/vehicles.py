"""What the vehicles did: who was at what from when until when, the tracks they planned and flew,
and where they have been."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from comms.node import Received
from comms.said.messages import AgentState, Message, MissionOver, Mode, Nav, Plan
from planner.dubins import Pose
from planner.reckoning import Course, Trace
from planner.types import FloatArray


@dataclass(frozen=True)
class Activity:
    """What a vehicle did from `begun_s` to `ended_s`. `works_on`: the number of its track or strip, 0 for none."""

    vehicle: str
    mode: Mode
    works_on: int
    begun_s: float
    ended_s: float


def activities(states: Iterable[Received[AgentState]], end_s: float) -> list[Activity]:
    """The activities of every vehicle, in the order of their beginning; the last of each goes on until `end_s`."""
    found: list[Activity] = []
    latest: dict[str, Received[AgentState]] = {}
    for one in states:
        before = latest.get(one.vehicle)
        if before is None:
            latest[one.vehicle] = one
        elif _what(before) != _what(one):
            found.append(_activity(before, one.t_s))
            latest[one.vehicle] = one
    found += [_activity(one, max(end_s, one.t_s)) for one in latest.values()]
    return sorted(found, key=lambda one: one.begun_s)


def _what(said: Received[AgentState]) -> tuple[Mode, int]:
    return said.message.mode, said.message.works_on


def _activity(said: Received[AgentState], ended_s: float) -> Activity:
    return Activity(said.vehicle, *_what(said), said.t_s, ended_s)


@dataclass(frozen=True)
class Ending:
    """How a vehicle has ended, and with which share of its battery.

    `how`: `home`, as its battery lasted for no more; `returning`, on its way there when the mission was over; `empty`,
    wherever that was; else `over`, where the mission ended with it. `ended_s`: when it was home, or its battery empty;
    else when its survey or the mission ended. `cut_short`: whether it has not ended its survey.
    """

    vehicle: str
    how: str
    ended_s: float
    battery_left: float
    cut_short: bool

    @property
    def words(self) -> str:
        """The same for people; nothing where the mission ended with it and its survey was done."""
        left = f"with {self.battery_left:.0%} of its battery"
        told = {
            "home": f"home at {self.ended_s:.0f} s {left}",
            "returning": f"on its way home at the end {left}",
            "empty": f"its battery was empty at {self.ended_s:.0f} s, not home",
        }.get(self.how, "")
        return ", ".join(filter(None, (told, "its survey is not finished" if self.cut_short else "")))


@dataclass(frozen=True)
class TrackRecord:
    """A track of a vehicle's last plan.

    `across_m`: its offset in the sweep frame. `planned_range_m`: the range its spacing was laid for, None where the
    plan does not say. `r_eff_m`: the range found on it, None if it was not flown. `begun_s`, `ended_s`: when its
    vehicle was on it, None if it never was. `line`: from its start to its end, mission frame.
    """

    vehicle: str
    number: int
    across_m: float
    flown: bool
    planned_range_m: int | None
    r_eff_m: int | None
    begun_s: float | None
    ended_s: float | None
    line: shapely.LineString


def tracks(plans: Iterable[Received[Plan]], done: Iterable[Activity]) -> list[TrackRecord]:
    """The tracks of each vehicle's last plan, by vehicle and number."""
    surveys = {(one.vehicle, one.works_on): one for one in done if one.mode is Mode.SURVEY}
    ranges_m: dict[tuple[str, int], int] = {}
    last: dict[str, Received[Plan]] = {}
    for said in plans:
        last[said.vehicle] = said
        # What is still to be flown is laid for the latest range.
        ahead = [track.number for track in said.message.tracks if not track.flown]
        ranges_m |= {(said.vehicle, number): said.message.r_adpt_m[-1] for number in ahead if said.message.r_adpt_m}
    return [track for _, said in sorted(last.items()) for track in _tracks(said, ranges_m, surveys)]


def _tracks(
    said: Received[Plan], ranges_m: dict[tuple[str, int], int], surveys: dict[tuple[str, int], Activity]
) -> Iterator[TrackRecord]:
    found_m = iter(said.message.r_eff_m)
    for track in said.message.tracks:
        survey = surveys.get((said.vehicle, track.number))
        yield TrackRecord(
            said.vehicle,
            track.number,
            track.across_m,
            track.flown,
            planned_range_m=ranges_m.get((said.vehicle, track.number)),
            r_eff_m=next(found_m, None) if track.flown else None,
            begun_s=survey.begun_s if survey else None,
            ended_s=survey.ended_s if survey else None,
            line=shapely.LineString([(track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m)]),
        )


@dataclass(frozen=True, eq=False)
class PathRecord:
    """Where a vehicle has been by its own account, mission frame; arrays of shape (n,), n >= 1, over time.

    `heading_rad`: compass heading.
    """

    vehicle: str
    t_s: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray

    @property
    def line(self) -> shapely.LineString:
        """The way from the first position to the last; empty where there is but one."""
        places = np.column_stack([self.x_m, self.y_m])
        return shapely.LineString(places if len(places) > 1 else None)

    @property
    def length_m(self) -> float:
        """Length of the way."""
        return float(self.line.length)


def paths(said: Iterable[Received[Message]], end_s: float) -> dict[str, PathRecord]:
    """The path of each vehicle that told its course: where it told that, and each second of such a course, until the
    mission is over or ends at `end_s`, or courses end that were told after it was over. `said`: courses and that it is
    over, in order."""
    rows: dict[str, list[tuple[int, Pose]]] = {}
    traces: dict[str, Trace] = {}

    def end(at_ms: int) -> None:
        for vehicle, trace in traces.items():
            rows[vehicle] += trace.end(at_ms)

    for one in said:
        if isinstance(one.message, MissionOver):
            end(one.header.sent_ms)
        elif isinstance(one.message, Nav):
            trace = traces.setdefault(one.vehicle, Trace(all_along=True))
            rows.setdefault(one.vehicle, []).extend(trace.hear(Course.of(one.message, one.header.sent_ms)))
    end(round(end_s * 1000))
    return {
        vehicle: PathRecord(vehicle, *np.array([(at_ms / 1000, *pose) for at_ms, pose in found]).T)
        for vehicle, found in rows.items()
    }
