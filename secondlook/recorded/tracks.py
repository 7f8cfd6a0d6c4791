"""The tracks of the survey vehicles, flown and planned."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import shapely

from comms.said.messages import Mode, Plan
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
    ranges_m: dict[tuple[str, int], int] = {}
    last: dict[str, Said[Plan]] = {}
    for said in plans:
        last[said.vehicle] = said
        # What is still to be flown is laid for the latest range.
        ahead = [track.number for track in said.message.tracks if not track.flown]
        ranges_m |= {(said.vehicle, number): said.message.r_adpt_m[-1] for number in ahead if said.message.r_adpt_m}
    return [track for _, said in sorted(last.items()) for track in _tracks(said, ranges_m, surveys)]


def _tracks(
    said: Said[Plan], ranges_m: dict[tuple[str, int], int], surveys: dict[tuple[str, int], Activity]
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
