"""From a scenario's area to what planning takes: the region, the heading of its tracks, and a first plan."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np

from comms.errors import NO_FAILURES, in_words
from comms.said.messages import MOST_TRACKS
from planner.first_plan import FirstPlan, best_heading, first_plan
from planner.flyable import flyable_pieces
from planner.footprints import footprint_of
from planner.keep_out import CLEARANCE_M, NOWHERE, KeepOut
from planner.profile_spacing import SpacingTerms, known_before
from planner.region import Region
from planner.types import Point
from secondlook.errors import UserError
from secondlook.fleet.roster import roster_vehicle
from secondlook.scenario import Scenario, SurveyVehicle
from secondlook.scenario.plug_ins import SPACING, made
from vehicle_agent.config import WHOLE
from vehicle_agent.helpers_ahead import helper_looks


def region_of(scenario: Scenario) -> Region:
    """What is surveyed, mission frame. Raises ValueError as `Region` does."""
    return Region(scenario.area.polygon_m, scenario.area.holes_m, scenario.area.keep_out)


def keep_out_of(scenario: Scenario) -> KeepOut:
    """The zones that no vehicle may enter, in whole centimetres as they are announced, and how far off all stay: what a
    vehicle may be off its position by the time limit, and a little for rounding."""
    if not scenario.area.keep_out:
        return NOWHERE
    hours = scenario.mission.time_limit_s / 3600
    off_m = max(one.position_error_m + one.position_drift_m_per_h * hours for one in scenario.vehicles.values())
    zones = tuple(tuple((round(x_m, 2), round(y_m, 2)) for x_m, y_m in zone) for zone in scenario.area.keep_out)
    return KeepOut(zones, round(off_m + CLEARANCE_M, 2))


def region_for(scenario: Scenario, vehicle: SurveyVehicle, heading_rad: float) -> Region:
    """What of it is surveyed by one vehicle, with tracks along a heading. Raises ValueError as `Region.share` does."""
    region = region_of(scenario)
    return region if vehicle.share == WHOLE else region.share(*vehicle.share, heading_rad)


def begin_of(scenario: Scenario, vehicle: SurveyVehicle, heading_rad: float) -> Point | None:
    """The place from which the way through a vehicle's survey is to be short; None where the scenario has none."""
    if vehicle.begin is None:
        return None
    if vehicle.begin == "nearest":
        return vehicle.start.x_m, vehicle.start.y_m
    west_m, south_m, east_m, north_m = region_for(scenario, vehicle, heading_rad).polygon.bounds
    north_or_south, east_or_west = vehicle.begin
    return (west_m if east_or_west == "w" else east_m, south_m if north_or_south == "s" else north_m)


def track_heading_rad(scenario: Scenario) -> float:
    """The compass heading of the tracks; where the scenario leaves it to us, the best for the first survey vehicle."""
    heading_deg = scenario.area.track_heading_deg
    if heading_deg != "auto":
        return math.radians(heading_deg)
    first = next(iter(scenario.survey_vehicles.values()))
    return best_heading(region_of(scenario), first.nadir_gap_m, first.told_range_m)


def plan_for(scenario: Scenario, name: str, heading_rad: float) -> FirstPlan:
    """The first tracks of a survey vehicle, by its id, as its spacing planner lays them with what it is told.

    Raises:
        UserError: a spacing planner of the user's fails.
    """
    vehicle = scenario.survey_vehicles[name]
    region = region_for(scenario, vehicle, heading_rad)
    sonar = vehicle.nadir_gap_m, vehicle.told_range_m
    spacing = made(SPACING, vehicle.spacing, nadir_gap_m=sonar[0], told_range_m=sonar[1])
    lead_m = footprint_of(vehicle.sonar).lead_m
    flyable = partial(
        flyable_pieces,
        keep_out=keep_out_of(scenario),
        turn_radius_m=vehicle.turn_radius_m,
        run_in_m=vehicle.run_in_m,
        lead_m=lead_m,
    )
    begin = begin_of(scenario, vehicle, heading_rad)
    known = None
    if vehicle.prior_curve is not None:
        known = known_before(vehicle.prior_curve.detection_curve, vehicle.threshold)
    fleet = [roster_vehicle(other, one) for other, one in scenario.vehicles.items()]
    looks = helper_looks(fleet, name)
    terms = SpacingTerms(scenario.area.cell_m, scenario.mission.rho, vehicle.wanted_risk, looks)
    with lays_tracks(vehicle):
        return first_plan(region, heading_rad, *sonar, spacing, known, terms, flyable=flyable, begin=begin)


class SpacingFailedError(UserError):
    """A spacing planner of the user's has failed."""


@contextmanager
def lays_tracks(vehicle: SurveyVehicle) -> Iterator[None]:
    """Within it the vehicle's spacing planner lays tracks. Raises SpacingFailedError where one of the user's fails."""
    try:
        with np.errstate():
            yield
    except NO_FAILURES:
        raise
    except BaseException as error:
        if vehicle.spacing in SPACING.ours:
            raise
        raise SpacingFailedError(f"{vehicle.spacing} has failed to lay tracks: {in_words(error)}") from error


def check_tracks(name: str, vehicle: SurveyVehicle, tracks: int) -> None:
    """Raises UserError for no track at all, and for more than a plan can tell of."""
    if not tracks and vehicle.spacing not in SPACING.ours:
        raise UserError(
            f"vehicles.{name}.spacing: {vehicle.spacing} lays no track that crosses the area and has room beside "
            "ground to keep out of; must lay one"
        )
    if not tracks:
        raise UserError(
            f"vehicles.{name}: no track of its survey has room beside ground to keep out of; must have less of "
            "turn_radius_m and run_in_m, or the area more room"
        )
    if tracks > MOST_TRACKS:
        raise UserError(
            f"vehicles.{name}.range_m: {vehicle.told_range_m:g} is not allowed; must be larger, or the area smaller, "
            f"as its survey has {tracks} tracks, more than {MOST_TRACKS}"
        )
