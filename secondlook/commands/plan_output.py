"""Planned surveys written out: for people, as JSON, and as GeoJSON."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import shapely
from shapely.geometry.base import BaseGeometry

from planner.area import SurveyArea
from planner.types import Point, Track
from secondlook.commands.planned_survey import PlannedSurvey
from secondlook.fleet.survey_area import region_of
from secondlook.recorded import GeographicOrigin
from secondlook.recorded.geojson import collection
from secondlook.scenario import Scenario


def plan_as_text(surveys: Sequence[PlannedSurvey]) -> str:
    """Each survey's sentence, and a line a track under a heading a part: x east, y north, metres."""
    lines = []
    for survey in surveys:
        lines.append(f"{survey.sentence}; {survey.takes_s:.0f} s at {survey.vehicle.speed_mps:g} m/s")
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
