"""`secondlook mines`: how many mines a mission may have left, in its area, in a part of it, or along a lane."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import shapely
import typer
from shapely.geometry.base import BaseGeometry

from planner.clearance import MinesLeft
from planner.goal import Lane
from planner.types import Point
from secondlook.commands.given import Run
from secondlook.commands.reading import reading
from secondlook.errors import UserError
from secondlook.recorded import RecordedMission, load_run

FARTHEST_M = 1e7  # a quarter of the way round the earth
LEAST_M = 1.0  # what is less is most probably in degrees
LEAST_M2 = 0.01
WHOLE = 0.999
"""Share of a place from which on nothing is said of the rest: the straight ends of a lane reach over an edge askew."""


class _Units(NamedTuple):
    """How a point is given, in words, how far from 0 its two numbers may be, and an example of two."""

    words: str
    limits: tuple[float, float]
    such_as: str


METRES = _Units("X,Y in metres", (FARTHEST_M, FARTHEST_M), "600,20 600,380")
DEGREES = _Units("LAT,LON in degrees", (90.0, 180.0), "54.401,10.201 54.403,10.213")


def mines(
    run: Run,
    lane: Annotated[
        str | None,
        typer.Option(metavar="X,Y X,Y ...", help="Points of a lane's middle, in order: metres of the mission frame."),
    ] = None,
    lane_deg: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON LAT,LON ...", help="The same in degrees WGS84; the scenario then has an origin."),
    ] = None,
    width: Annotated[float | None, typer.Option(metavar="METRES", help="How wide the lane is.")] = None,
    polygon: Annotated[
        str | None, typer.Option(metavar="X,Y X,Y X,Y ...", help="Corners of a part, in the same metres.")
    ] = None,
    polygon_deg: Annotated[
        str | None, typer.Option(metavar="LAT,LON LAT,LON LAT,LON ...", help="The same in degrees.")
    ] = None,
) -> None:
    """Tell how many mines may be left in a mission's area at its end, or in what of it lies in a polygon or a lane, the
    clearance (with which chance a mine that lies there has been found), and the risk of a ship that passes
    there."""
    options = {"--lane": lane, "--lane-deg": lane_deg, "--polygon": polygon, "--polygon-deg": polygon_deg}
    given = {option: told for option, told in options.items() if told is not None}
    option = _chosen(list(given), width)
    points = _points(option, given[option]) if option else ()
    name = option.removeprefix("--").removesuffix("-deg") or "area"
    with reading("mines", 1.0) as on_read:
        mission = load_run(run, on_read)
        place = _place(option, given[option], points, width, mission) if option else None
        if place is not None and mission.area.intersection(place).area < LEAST_M2:
            raise UserError(f"{option}: nothing of the area lies there; must be a {name} of which {LEAST_M2:g} m² does")
        left = mission.mines_left(place)
    if left is None:
        raise UserError(f"{run}: nothing of the area was seen, so nothing can be said; must be a run with a look")
    surveyed = 1.0 if place is None else _surveyed(mission, place)
    typer.echo(_words(name, left, is_whole=surveyed >= WHOLE))
    if surveyed < WHOLE:
        typer.echo(f"of the {name} {surveyed:.0%} was to be surveyed; of the rest nothing is known")


def _chosen(options: list[str], width: float | None) -> str:
    """The option that tells a place, of those given; empty for the whole area. Raises UserError."""
    if len(options) > 1:
        raise UserError(f"{', '.join(options)}: must be one of these")
    option = options[0] if options else ""
    is_lane = option.startswith("--lane")
    if is_lane != (width is not None):
        raise UserError(f"{option if is_lane else '--lane'}, --width: must stand together, or neither")
    if width is not None and not 0.0 < width <= FARTHEST_M:
        raise UserError(f"--width: {width:g} is not allowed; must be metres, above 0 and at most {FARTHEST_M:g}")
    return option


def _points(option: str, told: str) -> tuple[Point, ...]:
    """As they are given, in metres or in degrees. Raises UserError."""
    units = DEGREES if option.endswith("-deg") else METRES
    points = []
    for one in told.split():
        first, comma, second = one.partition(",")
        try:
            point = float(first), float(second)
        except ValueError:
            point = math.nan, math.nan
        # A NaN is within no limit.
        if not comma or not all(abs(number) <= limit for number, limit in zip(point, units.limits, strict=True)):
            such_as = units.such_as.split()[0]
            raise UserError(f"{option}: {one!r} is not allowed; must be {units.words}, such as {such_as}")
        points.append(point)
    least = 2 if option.startswith("--lane") else 3
    if len(points) < least:
        raise UserError(f"{option}: {told!r} is not allowed; must be {least} points or more, such as {units.such_as}")
    return tuple(points)


def _place(
    option: str, told: str, points: tuple[Point, ...], width: float | None, mission: RecordedMission
) -> BaseGeometry:
    """Where a lane or a polygon lies, mission frame. Raises UserError."""
    if option.endswith("-deg"):
        points = _in_metres(option, points, mission)
        least, hint = f"{LEAST_M:g} m or more", ""
    else:
        least, hint = f"metres, {LEAST_M:g} or more", f"; degrees go under {option}-deg"
    if width is not None:
        if shapely.LineString(points).length < LEAST_M:
            raise UserError(f"{option}: {told!r} is not allowed; must be {least} from end to end{hint}")
        return Lane(points, width).outline
    if np.ptp(points, axis=0).max() < LEAST_M:
        raise UserError(f"{option}: {told!r} is not allowed; must be {least} across{hint}")
    outline = shapely.Polygon(points)
    if not outline.is_valid or outline.area == 0.0:
        raise UserError(f"{option}: {told!r} is not allowed; must be corners in order, of sides that do not cross")
    return outline


def _in_metres(option: str, points: tuple[Point, ...], mission: RecordedMission) -> tuple[Point, ...]:
    """Latitudes and longitudes as places of the mission frame. Raises UserError where it has no place on Earth."""
    if mission.origin is None:
        metres = option.removesuffix("-deg")
        raise UserError(f"{option}: the scenario of {mission.folder} has no origin; must be {metres}, in metres")
    latitude_deg, longitude_deg = np.transpose(points)
    x_m, y_m = mission.origin.to_metres(longitude_deg, latitude_deg)
    return tuple(zip(x_m.tolist(), y_m.tolist(), strict=True))


def _words(name: str, left: MinesLeft, *, is_whole: bool) -> str:
    about = f"{left.mean:.0f}" if left.mean >= 10.0 else f"{left.mean:.2f}"
    risk = f"{'' if is_whole else 'at least '}{1.0 - left.none:.1%}"
    return (
        f"in the {name} about {about} mines are left, {left.low} to {left.high} with 90 %; the clearance is "
        f"{left.clearance:.0%}; none is left with {left.none:.1%}, and the risk that one is: {risk}"
    )


def _surveyed(mission: RecordedMission, place: BaseGeometry) -> float:
    return float(mission.area.intersection(place).area / place.area)
