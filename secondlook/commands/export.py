"""`secondlook geojson` and `secondlook export`: a mission for a map."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from secondlook.commands.given import Run
from secondlook.commands.reading import GEOJSON, reading
from secondlook.errors import UserError
from secondlook.export.kml import to_kml
from secondlook.export.risk_levels import NAMES, qgis_style, risk_levels
from secondlook.files import CannotWriteError, make_folder, whole_file, write_whole
from secondlook.progress import no_remark, shown_progress
from secondlook.recorded import GeographicOrigin, RecordedMission, load_run, to_geojson
from secondlook.recorded.geojson import collection, features_of
from secondlook.scenario import Scenario

Origin = Annotated[
    tuple[float, float] | None,
    typer.Option(metavar="LAT LON", help="Where x 0, y 0 is, degrees WGS84; the scenario's origin if left out."),
]

BEFORE_LEVELS = 0.1
"""Share of the time for all files that goes by before the risk is cut by levels."""


def geojson(
    run: Run,
    origin: Origin = None,
    out: Annotated[Path | None, typer.Option(help="File to write; standard output if left out.")] = None,
) -> None:
    """Write area, tracks, paths, hotspots, strips, contacts and missed targets as GeoJSON: in degrees with an origin,
    else in local metres."""
    place = _place(origin)
    with reading("geojson", GEOJSON) as on_read:
        mission = load_run(run, on_read)
        text = json.dumps(to_geojson(mission, place or _told_origin(mission)))
    if out is None:
        typer.echo(text)
        return
    try:
        write_whole(out, f"{text}\n")
    except CannotWriteError as error:
        raise UserError(f"--out {error}") from error


def export(
    run: Run,
    origin: Origin = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write to; RUN/export if left out.")] = None,
) -> None:
    """Write a mission for a geographic information system, in degrees: mission.geojson and mission.kml, the residual
    risk by levels as risk-levels.geojson with its style for QGIS, and cell by cell as risk.tif.

    risk.tif needs secondlook[geotiff].
    """
    place = _place(origin)
    with shown_progress("export", begins="reading") as tell:
        names = _export(run, load_run(run), place, out, lambda share: tell(share, no_remark))
    typer.echo("\n".join(names))
    if find_spec("rasterio") is None:
        typer.echo("risk.tif is left out: it needs rasterio, which the extra secondlook[geotiff] has", err=True)


def _export(
    run: Path,
    mission: RecordedMission,
    place: GeographicOrigin | None,
    out: Path | None,
    told: Callable[[float], None],
) -> list[str]:
    """Writes all files; their paths."""
    place = place or _told_origin(mission)
    if place is None:
        raise UserError(f"{run}: the scenario has no origin; must be given: --origin LAT LON")
    folder = out or run / "export"
    make_folder(folder)
    written = []
    for name, content in _files(mission, place, told):
        with whole_file(folder / name) as file:
            file.write(content)
        written.append(str(folder / name))
    return written


def _files(
    mission: RecordedMission, origin: GeographicOrigin, told: Callable[[float], None]
) -> Iterator[tuple[str, bytes]]:
    features = list(features_of(mission))
    yield "mission.geojson", json.dumps(collection(features, origin)).encode() + b"\n"
    yield "mission.kml", to_kml(mission.run.scenario, features, origin)
    told(BEFORE_LEVELS)
    risk, levels = mission.risk(), []
    for number, level in enumerate(risk_levels(risk), start=1):  # what takes longest
        levels.append(level)
        told(BEFORE_LEVELS + (1 - BEFORE_LEVELS) * number / len(NAMES))
    yield "risk-levels.geojson", json.dumps(collection(levels, origin)).encode() + b"\n"
    yield "risk-levels.qml", qgis_style()
    if find_spec("rasterio") is not None:
        yield "risk.tif", import_module("secondlook.export.geotiff").to_geotiff(risk, origin)


def _told_origin(mission: RecordedMission) -> GeographicOrigin | None:
    """The scenario's; None where it does not say. Raises UserError where the run's folder holds no scenario, which
    might have said."""
    if not mission.scenario.keys() & Scenario.model_fields.keys():
        file = mission.folder / "scenario.yaml"
        why = "holds no scenario" if file.exists() else "no such file"
        raise UserError(f"{file}: {why}, so that nothing tells the origin; must be given: --origin LAT LON")
    return mission.origin


def _place(origin: tuple[float, float] | None) -> GeographicOrigin | None:
    try:
        return None if origin is None else GeographicOrigin(*origin)
    except ValueError as error:
        raise UserError(f"--origin: {error}") from error
