"""The area that a scenario surveys."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator
from shapely import MultiPoint, MultiPolygon, Polygon, get_coordinates, get_parts, union_all
from shapely.geometry.base import BaseGeometry

from comms.said.announcement import MOST_CORNERS, MOST_HOLE_CORNERS, MOST_HOLES, MOST_ZONE_CORNERS, MOST_ZONES
from planner.types import PriorityGround, SweepFrame
from secondlook.scenario.values import TOLERANCE, Bin, Coordinate, Heading, Mapping, check_pair, refused

LARGEST_GRID_CELLS = 20_000_000
SMALLEST_PRIORITY_M2 = 1.0
SMALLEST_EXTENT_M = 1.0  # what is less is most probably in degrees
LEAST_NORTHING_M, MOST_NORTHING_M = 1e6, 1e7  # between them it is most probably in UTM metres


def _check_metres(value: object) -> object:
    pair = check_pair(value)
    northing = pair[1] if isinstance(pair, list | tuple) else None
    if isinstance(northing, int | float) and LEAST_NORTHING_M < northing < MOST_NORTHING_M:
        raise refused("must be metres of the mission frame; UTM metres go under a key that ends in _utm_m")
    return pair


Point = Annotated[tuple[Coordinate, Coordinate], BeforeValidator(_check_metres), Field(strict=False)]
Corners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_CORNERS)]
HoleCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_HOLE_CORNERS)]
ZoneCorners = Annotated[tuple[Point, ...], Field(strict=False, min_length=3, max_length=MOST_ZONE_CORNERS)]


def _check_outline(corners: tuple[Point, ...]) -> tuple[Point, ...]:
    for index, point in enumerate(corners):
        if point in corners[:index]:
            raise refused(f"must be the corners in order, each once, but ({point[0]:g}, {point[1]:g}) is repeated")
    if MultiPoint(corners).convex_hull.area < TOLERANCE:
        raise refused("must have an area, but all corners lie on one line")
    if np.ptp(corners, axis=0).max() < SMALLEST_EXTENT_M:
        raise refused(f"must be metres, {SMALLEST_EXTENT_M:g} or more across; degrees go under a key that ends in _deg")
    if not Polygon(corners).is_valid:
        raise refused("must be the corners in order, but its sides cross")
    announced = dict.fromkeys((round(x_m, 2), round(y_m, 2)) for x_m, y_m in corners)
    if len(announced) < 3 or not Polygon(announced).is_valid:
        raise refused("must keep its sides apart in whole centimetres, in which it is announced")
    return corners


Outline = Annotated[Corners, AfterValidator(_check_outline)]


def _check_word(value: object) -> object:
    if isinstance(value, str) and value != "auto":
        raise refused("must be a number of degrees, or auto")
    return value


TrackHeading = Annotated[
    Annotated[Heading, Tag("degrees")] | Annotated[Literal["auto"], Tag("auto")],
    Discriminator(lambda value: "auto" if value == "auto" else "degrees"),
    BeforeValidator(_check_word),
]


class Priority(Mapping):
    """Ground whose residual risk counts `weight` times when second looks are planned."""

    polygon_m: Outline
    """The corners in order, each once; it shares ground with what is surveyed. Or `polygon_deg`, or
    `polygon_utm_m`."""
    weight: Annotated[float, Field(ge=0, le=100)]
    """How often its residual risk counts. Only how weights compare matters."""

    @field_validator("polygon_m")
    @classmethod
    def _check_size(cls, polygon_m: tuple[Point, ...]) -> tuple[Point, ...]:
        if Polygon(polygon_m).area < SMALLEST_PRIORITY_M2:
            raise refused(f"must have an area of at least {SMALLEST_PRIORITY_M2:g} m2")
        return polygon_m


class Area(Mapping):
    """What is surveyed: a polygon in the mission frame, and holes in it that are not surveyed; how tracks lie; the
    map's cell; and ground that counts more in second looks."""

    polygon_m: Outline
    """The corners in order, each once; convex or not. Or `polygon_deg`, or `polygon_utm_m`."""
    holes_m: Annotated[tuple[HoleCorners, ...], Field(strict=False, max_length=MOST_HOLES)] = ()
    """The corners of each piece that lies in it and is not surveyed."""
    keep_out_m: Annotated[tuple[ZoneCorners, ...], Field(strict=False, max_length=MOST_ZONES)] | None = None
    """The corners of each zone that no vehicle may enter, such as land, moorings or a traffic lane: in the area, across
    its edge or beside it. What of the area lies in one is not surveyed, and all ways lead round."""
    track_heading_deg: TrackHeading = 0.0
    """Compass heading of the tracks, or `auto` for the one that needs the fewest."""
    cell_m: Annotated[Bin, Field(validate_default=True)] = 5.0
    """Cell of the residual-risk map, at most the shorter side of the area; the map has at most 20 million cells."""
    priorities: Annotated[tuple[Priority, ...], Field(strict=False, max_length=20)] = ()
    """Ground whose residual risk counts more in second looks, or less. Where several overlap the last one counts, and
    each must have ground that no later one covers. What is told of the risk that is left stays as it is; recording and
    report show where it lies."""

    @property
    def extent_m(self) -> tuple[float, float]:
        """Extent across and along the tracks; of the narrowest rectangle about it where their heading is `auto`."""
        return _extent_m(self.polygon_m, self.track_heading_deg)

    @field_validator("polygon_m")
    @classmethod
    def _check_extent(cls, polygon_m: tuple[Point, ...]) -> tuple[Point, ...]:
        if min(_extent_m(polygon_m, "auto")) < SMALLEST_EXTENT_M:
            raise refused(f"must be {SMALLEST_EXTENT_M:g} m or more across, wherever it is measured")
        return polygon_m

    @field_validator("holes_m")
    @classmethod
    def _check_holes(
        cls, holes_m: tuple[tuple[Point, ...], ...], info: ValidationInfo
    ) -> tuple[tuple[Point, ...], ...]:
        for hole in holes_m:
            _check_outline(hole)
        if "polygon_m" not in info.data:
            return holes_m
        holes = [Polygon(hole) for hole in holes_m]
        if not all(Polygon(info.data["polygon_m"]).contains_properly(hole) for hole in holes):
            raise refused("must lie inside the area, without touching its edge")
        if not MultiPolygon(holes).is_valid or any(
            one.intersects(other) for index, one in enumerate(holes) for other in holes[:index]
        ):
            raise refused("must not touch each other")
        return holes_m

    @field_validator("keep_out_m")
    @classmethod
    def _check_keep_out(
        cls, keep_out_m: tuple[tuple[Point, ...], ...] | None, info: ValidationInfo
    ) -> tuple[tuple[Point, ...], ...] | None:
        for zone in keep_out_m or ():
            _check_outline(zone)
        is_known = "polygon_m" in info.data and "holes_m" in info.data
        if keep_out_m and is_known and _surveyed(info.data, keep_out_m).area < SMALLEST_PRIORITY_M2:
            raise refused("must leave some of the area to survey")
        return keep_out_m or None

    @property
    def keep_out(self) -> tuple[tuple[Point, ...], ...]:
        """The zones that no vehicle may enter."""
        return self.keep_out_m or ()

    @field_validator("priorities")
    @classmethod
    def _check_priorities(cls, priorities: tuple[Priority, ...], info: ValidationInfo) -> tuple[Priority, ...]:
        if all(key in info.data for key in ("polygon_m", "holes_m", "keep_out_m")):
            area = _surveyed(info.data, info.data["keep_out_m"])
            if any(area.intersection(Polygon(one.polygon_m)).area < TOLERANCE for one in priorities):
                raise refused("must each share ground with what is surveyed")
            for number, ground in enumerate(_uncovered(area, priorities), start=1):
                if ground.area < TOLERANCE:  # they are told of by their number, so that none may be left out
                    raise refused(f"must each have ground that no later one covers, priority {number} has none")
        return priorities

    @field_validator("cell_m")
    @classmethod
    def _check_cells(cls, cell_m: float, info: ValidationInfo) -> float:
        if "polygon_m" not in info.data or "track_heading_deg" not in info.data:
            return cell_m
        across_m, along_m = _extent_m(info.data["polygon_m"], info.data["track_heading_deg"])
        shorter_m = min(across_m, along_m)
        if cell_m > shorter_m + TOLERANCE:
            raise refused(f"must be at most the area's shorter side, {shorter_m:g}")
        if across_m * along_m / cell_m**2 > LARGEST_GRID_CELLS:
            raise refused(f"must be larger, the map would have more than {LARGEST_GRID_CELLS} cells")
        return cell_m


def _surveyed(area: dict[str, Any], keep_out_m: tuple[tuple[Point, ...], ...] | None) -> BaseGeometry:
    """What is surveyed of an area that is outside all zones."""
    whole = Polygon(area["polygon_m"], area["holes_m"])
    return whole.difference(union_all([Polygon(zone) for zone in keep_out_m or ()]))


def _extent_m(polygon_m: tuple[Point, ...], track_heading_deg: float | Literal["auto"]) -> tuple[float, float]:
    if track_heading_deg == "auto":
        sides = np.diff(get_coordinates(Polygon(polygon_m).minimum_rotated_rectangle)[:3], axis=0)
        across_m, along_m = sorted(np.hypot(*sides.T).tolist())
        return across_m, along_m
    corners = np.array(polygon_m)
    across_m, along_m = SweepFrame(0, 0, math.radians(track_heading_deg)).to_sweep(corners[:, 0], corners[:, 1])
    return float(np.ptp(across_m)), float(np.ptp(along_m))


def _uncovered(area: BaseGeometry, priorities: Sequence[Priority]) -> list[BaseGeometry]:
    """Of each priority what lies in an area and under no later one."""
    found = []
    for one in reversed(priorities):
        outline = Polygon(one.polygon_m)
        found.append(outline.intersection(area))
        area = area.difference(outline)
    return found[::-1]


def priority_grounds(area: Polygon | MultiPolygon, priorities: Sequence[Priority]) -> list[PriorityGround]:
    """What counts more or less of an area: where several overlap the last one alone."""
    found: list[PriorityGround] = []
    for one, ground in zip(priorities, _uncovered(area, priorities), strict=True):
        # Where they only touch it is a line or a point.
        parts = [part for part in get_parts(ground) if isinstance(part, Polygon) and part.area]
        if parts:
            rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
            outlines = tuple(tuple((x_m, y_m) for x_m, y_m in ring.coords[:-1]) for ring in rings)
            found.append(PriorityGround(outlines, one.weight))
    return found
