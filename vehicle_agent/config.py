"""What each agent is told about itself before the mission."""

from __future__ import annotations

from dataclasses import dataclass

from planner.footprints.footprint import Footprint
from planner.spacing_planners import SpacingPlanner
from planner.types import DetectionCurve, Point
from planner.way_home import WayHome

WHOLE = (0.0, 1.0)


@dataclass(frozen=True)
class Homing:
    """How a vehicle comes home, and with what of its battery: by its reckoning it lasts for `reserve_ms` more then."""

    way: WayHome
    reserve_ms: int


@dataclass(frozen=True)
class SurveyConfig:
    """A survey agent. `footprint`: its sonar's. `nadir_gap_m`, `range_m`: r_min and the told r_max of planning.
    `threshold`: P_d from which data is admissible. `hotspot_risk`: residual risk from which a settled cell is a
    hotspot. `run_in_m`: straight run before and after each track. `endurance_ms`: mission time on one battery. `prior`:
    P(y) of earlier missions, which holds until the first track is flown (paper, section III-B). `share`: from which to
    which share of the area's width it surveys, see `planner.region.Region.share`. `wanted_risk`: see
    `planner.profile_spacing.SpacingTerms`. `begin`: the place from which the way to the first track, and through all
    parts, is to be short; None for the corner from which tracks are laid. `homing`: None for a vehicle that need not
    come home."""

    vehicle: str
    spacing: SpacingPlanner
    footprint: Footprint
    nadir_gap_m: float
    range_m: float
    threshold: float
    hotspot_risk: float
    run_in_m: float
    endurance_ms: int
    prior: DetectionCurve | None = None
    share: tuple[float, float] = WHOLE
    wanted_risk: float | None = None
    begin: Point | None = None
    homing: Homing | None = None


@dataclass(frozen=True)
class RevisitConfig:
    """A revisit agent. `footprint`: its sonar's. Speeds and turns are those of its vehicle. `homing`: None for one that
    need not come home."""

    vehicle: str
    footprint: Footprint
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    endurance_ms: int
    homing: Homing | None = None


@dataclass(frozen=True)
class SurveyRevisitConfig:
    """An agent that surveys, and takes strips once it has surveyed all."""

    survey: SurveyConfig
    revisit: RevisitConfig
