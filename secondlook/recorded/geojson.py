"""A mission's area, tracks, paths, hotspots and strips as GeoJSON, in metres or in degrees on the WGS84 ellipsoid."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from planner.types import FloatArray
from secondlook.recorded.mission import RecordedMission

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)


@dataclass(frozen=True)
class GeographicOrigin:
    """Where the mission frame's origin is, WGS84: latitude from -89 to 89, longitude from -180 to 180.

    Raises ValueError outside of that.
    """

    latitude_deg: float
    longitude_deg: float

    def __post_init__(self) -> None:
        for name, value, limit in (("latitude", self.latitude_deg, 89), ("longitude", self.longitude_deg, 180)):
            if not -limit <= value <= limit:  # refuses NaN too
                raise ValueError(
                    f"{name} {value:g} is not allowed; must be a number of degrees from -{limit} to {limit}"
                )

    def to_degrees(self, x_m: FloatArray, y_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude of places in the mission frame.

        x and y are taken as the east and north of the plane that touches the ellipsoid at the origin; the point of the
        ellipsoid straight below a place is the answer. Within 10 km of the origin places are off by 2 cm at most.
        Longitudes go on beyond 180 degrees where the mission crosses the antimeridian.
        """
        latitude, longitude = math.radians(self.latitude_deg), math.radians(self.longitude_deg)
        sin, cos = math.sin(latitude), math.cos(latitude)
        prime_m = SEMI_MAJOR_M / math.sqrt(1 - ECCENTRICITY_2 * sin * sin)
        # Earth-centred, turned so that the origin's meridian is the x axis.
        out_m = prime_m * cos - sin * y_m
        up_m = prime_m * (1 - ECCENTRICITY_2) * sin + cos * y_m
        radius_m = np.hypot(out_m, x_m)
        # Bowring's formula, which at such heights is exact to the last digits.
        polar_m = SEMI_MAJOR_M * (1 - FLATTENING)
        reduced = np.arctan2(SEMI_MAJOR_M * up_m, polar_m * radius_m)
        second_2 = ECCENTRICITY_2 / (1 - ECCENTRICITY_2)
        found = np.arctan2(
            up_m + second_2 * polar_m * np.sin(reduced) ** 3,
            radius_m - ECCENTRICITY_2 * SEMI_MAJOR_M * np.cos(reduced) ** 3,
        )
        return np.degrees(longitude + np.arctan2(x_m, out_m)), np.degrees(found)


LOCAL_FRAME = "local: metres, x east, y north of the mission frame's origin; not WGS84"
LOCAL_DECIMALS, DEGREE_DECIMALS = 2, 7  # a centimetre
PATH_STEP_M = 0.5  # how far a simplified path may lie off the positions that were told


Features = Iterable[tuple[BaseGeometry, dict[str, Any]]]
"""Geometries of the mission frame, and the properties of each."""


def to_geojson(mission: RecordedMission, origin: GeographicOrigin | None = None) -> dict[str, Any]:
    """A FeatureCollection; each feature's property `kind` is area, track, path, hotspot or strip.

    Without an origin, given or in the scenario, coordinates are metres of the mission frame, and the member `frame`
    says so: most programs would take them for degrees. With one the collection is as RFC 7946 asks: WGS84, longitude
    first, outer rings counterclockwise, cut at the antimeridian; `frame` tells origin and projection.
    """
    if origin is None and "origin" in mission.scenario:
        origin = GeographicOrigin(**mission.scenario["origin"])
    return collection(_features(mission), origin)


def collection(features: Features, origin: GeographicOrigin | None) -> dict[str, Any]:
    """A FeatureCollection as `to_geojson` tells; what is empty is left out."""
    frame = LOCAL_FRAME
    if origin is not None:
        place = f"latitude {origin.latitude_deg:.7f}, longitude {origin.longitude_deg:.7f}"
        frame = f"WGS84, from the tangent plane (east, north) at {place}"
    return {
        "type": "FeatureCollection",
        "frame": frame,
        "features": [
            {"type": "Feature", "geometry": drawn(geometry, origin), "properties": properties}
            for geometry, properties in features
            if not geometry.is_empty
        ],
    }


def _features(mission: RecordedMission) -> Iterator[tuple[BaseGeometry, dict[str, Any]]]:
    run = mission.run
    yield mission.area, {"kind": "area", "scenario": run.scenario, "seed": run.seed}
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
        yield line, {"kind": "path", "vehicle": path.vehicle, "length_m": round(path.length_m, 1)}
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
                "state": strip.state.value,
                "vehicle": strip.vehicle or None,
                "expected_m2": strip.expected_m2,
                "published_s": strip.history[0].t_s,
                "ended_s": strip.history[-1].t_s,
                "reason": strip.history[-1].reason,
                "why": strip.why,
                "foreseen": strip.foreseen,
            },
        )


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
    west, _, east, _ = geometry.bounds
    if west >= -180 and east <= 180:
        return geometry
    pieces = [_moved_into_range(geometry, turn_deg) for turn_deg in (-360.0, 0.0, 360.0)]
    return shapely.union_all(pieces)


def _moved_into_range(geometry: BaseGeometry, turn_deg: float) -> BaseGeometry:
    """The part of a geometry that lies a turn away, brought back."""
    there = shapely.box(turn_deg - 180, -90, turn_deg + 180, 90)
    return shapely.transform(shapely.intersection(geometry, there), lambda places: places - [turn_deg, 0.0])
