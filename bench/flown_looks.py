"""What a fleet's helpers looked at in a mission, look by look as it was flown, by the truth of its sonar."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np

from bench.legs import Leg, Schedule
from bench.removable import LegHelper, Removable
from comms.node import Received
from comms.said.messages import Look, Maneuver
from planner.footprints import footprint_of
from planner.footprints.cells import look_on_grid
from planner.types import FloatArray, GridSpec
from secondlook.fleet.build import build_fleet
from secondlook.scenario import Scenario
from sim_world.config import EstimateConfig, VehicleConfig, WorldConfig
from sim_world.looks import Looks
from sim_world.seabed import make_seabed
from sim_world.steadiness import make_current
from sim_world.targets import NO_TARGETS, Recogniser
from sim_world.vehicle import SimulatedVehicle, Stretch

STRAIGHT = 1 - 1e-6
"""Cosine of the angle by which a look that ran along the grid or across it may be off: headings travel in
microradians."""


@dataclass
class FlownLooks:
    """Told every message of a mission, it makes each look of a helper once more, as the world made it but without the
    errors of the vehicle's estimate. `looks`: those by vehicle, each where it truly was, with the true P_d."""

    scenario: Scenario
    looks: dict[str, list[Look]] = field(default_factory=dict)
    _bodies: dict[str, _Body] = field(default_factory=dict)
    _maneuvers: dict[tuple[str, int], Maneuver] = field(default_factory=dict)

    def __post_init__(self) -> None:
        world: WorldConfig = build_fleet(self.scenario, record=False).specs["world"].config
        helpers = self.scenario.revisit_vehicles
        self._bodies = {body.vehicle: _Body(world, body) for body in world.vehicles if body.vehicle in helpers}

    def hear(self, received: Received) -> None:
        """Takes one message, in the order of sending."""
        vehicle, message = received.vehicle, received.message
        if vehicle not in self._bodies:
            return
        if isinstance(message, Maneuver):
            self._maneuvers[vehicle, message.number] = message
        elif isinstance(message, Look) and message.valid:
            maneuver = self._maneuvers[vehicle, message.maneuver]
            true_look = self._bodies[vehicle].true_look(message, maneuver, received.header.sent_ms)
            self.looks.setdefault(vehicle, []).append(true_look)

    def leaves(self, grid: GridSpec) -> FloatArray:
        """The share of the risk of each cell that all looks together leave, grid shape: they multiply in any order."""
        leaves = np.ones(grid.shape)
        for look in (look for looks in self.looks.values() for look in looks):
            rows, columns, p_detect = look_on_grid(grid, look.geometry, look.p_detect)
            leaves[rows, columns] *= 1 - p_detect
        return leaves

    def left(self, mission: Removable) -> FloatArray:
        """The residual risk that they leave of what the survey does, grid shape."""
        return mission.risk * self.leaves(mission.grid)


class _Body:
    """A helper's body in the world, whose sonar tells the truth."""

    def __init__(self, world: WorldConfig, config: VehicleConfig) -> None:
        sensor = replace(config.sensor, noise_cell=0.0, noise_track=0.0, estimate=EstimateConfig())
        exact = replace(config, sensor=sensor)
        self._footprint = footprint_of(config.sensor.shape)
        current = make_current(world.current, world.seed)
        self._vehicle = SimulatedVehicle(config, world.seed, current)
        self._looks = Looks(
            exact,
            sonar=config.sensor.sonar_over(make_seabed(world.seabed, world.area, world.seed), config.vehicle),
            targets=NO_TARGETS,
            recogniser=Recogniser(config.sensor.curve, false_alarms_per_km2=0),
            seed=world.seed,
            current=current,
        )

    def true_look(self, look: Look, maneuver: Maneuver, passed_ms: int) -> Look:
        """The look that it told of when it had passed the stretch."""
        offset_m = self._vehicle.offset_at(passed_ms)
        bins = round(self._footprint.track_length_m(look.geometry) / look.along_bin_m)
        stretch = Stretch(maneuver, look.heading_rad, look.first_along_m, bins)
        made, _ = self._looks.look(stretch, passed_ms / 1000, offset_m, 0.0)
        return replace(made, origin_x_m=made.origin_x_m + offset_m[0], origin_y_m=made.origin_y_m + offset_m[1])


def legs_flown(looks: Mapping[str, Sequence[Look]], mission: Removable) -> Schedule:
    """The legs of those looks that ran along the grid or across it, on the nearest lines, in the order of flying: a
    schedule to begin a search with. What the looks removed it does not tell."""
    schedule = []
    for helper in mission.helpers:
        maneuvers = groupby(looks.get(helper.name, ()), key=lambda look: look.maneuver)
        legs = [_leg(mission, helper, list(of_one)) for _, of_one in maneuvers]
        schedule.append(tuple(leg for leg in legs if leg is not None))
    return tuple(schedule)


def _leg(mission: Removable, helper: LegHelper, looks: Sequence[Look]) -> Leg | None:
    grid = mission.grid
    turn_rad, cell_m = looks[0].heading_rad - grid.frame.heading_rad, grid.cell_m
    across = abs(math.sin(turn_rad)) > 0.5
    way = math.sin(turn_rad) if across else math.cos(turn_rad)
    if abs(way) < STRAIGHT:
        return None
    side_m, along_m = grid.frame.to_sweep(*looks[0].geometry.origin)
    # In cells, from where the first column and the first row begin.
    begin, line = ((side_m / cell_m + 0.5), along_m / cell_m - 0.5) if across else (along_m / cell_m, side_m / cell_m)
    swath, (steps, lines) = helper.sensor(across=across).swath, mission.extent(across=across)
    last = looks[-1]
    ends_m = looks[0].first_along_m, last.first_along_m + last.geometry.along_bins * last.along_bin_m
    first, end = sorted(round(begin + math.copysign(at_m / cell_m, way)) for at_m in ends_m)
    place = min(max(swath.column_at(line), 0), lines - 1)
    return Leg(place, min(max(first, 0), steps - 1), min(max(end, 1), steps), way > 0, across)
