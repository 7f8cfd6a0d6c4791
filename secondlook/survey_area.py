"""From a scenario's area to what planning takes: the region, the heading of its tracks, and a first plan."""

from __future__ import annotations

import math

from planner.first_plan import FirstPlan, best_heading, first_plan
from planner.region import Region
from secondlook.scenario import Scenario, SurveyVehicle
from vehicle_agent.config import WHOLE


def region_of(scenario: Scenario) -> Region:
    """What is surveyed, mission frame. Raises ValueError as `Region` does."""
    return Region(scenario.area.polygon_m, scenario.area.holes_m)


def region_for(scenario: Scenario, vehicle: SurveyVehicle, heading_rad: float) -> Region:
    """What of it is surveyed by one vehicle, with tracks along a heading. Raises ValueError as `Region.share` does."""
    region = region_of(scenario)
    return region if vehicle.share == WHOLE else region.share(*vehicle.share, heading_rad)


def track_heading_rad(scenario: Scenario) -> float:
    """The compass heading of the tracks; where the scenario leaves it to us, the best for the first survey vehicle."""
    heading_deg = scenario.area.track_heading_deg
    if heading_deg != "auto":
        return math.radians(heading_deg)
    first = next(iter(scenario.survey_vehicles.values()))
    return best_heading(region_of(scenario), first.nadir_gap_m, first.told_range_m)


def first_plans(scenario: Scenario, heading_rad: float) -> dict[str, FirstPlan]:
    """The tracks that Algorithm 1 lays for each survey vehicle, by its id, with the range that it is told."""
    return {
        name: first_plan(
            region_for(scenario, vehicle, heading_rad), heading_rad, vehicle.nadir_gap_m, vehicle.told_range_m
        )
        for name, vehicle in scenario.survey_vehicles.items()
    }
