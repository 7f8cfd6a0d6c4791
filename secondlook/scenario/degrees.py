"""Degrees in a scenario: they become metres of the mission frame before the whole is validated."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, Field, ValidationError
from pydantic_core import ErrorDetails

from comms.said.announcement import MOST_CORNERS, MOST_HOLE_CORNERS, MOST_HOLES, MOST_ZONE_CORNERS, MOST_ZONES
from secondlook.geography import GeographicOrigin
from secondlook.scenario.area import Area, Priority
from secondlook.scenario.chart import ChartError, read_chart
from secondlook.scenario.errors import KeyPath
from secondlook.scenario.text import Value
from secondlook.scenario.values import Mapping, check_pair
from secondlook.scenario.vehicle import Start

FARTHEST_KM = 100

Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
# Beyond, a metre of easting is more degrees than a map can show.
OriginLatitude = Annotated[float, Field(ge=-89, le=89)]

Point = Annotated[tuple[Latitude, Longitude], BeforeValidator(check_pair), Field(strict=False)]
Corners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_CORNERS)]
HoleCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_HOLE_CORNERS)]

ZoneCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_ZONE_CORNERS)]


class Origin(Mapping):
    """The mission frame's origin, WGS84: x points east there, y north."""

    latitude_deg: OriginLatitude
    """Degrees north."""
    longitude_deg: Longitude
    """Degrees east."""


class AreaInDegrees(Mapping):
    """What of an area may be given in degrees, or drawn in a file."""

    polygon_deg: Corners | None = None
    """In place of `polygon_m`: the corners as [latitude, longitude], WGS84; the last may repeat the first."""
    holes_deg: Annotated[tuple[HoleCorners, ...], Field(strict=False, max_length=MOST_HOLES)] | None = None
    """In place of `holes_m`: the same for each hole."""
    keep_out_deg: Annotated[tuple[ZoneCorners, ...], Field(strict=False, max_length=MOST_ZONES)] | None = None
    """In place of `keep_out_m`: the same for each zone."""
    file: str | None = None
    """In place of polygon, holes and zones to keep out of: a GeoJSON or KML file that draws them, relative to the
    scenario's. Its priorities follow those that are given here."""


class PriorityInDegrees(Mapping):
    """What of ground that counts more may be given in degrees."""

    polygon_deg: Corners | None = None
    """In place of `polygon_m`: the corners as [latitude, longitude], WGS84; the last may repeat the first."""


class StartInDegrees(Mapping):
    """What of a start may be given in degrees."""

    latitude_deg: Latitude | None = None
    """In place of `y_m`, with `longitude_deg`: degrees north, WGS84."""
    longitude_deg: Longitude | None = None
    """In place of `x_m`, with `latitude_deg`: degrees east."""


IN_DEGREES: dict[type[BaseModel] | None, type[BaseModel]] = {
    Area: AreaInDegrees,
    Priority: PriorityInDegrees,
    Start: StartInDegrees,
}
"""What may be given in degrees in place of keys of a mapping."""

_GIVES = {
    "polygon_deg": ("polygon_m",),
    "holes_deg": ("holes_m",),
    "keep_out_deg": ("keep_out_m",),
    "latitude_deg": ("y_m",),
    "longitude_deg": ("x_m",),
    "file": ("polygon_m", "holes_m", "keep_out_m"),
}
_NOT_BESIDE = {
    **_GIVES,
    "latitude_deg": ("x_m", "y_m"),
    "longitude_deg": ("x_m", "y_m"),
    "file": ("polygon_m", "holes_m", "keep_out_m", "polygon_deg", "holes_deg", "keep_out_deg"),
}
_NEEDS_ORIGIN = "must stand with origin, which tells where x 0, y 0 is: {latitude_deg: ..., longitude_deg: ...}"


@dataclass(frozen=True)
class InMetres:
    """A scenario's data with metres in place of degrees.

    `written` has, for each key of metres that degrees stand for, the key of degrees and its value, None where it is
    missing; `errors` what is wrong with the degrees, as pydantic would report it of the data as it was given.
    """

    data: dict[str, Value]
    written: dict[KeyPath, tuple[KeyPath, Value]] = field(default_factory=dict)
    errors: list[ErrorDetails] = field(default_factory=list)


class _RefusedError(Exception):
    """Degrees that cannot be used: where they are, what was given, and what is allowed."""

    def __init__(self, path: KeyPath, value: object, allowed: str) -> None:
        super().__init__(allowed)
        self.details = ErrorDetails(type="refused", loc=path, msg=allowed, input=value, ctx={"allowed": allowed})


def in_metres(data: dict[str, Value], folder: Path) -> InMetres:
    """Turns all that is given in degrees into metres about the scenario's origin, to the millimetre; files that draw an
    area are looked for in the folder."""
    turned = InMetres(copy.deepcopy(data))
    for path, holder, model in _holders(turned.data):
        given = {key: holder[key] for key in model.model_fields if key in holder}
        if not given:
            continue
        for key, value in given.items():
            turned.written.update({(*path, metres): ((*path, key), value) for metres in _GIVES[key]})
        if model is StartInDegrees:  # of which one alone is none
            for key in model.model_fields.keys() - given.keys():
                turned.written[*path, *_GIVES[key]] = ((*path, key), None)
        try:
            checked = model.model_validate(given)
            for key, value in given.items():
                if others := [other for other in _NOT_BESIDE[key] if other in holder]:
                    raise _RefusedError((*path, key), value, f"must be left out beside {' and '.join(others)}")
                if data.get("origin") is None:
                    raise _RefusedError((*path, key), value, _NEEDS_ORIGIN)
            _turn(turned, path, holder, checked, folder)
        except ValidationError as error:
            turned.errors.extend({**one, "loc": (*path, *one["loc"])} for one in error.errors())
        except _RefusedError as error:
            if error.details["msg"] != _NEEDS_ORIGIN or not any(one["msg"] == _NEEDS_ORIGIN for one in turned.errors):
                turned.errors.append(error.details)
        for key in given:
            del holder[key]
    return turned


def _holders(data: dict[str, Value]) -> Iterator[tuple[KeyPath, dict[str, Value], type[BaseModel]]]:
    """The mappings in which degrees may be given."""
    area, vehicles = data.get("area"), data.get("vehicles")
    if isinstance(area, dict):
        yield ("area",), area, AreaInDegrees
        priorities = area.get("priorities")
        for index, one in enumerate(priorities if isinstance(priorities, list) else ()):
            if isinstance(one, dict):
                yield ("area", "priorities", index), one, PriorityInDegrees
    for key, vehicle in vehicles.items() if isinstance(vehicles, dict) else ():
        start = vehicle.get("start") if isinstance(vehicle, dict) else None
        if isinstance(start, dict):
            yield ("vehicles", key, "start"), start, StartInDegrees


def _turn(turned: InMetres, path: KeyPath, holder: dict[str, Value], checked: BaseModel, folder: Path) -> None:
    """Puts into a mapping of the scenario what its degrees are in metres."""
    try:
        origin = GeographicOrigin(**Origin.model_validate(turned.data["origin"]).model_dump())
    except ValidationError:
        return  # told when the whole is validated
    match checked:
        case StartInDegrees(latitude_deg=float(latitude_deg), longitude_deg=float(longitude_deg)):
            place = _place_m((*path, "latitude_deg"), (latitude_deg, longitude_deg), origin)
            holder["x_m"], holder["y_m"] = place
        case AreaInDegrees(file=str(file)):
            _take_chart(turned, holder, file, folder, origin)
        case AreaInDegrees() | PriorityInDegrees():
            if checked.polygon_deg is not None:
                holder["polygon_m"] = _ring_m((*path, "polygon_deg"), checked.polygon_deg, origin)
            if isinstance(checked, AreaInDegrees):
                for key, rings in (("holes", checked.holes_deg), ("keep_out", checked.keep_out_deg)):
                    if rings is not None:
                        in_deg = (*path, f"{key}_deg")
                        holder[f"{key}_m"] = [_ring_m((*in_deg, at), ring, origin) for at, ring in enumerate(rings)]


def _take_chart(turned: InMetres, area: dict[str, Value], file: str, folder: Path, origin: GeographicOrigin) -> None:
    """Puts what a file draws into the area."""
    path: KeyPath = ("area", "file")
    try:
        chart = read_chart(folder / file)
    except ChartError as error:
        raise _RefusedError(path, file, str(error)) from error
    if chart.left_out:
        raise _RefusedError(path, file, f"{chart.left_out[0]}; secondlook new leaves such features out")
    area["polygon_m"] = _ring_m(path, chart.area, origin)
    area["holes_m"] = [_ring_m(path, hole, origin) for hole in chart.holes]
    if chart.keep_out:
        area["keep_out_m"] = [_ring_m(path, zone, origin) for zone in chart.keep_out]
    if chart.priorities and "priorities" not in area:
        turned.written["area", "priorities"] = (path, file)
    priorities = area.setdefault("priorities", [])
    if isinstance(priorities, list):
        for ring, weight in chart.priorities:
            turned.written["area", "priorities", len(priorities)] = (path, file)
            priorities.append({"polygon_m": _ring_m(path, ring, origin), "weight": weight})


def _ring_m(path: KeyPath, corners: Sequence[tuple[float, float]], origin: GeographicOrigin) -> list[Value]:
    open_corners = corners[:-1] if len(corners) > 3 and corners[0] == corners[-1] else corners
    return [_place_m((*path, index), corner, origin) for index, corner in enumerate(open_corners)]


def _place_m(path: KeyPath, place: tuple[float, float], origin: GeographicOrigin) -> list[Value]:
    x_m, y_m = (float(one) for one in origin.to_metres(place[1], place[0]))
    if not math.hypot(x_m, y_m) <= FARTHEST_KM * 1000:
        if path[:2] == ("area", "file"):
            said = f"latitude {place[0]:g}, longitude {place[1]:g} is not; charts have longitude first"
            raise _RefusedError(path[:2], None, f"all must be within {FARTHEST_KM} km of origin, but {said}")
        hint = "; latitude comes first" if isinstance(path[-1], int) else ""
        raise _RefusedError(path, [*place], f"must be within {FARTHEST_KM} km of origin{hint}")
    return [round(x_m, 3) + 0.0, round(y_m, 3) + 0.0]
