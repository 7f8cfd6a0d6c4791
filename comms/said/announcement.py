"""What is announced at the start of a run: who is in the fleet, in which role, with which sonar, and what is surveyed.

Annotations are not postponed here: the wire's codecs read them, and would have to compile each from its text.
"""

import enum
from dataclasses import dataclass
from typing import Annotated, ClassVar

from comms.said.over_water import Follows, PlaceX, PlaceY
from comms.said.wire import (
    AtMost,
    Count,
    Digest,
    Identifier,
    Metres,
    MetresPerSecond,
    Milliseconds,
    Probability,
    Radians,
    Whole,
    YesNo,
)
from planner.types import GridSpec, Point, SonarShape, SweepFrame

LONGEST_NAME = 40
"""Characters of a scenario's name, as of any identifier."""
LARGEST_SEED = 2**32 - 1
MOST_CORNERS = 1000
MOST_VEHICLES = 1024
MOST_HOLES = 20
MOST_HOLE_CORNERS = 50
"""Of each hole: more would not fit a message, with as many holes as there may be."""
MOST_ZONES = 20
MOST_ZONE_CORNERS = 50
"""Of each zone to keep out of."""


class Role(enum.Enum):
    """What a node is in the fleet."""

    CLOCK = "clock"
    WORLD = "world"
    BODY = "body"
    SURVEY = "survey"
    REVISIT = "revisit"
    COORDINATOR = "coordinator"
    RECORDER = "recorder"
    OBSERVER = "observer"
    SURVEY_REVISIT = "survey_revisit"
    MODEM = "modem"
    DRIVER = "driver"

    @property
    def is_single(self) -> bool:
        """Whether a fleet has one such node at most, whose id is the role's word."""
        return self in (Role.CLOCK, Role.WORLD, Role.COORDINATOR, Role.RECORDER, Role.OBSERVER)

    @property
    def surveys(self) -> bool:
        """Whether it is the agent of a primary."""
        return self in (Role.SURVEY, Role.SURVEY_REVISIT)

    @property
    def revisits(self) -> bool:
        """Whether it takes strips: a helper's agent, or a primary's once it has surveyed all."""
        return self in (Role.REVISIT, Role.SURVEY_REVISIT)


class ClockMode(enum.Enum):
    """Whether simulated time advances in lockstep or with the wall clock."""

    LOCKSTEP = "lockstep"
    WALL = "wall"


@dataclass(frozen=True, slots=True)
class RosterVehicle:
    """One vehicle of the fleet, as everyone is told at the start.

    `footprint`, `near_m`, `far_m`, `half_angle_rad`, `look_m`: what its sonar sees, see `planner.types.SonarShape`.
    `p_detect`: the mean P_d of a pass over the lateral ranges that it reaches, which a second look is expected to have.
    `endurance_ms`: how long its battery lasts from the mission's start. By its own reckoning it is home, at `home_x_m`,
    `home_y_m`, `reserve_ms` before that. `drift_mps`, `set_rad`: of the current that it reckons with, slower than it is
    through the water; `is_tidal`: it flows to and fro, so fast at most. 0 for one that keeps its speed over the ground.
    """

    vehicle: Identifier
    role: Role
    speed_mps: MetresPerSecond
    turn_radius_m: Metres
    run_in_m: Metres
    near_m: Metres
    far_m: Metres
    p_detect: Probability
    endurance_ms: Milliseconds
    footprint: Identifier = "side"
    half_angle_rad: Radians = 0.0
    look_m: Metres = 20.0
    home_x_m: Metres = 0.0
    home_y_m: Metres = 0.0
    reserve_ms: Milliseconds = 0
    drift_mps: MetresPerSecond = 0.0
    set_rad: Radians = 0.0
    is_tidal: YesNo = False

    @property
    def sonar(self) -> SonarShape:
        """Its sonar as planning knows it."""
        return SonarShape(self.footprint, self.near_m, self.far_m, self.half_angle_rad, self.look_m)


@dataclass(frozen=True, slots=True)
class Vertex:
    """A corner of an outline."""

    x_m: Annotated[PlaceX, Follows(4)]
    y_m: Annotated[PlaceY, Follows(4)]


@dataclass(frozen=True, slots=True)
class Grid:
    """The residual-risk map's grid (`planner.types.GridSpec`): the sweep frame's origin and heading, cells."""

    origin_x_m: Metres
    origin_y_m: Metres
    heading_rad: Radians
    cell_m: Metres
    columns: Count
    rows: Count

    @property
    def spec(self) -> GridSpec:
        """The grid as planning uses it."""
        frame = SweepFrame(self.origin_x_m, self.origin_y_m, self.heading_rad)
        return GridSpec(frame, self.cell_m, self.columns, self.rows)


@dataclass(frozen=True, slots=True)
class Hole:
    """What is left out of an area: a hole's outline."""

    outline: Annotated[tuple[Vertex, ...], AtMost(MOST_HOLE_CORNERS)]


@dataclass(frozen=True, slots=True)
class Zone:
    """Ground that no vehicle may enter: its outline."""

    outline: Annotated[tuple[Vertex, ...], AtMost(MOST_ZONE_CORNERS)]


@dataclass(frozen=True, slots=True)
class RunInfo:
    """What is run: published once by the clock before anything else. Everyone takes area, grid and roster from here.

    `area`: the survey area's outline. `rho`: correlation of looks at one cell in the residual risk, 0 for none.
    `holes`: what is not to be surveyed within the area. `keep_out`: ground that no vehicle may enter, within the area
    or beside it, and `keep_out_margin_m`: how far off it all stay where they believe they are, as that may not be quite
    so.
    """

    LEFT_OUT: ClassVar[int] = 2

    schema: Count
    scenario: Identifier
    scenario_sha256: Digest
    seed: Annotated[int, Whole(0, LARGEST_SEED)]
    mode: ClockMode
    area: Annotated[tuple[Vertex, ...], AtMost(MOST_CORNERS)]
    grid: Grid
    rho: Probability
    vehicles: Annotated[tuple[RosterVehicle, ...], AtMost(MOST_VEHICLES)]
    holes: Annotated[tuple[Hole, ...], AtMost(MOST_HOLES)] = ()
    keep_out: Annotated[tuple[Zone, ...], AtMost(MOST_ZONES)] = ()
    keep_out_margin_m: Metres = 0.0

    @property
    def outline(self) -> tuple[Point, ...]:
        """The survey area's corners, mission frame."""
        return tuple((corner.x_m, corner.y_m) for corner in self.area)

    @property
    def hole_outlines(self) -> tuple[tuple[Point, ...], ...]:
        """The corners of each hole, mission frame."""
        return tuple(tuple((corner.x_m, corner.y_m) for corner in hole.outline) for hole in self.holes)

    @property
    def keep_out_outlines(self) -> tuple[tuple[Point, ...], ...]:
        """The corners of each zone to keep out of, mission frame."""
        return tuple(tuple((corner.x_m, corner.y_m) for corner in zone.outline) for zone in self.keep_out)
