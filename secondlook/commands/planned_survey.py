"""What the surveys of a scenario come to before anything is flown: tracks, time, and what they do not cover."""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner.dubins import Pose
from planner.first_plan import FirstPlan
from planner.seen import seen_cells
from planner.sweep import distance_over, run_over
from secondlook.fleet.survey_area import plan_for, region_for, track_heading_rad
from secondlook.scenario import Scenario, SurveyVehicle


@dataclass(frozen=True)
class PlannedSurvey:
    """One vehicle's first plan. `heading_rad`: of the sweep frame, compass. `uncovered_share`: of its part of the area,
    how much lies nowhere between the nadir gap and the range it is told. `takes_s`: from its start to its last track's
    end."""

    name: str
    vehicle: SurveyVehicle
    heading_rad: float
    plan: FirstPlan
    uncovered_share: float
    takes_s: float

    @property
    def sentence(self) -> str:
        """Tracks, heading, length and coverage in words."""
        plan = self.plan
        covered = f"{self.uncovered_share:.2%} is not covered" if self.uncovered_share else "all is covered"
        in_parts = f" in {len(plan.parts)} convex parts" if len(plan.parts) > 1 else ""
        many = f"{plan.track_count} track{'' if plan.track_count == 1 else 's'}"
        return (
            f"{self.name}: {many} along {math.degrees(self.heading_rad):.4g} degrees{in_parts}, "
            f"{plan.length_m / 1000:.1f} km; up to {self.vehicle.told_range_m:g} m {covered}"
        )

    @property
    def warning(self) -> str:
        """That the battery will not last, in a sentence; else empty."""
        endurance_s = self.vehicle.endurance_s
        if self.takes_s <= endurance_s:
            return ""
        return f"{self.name}: its survey takes {self.takes_s:.0f} s, longer than its endurance_s of {endurance_s:g}"


def planned_surveys(scenario: Scenario) -> list[PlannedSurvey]:
    """Of all survey vehicles, in the scenario's order. Raises UserError where a spacing planner of the user's fails."""
    heading_rad = track_heading_rad(scenario)
    return [_planned(scenario, name, vehicle, heading_rad) for name, vehicle in scenario.survey_vehicles.items()]


def _planned(scenario: Scenario, name: str, vehicle: SurveyVehicle, heading_rad: float) -> PlannedSurvey:
    plan = plan_for(scenario, name, heading_rad)
    tracks = plan.all_tracks
    region = region_for(scenario, vehicle, heading_rad)
    grid = region.about(heading_rad).grid(scenario.area.cell_m)
    inside = region.inside(grid)
    missed = inside & ~seen_cells(grid, tracks, vehicle.nadir_gap_m, vehicle.told_range_m)
    start = Pose(vehicle.start.x_m, vehicle.start.y_m, math.radians(vehicle.start.heading_deg))
    runs = [run_over(track.start, track.end, vehicle.run_in_m) for track in tracks]
    # The last track's run-out comes after its end.
    way_m = distance_over(start, runs, vehicle.turn_radius_m) - vehicle.run_in_m
    return PlannedSurvey(
        name, vehicle, heading_rad, plan, float(missed.sum() / max(1, inside.sum())), way_m / vehicle.speed_mps
    )
