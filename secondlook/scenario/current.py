"""How the water flows in a scenario: everywhere alike, or from place to place and time to time, as a file has it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator

from planner.currents import FlowGrid
from planner.types import FloatArray, Point
from secondlook.geography import GeographicOrigin, longitudes_about
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
from secondlook.scenario.text import Value
from secondlook.scenario.values import TOLERANCE, Coordinate, Heading, Mapping, Speed, refused

MOST_NODES = 10_000
FASTEST_MPS = 30.0
DECIMALS = 4
"""Of flows in m/s that were read from a file."""
_LIMITS = {**PLACE_LIMITS, "time_s": 1e9, "east_mps": FASTEST_MPS, "north_mps": FASTEST_MPS}
_FLOWS = ("east_mps", "north_mps")


class Current(Mapping):
    """A current, everywhere alike, or from a file. Every vehicle is faster: it keeps its track by crabbing. What that
    does to its sonar besides, `sensor.half_at_crab_deg` tells."""

    set_deg: Heading
    """Compass heading towards which it flows. Or `file`."""
    drift_mps: Speed
    """How fast the water flows, at most. Or `file`."""
    period_s: Annotated[float, Field(ge=1, le=1e7)] | None = None
    """With a period it flows to and fro, as in a seiche or a tide, and when it is slack is drawn from the seed. Left
    out, it is steady. Not with `file`."""
    keeps: Literal["water", "ground"] = "water"
    """Of which kind the speed is that vehicles keep: through the `water`, so that with the stream they make good more
    than against it, or over the `ground`, whatever that takes."""

    @property
    def fastest(self) -> tuple[float, str]:
        """How fast it flows at most, in m/s, and where and when, in words."""
        return self.drift_mps, ""


class CurrentFromFile(Mapping):
    """What of a current may be in a file."""

    file: str | None = None
    """In place of `set_deg` and `drift_mps`: a CSV file with the flow over a grid of places, relative to the
    scenario's."""


Axis = Annotated[tuple[Coordinate, ...], Field(strict=False, min_length=1, max_length=MOST_NODES)]
Times = Annotated[
    tuple[Annotated[float, Field(ge=-1e9, le=1e9)], ...], Field(strict=False, min_length=1, max_length=MOST_NODES)
]
Component = Annotated[float, Field(ge=-FASTEST_MPS, le=FASTEST_MPS)]
Flows = Annotated[tuple[Component, ...], Field(strict=False, max_length=MOST_NODES)]


class GridCurrent(Mapping):
    """A current over a grid of places and times, as a file has told it (`file`), and as the scenario has it that is
    kept with a run. Between places and times it is linear; before the first time and after the last it is as then."""

    x_m: Axis
    """Places of the columns, ascending."""
    y_m: Axis
    """Places of the rows, ascending."""
    time_s: Times = (0.0,)
    """Seconds since the mission's start, ascending."""
    east_mps: Flows
    """The flow to the east at each, time by time, and then row by row."""
    north_mps: Flows
    """The flow to the north."""
    keeps: Literal["water", "ground"] = "water"
    """As of a current that is everywhere alike."""

    @field_validator("x_m", "y_m", "time_s")
    @classmethod
    def _check_ascending(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        for before, after in pairwise(values):
            if after <= before:
                raise refused(f"must ascend, but {after:g} follows {before:g}")
        return values

    @field_validator("east_mps", "north_mps")
    @classmethod
    def _check_count(cls, flows: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        if info.data.keys() >= {"x_m", "y_m", "time_s"}:
            count = math.prod(len(info.data[key]) for key in ("x_m", "y_m", "time_s"))
            if len(flows) != count:
                raise refused(f"must have an entry for each time, row and column, {count} and not {len(flows)}")
        return flows

    def outside(self, places: Iterable[Point]) -> str:
        """The first of some places, mission frame, that the grid does not hold, in words; else empty."""
        (west_m, east_m), (south_m, north_m) = ((axis[0], axis[-1]) for axis in (self.x_m, self.y_m))
        for x_m, y_m in places:
            within = west_m - TOLERANCE <= x_m <= east_m + TOLERANCE
            if not (within and south_m - TOLERANCE <= y_m <= north_m + TOLERANCE):
                held = f"x {west_m:g} to {east_m:g}, y {south_m:g} to {north_m:g}"
                return f"x {x_m:g}, y {y_m:g} lies outside of {held}"
        return ""

    @property
    def grid(self) -> FlowGrid:
        """The same for planning."""
        x_m, y_m, time_s = (np.array(one, dtype=np.float64) for one in (self.x_m, self.y_m, self.time_s))
        shape = time_s.size, y_m.size, x_m.size
        east_mps, north_mps = (np.array(one).reshape(shape) for one in (self.east_mps, self.north_mps))
        return FlowGrid(x_m, y_m, time_s, east_mps, north_mps)

    @property
    def fastest(self) -> tuple[float, str]:
        """How fast it flows at most, in m/s, and where and when, in words."""
        speeds_mps = np.hypot(self.east_mps, self.north_mps)
        at = int(speeds_mps.argmax())
        time, row, column = np.unravel_index(at, (len(self.time_s), len(self.y_m), len(self.x_m)))
        where = f" at x {self.x_m[column]:g}, y {self.y_m[row]:g}, {self.time_s[time]:g} s"
        return float(speeds_mps[at]), where


AnyCurrent = Annotated[
    Annotated[Current, Tag("alike")] | Annotated[GridCurrent, Tag("grid")],
    Discriminator(
        lambda value: (
            "grid" if isinstance(value, GridCurrent) or (isinstance(value, dict) and "east_mps" in value) else "alike"
        )
    ),
]


@dataclass(frozen=True)
class FlowTable:
    """What such a file holds. `columns`: those that tell places, to the east and to the north; `east`, `north`,
    `time_s`: the grid's axes, ascending; `east_mps`, `north_mps`: shape (times, rows, columns)."""

    columns: tuple[str, str]
    east: FloatArray
    north: FloatArray
    time_s: FloatArray
    east_mps: FloatArray
    north_mps: FloatArray

    @property
    def is_in_degrees(self) -> bool:
        """Whether places are told by longitude and latitude."""
        return self.columns == IN_DEGREES

    def written(self, origin: GeographicOrigin | None) -> dict[str, Value]:
        """The keys of a `GridCurrent` in the mission frame; `origin`: of that, not None for places in degrees.

        A grid in degrees lies a little askew in that frame: the flow is taken at as many places of one in metres.
        """
        east, north, flows_mps = self.east, self.north, np.stack([self.east_mps, self.north_mps])
        if origin is not None:
            east, order = np.unique(longitudes_about(origin.longitude_deg, east), return_index=True)
            grid = FlowGrid(east, north, self.time_s, *flows_mps[..., order])
            x_m, y_m = origin.to_metres(*np.meshgrid(east, north))
            east, north = (np.linspace(one.min(), one.max(), one.shape[axis]) for one, axis in ((x_m, 1), (y_m, 0)))
            flows_mps = grid.flows_mps(*origin.to_degrees(*np.meshgrid(east, north)))
        axes = {"x_m": np.round(east, 3), "y_m": np.round(north, 3), "time_s": self.time_s}
        values = {name: np.round(one, DECIMALS).ravel() + 0.0 for name, one in zip(_FLOWS, flows_mps, strict=True)}
        return {name: one.tolist() for name, one in {**axes, **values}.items()}


def read_flows(path: Path) -> FlowTable:
    """The flows in a CSV file: a line with the columns' names, `east_mps` and `north_mps`, `x_m` and `y_m` or
    `longitude_deg` and `latitude_deg`, and `time_s` where they change; then a line for each place and time of a grid,
    in any order. Lines that begin with # count for nothing.

    Raises:
        TableError: the file cannot be read, or is no such table.
    """
    rows = rows_of(path)
    heading = next(rows, (0, []))[1]
    columns = _columns(heading)
    found: dict[tuple[float, ...], tuple[float, ...]] = {}
    for line, fields in rows:
        numbers = numbers_of(line, heading, fields, _LIMITS)
        node = (numbers.get("time_s", 0.0), numbers[columns[1]], numbers[columns[0]])
        if node in found:
            raise TableError(f"line {line}: {_named(columns, node)} is given again; must be given once")
        if len(found) == MOST_NODES:
            raise TableError(f"line {line}: more than {MOST_NODES} places and times; must be fewer")
        found[node] = numbers["east_mps"], numbers["north_mps"]
    if not found:
        raise TableError("holds no flow; must have a line for each place of a regular grid")
    time_s, north, east = (sorted({node[axis] for node in found}) for axis in range(3))
    for node in product(time_s, north, east):
        if node not in found:
            raise TableError(
                f"{_named(columns, node)} is missing; must have every place of a regular grid, at every time"
            )
    shape = len(time_s), len(north), len(east)
    flows = np.array([found[node] for node in product(time_s, north, east)]).reshape(*shape, 2)
    return FlowTable(columns, np.array(east), np.array(north), np.array(time_s), flows[..., 0], flows[..., 1])


def _columns(heading: list[str]) -> tuple[str, str]:
    """The columns that hold places."""
    allowed = f"east_mps, north_mps, {PLACES_IN_WORDS}, and time_s or not"
    check_columns(heading, _LIMITS, allowed)
    places = place_columns(heading)
    if places is None or not {*_FLOWS} <= set(heading):
        raise columns_refused(heading, allowed)
    return places


def _named(columns: tuple[str, str], node: tuple[float, ...]) -> str:
    return f"{columns[0]} {node[2]:g}, {columns[1]} {node[1]:g}, time_s {node[0]:g}"
