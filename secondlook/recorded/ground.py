"""What is known of the ground: the residual-risk map at one moment, ground that counts for more or less,
contacts, and the targets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pydantic import TypeAdapter, ValidationError
from shapely.geometry.base import BaseGeometry

from comms.node import Received
from comms.said.messages import Contact, TruthLook, TruthTargets
from planner.contacts import SeenObjects, are_listed
from planner.risk import RiskStatistics, risk_statistics
from planner.types import BoolArray, FloatArray, GridSpec, PriorityGround
from secondlook.errors import UserError
from secondlook.recorded.metrics import Metrics
from secondlook.scenario.area import Priority, priority_grounds

Cells = tuple[np.ndarray[tuple[int], np.dtype[np.intp]], np.ndarray[tuple[int], np.dtype[np.intp]]]
"""Rows and columns of cells."""
OFF_ANY_GRID_M = 1e9


@dataclass(frozen=True, eq=False)
class RiskMap:
    """Residual risk per cell at `t_s`: 1 where nobody has looked.

    `risk`, `seen` (with at least one look) and `inside` (the area) have shape (rows, columns) of `grid`.
    """

    t_s: float
    grid: GridSpec
    risk: FloatArray
    seen: BoolArray
    inside: BoolArray

    @classmethod
    def of(cls, t_s: float, metrics: Metrics) -> RiskMap:
        """The map of all that was taken until `t_s`."""
        fleet = metrics.map
        assert fleet is not None  # announced before anything else
        return cls(t_s, fleet.grid, fleet.risk, fleet.seen(), metrics.inside)

    @cached_property
    def x_m(self) -> FloatArray:
        """East of each cell's centre in the mission frame, shape (rows, columns)."""
        return self._centres[0]

    @cached_property
    def y_m(self) -> FloatArray:
        """North of each cell's centre in the mission frame, shape (rows, columns)."""
        return self._centres[1]

    @property
    def statistics(self) -> RiskStatistics:
        """Mean, mean over the worst 30 % and share not seen, over the cells inside the area."""
        return risk_statistics(self.risk, self.seen, self.inside)

    def at(self, x_m: FloatArray | float, y_m: FloatArray | float) -> FloatArray:
        """The risk of the cells that hold these places (mission frame); NaN outside the grid, and for no place."""
        places = (
            np.clip(np.nan_to_num(one, nan=OFF_ANY_GRID_M), -OFF_ANY_GRID_M, OFF_ANY_GRID_M) for one in (x_m, y_m)
        )
        rows, columns = self.grid.cells_of(*places)
        on_grid = (columns >= 0) & (columns < self.grid.columns) & (rows >= 0) & (rows < self.grid.rows)
        row, column = (np.where(on_grid, numbers, 0) for numbers in (rows, columns))
        return np.where(on_grid, self.risk[row, column], np.nan)

    def mean_within(self, geometry: BaseGeometry) -> float:
        """Mean risk of the cells inside the area whose centres lie within a geometry (mission frame) and not on its
        border; NaN if none does."""
        return self.mean_of(self.cells_within(geometry))

    def mean_of(self, cells: Cells) -> float:
        """Mean risk of some cells; NaN of none."""
        return float(self.risk[cells].mean()) if cells[0].size else float("nan")

    def cells_within(self, geometry: BaseGeometry) -> Cells:
        """Rows and columns of the cells inside the area whose centres lie within a geometry (mission frame) and not on
        its border. Raises UserError for what is no geometry of shapely's."""
        check_geometry("geometry", geometry)
        near_rows, near_columns = self._around(geometry)
        rows, columns = np.nonzero(self.inside[near_rows, near_columns])
        rows, columns = rows + near_rows.start, columns + near_columns.start
        x_m, y_m = self.grid.frame.to_mission(self.grid.across_m[columns], self.grid.along_m[rows])
        within = shapely.contains_xy(geometry, x_m, y_m)
        return rows[within], columns[within]

    def _around(self, geometry: BaseGeometry) -> tuple[slice, slice]:
        """The rows and columns of the grid that a geometry's bounding box may reach: of a large grid but a few."""
        if geometry.is_empty:
            return slice(0, 0), slice(0, 0)
        west_m, south_m, east_m, north_m = geometry.bounds
        across_m, along_m = self.grid.frame.to_sweep(
            np.array([west_m, east_m, east_m, west_m]), np.array([south_m, south_m, north_m, north_m])
        )
        cell_m = self.grid.cell_m
        return _span(along_m / cell_m - 0.5, self.grid.rows), _span(across_m / cell_m, self.grid.columns)

    @cached_property
    def _centres(self) -> tuple[FloatArray, FloatArray]:
        return self.grid.frame.to_mission(self.grid.across_m[np.newaxis, :], self.grid.along_m[:, np.newaxis])


def check_geometry(name: str, geometry: object) -> None:
    """Raises UserError for what is no geometry of shapely's, such as a list of corners."""
    if not isinstance(geometry, BaseGeometry):
        told = type(geometry).__name__
        raise UserError(f"{name}: a {told} is not allowed; must be a geometry, such as shapely.Polygon(corners)")


def _span(places: FloatArray, count: int) -> slice:
    """Of a number of cells, whose centres lie at 0, 1 and so on, those from the first of some places to the last."""
    return slice(max(0, math.floor(places.min())), max(0, min(count, math.ceil(places.max()) + 1)))


def polygon_of(priority: PriorityGround) -> BaseGeometry:
    """The ground of a priority as a polygon, or several."""
    ground: BaseGeometry = shapely.Polygon()
    for outline in priority.outlines_m:
        ground = ground.symmetric_difference(shapely.Polygon(outline))
    return ground


@dataclass(frozen=True)
class PriorityRisk:
    """Ground that counts for more or less, and the mean residual risk within it, by the primaries alone and by all; NaN
    where no cell has its centre there."""

    weight: float
    area_m2: float
    before: float
    after: float


def risk_in_priorities(grounds: Iterable[PriorityGround], before: RiskMap, after: RiskMap) -> list[PriorityRisk]:
    """Of each ground; `before` and `after`: the risk by the primaries alone and by all."""
    found = []
    for one in grounds:
        polygon = polygon_of(one)
        cells = after.cells_within(polygon)
        found.append(PriorityRisk(one.weight, float(polygon.area), before.mean_of(cells), after.mean_of(cells)))
    return found


_PRIORITIES = TypeAdapter(list[Priority])


def priorities(
    scenario: Mapping[str, Any], area: shapely.Polygon | shapely.MultiPolygon, folder: Path
) -> list[PriorityGround]:
    """Those of a scenario as a run's folder holds it, each as far as it lies in the area and under no later one.

    Raises UserError where they are not as the run wrote them.
    """
    told = scenario.get("area")
    try:
        read = _PRIORITIES.validate_python(told.get("priorities", []) if isinstance(told, dict) else [])
    except ValidationError:
        raise UserError(f"{folder / 'scenario.yaml'}: area.priorities must be as the run wrote them") from None
    return priority_grounds(area, read)


@dataclass(frozen=True)
class ContactRecord:
    """What a vehicle took for a target: where it is by its own account, mission frame, with its standard deviation,
    and the recogniser's score from 0 to 1."""

    vehicle: str
    number: int
    found_s: float
    score: float
    sigma_m: float
    point: shapely.Point


def contacts(said: Iterable[Received[Contact]]) -> list[ContactRecord]:
    """Every contact, each as it was first told, in the order of finding."""
    first: dict[tuple[str, int], Received[Contact]] = {}
    for one in said:
        first.setdefault((one.key, one.header.incarnation), one)
    return [
        ContactRecord(
            one.vehicle,
            one.number,
            one.t_s,
            one.message.score,
            one.message.sigma_m,
            shapely.Point(one.message.x_m, one.message.y_m),
        )
        for one in first.values()
    ]


@dataclass(frozen=True)
class ObjectRecord:
    """What lies on the seabed by the contacts that are joined to it: where, mission frame, with the standard deviation
    of that, of how many `contacts`, with which chance it is a mine, and whether it is listed as one."""

    contacts: int
    sigma_m: float
    mine_chance: float
    listed: bool
    point: shapely.Point


def objects(seen: SeenObjects, chances: FloatArray) -> list[ObjectRecord]:
    """All of them, those first that are mines most likely. `chances`: that each is a mine."""
    found = [
        ObjectRecord(round(contacts), sigma_m, chance, listed, shapely.Point(x_m, y_m))
        for contacts, sigma_m, chance, listed, x_m, y_m in zip(
            seen.contacts.tolist(),
            seen.sigma_m.tolist(),
            chances.tolist(),
            are_listed(chances).tolist(),
            seen.x_m.tolist(),
            seen.y_m.tolist(),
            strict=True,
        )
    ]
    return sorted(found, key=lambda one: -one.mine_chance)


@dataclass(frozen=True)
class TargetRecord:
    """A target on the seabed at its true place, mission frame. `found_by` and `found_s`: the first look that detected
    it; None if none did. `listed`: whether it was detected and is on the list of mines at the end: else it is left."""

    number: int
    found_by: str | None
    found_s: float | None
    listed: bool
    point: shapely.Point


def targets(
    truth: Iterable[Received[TruthTargets]], looks: Iterable[Received[TruthLook]], listed: BoolArray
) -> list[TargetRecord]:
    """All targets, and which are `listed`, by number; none where nobody knows them."""
    first: dict[int, Received[TruthLook]] = {}
    for look in looks:
        for number in look.message.detected:
            first.setdefault(number, look)
    places = [target for said in truth for target in said.message.targets]
    return [
        TargetRecord(
            number,
            first[number].vehicle if number in first else None,
            first[number].t_s if number in first else None,
            bool(listed[number : number + 1].any()),  # of a run that was never announced nothing is
            shapely.Point(place.x_m, place.y_m),
        )
        for number, place in enumerate(places)
    ]
