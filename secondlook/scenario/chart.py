"""Charts: the area, holes, zones to keep out of, priorities and starts that a GeoJSON or KML file draws, in degrees."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import shapely

from comms.said.announcement import MOST_CORNERS, MOST_HOLE_CORNERS, MOST_ZONE_CORNERS
from secondlook.geography import UnknownGridError, utm_to_degrees
from secondlook.scenario.errors import shown

LARGEST_CHART_BYTES = 10_000_000
USUAL_WEIGHT = 3.0
ROLES = ("area", "hole", "keep_out", "priority", "start")
_ROLE_KEYS = ("role", "kind", "name", "title")
_NUMBER_KEYS = {"weight", "heading_deg"}
_ROLE = re.compile(rf"({'|'.join(ROLES).replace('_', '[ _-]?')})s?(?![a-z])[\s_:-]*(.*)", re.DOTALL)
_WGS84 = re.compile(r".*(crs84|epsg:+(4326|4979))", re.IGNORECASE)
_EPSG = re.compile(r".*epsg:+(?:[0-9.]*:)?([0-9]{1,6})", re.IGNORECASE)

Place = tuple[float, float]
"""Latitude and longitude, degrees WGS84."""
Ring = tuple[Place, ...]
"""Corners in order, each once."""


class ChartError(Exception):
    """A chart that cannot be used; `str()` says what is wrong with it, without its name."""


@dataclass(frozen=True)
class ChartStart:
    """Where a vehicle starts: its id, empty where none is given, and the compass heading."""

    vehicle: str
    place: Place
    heading_deg: float


@dataclass(frozen=True)
class Chart:
    """What a chart draws. `left_out` names each feature that was not understood, in a sentence."""

    area: Ring
    holes: tuple[Ring, ...] = ()
    keep_out: tuple[Ring, ...] = ()
    priorities: tuple[tuple[Ring, float], ...] = ()
    starts: tuple[ChartStart, ...] = ()
    left_out: tuple[str, ...] = ()


@dataclass
class _Feature:
    """A feature as drawn: what to call it in a sentence, its role and what its name says beside that."""

    called: str
    role: str | None
    rest: str
    geometry: dict[str, Any]
    properties: dict[str, Any]
    epsg: int | None

    def wrong(self, problem: str) -> ChartError:
        return ChartError(f"{self.called}: {problem}")


@dataclass
class _Drawn:
    areas: list[list[Ring]] = field(default_factory=list)
    holes: list[Ring] = field(default_factory=list)
    keep_out: list[Ring] = field(default_factory=list)
    priorities: list[tuple[Ring, float]] = field(default_factory=list)
    starts: list[ChartStart] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def read_chart(path: Path) -> Chart:
    """The chart in a file: KML, or GeoJSON as RFC 7946 has it, or with a member `crs` that names WGS84 or a UTM zone.

    A feature's role is told by its property `role`, `kind`, `name` or `title`: area, hole, keep_out (or keep-out),
    priority (with `weight`, 3 if left out) or start (with `vehicle` and `heading_deg`). A file's only polygon is the
    area whatever it is called.

    Raises:
        ChartError: the file cannot be read, or a feature of a known role cannot be used, or there is no area.
    """
    features = list(_features(_parsed(path)))
    polygons = [one for one in features if one.geometry["type"] in {"Polygon", "MultiPolygon"}]
    if len(polygons) == 1 and polygons[0].role is None:
        polygons[0].role = "area"
    drawn = _Drawn()
    for feature in features:
        _take(feature, drawn)
    if len(drawn.areas) != 1:
        count = "no feature is the area" if not drawn.areas else f"{len(drawn.areas)} features are areas"
        raise ChartError(f"{count}; must have one polygon whose role or name is area")
    outline, *holes = drawn.areas[0]
    return Chart(
        outline,
        (*holes, *drawn.holes),
        tuple(drawn.keep_out),
        tuple(drawn.priorities),
        tuple(drawn.starts),
        tuple(drawn.left_out),
    )


def read_points(path: Path) -> list[tuple[str, Place]]:
    """The points in such a file, each with what to call it in a sentence.

    Raises:
        ChartError: the file cannot be read, or holds something else than points.
    """
    found = []
    for feature in _features(_parsed(path)):
        if feature.geometry["type"] != "Point":
            raise feature.wrong(f"a {feature.geometry['type']} is not allowed; must be a Point")
        found.append((feature.called, _place(feature, feature.geometry.get("coordinates"))))
    return found


def _parsed(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_CHART_BYTES + 1)
    except (OSError, ValueError) as error:
        raise ChartError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if len(content) > LARGEST_CHART_BYTES:
        raise ChartError(f"larger than {LARGEST_CHART_BYTES} bytes; must be smaller")
    if not content.strip():
        raise ChartError("the file is empty; must be GeoJSON or KML")
    if content.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<"):
        return _kml(content)
    try:
        found = json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise ChartError(f"byte {content[error.start]:#04x} is not allowed; must be UTF-8 text") from None
    except json.JSONDecodeError as error:
        raise ChartError(f"line {error.lineno}, column {error.colno}: not JSON; must be GeoJSON or KML") from None
    except (ValueError, RecursionError):
        raise ChartError("not JSON that can be read; must be GeoJSON or KML") from None
    if not isinstance(found, dict) or "type" not in found:
        raise ChartError("not GeoJSON; must be a FeatureCollection, a Feature or a Polygon")
    return found


def _kml(content: bytes) -> dict[str, Any]:
    """The placemarks of a KML file as GeoJSON has features; names and extended data are their properties."""
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise ChartError(f"line {line}, column {column + 1}: not XML; must be GeoJSON or KML") from None
    except (ValueError, LookupError):
        raise ChartError("not XML that can be read; must be GeoJSON or KML") from None
    if root.tag.rpartition("}")[2] != "kml":
        raise ChartError("not KML; must be GeoJSON or KML")
    features = [
        {"type": "Feature", "properties": _kml_properties(placemark), "geometry": _kml_geometry(placemark)}
        for placemark in root.iterfind(".//{*}Placemark")
    ]
    return {"type": "FeatureCollection", "features": features}


def _kml_properties(placemark: ElementTree.Element) -> dict[str, Any]:
    found: dict[str, Any] = {"name": (placemark.findtext("{*}name") or "").strip()}
    for one in (*placemark.iterfind(".//{*}Data"), *placemark.iterfind(".//{*}SimpleData")):
        found[one.get("name", "")] = (one.findtext("{*}value") or one.text or "").strip()
    for key in _NUMBER_KEYS & found.keys():
        with suppress(ValueError):
            found[key] = float(found[key])
    return found


def _kml_geometry(placemark: ElementTree.Element) -> dict[str, Any] | None:
    """The geometry of a placemark; one of several parts, or none that charts have, keeps its name alone."""
    holder = placemark.find("{*}MultiGeometry")
    drawn = [one for one in (placemark if holder is None else holder) if one.tag.rpartition("}")[2] in _KML_GEOMETRIES]
    if len(drawn) != 1:
        return {"type": "MultiGeometry"} if drawn else None
    kind = drawn[0].tag.rpartition("}")[2]
    if kind == "Point":
        return {"type": kind, "coordinates": next(iter(_kml_positions(drawn[0])), None)}
    boundaries = [*drawn[0].iterfind("{*}outerBoundaryIs"), *drawn[0].iterfind("{*}innerBoundaryIs")]
    return {"type": kind, "coordinates": [_kml_positions(one) for one in boundaries]}


_KML_GEOMETRIES = ("Point", "LineString", "LinearRing", "Polygon", "Model", "Track")


def _kml_positions(element: ElementTree.Element) -> list[list[float] | str]:
    found: list[list[float] | str] = []
    for word in (element.findtext(".//{*}coordinates") or "").split():
        try:
            found.append([float(number) for number in word.split(",")])
        except ValueError:
            found.append(word)
    return found


def _features(found: dict[str, Any]) -> Iterator[_Feature]:
    epsg = _grid(found)
    match found:
        case {"type": "FeatureCollection", "features": list(features)}:
            pass
        case {"type": "FeatureCollection"}:
            raise ChartError("a FeatureCollection without features is not allowed; must have a list of them")
        case {"type": "Feature"}:
            features = [found]
        case {"type": "Polygon" | "MultiPolygon"}:
            features = [{"type": "Feature", "geometry": found, "properties": {}}]
        case {"type": kind}:
            raise ChartError(f"a {kind} is not allowed; must be a FeatureCollection, a Feature or a Polygon")
    for number, feature in enumerate(features, start=1):
        match feature:
            case {"type": "Feature", "geometry": {"type": str()} | None as geometry}:
                properties = feature.get("properties")
                properties = properties if isinstance(properties, dict) else {}
                role, rest = _role(properties)
                name = next((str(properties[key]) for key in _ROLE_KEYS if properties.get(key)), "")
                called = f"feature {number} ({name})" if name else f"feature {number}"
                yield _Feature(called, role, rest, geometry or {"type": "missing geometry"}, properties, epsg)
            case _:
                raise ChartError(f"feature {number}: must be a Feature with a geometry")


def _grid(found: dict[str, Any]) -> int | None:
    """The EPSG code of the grid in whose metres a file is; None where it is in degrees."""
    match found.get("crs"):
        case None:
            return None
        case {"properties": {"name": str(name)}}:
            if _WGS84.fullmatch(name):
                return None
            if (code := _EPSG.fullmatch(name)) is not None:
                return int(code[1])
            raise ChartError(f"crs {name} is not known; must be WGS84 or a UTM zone by its EPSG code")
        case _:
            raise ChartError("crs has no name; must be WGS84 or a UTM zone by its EPSG code")


def _role(properties: dict[str, Any]) -> tuple[str | None, str]:
    for key in _ROLE_KEYS:
        match = _ROLE.fullmatch(str(properties.get(key) or "").strip().lower())
        if match:
            return "keep_out" if match[1].startswith("keep") else match[1], match[2]
    return None, ""


def _take(feature: _Feature, drawn: _Drawn) -> None:
    match feature.role:
        case "area":
            drawn.areas.append(_rings(feature, holes=True))
        case "hole":
            drawn.holes.extend(_rings(feature, holes=False))
        case "keep_out":
            drawn.keep_out.extend(_rings(feature, holes=False))
        case "priority":
            weight = feature.properties.get("weight", USUAL_WEIGHT)
            if not _is_number(weight) or not 0 <= weight <= 100:
                raise feature.wrong(f"weight {shown(weight)} is not allowed; must be a number from 0 to 100")
            drawn.priorities.append((_rings(feature, holes=False)[0], float(weight)))
        case "start":
            drawn.starts.append(_start(feature))
        case _:
            kind = feature.geometry["type"]
            drawn.left_out.append(f"{feature.called}: a {kind} of unknown role; must be {', '.join(ROLES)}")


def _start(feature: _Feature) -> ChartStart:
    if feature.geometry["type"] != "Point":
        raise feature.wrong(f"a {feature.geometry['type']} is not allowed; must be a Point")
    heading_deg = feature.properties.get("heading_deg", 0.0)
    if not _is_number(heading_deg) or not 0 <= heading_deg < 360:
        said = shown(heading_deg)
        raise feature.wrong(f"heading_deg {said} is not allowed; must be a number from 0 to less than 360")
    vehicle = feature.properties.get("vehicle") or feature.rest
    return ChartStart(str(vehicle), _place(feature, feature.geometry.get("coordinates")), float(heading_deg))


def _rings(feature: _Feature, *, holes: bool) -> list[Ring]:
    """The outline of a polygon, then its holes if it may have some."""
    kind, coordinates = feature.geometry["type"], feature.geometry.get("coordinates")
    if kind == "MultiPolygon" and isinstance(coordinates, list) and len(coordinates) == 1:
        kind, coordinates = "Polygon", coordinates[0]
    if kind != "Polygon":
        several = " of several parts" if kind == "MultiPolygon" else ""
        raise feature.wrong(f"a {kind}{several} is not allowed; must be a Polygon")
    if not isinstance(coordinates, list) or not coordinates:
        raise feature.wrong("no coordinates; must be a list of rings")
    if len(coordinates) > 1 and not holes:
        raise feature.wrong("rings within it are not allowed; must be one ring")
    most = [
        {"area": MOST_CORNERS, "priority": MOST_CORNERS, "keep_out": MOST_ZONE_CORNERS}.get(
            feature.role or "", MOST_HOLE_CORNERS
        )
    ]
    most += [MOST_HOLE_CORNERS] * (len(coordinates) - 1)
    return [_ring(feature, ring, limit) for ring, limit in zip(coordinates, most, strict=True)]


def _ring(feature: _Feature, ring: object, most: int) -> Ring:
    if not isinstance(ring, list) or len(ring) < 4:
        raise feature.wrong("a ring is too short; must have three corners and its first position again")
    if ring[0] != ring[-1]:
        raise feature.wrong("a ring is not closed; must end with its first position")
    places = [_place(feature, position) for position in ring[:-1]]
    # Twice the same in a row is a slip of the hand that changes nothing.
    corners = tuple(place for index, place in enumerate(places) if place != places[index - 1])
    if len(corners) > most:
        raise feature.wrong(f"a ring has {len(corners)} corners; must have at most {most}")
    if len(corners) < 3 or not shapely.Polygon(corners).is_valid:
        raise feature.wrong("a ring's sides cross or touch; must be the corners in order")
    return corners


def _place(feature: _Feature, position: object) -> Place:
    if not isinstance(position, list) or len(position) < 2 or not all(map(_is_number, position)):
        raise feature.wrong(f"{shown(position)} is not allowed; must be longitude and latitude, two numbers")
    longitude_deg, latitude_deg = float(position[0]), float(position[1])
    if feature.epsg is not None:
        try:
            longitude_deg, latitude_deg = utm_to_degrees(feature.epsg, longitude_deg, latitude_deg)
        except UnknownGridError as error:
            raise ChartError(f"crs {error}") from error
    for name, value, limit in (("latitude", latitude_deg, 90), ("longitude", longitude_deg, 180)):
        if not -limit <= value <= limit:
            hint = "; charts have longitude first" if name == "latitude" and abs(value) <= 180 else ""
            raise feature.wrong(f"{name} {value:g} is not allowed; must be from -{limit} to {limit}{hint}")
    return latitude_deg, longitude_deg


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e9
