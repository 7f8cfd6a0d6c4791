"""What the surveys of a scenario come to before anything is flown: tracks, time, and what they do not cover; for
people, as JSON, and as GeoJSON."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import shapely
from shapely.geometry.base import BaseGeometry

from planner.area import SurveyArea
from planner.dubins import Pose
from planner.first_plan import FirstPlan
from planner.flyable import reachable
from planner.footprints import footprint_of
from planner.footprints.cells import seen_cells
from planner.sweep import pass_over
from planner.types import Point, Track
from planner.way_home import MARGIN_S
from planner.ways import shortest_way
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.fleet.roster import flows_of, way_home_of
from secondlook.fleet.survey_area import (
    check_tracks,
    keep_out_of,
    plan_for,
    region_for,
    region_of,
    track_heading_rad,
)
from secondlook.progress import in_seconds
from secondlook.recorded import GeographicOrigin
from secondlook.recorded.geojson import collection
from secondlook.scenario import Scenario, SurveyVehicle

LONGEST_S = 1e7
LEAST_SHARE = 1e-4
"""Less of the area than this is rounding."""


@dataclass(frozen=True)
class PlannedSurvey:
    """One vehicle's first plan. `heading_rad`: of the sweep frame, compass. `uncovered_share`: of its part of the area,
    how much lies nowhere between the nadir gap and the range it is told. `takes_s`: from its start to its last track's
    end; `home_s`: from there home. `lasts_for`: for how many tracks its battery lasts, and home after them."""

    name: str
    vehicle: SurveyVehicle
    heading_rad: float
    plan: FirstPlan
    uncovered_share: float
    takes_s: float
    home_s: float
    lasts_for: int

    @property
    def sentence(self) -> str:
        """Tracks, heading, length and coverage in words."""
        plan = self.plan
        covered = f"{self.uncovered_share:.2%} is not covered" if self.uncovered_share else "all is covered"
        in_parts = f" in {len(plan.parts)} convex parts" if len(plan.parts) > 1 else ""
        many = f"{plan.track_count} track{'' if plan.track_count == 1 else 's'}"
        return (
            f"{self.name}: {many} along {math.degrees(self.heading_rad):.4g} degrees{in_parts}, "
            f"{plan.length_m / 1000:.1f} km; up to {self.vehicle.told_range_m:g} m {covered}"
        )

    @property
    def warning(self) -> str:
        """That the battery will not last, in a sentence; else empty."""
        tracks, vehicle = self.plan.track_count, self.vehicle
        if self.lasts_for >= tracks:
            return ""
        return (
            f"{self.name}: its survey takes {in_seconds(self.takes_s)} and {in_seconds(self.home_s)} home, longer than "
            f"its endurance_s of {vehicle.endurance_s:g} less {vehicle.kept_s + MARGIN_S:g} to spare; "
            f"it will go home after {self.lasts_for} of {tracks} tracks"
        )


def planned_surveys(scenario: Scenario) -> list[PlannedSurvey]:
    """Of all survey vehicles, in the scenario's order. Raises UserError where the scenario makes no fleet or a spacing
    planner of the user's fails, and for a plan that no message or mission can hold."""
    build_fleet(scenario, record=False)  # refuses what makes none
    heading_rad = track_heading_rad(scenario)
    return [_planned(scenario, name, vehicle, heading_rad) for name, vehicle in scenario.survey_vehicles.items()]


def _planned(scenario: Scenario, name: str, vehicle: SurveyVehicle, heading_rad: float) -> PlannedSurvey:
    plan = plan_for(scenario, name, heading_rad)
    tracks = plan.all_tracks
    check_tracks(name, vehicle, len(tracks))
    region = region_for(scenario, vehicle, heading_rad)
    grid = region.about(heading_rad).grid(scenario.area.cell_m)
    inside = region.inside(grid)
    missed = inside & ~seen_cells(grid, tracks, footprint_of(vehicle.sonar).told(vehicle.told_range_m).reach)
    lead_m = footprint_of(vehicle.sonar).lead_m
    passes = [pass_over(track.start, track.end, vehicle.run_in_m, lead_m) for track in tracks]
    # The last track's run-out comes after its end.
    start, keep_out = _start(vehicle), keep_out_of(scenario)
    homeward, end = way_home_of(vehicle, scenario.current, keep_out, flows_of(scenario)), passes[-1].end
    run_out_s = homeward.sailing.straight_s(vehicle.run_in_m, end)
    home_s = run_out_s + homeward.from_pose(end)[0]
    lasts_for = homeward.passes_within(start, passes, vehicle.endurance_s - vehicle.kept_s - MARGIN_S)
    uncovered_share = float(missed.sum() / max(1, inside.sum()))
    takes_s = homeward.sailing.passes_s(passes, vehicle.turn_radius_m, start, keep_out) - run_out_s
    if not takes_s <= LONGEST_S:
        raise UserError(
            f"vehicles.{name}.speed_mps: {vehicle.speed_mps:g} is not allowed; must be larger, or the area smaller or "
            f"nearer, as its survey takes {in_seconds(takes_s)}, longer than a mission may, {LONGEST_S:g} s"
        )
    return PlannedSurvey(name, vehicle, heading_rad, plan, uncovered_share, takes_s, home_s, lasts_for)


def unreachable(scenario: Scenario, surveys: Sequence[PlannedSurvey]) -> list[str]:
    """What ground to keep out of leaves nobody, or a vehicle, no way to: a sentence each."""
    keep_out, region = keep_out_of(scenario), region_of(scenario).polygon
    if not keep_out:
        return []
    told = []
    for name, vehicle in scenario.vehicles.items():
        start = (vehicle.start.x_m, vehicle.start.y_m)
        if vehicle.body == "external":
            told.append(f"{name}: its body is not ours: it has to keep out of area.keep_out_m by itself")
        share = 1.0 - reachable(start, region, keep_out).area / region.area
        if share > LEAST_SHARE:
            told.append(
                f"{name}: {share:.2%} of the area lies where no way leads from its start past ground to keep out of"
            )
        if keep_out.are_parted(start, vehicle.home_m):
            told.append(f"{name}: no way past ground to keep out of leads from its start to its home")
    for survey in surveys:
        vehicle, here = survey.vehicle, _start(survey.vehicle)
        lead_m, without = footprint_of(vehicle.sonar).lead_m, []
        for track in survey.plan.all_tracks:
            begin, end = pass_over(track.start, track.end, vehicle.run_in_m, lead_m)
            if shortest_way(here, begin, vehicle.turn_radius_m, keep_out) is None:
                without.append(str(track.number))
            else:
                here = end
        if without:
            tracks = f"track {without[0]}" if len(without) == 1 else f"tracks {', '.join(without)}"
            told.append(
                f"{survey.name}: no way past ground to keep out of leads to {tracks}, of which it will look at nothing"
            )
    return told


def _start(vehicle: SurveyVehicle) -> Pose:
    return Pose(vehicle.start.x_m, vehicle.start.y_m, math.radians(vehicle.start.heading_deg))


def plan_as_text(surveys: Sequence[PlannedSurvey]) -> str:
    """Each survey's sentence, and a line a track under a heading a part: x east, y north, metres."""
    lines = []
    for survey in surveys:
        lines.append(f"{survey.sentence}; {in_seconds(survey.takes_s)} at {survey.vehicle.speed_mps:g} m/s")
        for number, (part, tracks, range_m) in enumerate(_parts(survey), start=1):
            frame = part.frame
            lines.append(
                f"part {number}: {part.width_m:.0f} m across, {part.length_m:.0f} m along, spaced for {range_m} m; "
                f"sweep frame at {_place((frame.origin_x_m, frame.origin_y_m))}, heading "
                f"{_degrees(frame.heading_rad):g} degrees"
            )
            lines += [
                f"  track {track.number:2}  at {track.across_m:7.1f} m across: {_place(track.start)} to "
                f"{_place(track.end)}, {track.length_m:.0f} m along {_degrees(track.heading_rad):g} degrees"
                for track in tracks
            ]
    return "\n".join(lines)


def plan_as_json(scenario: Scenario, surveys: Sequence[PlannedSurvey]) -> dict[str, Any]:
    """Everything in the mission frame: metres, x east, y north; compass headings in degrees."""
    return {
        "scenario": scenario.name,
        "surveys": [
            {
                "vehicle": survey.name,
                "heading_deg": _degrees(survey.heading_rad),
                "tracks": survey.plan.track_count,
                "turns": survey.plan.turns,
                "length_m": round(survey.plan.length_m, 1),
                "uncovered_share": survey.uncovered_share,
                "takes_s": round(survey.takes_s, 1),
                "endurance_s": survey.vehicle.endurance_s,
                "home_s": round(survey.home_s, 1),
                "tracks_before_going_home": survey.lasts_for,
                "parts": [_part(*part) for part in _parts(survey)],
            }
            for survey in surveys
        ],
    }


def plan_as_geojson(scenario: Scenario, surveys: Sequence[PlannedSurvey]) -> dict[str, Any]:
    """A FeatureCollection of the area and of each survey's parts and tracks; in degrees with the scenario's origin."""
    origin = None if scenario.origin is None else GeographicOrigin(**scenario.origin.model_dump())
    return collection(_features(scenario, surveys), origin)


def _features(scenario: Scenario, surveys: Sequence[PlannedSurvey]) -> Iterator[tuple[BaseGeometry, dict[str, Any]]]:
    yield region_of(scenario).polygon, {"kind": "area", "scenario": scenario.name}
    for number, zone in enumerate(scenario.area.keep_out, start=1):
        yield shapely.Polygon(zone), {"kind": "keep_out", "zone": number}
    for survey in surveys:
        for number, (part, tracks, range_m) in enumerate(_parts(survey), start=1):
            of = {"vehicle": survey.name, "part": number}
            yield shapely.Polygon(part.vertices), {"kind": "part", **of, "planned_range_m": range_m}
            for track in tracks:
                heading_deg = _degrees(track.heading_rad)
                told = {"kind": "track", **of, "number": track.number, "heading_deg": heading_deg}
                yield shapely.LineString([track.start, track.end]), told


def _parts(survey: PlannedSurvey) -> list[tuple[SurveyArea, tuple[Track, ...], int]]:
    return list(zip(survey.plan.parts, survey.plan.tracks, survey.plan.ranges_m, strict=True))


def _part(part: SurveyArea, tracks: Sequence[Track], range_m: int) -> dict[str, Any]:
    frame = part.frame
    return {
        "r_adpt_m": range_m,
        "frame": {
            "origin_m": _rounded((frame.origin_x_m, frame.origin_y_m)),
            "heading_deg": _degrees(frame.heading_rad),
        },
        "width_m": round(part.width_m, 3),
        "length_m": round(part.length_m, 3),
        "polygon_m": [_rounded(corner) for corner in part.vertices],
        "tracks": [
            {
                "number": track.number,
                "across_m": track.across_m,
                "start_m": _rounded(track.start),
                "end_m": _rounded(track.end),
                "heading_deg": _degrees(track.heading_rad),
            }
            for track in tracks
        ],
    }


def _degrees(heading_rad: float) -> float:
    return round(math.degrees(heading_rad), 3) % 360


def _rounded(place: Point) -> list[float]:
    return [round(along_m, 3) + 0.0 for along_m in place]


def _place(place: Point) -> str:
    x_m, y_m = (round(along_m, 1) + 0.0 for along_m in place)  # + 0.0: no -0.0
    return f"({x_m:.1f}, {y_m:.1f})"
