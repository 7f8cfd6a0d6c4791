"""`secondlook mines`: how many mines a mission may have left, in its area, in a part of it, or along a lane."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import shapely
import typer
from shapely.geometry.base import BaseGeometry

from planner.clearance import MinesLeft
from planner.goal import Lane
from secondlook.commands.reading import reading
from secondlook.errors import UserError
from secondlook.recorded import RecordedMission, load_run

FARTHEST_M = 1e7  # a quarter of the way round the earth
LEAST_M2 = 0.01
WHOLE = 0.999
"""Share of a place from which on nothing is said of the rest: the straight ends of a lane reach over an edge askew."""


def mines(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    lane: Annotated[
        str | None,
        typer.Option(metavar="X,Y X,Y ...", help="Points of a lane's middle, in order: metres of the mission frame."),
    ] = None,
    width: Annotated[float | None, typer.Option(metavar="METRES", help="How wide the lane is.")] = None,
    polygon: Annotated[
        str | None, typer.Option(metavar="X,Y X,Y X,Y ...", help="Corners of a part, in the same metres.")
    ] = None,
) -> None:
    """Tell how many mines may be left in a mission's area at its end, or in what of it lies in a polygon or a lane, the
    clearance (with which chance a mine that lies there has been found), and the risk of a ship that passes
    there."""
    name, place = _place(lane, width, polygon)
    with reading("mines", 1.0) as on_read:
        mission = load_run(run, on_read)
        if place is not None and mission.area.intersection(place).area < LEAST_M2:
            raise UserError(f"--{name}: nothing of the area lies there; must be a {name} of which {LEAST_M2:g} m² does")
        left = mission.mines_left(place)
    if left is None:
        raise UserError(f"{run}: nothing of the area was seen, so nothing can be said; must be a run with a look")
    surveyed = 1.0 if place is None else _surveyed(mission, place)
    typer.echo(_words(name, left, is_whole=surveyed >= WHOLE))
    if surveyed < WHOLE:
        typer.echo(f"of the {name} {surveyed:.0%} was to be surveyed; of the rest nothing is known")


def _place(lane: str | None, width: float | None, polygon: str | None) -> tuple[str, BaseGeometry | None]:
    """What it is called, and where it lies. Raises UserError."""
    if lane is not None and polygon is not None:
        raise UserError("--lane, --polygon: must be one of both")
    if (lane is None) != (width is None):
        raise UserError("--lane, --width: must stand together, or neither")
    if lane is not None and width is not None:
        if not 0.0 < width <= FARTHEST_M:
            raise UserError(f"--width: {width:g} is not allowed; must be metres, above 0 and at most {FARTHEST_M:g}")
        way = _points("--lane", lane, least=2)
        if shapely.LineString(way).length == 0.0:
            raise UserError(f"--lane: {lane!r} is not allowed; must be points that lie apart")
        return "lane", Lane(way, width).outline
    if polygon is not None:
        outline = shapely.Polygon(_points("--polygon", polygon, least=3))
        if not outline.is_valid or outline.area == 0.0:
            raise UserError(
                f"--polygon: {polygon!r} is not allowed; must be corners in order, of sides that do not cross"
            )
        return "polygon", outline
    return "area", None


def _points(option: str, told: str, least: int) -> tuple[tuple[float, float], ...]:
    points = []
    for one in told.split():
        x_m, comma, y_m = one.partition(",")
        try:
            point = float(x_m), float(y_m)
        except ValueError:
            point = math.nan, math.nan
        if not comma or not all(abs(one) <= FARTHEST_M for one in point):  # a NaN is not, either
            raise UserError(f"{option}: {one!r} is not allowed; must be X,Y in metres, such as 600,20")
        points.append(point)
    if len(points) < least:
        raise UserError(f"{option}: {told!r} is not allowed; must be {least} points or more, such as 600,20 600,380")
    return tuple(points)


def _words(name: str, left: MinesLeft, *, is_whole: bool) -> str:
    about = f"{left.mean:.0f}" if left.mean >= 10.0 else f"{left.mean:.2f}"
    risk = f"{'' if is_whole else 'at least '}{1.0 - left.none:.1%}"
    return (
        f"in the {name} about {about} mines are left, {left.low} to {left.high} with 90 %; the clearance is "
        f"{left.clearance:.0%}; none is left with {left.none:.1%}, and the risk that one is: {risk}"
    )


def _surveyed(mission: RecordedMission, place: BaseGeometry) -> float:
    return float(mission.area.intersection(place).area / place.area)
