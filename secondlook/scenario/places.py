"""Targets whose places a file tells: they become part of the scenario, in metres, before the whole is validated."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from planner.types import FloatArray
from secondlook.geography import GeographicOrigin
from secondlook.scenario.area import Area
from secondlook.scenario.chart import ChartError, read_points
from secondlook.scenario.degrees import NEEDS_ORIGIN, InMetres, Origin, RefusedError
from secondlook.scenario.errors import KeyPath
from secondlook.scenario.table import (
    IN_DEGREES,
    PLACE_LIMITS,
    PLACES_IN_WORDS,
    TableError,
    check_columns,
    columns_refused,
    numbers_of,
    place_columns,
    rows_of,
)
from secondlook.scenario.targets import MOST_TARGETS, first_outside
from secondlook.scenario.text import Value

TABLES, CHARTS = (".csv",), (".geojson", ".json", ".kml")
FILE: KeyPath = ("targets", "layout", "file")


@dataclass(frozen=True)
class Places:
    """Places that a file tells: `east` and `north`, shape (places,), by longitude and latitude `in_degrees`, or by x
    and y of the mission frame; and what each is `called` there."""

    in_degrees: bool
    east: FloatArray
    north: FloatArray
    called: list[str]


def read_places(path: Path) -> Places:
    """The places in a CSV file, by columns `x_m` and `y_m` or `longitude_deg` and `latitude_deg`; or in a GeoJSON or
    KML file of points.

    Raises:
        TableError, ChartError: the file cannot be read, or is neither; `str()` says what is wrong and where.
    """
    if path.suffix in TABLES:
        return _read_table(path)
    if path.suffix in CHARTS:
        points = read_points(path)
        latitudes, longitudes = ([place[axis] for _, place in points] for axis in (0, 1))
        return _checked(Places(True, np.array(longitudes), np.array(latitudes), [called for called, _ in points]))
    raise TableError(f"must be a file of the kind {', '.join((*TABLES, *CHARTS))}")


def _read_table(path: Path) -> Places:
    rows = rows_of(path)
    heading = next(rows, (0, []))[1]
    check_columns(heading, PLACE_LIMITS, PLACES_IN_WORDS)
    columns = place_columns(heading)
    if columns is None:
        raise columns_refused(heading, PLACES_IN_WORDS)
    lines = [(line, numbers_of(line, heading, fields, PLACE_LIMITS)) for line, fields in rows]
    east, north = (np.array([numbers[name] for _, numbers in lines]) for name in columns)
    return _checked(Places(columns == IN_DEGREES, east, north, [f"line {line}" for line, _ in lines]))


def _checked(places: Places) -> Places:
    if not places.called:
        raise TableError("holds no place; must have one for each target")
    if len(places.called) > MOST_TARGETS:
        raise TableError(f"{places.called[MOST_TARGETS]}: more than {MOST_TARGETS} places; must be fewer")
    return places


def take_places(turned: InMetres, folder: Path) -> None:
    """Puts the places that a layout's file holds in its place; files are looked for in the folder."""
    targets = turned.data.get("targets")
    layout = targets.get("layout") if isinstance(targets, dict) else None
    if not isinstance(targets, dict) or not isinstance(layout, dict) or "file" not in layout:
        return
    file = layout.pop("file")
    turned.written[FILE[:-1]] = FILE, file
    try:
        if not isinstance(file, str):
            raise RefusedError(FILE, file, "must be a text")
        if layout:
            raise RefusedError(FILE, file, f"must be left out beside {' and '.join(layout)}")
        places = read_places(folder / file)
        x_m, y_m = places.east, places.north
        if places.in_degrees:
            if turned.data.get("origin") is None:
                raise RefusedError(FILE, file, NEEDS_ORIGIN)
            x_m, y_m = GeographicOrigin(**Origin.model_validate(turned.data["origin"]).model_dump()).to_metres(x_m, y_m)
        places_m: list[list[float]] = (np.round(np.column_stack([x_m, y_m]), 3) + 0.0).tolist()
        outside = first_outside(Area.model_validate(turned.data.get("area")), places_m)
        if outside is not None:
            east, north = places_m[outside]
            said = f"{places.called[outside]}: x {east:g}, y {north:g} is not"
            raise RefusedError(FILE, file, f"all must lie in the area, and {said}")
        layout.update({"kind": "places", "places_m": [list[Value](place) for place in places_m]})
        return
    except (TableError, ChartError) as error:
        turned.errors.append(RefusedError(FILE, file, str(error)).details)
    except RefusedError as error:
        turned.errors.append(error.details)
    except ValidationError:
        pass  # of origin or area: told when the whole is validated
    del targets["layout"]
