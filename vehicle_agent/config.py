"""What each agent is told about itself before the mission."""

from __future__ import annotations

from dataclasses import dataclass

from planner.spacing_planners import SpacingPlanner
from planner.types import DetectionCurve


@dataclass(frozen=True)
class SurveyConfig:
    """A survey agent. `nadir_gap_m`, `range_m`: r_min and the told r_max of planning. `threshold`: P_d from which data
    is admissible. `hotspot_risk`: residual risk from which a settled cell is a hotspot. `run_in_m`: straight run before
    and after each track. `endurance_ms`: mission time on one battery. `prior`: P(y) of earlier missions, which holds
    until the first track is flown (paper, section III-B)."""

    vehicle: str
    spacing: SpacingPlanner
    nadir_gap_m: float
    range_m: float
    threshold: float
    hotspot_risk: float
    run_in_m: float
    endurance_ms: int
    prior: DetectionCurve | None = None


@dataclass(frozen=True)
class RevisitConfig:
    """A revisit agent. `swath_m`: the full width one pass covers. Speeds and turns are those of its vehicle."""

    vehicle: str
    swath_m: float
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    endurance_ms: int
