"""What is announced of each vehicle of a scenario."""

from __future__ import annotations

import math

import numpy as np

from comms.said.announcement import Role, RosterVehicle
from planner.currents import FlowGrid, Sailing
from planner.footprints import footprint_of
from planner.keep_out import NOWHERE, KeepOut
from planner.way_home import WayHome
from secondlook.scenario import AnyCurrent, GridCurrent, RevisitVehicle, Scenario, SurveyVehicle

LEAST_P_DETECT = 0.001
"""Of a pass, on average: a second look of less is worth nothing, and far less is announced as nothing."""


def roster_vehicle(
    name: str,
    vehicle: SurveyVehicle | RevisitVehicle,
    current: AnyCurrent | None = None,
    flows: FlowGrid | None = None,
) -> RosterVehicle:
    """A vehicle as it is announced. Raises ValueError for one whose sonar sees next to nothing."""
    sailing = sailing_of(vehicle, current, flows)
    sonar = vehicle.sonar
    return RosterVehicle(
        vehicle=name,
        role=role_of(vehicle),
        speed_mps=vehicle.speed_mps,
        turn_radius_m=vehicle.turn_radius_m,
        run_in_m=vehicle.run_in_m,
        near_m=sonar.near_m,
        far_m=sonar.far_m,
        p_detect=_mean_p_detect(name, vehicle),
        endurance_ms=endurance_ms_of(vehicle),
        footprint=sonar.footprint,
        half_angle_rad=sonar.half_angle_rad,
        look_m=sonar.look_m,
        home_x_m=vehicle.home_m[0],
        home_y_m=vehicle.home_m[1],
        reserve_ms=reserve_ms_of(vehicle),
        drift_mps=sailing.drift_mps,
        set_rad=sailing.set_rad,
        is_tidal=sailing.tidal,
    )


def _mean_p_detect(name: str, vehicle: SurveyVehicle | RevisitVehicle) -> float:
    """The mean of P(y) of a pass, over the lateral ranges that it reaches. Raises ValueError where that is next to
    nothing."""
    footprint = footprint_of(vehicle.sonar)
    curve = footprint.pass_curve(vehicle.detection_curve)
    near_m, far_m = footprint.reach.near_m, footprint.reach.far_m
    within = curve.range_m[(curve.range_m > near_m) & (curve.range_m < far_m)]
    range_m = np.concatenate([[near_m], within, [far_m]])
    mean = float(np.trapezoid(curve.at(range_m), range_m)) / (far_m - near_m)
    if mean < LEAST_P_DETECT:
        raise ValueError(
            f"vehicles.{name}.sensor must detect something, with a P_d of {LEAST_P_DETECT} or more on average"
        )
    return mean


def endurance_ms_of(vehicle: SurveyVehicle | RevisitVehicle) -> int:
    """How long its battery lasts, in whole milliseconds."""
    return round(vehicle.endurance_s * 1000)


def reserve_ms_of(vehicle: SurveyVehicle | RevisitVehicle) -> int:
    """How long it is still to last when the vehicle comes home."""
    return round(vehicle.kept_s * 1000)


def flows_of(scenario: Scenario) -> FlowGrid | None:
    """The flows that are reckoned with until the mission's time limit; None where they are alike everywhere."""
    current = scenario.current
    return current.grid.until(scenario.mission.time_limit_s) if isinstance(current, GridCurrent) else None


def sailing_of(
    vehicle: SurveyVehicle | RevisitVehicle, current: AnyCurrent | None, flows: FlowGrid | None = None
) -> Sailing:
    """What it makes good in a current, as it is reckoned with. `flows`: see `flows_of`."""
    if current is None or current.keeps == "ground":
        return Sailing(vehicle.speed_mps)
    if isinstance(current, GridCurrent):
        flows = current.grid if flows is None else flows
        return Sailing(vehicle.speed_mps, flows.fastest_mps, grid=flows)
    tidal = current.period_s is not None
    return Sailing(vehicle.speed_mps, current.drift_mps, math.radians(current.set_deg), tidal=tidal)


def way_home_of(
    vehicle: SurveyVehicle | RevisitVehicle,
    current: AnyCurrent | None,
    keep_out: KeepOut = NOWHERE,
    flows: FlowGrid | None = None,
) -> WayHome:
    """Its way home, as it is reckoned with; its agent hears of ground to keep out of from the run's announcement."""
    return WayHome(vehicle.home_m, sailing_of(vehicle, current, flows), vehicle.turn_radius_m, keep_out)


def role_of(vehicle: SurveyVehicle | RevisitVehicle) -> Role:
    """What a vehicle's agent is in the fleet."""
    if isinstance(vehicle, RevisitVehicle):
        return Role.REVISIT
    return Role.SURVEY_REVISIT if vehicle.revisits else Role.SURVEY
