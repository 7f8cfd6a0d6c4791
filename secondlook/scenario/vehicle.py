"""The vehicles of a scenario, by role."""

from __future__ import annotations

import inspect
import re
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from comms.said.announcement import Role
from planner.curve import effective_range_m
from planner.types import DetectionCurve, Point, SonarShape
from secondlook.scenario.plug_ins import NODE, SPACING
from secondlook.scenario.sensor import Curve, OptionalCurve, Sensor
from secondlook.scenario.values import (
    TOLERANCE,
    Coordinate,
    Duration,
    Heading,
    Length,
    LengthOrZero,
    Mapping,
    OpenShare,
    Speed,
    plug_in,
    refused,
)

RESERVE_SHARE = 0.1
_SHARE = re.compile(r"([1-9][0-9]{0,2}) of ([1-9][0-9]{0,2})")

AUTHORITY, ROUTER = "ca", "router"
"""What is certified beside the nodes of a fleet spread over hosts: its authority, and what all connect to."""
RESERVED_IDS = tuple(sorted({AUTHORITY, ROUTER, *(role.value for role in Role if role.is_single)}))
"""Ids of the nodes that are no vehicles, and names of other certificates."""


def _check_free(vehicle_id: str) -> str:
    if vehicle_id in RESERVED_IDS:
        raise refused(f"must be none of {', '.join(RESERVED_IDS)}, which others are called")
    return vehicle_id


def body_of(vehicle: str) -> str:
    """The node id of a vehicle's external body."""
    return f"{vehicle}-body"


VehicleId = Annotated[str, Field(pattern=r"^[a-z0-9_-]+$", max_length=32), AfterValidator(_check_free)]


class Start(Mapping):
    """Where a vehicle is when the mission starts: mission frame, compass heading."""

    x_m: Coordinate
    """East. Or `longitude_deg`, or `easting_m`."""
    y_m: Coordinate
    """North. Or `latitude_deg`, or `northing_m`."""
    heading_deg: Heading = 0.0
    """Compass heading."""


class Home(Mapping):
    """Where a vehicle is waited for: mission frame."""

    x_m: Coordinate
    """East. Or `longitude_deg`."""
    y_m: Coordinate
    """North. Or `latitude_deg`."""


class Settling(Mapping):
    """How a vehicle settles after a turn, until when its sonar sees less."""

    share: OpenShare
    """Share of P_d that is lost at the end of the turn; from there on less, evenly down to nothing."""
    length_m: Length
    """Straight run after which it is steady. `run_in_m` is the first part of it."""


class VehicleBase(Mapping):
    """What every vehicle has, whatever its role."""

    role: str
    """`survey`: it surveys the area, track by track. `revisit`: it takes second looks at the strips it is given."""
    body: Literal["simulated", "external"] = "simulated"
    """What moves it: the simulated world, or `external`, a program of yours."""
    start: Start
    """Where it is when the mission starts."""
    speed_mps: Speed
    """The speed at which it flies."""
    turn_radius_m: Length
    """The tightest circle that it can turn."""
    endurance_s: Duration
    """How long its battery lasts, from the mission's start. Who would not come home otherwise ends its work before."""
    home: Home | None = None
    """Where it is to be before its battery is empty; left out, where it starts."""
    reserve_s: Annotated[float, Field(ge=0, le=1e7)] | None = None
    """How long its battery is still to last when it comes home, by its own reckoning; less than `endurance_s`. Left
    out, a tenth of that."""
    altitude_m: Length
    """Height above the seabed."""
    run_in_m: LengthOrZero
    """Straight run before and after each track."""
    nadir_gap_m: LengthOrZero
    """What it does not see beside its track, per side; r_min of the paper."""
    sensor: Sensor
    """Its sonar, which must see beyond `nadir_gap_m`."""
    position_error_m: LengthOrZero = 0.0
    """How far it truly is from where it believes it is, in a random direction."""
    position_drift_m_per_h: LengthOrZero = 0.0
    """By how much it drifts from there, in another."""
    settling: Settling | None = None
    """How it settles after a turn; left out, it is steady at once."""
    agent: Annotated[str, plug_in(NODE)] | None = None
    """`package.module:Class` of a node of your own in its back seat."""

    @field_validator("sensor")
    @classmethod
    def _check_reach(cls, sensor: Sensor, info: ValidationInfo) -> Sensor:
        if "nadir_gap_m" in info.data:
            sensor.check_nadir_gap(info.data["nadir_gap_m"])
        return sensor

    @field_validator("reserve_s")
    @classmethod
    def _check_reserve(cls, reserve_s: float | None, info: ValidationInfo) -> float | None:
        endurance_s = info.data.get("endurance_s")
        if reserve_s is not None and endurance_s is not None and reserve_s >= endurance_s:
            raise refused(f"must be less than endurance_s, {endurance_s:g}")
        return reserve_s

    @property
    def home_m(self) -> Point:
        """Where it is to be before its battery is empty, mission frame."""
        place = self.start if self.home is None else self.home
        return place.x_m, place.y_m

    @property
    def kept_s(self) -> float:
        """How long its battery is still to last when it comes home."""
        return RESERVE_SHARE * self.endurance_s if self.reserve_s is None else self.reserve_s

    @property
    def sonar(self) -> SonarShape:
        """What ground its sonar sees."""
        return self.sensor.shape(self.nadir_gap_m)

    @property
    def detection_curve(self) -> DetectionCurve:
        """P_d of a look over the range: the sensor's curve, or the flat one from the nearest to the farthest range."""
        return self.sensor.detection_curve(self.sonar)


class SurveyVehicle(VehicleBase):
    """A vehicle that surveys the area, track by track."""

    role: Literal["survey"]
    altitude_m: Length = 15.0
    run_in_m: LengthOrZero = 20.0
    range_m: Annotated[float, Field(ge=1, le=1000)] | None = None
    """r_max, the range that it is told to plan with until it has flown the first pair of tracks; at least 3 times
    `nadir_gap_m`. Left out, r_eff of `prior_curve`."""
    spacing: Annotated[str, plug_in(SPACING)] = "adaptive"
    """How tracks are spaced: `adaptive`, by what it sees, `fixed`, by the first plan, `profile`, as many as `adaptive`
    would lay, but where they leave least in the worst 30 %, by all of P(y), `joint`, the same together with what
    helpers are expected to look at, or `package.module:Class` of your own."""
    wanted_risk: OpenShare | None = None
    """With `profile`, `joint` or a spacing planner of your own: the fewest tracks are laid from which it expects a mean
    residual risk of the worst 30 % of no more than this, at most three times as many as `adaptive` would lay. With
    `joint` they may leave ground unseen to helpers. Left out, as many as `adaptive` would lay."""
    threshold: OpenShare = 0.05
    """P_d from which data is admissible."""
    prior_curve: OptionalCurve = None
    """P(y) as earlier missions have measured it, in the forms of `sensor.curve`; holds until the first track is
    flown."""
    hotspot_risk: OpenShare = 0.55
    """Residual risk from which a cell is worth a second look."""
    part: str | None = None
    """Which share of the area is its own: `1 of 3` is the first of three equally wide ones, in the order in which
    tracks are laid. Left out, the whole."""
    begin: Literal["nearest", "sw", "se", "nw", "ne"] | None = None
    """Where its survey begins, and so on which side, and in which order it surveys the parts of an area: at the corner
    `nearest` to its start, or towards the south-west (`sw`) and so on. Left out, at the corner from which tracks are
    laid, which is the south-west with tracks to the north."""
    revisits: bool = False
    """Whether it takes strips itself once it has surveyed all."""

    @field_validator("range_m")
    @classmethod
    def _check_range(cls, range_m: float | None, info: ValidationInfo) -> float | None:
        lowest_m = 3 * info.data.get("nadir_gap_m", 0.0)
        if range_m is not None and range_m < lowest_m - TOLERANCE:
            raise refused(f"must be at least 3 times nadir_gap_m, {lowest_m:g}")
        return range_m

    @field_validator("wanted_risk")
    @classmethod
    def _check_wanted_risk(cls, wanted_risk: float | None, info: ValidationInfo) -> float | None:
        spacing = info.data.get("spacing")
        if wanted_risk is not None and spacing is not None:
            maker = SPACING.maker(spacing)
            if inspect.isclass(maker) and not hasattr(maker, "lay"):
                raise refused(f"must be left out with spacing {spacing}; profile and joint lay tracks by risk")
        return wanted_risk

    @field_validator("prior_curve")
    @classmethod
    def _check_prior(cls, prior: Curve | None, info: ValidationInfo) -> Curve | None:
        if prior is not None and info.data.keys() >= {"range_m", "threshold"} and info.data["range_m"] is None:
            lowest_m = 3 * info.data.get("nadir_gap_m", 0.0)
            r_eff_m = effective_range_m(prior.detection_curve, info.data["threshold"])
            if not r_eff_m or r_eff_m < lowest_m - TOLERANCE:
                raise refused(f"must without range_m be admissible up to 3 times nadir_gap_m, {lowest_m:g}")
        return prior

    @model_validator(mode="after")
    def _check_told(self) -> Self:
        if self.range_m is None and self.prior_curve is None:
            raise refused("must have range_m, or prior_curve to read it off")
        return self

    @property
    def told_range_m(self) -> float:
        """r_max as told, or else r_eff of the prior curve."""
        if self.range_m is not None:
            return self.range_m
        assert self.prior_curve is not None
        return effective_range_m(self.prior_curve.detection_curve, self.threshold) or 0

    @field_validator("part")
    @classmethod
    def _check_part(cls, part: str | None) -> str | None:
        match = None if part is None else _SHARE.fullmatch(part)
        if part is not None and (match is None or not 1 <= int(match[1]) <= int(match[2])):
            raise refused("must be such as 1 of 3: which share, and of how many, at most 999")
        return part

    @property
    def share_of(self) -> tuple[int, int]:
        """Which share of how many is its own, from 1; the whole is 1 of 1."""
        match = None if self.part is None else _SHARE.fullmatch(self.part)
        return (1, 1) if match is None else (int(match[1]), int(match[2]))

    @property
    def share(self) -> tuple[float, float]:
        """From where to where its share of the area's width runs."""
        share, shares = self.share_of
        return (share - 1) / shares, share / shares


class RevisitVehicle(VehicleBase):
    """A vehicle that takes a second look at the strips it is given."""

    role: Literal["revisit"]
    altitude_m: Length = 5.0
    run_in_m: LengthOrZero = 5.0
    nadir_gap_m: LengthOrZero = 0.0


Vehicle = Annotated[SurveyVehicle | RevisitVehicle, Field(discriminator="role")]
