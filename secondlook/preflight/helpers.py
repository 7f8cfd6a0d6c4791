"""Who of those that take second looks can do nothing in a mission, and why; only what is certain is told."""

from __future__ import annotations

import math

import shapely
from shapely.geometry.base import BaseGeometry

from planner.flyable import reachable
from planner.footprints import footprint_of
from planner.way_home import MARGIN_S
from secondlook.fleet.roster import sailing_of
from secondlook.fleet.survey_area import keep_out_of, region_of
from secondlook.progress import in_seconds
from secondlook.scenario import RevisitVehicle, Scenario, SurveyVehicle

NOTHING_M2 = 1.0
"""Less ground than this is none."""


def why_idle(scenario: Scenario, name: str, from_s: float, until_s: float) -> str:
    """Why a vehicle can take no second look from one time to another; nothing where it can, or might."""
    vehicle, coordinator = scenario.vehicles[name], scenario.coordinator
    if isinstance(vehicle, SurveyVehicle) and from_s >= until_s:
        return "it revisits, but the mission is over when its survey is"
    if coordinator.node is None and coordinator.strips == "reacting" and coordinator.allocator == "none":
        return "coordinator.allocator is none, which gives strips to nobody"
    if coordinator.node is None and not coordinator.strips.startswith("lanes"):
        across_m, along_m = scenario.area.extent_m
        longest_m = max(across_m, along_m) if coordinator.across else along_m
        swath_m = footprint_of(vehicle.sonar).reach.strip_width_m
        if longest_m + swath_m < coordinator.min_strip_m:  # what is cut is cut in cells
            return (
                f"a strip is {coordinator.min_strip_m:g} m long or longer (coordinator.min_strip_m), and in the area "
                f"none is longer than {longest_m:.0f} m"
            )
    area, start = region_of(scenario).polygon, (vehicle.start.x_m, vehicle.start.y_m)
    keep_out = keep_out_of(scenario)
    if keep_out and reachable(start, area, keep_out).area < NOTHING_M2:
        return "no way leads from its start to the area past ground to keep out of"
    return "" if isinstance(vehicle, SurveyVehicle) else _out_of_reach(scenario, vehicle, area, until_s)


def _out_of_reach(scenario: Scenario, vehicle: RevisitVehicle, area: BaseGeometry, until_s: float) -> str:
    """Counts beelines with the stream, and of strips the shortest: no way is shorter."""
    far_m = footprint_of(vehicle.sonar).reach.far_m
    out_m, back_m = (
        max(0.0, shapely.distance(area, shapely.Point(place)) - far_m)
        for place in ((vehicle.start.x_m, vehicle.start.y_m), vehicle.home_m)
    )
    fastest_mps = vehicle.speed_mps + sailing_of(vehicle, scenario.current).drift_mps
    strip_m = 0.0 if scenario.coordinator.strips.startswith("lanes") else scenario.coordinator.min_strip_m
    least_s, lasts_s = (out_m + strip_m + back_m) / fastest_mps, vehicle.endurance_s - vehicle.kept_s - MARGIN_S
    if least_s > lasts_s:
        return (
            f"it needs {in_seconds(math.ceil(least_s))} or more for the shortest strip, the way there ({out_m:.0f} m) "
            f"and home ({back_m:.0f} m), and its endurance_s of {vehicle.endurance_s:g} is for "
            f"{max(0, math.floor(lasts_s))} s beside its reserve"
        )
    if out_m / fastest_mps >= until_s:
        return (
            f"it needs {in_seconds(math.ceil(out_m / fastest_mps))} or more to the area, and the mission is over after "
            f"{in_seconds(until_s)} at the latest"
        )
    return ""
