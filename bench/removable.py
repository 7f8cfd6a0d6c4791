"""What second looks could have removed in a mission that was flown: where, from when on, by which helper."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bench.swath import Swath
from comms.node import Received
from coordinator.cut.ground import Objective
from planner.dubins import Pose
from planner.risk import RiskStatistics, risk_statistics
from planner.types import BoolArray, FloatArray, GridSpec
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.recorded.metrics import Metrics
from secondlook.scenario import RevisitVehicle, Scenario
from sim_world.config import VehicleConfig, WorldConfig
from sim_world.seabed import make_seabed


@dataclass(frozen=True, eq=False)
class LegSensor:
    """What one look from a leg along the grid does, or from one across it.

    `p_detect`: true P_d of a look at each cell, by the column's place in the swath, shape (width, rows, columns); 0
    outside the area. Of legs across, the same with rows for columns and columns for rows.
    """

    swath: Swath
    p_detect: FloatArray


@dataclass(frozen=True, eq=False)
class LegHelper:
    """One helper, with what it flies legs with; `lasts_s`: its endurance; `sensors`: along the grid, and across it."""

    name: str
    start: Pose
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    lasts_s: float
    sensors: tuple[LegSensor, LegSensor]

    def sensor(self, *, across: bool) -> LegSensor:
        """What looks do from legs of one heading."""
        return self.sensors[across]

    @property
    def best_p_detect(self) -> FloatArray:
        """The P_d of each cell at its best place in either swath, grid shape."""
        along, across = (one.p_detect.max(axis=0) for one in self.sensors)
        best: FloatArray = np.maximum(along, across.T)
        return best


@dataclass(frozen=True, eq=False)
class Removable:
    """A mission as a clairvoyant sees it: a look counts whenever it happens, as looks multiply in any order.

    `risk`: the residual risk that the survey alone leaves, grid shape, 0 outside the area. `ends_s`: the mission's
    deadline.
    """

    grid: GridSpec
    inside: BoolArray
    risk: FloatArray
    ends_s: float
    helpers: tuple[LegHelper, ...]

    def extent(self, *, across: bool) -> tuple[int, int]:
        """How many cells a leg may be long, and on how many lines it may lie."""
        return self.grid.shape[::-1] if across else self.grid.shape

    def left(self, risk: FloatArray) -> RiskStatistics:
        """Of the residual risk that is left, grid shape."""
        return risk_statistics(risk, self.inside, self.inside)

    def gain_m2(self, risk: FloatArray, objective: Objective) -> float:
        """How much less the objective is with this residual risk than with the survey's alone, times the area."""
        gain = 0.0
        if objective.mean:
            gain += objective.mean * float((self.risk - risk).sum())
        if objective.worst:
            there = self._there
            gain += objective.worst * (there.worst30_mean - self.left(risk).worst30_mean) * there.cells
        return gain * self.grid.cell_area_m2

    @cached_property
    def _there(self) -> RiskStatistics:
        return self.left(self.risk)

    @property
    def total_m2(self) -> float:
        """All the risk that is there, times the area."""
        return float(self.risk.sum()) * self.grid.cell_area_m2


@dataclass
class Clairvoyance:
    """Told every message of a mission, it knows afterwards what there was to remove.

    Raises UserError for a scenario whose objective is another than the clairvoyant's, or with a helper of whom nobody
    could say beforehand what a leg sees.
    """

    scenario: Scenario
    metrics: Metrics = field(default_factory=Metrics)

    def __post_init__(self) -> None:
        rho = self.scenario.mission.rho
        if rho > 0:
            raise UserError(f"mission.rho: {rho:g} is not allowed here; must be 0, looks independent of each other")
        if self.scenario.area.priorities:
            raise UserError("area.priorities: not allowed here; must be [], all ground counts alike")
        for name, helper in self.scenario.revisit_vehicles.items():
            _require_legs(f"vehicles.{name}", helper, in_current=self.scenario.current is not None)

    def hear(self, received: Received) -> None:
        """Takes one message, in the order of sending."""
        self.metrics.hear(received)

    def removable(self) -> Removable:
        """What the messages told; raises ValueError where the survey was not finished."""
        metrics = self.metrics
        primary_ms = metrics.primary_ms()
        if metrics.map is None or primary_ms is None:
            raise ValueError("the mission was over before the survey")
        layers = [
            one.surveyed or metrics.map.layers[name]
            for name, one in metrics.vehicles.items()
            if one.role.surveys and name in metrics.map.layers
        ]
        risk, _ = metrics.map.risk_of_layers(layers)
        return Removable(
            grid=metrics.map.grid,
            inside=metrics.inside,
            risk=np.where(metrics.inside, risk, 0.0),
            ends_s=self.scenario.mission.ends_s(primary_ms / 1000),
            helpers=leg_helpers(self.scenario, metrics.map.grid, metrics.inside),
        )


def _require_legs(key: str, helper: RevisitVehicle, *, in_current: bool) -> None:
    """Refuses a helper with whom it hangs on more than a leg's place what a look from it removes."""
    if helper.body != "simulated":
        raise UserError(f"{key}.body: {helper.body} is not allowed here; must be simulated, its true P_d known")
    if helper.sonar.footprint != "side":
        told = f"{key}.sensor.footprint: {helper.sonar.footprint} is not allowed here; must be side"
        raise UserError(f"{told}, each place seen once from a leg")
    if helper.settling is not None:
        raise UserError(f"{key}.settling: not allowed here; must be left out, all of a leg seen alike")
    if in_current and helper.sensor.half_at_crab_deg is not None:
        told = f"{key}.sensor.half_at_crab_deg: not allowed here in a current; must be left out"
        raise UserError(f"{told}, all legs seen alike whenever they are flown")


def leg_helpers(scenario: Scenario, grid: GridSpec, inside: BoolArray) -> tuple[LegHelper, ...]:
    """The scenario's helpers with the truth of what their sensors would see."""
    fleet = build_fleet(scenario, record=False)
    world: WorldConfig = fleet.specs["world"].config
    bodies = {body.vehicle: body for body in world.vehicles}
    return tuple(
        LegHelper(
            name=name,
            start=Pose(body.start_x_m, body.start_y_m, body.start_heading_rad),
            speed_mps=body.speed_mps,
            turn_radius_m=body.turn_radius_m,
            run_in_m=vehicle.run_in_m,
            lasts_s=vehicle.endurance_s,
            sensors=(
                _leg_sensor(world, body, grid, inside, across=False),
                _leg_sensor(world, body, grid, inside, across=True),
            ),
        )
        for name, vehicle in scenario.revisit_vehicles.items()
        for body in (bodies[name],)
    )


def _leg_sensor(
    world: WorldConfig, body: VehicleConfig, grid: GridSpec, inside: BoolArray, *, across: bool
) -> LegSensor:
    curve = body.sensor.curve
    swath = Swath.of(grid, 2 * float(curve.range_m[-1]))
    sonar = body.sensor.sonar_over(make_seabed(world.seabed, world.area, world.seed), body.vehicle)
    x_m, y_m = grid.frame.to_mission(grid.across_m[np.newaxis, :], grid.along_m[:, np.newaxis])
    # Either side looks across the same crests: a leg there and a leg back see alike.
    bearing_rad = grid.frame.heading_rad + (0.0 if across else math.pi / 2)
    by_place = [
        np.where(
            inside, sonar.p_detect(np.full(grid.shape, distance_m), bearing_rad, body.altitude_m, (x_m, y_m), 0.0), 0.0
        )
        for distance_m in np.abs(np.arange(swath.width) - (swath.width - 1) / 2) * grid.cell_m
    ]
    return LegSensor(swath, np.array([one.T for one in by_place] if across else by_place))
