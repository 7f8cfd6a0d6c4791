"""`secondlook check`: is a scenario valid, and how will its area be surveyed?"""

from __future__ import annotations

import math
from typing import Annotated

import typer

from planner.first_plan import FirstPlan
from planner.seen import seen_cells
from secondlook.fleet import build_fleet
from secondlook.scenario import Scenario, SurveyVehicle, load_scenario
from secondlook.survey_area import first_plans, region_of, track_heading_rad


def check(scenario: Annotated[str, typer.Argument(help="A bundled scenario's name or a YAML file.")]) -> None:
    """Validate a scenario, and tell all that is wrong with it by line."""
    valid = load_scenario(scenario)
    build_fleet(valid, record=False)
    across_m, along_m = valid.area.extent_m
    vehicles = ", ".join(f"{key} ({vehicle.role})" for key, vehicle in valid.vehicles.items())
    typer.echo(f"{scenario}: valid; {across_m:g} m by {along_m:g} m, {vehicles}")
    heading_rad = track_heading_rad(valid)
    for name, plan in first_plans(valid, heading_rad).items():
        typer.echo(f"{name}: {_told(valid, valid.survey_vehicles[name], plan, heading_rad)}")


def _told(scenario: Scenario, vehicle: SurveyVehicle, plan: FirstPlan, heading_rad: float) -> str:
    """How Algorithm 1 lays the first tracks, and what these do not cover as far as the vehicle is told to see."""
    region = region_of(scenario)
    grid = region.about(heading_rad).grid(scenario.area.cell_m)
    inside = region.inside(grid)
    tracks = [track for part in plan.tracks for track in part]
    missed = inside & ~seen_cells(grid, tracks, vehicle.nadir_gap_m, vehicle.told_range_m)
    covered = f"{missed.sum() / inside.sum():.2%} is not covered" if missed.any() else "all is covered"
    in_parts = f" in {len(plan.parts)} convex parts" if len(plan.parts) > 1 else ""
    many = f"{plan.track_count} track{'' if plan.track_count == 1 else 's'}"
    return (
        f"{many} along {math.degrees(heading_rad):.4g} degrees{in_parts}, {plan.length_m / 1000:.1f} km; "
        f"up to {vehicle.told_range_m:g} m {covered}"
    )
