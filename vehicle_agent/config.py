"""What each agent is told about itself before the mission."""

from __future__ import annotations

from dataclasses import dataclass

from planner.spacing_planners import SpacingPlanner
from planner.types import DetectionCurve

WHOLE = (0.0, 1.0)


@dataclass(frozen=True)
class SurveyConfig:
    """A survey agent. `nadir_gap_m`, `range_m`: r_min and the told r_max of planning. `threshold`: P_d from which data
    is admissible. `hotspot_risk`: residual risk from which a settled cell is a hotspot. `run_in_m`: straight run before
    and after each track. `endurance_ms`: mission time on one battery. `prior`: P(y) of earlier missions, which holds
    until the first track is flown (paper, section III-B). `share`: from which to which share of the area's
    width it surveys, see `planner.region.Region.share`."""

    vehicle: str
    spacing: SpacingPlanner
    nadir_gap_m: float
    range_m: float
    threshold: float
    hotspot_risk: float
    run_in_m: float
    endurance_ms: int
    prior: DetectionCurve | None = None
    share: tuple[float, float] = WHOLE


@dataclass(frozen=True)
class RevisitConfig:
    """A revisit agent. `swath_m`: the full width one pass covers; `beside_m`: how far to the side of the track the
    middle of that lies, 0 for a sensor without a nadir gap. Speeds and turns are those of its vehicle."""

    vehicle: str
    swath_m: float
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    endurance_ms: int
    beside_m: float = 0.0


@dataclass(frozen=True)
class SurveyRevisitConfig:
    """An agent that surveys, and takes strips once it has surveyed all."""

    survey: SurveyConfig
    revisit: RevisitConfig
