"""A mission's ground, tracks, paths, hotspots, strips, contacts and missed targets as GeoJSON, in metres or in degrees
on the WGS84 ellipsoid."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import shapely
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from secondlook.geography import GeographicOrigin
from secondlook.recorded.ground import polygon_of
from secondlook.recorded.mission import RecordedMission

LOCAL_FRAME = "local: metres, x east, y north of the mission frame's origin; not WGS84"
LOCAL_DECIMALS, DEGREE_DECIMALS = 3, 8  # a millimetre
PATH_STEP_M = 0.5  # how far a simplified path may lie off the positions that were told


Feature = tuple[BaseGeometry, dict[str, Any]]
"""A geometry of the mission frame and its properties."""


def to_geojson(mission: RecordedMission, origin: GeographicOrigin | None = None) -> dict[str, Any]:
    """A FeatureCollection; each feature's property `kind` is area, keep_out, priority, track, path, hotspot, strip,
    contact or missed_target. Beside a time in seconds stands the same in UTC where the scenario says when the mission
    began.

    Without an origin, given or in the scenario, coordinates are metres of the mission frame, and the member `frame`
    says so: most programs would take them for degrees. With one the collection is as RFC 7946 asks: WGS84, longitude
    first, outer rings counterclockwise, cut at the antimeridian; `frame` tells origin and projection.
    """
    return collection(features_of(mission), origin or mission.origin)


def collection(features: Iterable[Feature], origin: GeographicOrigin | None) -> dict[str, Any]:
    """A FeatureCollection as `to_geojson` tells; what is empty is left out."""
    frame = LOCAL_FRAME
    if origin is not None:
        place = f"latitude {origin.latitude_deg:.7f}, longitude {origin.longitude_deg:.7f}"
        frame = f"WGS84, from distance and bearing (x east, y north) at {place}"
    return {
        "type": "FeatureCollection",
        "frame": frame,
        "features": [
            {"type": "Feature", "geometry": drawn(geometry, origin), "properties": properties}
            for geometry, properties in features
            if not geometry.is_empty
        ],
    }


def features_of(mission: RecordedMission) -> Iterator[Feature]:
    """All that was planned, flown and found, and, to evaluate it, the targets that were missed."""
    for geometry, properties in (*_ground(mission), *_flown(mission), *_second_looks(mission), *_targets(mission)):
        times = {key: value for key, value in properties.items() if key.endswith("_s")}
        if mission.start_utc is not None:
            for key, t_s in times.items():
                properties[f"{key[:-2]}_utc"] = None if t_s is None else mission.utc(t_s)
        yield geometry, properties


def _ground(mission: RecordedMission) -> Iterator[Feature]:
    run = mission.run
    yield mission.area, {"kind": "area", "scenario": run.scenario, "seed": run.seed}
    yield from ((zone, {"kind": "keep_out", "zone": at}) for at, zone in enumerate(mission.keep_out, start=1))
    if not mission.priorities:
        return
    risk = mission.risk()
    for number, priority in enumerate(mission.priorities, start=1):
        ground = polygon_of(priority)
        mean = risk.mean_within(ground)
        properties = {"weight": priority.weight, "mean_risk": None if math.isnan(mean) else round(mean, 4)}
        yield ground, {"kind": "priority", "number": number, **properties}


def _flown(mission: RecordedMission) -> Iterator[Feature]:
    for track in mission.tracks:
        yield (
            track.line,
            {
                "kind": "track",
                "vehicle": track.vehicle,
                "number": track.number,
                "flown": track.flown,
                "planned_range_m": track.planned_range_m,
                "r_eff_m": track.r_eff_m,
                "begun_s": track.begun_s,
                "ended_s": track.ended_s,
            },
        )
    for path in mission.paths.values():
        line = path.line.simplify(PATH_STEP_M)
        yield (
            line,
            {
                "kind": "path",
                "vehicle": path.vehicle,
                "length_m": round(path.length_m, 1),
                "begun_s": float(path.t_s[0]),
                "ended_s": float(path.t_s[-1]),
            },
        )


def _second_looks(mission: RecordedMission) -> Iterator[Feature]:
    for hotspot in mission.hotspots:
        yield (
            hotspot.polygon,
            {
                "kind": "hotspot",
                "vehicle": hotspot.vehicle,
                "number": hotspot.number,
                "state": hotspot.state.value,
                "mean_risk": hotspot.mean_risk,
                "found_s": hotspot.found_s,
                "changed_s": hotspot.changed_s,
            },
        )
    for strip in mission.strips:
        yield (
            strip.polygon,
            {
                "kind": "strip",
                "number": strip.number,
                "state": strip.fate,
                "vehicle": strip.vehicle or None,
                "expected_m2": strip.expected_m2,
                "published_s": strip.history[0].t_s,
                "ended_s": strip.history[-1].t_s,
                "reason": strip.history[-1].reason,
                "why": strip.why,
                "foreseen": strip.foreseen,
            },
        )


def _targets(mission: RecordedMission) -> Iterator[Feature]:
    for contact in mission.contacts:
        yield (
            contact.point,
            {
                "kind": "contact",
                "vehicle": contact.vehicle,
                "number": contact.number,
                "score": round(contact.score, 3),
                "sigma_m": round(contact.sigma_m, 3),
                "found_s": contact.found_s,
            },
        )
    for one in mission.objects:
        yield (
            one.point,
            {
                "kind": "object",
                "contacts": one.contacts,
                "sigma_m": round(one.sigma_m, 3),
                "mine_chance": round(one.mine_chance, 3),
                "listed": one.listed,
            },
        )
    for target in mission.targets:
        if target.found_by is None:
            yield target.point, {"kind": "missed_target", "number": target.number, "evaluation": True}


def drawn(geometry: BaseGeometry, origin: GeographicOrigin | None) -> dict[str, Any]:
    """A geometry of the mission frame as GeoJSON has it, in metres, or in degrees with an origin."""
    if origin is not None:
        geometry = shapely.transform(geometry, lambda places: np.column_stack(origin.to_degrees(*places.T)))
        geometry = _cut_at_the_antimeridian(geometry)
    decimals = LOCAL_DECIMALS if origin is None else DEGREE_DECIMALS
    oriented = shapely.orient_polygons(geometry)
    found: dict[str, Any] = mapping(shapely.transform(oriented, lambda places: np.round(places, decimals)))
    return found


def _cut_at_the_antimeridian(geometry: BaseGeometry) -> BaseGeometry:
    """A geometry within -180 and 180 degrees; of what only touches the antimeridian nothing lies on its other side."""
    west, _, east, _ = np.round(geometry.bounds, DEGREE_DECIMALS)
    turns = (west + 180.0) // 360.0
    geometry = _turned_back(geometry, turns)
    if east - 360.0 * turns <= 180.0:
        return geometry
    pieces = []
    for turn in (0, 1):
        there = shapely.box(360 * turn - 180, -90, 360 * turn + 180, 90)
        pieces.append(_turned_back(shapely.intersection(geometry, there), turn))
    parts = shapely.get_parts(pieces)
    # A side on the antimeridian is in both: of the one as a line, which is no part of an area.
    return shapely.union_all(parts[shapely.get_dimensions(parts) == shapely.get_dimensions(geometry)])


def _turned_back(geometry: BaseGeometry, turns: float) -> BaseGeometry:
    return shapely.transform(geometry, lambda places: places - [360.0 * turns, 0.0])
