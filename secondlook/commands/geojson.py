"""`secondlook geojson`: a mission's area, tracks and strips for a map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from secondlook import load
from secondlook.errors import UserError
from secondlook.files import CannotWriteError, write_whole
from secondlook.recorded import GeographicOrigin, to_geojson


def geojson(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    origin: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LAT LON", help="Where x 0, y 0 is, degrees WGS84; the scenario's origin if left out."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="File to write; standard output if left out.")] = None,
) -> None:
    """Write area, tracks, paths, hotspots and strips as GeoJSON: in degrees with an origin, else in local metres."""
    try:
        place = None if origin is None else GeographicOrigin(*origin)
    except ValueError as error:
        raise UserError(f"--origin: {error}") from error
    text = json.dumps(to_geojson(load(run), place))
    if out is None:
        typer.echo(text)
        return
    try:
        write_whole(out, f"{text}\n")
    except CannotWriteError as error:
        raise UserError(f"--out {error}") from error
