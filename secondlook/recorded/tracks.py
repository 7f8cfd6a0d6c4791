"""The tracks of the survey vehicles, flown and planned."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import shapely

from comms.messages import Mode, Plan
from secondlook.recorded.activities import Activity
from secondlook.recorded.said import Said


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


def tracks(plans: Iterable[Said[Plan]], done: Iterable[Activity]) -> list[TrackRecord]:
    """The tracks of each vehicle's last plan, by vehicle and number."""
    surveys = {(one.vehicle, one.works_on): one for one in done if one.mode is Mode.SURVEY}
    last = {one.vehicle: one for one in plans}
    return [track for _, plan in sorted(last.items()) for track in _tracks(plan, surveys)]


def _tracks(said: Said[Plan], surveys: dict[tuple[str, int], Activity]) -> Iterable[TrackRecord]:
    plan, found_m = said.message, iter(said.message.r_eff_m)
    for index, track in enumerate(plan.tracks):
        # One range a pair; what is still to be planned has the latest.
        pair = min(index // 2, len(plan.r_adpt_m) - 1)
        survey = surveys.get((said.vehicle, track.number))
        yield TrackRecord(
            said.vehicle,
            track.number,
            track.across_m,
            track.flown,
            planned_range_m=plan.r_adpt_m[pair] if plan.r_adpt_m else None,
            r_eff_m=next(found_m, None) if track.flown else None,
            begun_s=survey.begun_s if survey else None,
            ended_s=survey.ended_s if survey else None,
            line=shapely.LineString([(track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m)]),
        )
