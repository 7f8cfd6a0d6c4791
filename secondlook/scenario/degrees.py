"""Degrees and UTM metres in a scenario: they become metres of the mission frame before the whole is validated."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, ValidationError
from pydantic_core import ErrorDetails

from comms.said.announcement import MOST_CORNERS, MOST_HOLE_CORNERS, MOST_HOLES, MOST_ZONE_CORNERS, MOST_ZONES
from secondlook.geography import GeographicOrigin, UnknownGridError, utm_to_degrees, utm_zone
from secondlook.scenario.area import Area, Priority
from secondlook.scenario.chart import ChartError, read_chart
from secondlook.scenario.current import Current, CurrentFromFile, GridCurrent, read_flows
from secondlook.scenario.errors import KeyPath
from secondlook.scenario.goal import MOST_WAY_POINTS, LaneGoal
from secondlook.scenario.link import Position
from secondlook.scenario.table import TableError
from secondlook.scenario.targets import PlacesFromFile, PlacesLayout
from secondlook.scenario.text import Value
from secondlook.scenario.values import Mapping, check_pair, refused
from secondlook.scenario.vehicle import Home, Start

FARTHEST_KM = 100

Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
# Beyond, a metre of easting is more degrees than a map can show.
FARTHEST_ORIGIN_DEG = 89
OriginLatitude = Annotated[float, Field(ge=-FARTHEST_ORIGIN_DEG, le=FARTHEST_ORIGIN_DEG)]

Point = Annotated[tuple[Latitude, Longitude], BeforeValidator(check_pair), Field(strict=False)]
Corners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_CORNERS)]
HoleCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_HOLE_CORNERS)]

ZoneCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_ZONE_CORNERS)]


def _check_zone(epsg: int) -> int:
    try:
        utm_zone(epsg)
    except UnknownGridError:
        raise refused("must be a UTM zone of WGS84 or ETRS89, such as 32632") from None
    return epsg


Epsg = Annotated[int, AfterValidator(_check_zone)]
Easting = Annotated[float, Field(ge=0, le=1_000_000)]
Northing = Annotated[float, Field(ge=0, le=10_000_000)]
UtmPoint = Annotated[tuple[Easting, Northing], BeforeValidator(check_pair), Field(strict=False)]
UtmCorners = Annotated[tuple[UtmPoint, ...], Field(strict=False, min_length=3, max_length=MOST_CORNERS)]
UtmZoneCorners = Annotated[tuple[UtmPoint, ...], Field(strict=False, min_length=3, max_length=MOST_ZONE_CORNERS)]
UtmHoleCorners = Annotated[tuple[UtmPoint, ...], Field(strict=False, min_length=3, max_length=MOST_HOLE_CORNERS)]


class Origin(Mapping):
    """The mission frame's origin, WGS84: x points east there, y to true north."""

    latitude_deg: OriginLatitude
    """Degrees north. Or `northing_m`."""
    longitude_deg: Longitude
    """Degrees east. Or `easting_m`."""


class OriginInUtm(Mapping):
    """The origin in UTM metres."""

    epsg: Epsg | None = None
    """The UTM zone of `easting_m` and `northing_m`; the area's if left out."""
    easting_m: Easting | None = None
    """In place of `longitude_deg`, with `northing_m`."""
    northing_m: Northing | None = None
    """In place of `latitude_deg`, with `easting_m`."""


class AreaInDegrees(Mapping):
    """What of an area may be given in degrees or in UTM metres, or drawn in a file."""

    polygon_deg: Corners | None = None
    """In place of `polygon_m`: the corners as [latitude, longitude], WGS84; the last may repeat the first."""
    holes_deg: Annotated[tuple[HoleCorners, ...], Field(strict=False, max_length=MOST_HOLES)] | None = None
    """In place of `holes_m`: the same for each hole."""
    keep_out_deg: Annotated[tuple[ZoneCorners, ...], Field(strict=False, max_length=MOST_ZONES)] | None = None
    """In place of `keep_out_m`: the same for each zone."""
    epsg: Epsg | None = None
    """The UTM zone of all that is given in UTM metres and names none itself: the EPSG code of a zone of WGS84, 32601 to
    32660 and 32701 to 32760, or of ETRS89, 25828 to 25838."""
    polygon_utm_m: UtmCorners | None = None
    """In place of `polygon_m`: the corners as [easting, northing]; the last may repeat the first."""
    holes_utm_m: Annotated[tuple[UtmHoleCorners, ...], Field(strict=False, max_length=MOST_HOLES)] | None = None
    """In place of `holes_m`: the same for each hole."""
    keep_out_utm_m: Annotated[tuple[UtmZoneCorners, ...], Field(strict=False, max_length=MOST_ZONES)] | None = None
    """In place of `keep_out_m`: the same for each zone."""
    file: str | None = None
    """In place of polygon, holes and zones to keep out of: a GeoJSON or KML file that draws them, relative to the
    scenario's. Its priorities follow those that are given here."""


class PriorityInDegrees(Mapping):
    """What of ground that counts more may be given in degrees or in UTM metres."""

    polygon_deg: Corners | None = None
    """In place of `polygon_m`: the corners as [latitude, longitude], WGS84; the last may repeat the first."""
    epsg: Epsg | None = None
    """The UTM zone of `polygon_utm_m`; the area's if left out."""
    polygon_utm_m: UtmCorners | None = None
    """In place of `polygon_m`: the corners as [easting, northing]; the last may repeat the first."""


class LaneInDegrees(Mapping):
    """What of a lane may be given in degrees or in UTM metres."""

    lane_deg: Annotated[tuple[Point, ...], Field(strict=False, min_length=2, max_length=MOST_WAY_POINTS)] | None = None
    """In place of `lane_m`: the points of its middle as [latitude, longitude], WGS84."""
    epsg: Epsg | None = None
    """The UTM zone of `lane_utm_m`; the area's if left out."""
    lane_utm_m: (
        Annotated[tuple[UtmPoint, ...], Field(strict=False, min_length=2, max_length=MOST_WAY_POINTS)] | None
    ) = None
    """In place of `lane_m`: the points of its middle as [easting, northing]."""


class PlaceInDegrees(Mapping):
    """What of a start, home or position may be given in degrees or in UTM metres."""

    latitude_deg: Latitude | None = None
    """In place of `y_m`, with `longitude_deg`: degrees north, WGS84."""
    longitude_deg: Longitude | None = None
    """In place of `x_m`, with `latitude_deg`: degrees east."""
    epsg: Epsg | None = None
    """The UTM zone of `easting_m` and `northing_m`; the area's if left out."""
    easting_m: Easting | None = None
    """In place of `x_m`, with `northing_m`."""
    northing_m: Northing | None = None
    """In place of `y_m`, with `easting_m`."""


IN_DEGREES: dict[type[BaseModel] | None, type[BaseModel]] = {
    Origin: OriginInUtm,
    Area: AreaInDegrees,
    Priority: PriorityInDegrees,
    LaneGoal: LaneInDegrees,
    Start: PlaceInDegrees,
    Home: PlaceInDegrees,
    Position: PlaceInDegrees,
    Current: CurrentFromFile,
    PlacesLayout: PlacesFromFile,
}
"""What may be given in degrees, in UTM metres or in a file in place of keys of a mapping."""

_GIVES: dict[str, tuple[str, ...]] = {
    "polygon_deg": ("polygon_m",),
    "polygon_utm_m": ("polygon_m",),
    "lane_deg": ("lane_m",),
    "lane_utm_m": ("lane_m",),
    "holes_deg": ("holes_m",),
    "holes_utm_m": ("holes_m",),
    "latitude_deg": ("y_m",),
    "longitude_deg": ("x_m",),
    "easting_m": ("x_m",),
    "northing_m": ("y_m",),
    "epsg": (),
    "keep_out_deg": ("keep_out_m",),
    "keep_out_utm_m": ("keep_out_m",),
    "file": ("polygon_m", "holes_m", "keep_out_m"),
}
_GIVES_ORIGIN = {"easting_m": ("longitude_deg",), "northing_m": ("latitude_deg",), "epsg": ()}
_PARTNER = {
    "latitude_deg": "longitude_deg",
    "longitude_deg": "latitude_deg",
    "easting_m": "northing_m",
    "northing_m": "easting_m",
}
_NOT_BESIDE = {
    **_GIVES,
    "polygon_utm_m": ("polygon_m", "polygon_deg"),
    "lane_utm_m": ("lane_m", "lane_deg"),
    "holes_utm_m": ("holes_m", "holes_deg"),
    "latitude_deg": ("x_m", "y_m"),
    "longitude_deg": ("x_m", "y_m"),
    "keep_out_utm_m": ("keep_out_m", "keep_out_deg"),
    "easting_m": ("x_m", "y_m", "latitude_deg", "longitude_deg"),
    "northing_m": ("x_m", "y_m", "latitude_deg", "longitude_deg"),
    "epsg": ("polygon_m", "lane_m", "x_m", "y_m"),
    "file": tuple(f"{key}_{ending}" for key in ("polygon", "holes", "keep_out") for ending in ("m", "deg", "utm_m")),
}
_NOT_BESIDE_FLOWS = (Current.model_fields.keys() | GridCurrent.model_fields.keys()) - {"keeps"}
_SEVERAL = ("holes", "keep_out")  # keys, without their ending, that hold several rings
NEEDS_ORIGIN = "must stand with origin, which tells where x 0, y 0 is: {latitude_deg: ..., longitude_deg: ...}"


@dataclass(frozen=True)
class InMetres:
    """A scenario's data with metres in place of degrees.

    `written` has, for each key of metres that degrees stand for, the key of degrees and its value, None where it is
    missing; `errors` what is wrong with the degrees, as pydantic would report it of the data as it was given.
    """

    data: dict[str, Value]
    written: dict[KeyPath, tuple[KeyPath, Value]] = field(default_factory=dict)
    errors: list[ErrorDetails] = field(default_factory=list)


class RefusedError(Exception):
    """What cannot be used: where it is, what was given, and what is allowed; or that it is missing."""

    def __init__(self, path: KeyPath, value: object, allowed: str, kind: str = "refused") -> None:
        super().__init__(allowed)
        self.details = ErrorDetails(type=kind, loc=path, msg=allowed, input=value, ctx={"allowed": allowed})


class _ToldError(Exception):
    """Nothing can be turned, for a reason that is told elsewhere."""


@dataclass(frozen=True)
class _Frame:
    """What places are turned about: the origin, and the UTM zone of eastings and northings, None for degrees."""

    origin: GeographicOrigin
    epsg: int | None = None

    def place_m(self, path: KeyPath, place: tuple[float, float]) -> list[Value]:
        """Of latitude and longitude, or of easting and northing. Where these are keys, `path` is the first one's."""
        longitude_deg, latitude_deg = place[::-1] if self.epsg is None else utm_to_degrees(self.epsg, *place)
        x_m, y_m = (float(one) for one in self.origin.to_metres(longitude_deg, latitude_deg))
        if not math.hypot(x_m, y_m) <= FARTHEST_KM * 1000:
            if path[:2] == ("area", "file"):
                said = f"latitude {place[0]:g}, longitude {place[1]:g} is not; charts have longitude first"
                raise RefusedError(path[:2], None, f"all must be within {FARTHEST_KM} km of origin, but {said}")
            hint = "; latitude comes first" if isinstance(path[-1], int) else ""
            if self.epsg is not None:
                hint = f"; easting comes first, and the zone is that of EPSG:{self.epsg}"
            if path[-1] in _PARTNER:  # told is the one that leads farther away
                east, north = ("longitude_deg", "latitude_deg") if self.epsg is None else ("easting_m", "northing_m")
                path = (*path[:-1], east if self._is_rather_east(longitude_deg, latitude_deg) else north)
            raise RefusedError(path, [*place], f"must be within {FARTHEST_KM} km of origin{hint}")
        return [round(x_m, 3) + 0.0, round(y_m, 3) + 0.0]

    def _is_rather_east(self, longitude_deg: float, latitude_deg: float) -> bool:
        """Whether a place lies farther to the east or west of the origin than to the north or south."""
        east_deg = abs((longitude_deg - self.origin.longitude_deg + 180) % 360 - 180)
        shrunk_deg = east_deg * math.cos(math.radians(self.origin.latitude_deg))
        return shrunk_deg > abs(latitude_deg - self.origin.latitude_deg)

    def ring_m(self, path: KeyPath, corners: Sequence[tuple[float, float]]) -> list[Value]:
        """Of a ring, whose last corner may be its first again."""
        return self.way_m(path, corners[:-1] if len(corners) > 3 and corners[0] == corners[-1] else corners)

    def way_m(self, path: KeyPath, points: Sequence[tuple[float, float]]) -> list[Value]:
        """Of points one after the other."""
        return [self.place_m((*path, index), point) for index, point in enumerate(points)]


def in_metres(data: dict[str, Value], folder: Path) -> InMetres:
    """Turns all that is given in degrees or UTM metres into metres about the scenario's origin, to the millimetre;
    files that draw an area or hold a current are looked for in the folder."""
    turned = InMetres(copy.deepcopy(data))
    for path, holder, model in _holders(turned.data):
        given = {key: holder[key] for key in model.model_fields if key in holder}
        if not given:
            continue
        gives = _GIVES_ORIGIN if model is OriginInUtm else _GIVES
        for key, value in given.items():
            turned.written.update({(*path, metres): ((*path, key), value) for metres in gives[key]})
            partner = _PARTNER.get(key)
            if partner is not None and partner not in given:  # one alone is none
                turned.written[*path, *gives[partner]] = ((*path, partner), None)
        try:
            checked = model.model_validate(given)
            for key, value in given.items():
                if others := [other for other in _NOT_BESIDE[key] if other in holder]:
                    raise RefusedError((*path, key), value, f"must be left out beside {' and '.join(others)}")
                if data.get("origin") is None and key != "epsg":
                    raise RefusedError((*path, key), value, NEEDS_ORIGIN)
            _turn(turned, path, holder, checked, data, folder)
        except ValidationError as error:
            turned.errors.extend({**one, "loc": (*path, *one["loc"])} for one in error.errors())
        except _ToldError:
            pass
        except RefusedError as error:
            if error.details["msg"] != NEEDS_ORIGIN or not any(one["msg"] == NEEDS_ORIGIN for one in turned.errors):
                turned.errors.append(error.details)
        for key in given:
            del holder[key]
    current = turned.data.get("current")
    if isinstance(current, dict) and "file" in current:
        _take_flows(turned, current, folder)
    return turned


def _holders(data: dict[str, Value]) -> Iterator[tuple[KeyPath, dict[str, Value], type[BaseModel]]]:
    """The mappings in which degrees or UTM metres may be given, the origin first."""
    mission = data.get("mission")
    goal = mission.get("goal") if isinstance(mission, dict) else None
    origin, area, vehicles = data.get("origin"), data.get("area"), data.get("vehicles")
    if isinstance(origin, dict):
        yield ("origin",), origin, OriginInUtm
    if isinstance(area, dict):
        yield ("area",), area, AreaInDegrees
        priorities = area.get("priorities")
        for index, one in enumerate(priorities if isinstance(priorities, list) else ()):
            if isinstance(one, dict):
                yield ("area", "priorities", index), one, PriorityInDegrees
    if isinstance(goal, dict) and goal.get("kind") == "lane":
        yield ("mission", "goal"), goal, LaneInDegrees
    for key, vehicle in vehicles.items() if isinstance(vehicles, dict) else ():
        for name in ("start", "home"):
            place = vehicle.get(name) if isinstance(vehicle, dict) else None
            if isinstance(place, dict):
                yield ("vehicles", key, name), place, PlaceInDegrees
    coordinator = data.get("coordinator")
    position = coordinator.get("position") if isinstance(coordinator, dict) else None
    if isinstance(position, dict):
        yield ("coordinator", "position"), position, PlaceInDegrees


def _take_flows(turned: InMetres, current: dict[str, Value], folder: Path) -> None:
    """Puts the flows that a current's file holds in its place."""
    path, file = ("current", "file"), current.pop("file")
    turned.written["current",] = path, file
    turned.written["current", "keeps"] = ("current", "keeps"), current.get("keeps")
    try:
        if not isinstance(file, str):
            raise RefusedError(path, file, "must be a text")
        if others := [key for key in current if key in _NOT_BESIDE_FLOWS]:
            raise RefusedError(path, file, f"must be left out beside {' and '.join(others)}")
        table = read_flows(folder / file)
        origin = None
        if table.is_in_degrees:
            if turned.data.get("origin") is None:
                raise RefusedError(path, file, NEEDS_ORIGIN)
            origin = GeographicOrigin(**Origin.model_validate(turned.data["origin"]).model_dump())
        current.update(table.written(origin))
        return
    except TableError as error:
        turned.errors.append(RefusedError(path, file, str(error)).details)
    except RefusedError as error:
        turned.errors.append(error.details)
    except ValidationError:
        pass  # of the origin: told when the whole is validated
    del turned.data["current"]


def _epsg(data: dict[str, Value], path: KeyPath, own: int | None) -> int:
    """The UTM zone that holds at a path: its own, or the area's."""
    area = data.get("area")
    found: Any = own if own is not None or not isinstance(area, dict) else area.get("epsg")
    if found is None:
        missing = ("area",) if isinstance(area, dict) and "polygon_utm_m" in area else path
        raise RefusedError((*missing, "epsg"), None, "must be given", kind="missing")
    try:
        utm_zone(found)
    except (UnknownGridError, TypeError):
        raise _ToldError from None
    return int(found)


def _turn(
    turned: InMetres,
    path: KeyPath,
    holder: dict[str, Value],
    checked: BaseModel,
    data: dict[str, Value],
    folder: Path,
) -> None:
    """Puts into a mapping of the scenario what its degrees or UTM metres are in metres; into the origin degrees."""
    if isinstance(checked, OriginInUtm):
        if checked.easting_m is not None and checked.northing_m is not None:
            epsg = _epsg(data, path, checked.epsg)
            place_deg = utm_to_degrees(epsg, checked.easting_m, checked.northing_m)
            if not abs(place_deg[1]) <= FARTHEST_ORIGIN_DEG:
                to_deg = f"-{FARTHEST_ORIGIN_DEG} to {FARTHEST_ORIGIN_DEG}"
                must = f"must lie at latitude {to_deg}, and lies at {place_deg[1]:.4f}"
                raise RefusedError((*path, "northing_m"), checked.northing_m, must)
            holder["longitude_deg"], holder["latitude_deg"] = (round(one, 9) for one in place_deg)
        return
    try:
        origin = GeographicOrigin(**Origin.model_validate(turned.data["origin"]).model_dump())
    except (KeyError, ValidationError):
        return  # told when the whole is validated, or needed by none
    frame = _Frame(origin)
    match checked:
        case PlaceInDegrees(latitude_deg=float(latitude_deg), longitude_deg=float(longitude_deg)):
            place = frame.place_m((*path, "latitude_deg"), (latitude_deg, longitude_deg))
            holder["x_m"], holder["y_m"] = place
        case PlaceInDegrees(easting_m=float(easting_m), northing_m=float(northing_m)):
            frame = replace(frame, epsg=_epsg(data, path, checked.epsg))
            holder["x_m"], holder["y_m"] = frame.place_m((*path, "easting_m"), (easting_m, northing_m))
        case LaneInDegrees(lane_deg=tuple(way)):
            holder["lane_m"] = frame.way_m((*path, "lane_deg"), way)
        case LaneInDegrees(lane_utm_m=tuple(way)):
            frame = replace(frame, epsg=_epsg(data, path, checked.epsg))
            holder["lane_m"] = frame.way_m((*path, "lane_utm_m"), way)
        case AreaInDegrees(file=str(file)):
            _take_chart(turned, holder, file, folder, frame)
        case AreaInDegrees() | PriorityInDegrees():
            for ending in ("deg", "utm_m"):
                given = {key: getattr(checked, f"{key}_{ending}", None) for key in ("polygon", *_SEVERAL)}
                if ending == "utm_m" and any(one is not None for one in given.values()):
                    frame = replace(frame, epsg=_epsg(data, path, checked.epsg))
                if (outline := given.pop("polygon")) is not None:
                    holder["polygon_m"] = frame.ring_m((*path, f"polygon_{ending}"), outline)
                for key, rings in given.items():
                    if rings is not None:
                        holder[f"{key}_m"] = [
                            frame.ring_m((*path, f"{key}_{ending}", index), ring) for index, ring in enumerate(rings)
                        ]


def _take_chart(turned: InMetres, area: dict[str, Value], file: str, folder: Path, frame: _Frame) -> None:
    """Puts what a file draws into the area."""
    path: KeyPath = ("area", "file")
    try:
        chart = read_chart(folder / file)
    except ChartError as error:
        raise RefusedError(path, file, str(error)) from error
    if chart.left_out:
        raise RefusedError(path, file, f"{chart.left_out[0]}; secondlook new leaves such features out")
    area["polygon_m"] = frame.ring_m(path, chart.area)
    area["holes_m"] = [frame.ring_m(path, hole) for hole in chart.holes]
    if chart.keep_out:
        area["keep_out_m"] = [frame.ring_m(path, zone) for zone in chart.keep_out]
    if chart.priorities and "priorities" not in area:
        turned.written["area", "priorities"] = (path, file)
    priorities = area.setdefault("priorities", [])
    if isinstance(priorities, list):
        for ring, weight in chart.priorities:
            turned.written["area", "priorities", len(priorities)] = (path, file)
            priorities.append({"polygon_m": frame.ring_m(path, ring), "weight": weight})
