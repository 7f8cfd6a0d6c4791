"""A vehicle's sonar: what it detects over range, how noisy that is, and how finely it reports."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)

from comms.errors import NO_FAILURES, in_words
from planner.contacts import OTHERS_UP_TO
from planner.types import DetectionCurve, SonarShape
from secondlook.scenario import bundled
from secondlook.scenario.plug_ins import CURVE, SONAR, PlugInError
from secondlook.scenario.text import Value
from secondlook.scenario.values import (
    LEAST,
    TOLERANCE,
    Bin,
    Length,
    LengthOrZero,
    Mapping,
    Noise,
    PDetect,
    Share,
    check_as_many,
    check_ascending,
    plug_in,
    refused,
)


class Curve(Mapping):
    """A detection curve P(y): P_d over lateral range, linear between its points and 0 outside."""

    range_m: Annotated[tuple[LengthOrZero, ...], Field(strict=False, min_length=2, max_length=10_000)]
    """Lateral ranges, ascending."""
    p_detect: Annotated[tuple[PDetect, ...], Field(strict=False)]
    """P_d at each of them."""
    noise_cell: Noise | None = None
    """The noise a cell that was calibrated with it, for sensors that do not name their own."""
    noise_track: Noise | None = None
    """The same a track."""

    @field_validator("range_m")
    @classmethod
    def _check_ascending(cls, range_m: tuple[float, ...]) -> tuple[float, ...]:
        return check_ascending(range_m)

    @field_validator("p_detect")
    @classmethod
    def _check_length(cls, p_detect: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        return check_as_many(p_detect, info)

    @property
    def detection_curve(self) -> DetectionCurve:
        """P(y) for the planner."""
        return DetectionCurve(np.array(self.range_m), np.array(self.p_detect))


def _bundled(value: object) -> object:
    if not isinstance(value, str):
        return value
    names = bundled.curve_names()
    if value in names:
        return bundled.curve(value)
    if ":" not in value:
        raise refused(
            f"must be a bundled curve ({', '.join(names)}), a mapping with range_m and p_detect, "
            "or package.module:Class of what makes one"
        )
    try:
        made = CURVE.make(value)
    except PlugInError as error:
        raise refused(str(error)) from error
    except NO_FAILURES:
        raise
    except BaseException as error:
        raise refused(f"must make a DetectionCurve; {in_words(error)}") from error
    if not isinstance(made, DetectionCurve):
        raise refused(f"must make a DetectionCurve; it makes a {type(made).__name__}")
    return {"range_m": np.asarray(made.range_m).tolist(), "p_detect": np.asarray(made.p_detect).tolist()}


OptionalCurve = Annotated[Curve | None, BeforeValidator(_bundled, json_schema_input_type=Curve | str | None)]
"""A curve inline, a bundled one's name, or `package.module:Class` of what makes one."""

CALIBRATED = "muscle"
"""The bundled curve whose noise holds for every sensor that has none of its own."""


def _noise(name: Literal["noise_cell", "noise_track"]) -> Any:
    """The default of a sensor's noise: its curve's, or else the calibrated one."""

    def default(sensor: dict[str, Any]) -> Value:
        curve = sensor.get("curve")
        own = None if curve is None else getattr(curve, name)
        return bundled.curve(CALIBRATED)[name] if own is None else own

    return Field(default_factory=default)


Bias = Annotated[float, Field(ge=-0.9, le=9)]


class Estimate(Mapping):
    """How wrong the P_d is that a vehicle tells of its looks, beyond `noise_cell` and `noise_track`; what it detects
    stays as it is. The shares multiply."""

    bias: Bias = 0.0
    """The share by which it tells too much, below 0 too little: 0.2 for a fifth more than there is."""
    bias_at_reach: Bias = 0.0
    """The same at the farthest range, and evenly less down to nothing at range 0."""
    bias_after_turn: Bias = 0.0
    """The same where a turn ends, and evenly less until it has gone straight for `turn_m`."""
    turn_m: Length = 100.0
    """For how long a straight run `bias_after_turn` lasts; the run-in counts."""
    blind_to_seabed: bool = False
    """It tells what its sonar would see if the seabed took nothing."""
    drift_per_km: Noise = 0.0
    """Standard deviation, in logits, to which a random walk of its error comes over a kilometre looked at."""
    noise_along_m: Length | None = None
    """Over which distance along the track the errors of cells stay alike, to 1 / e; left out, each has its own. Not of
    a `wedge`, whose looks overlap."""


def _none_if_right(estimate: Estimate | None) -> Estimate | None:
    return None if estimate == Estimate() else estimate  # the same sensor, so the same scenario


class SensorBase(Mapping):
    """What every sonar has, whatever the kind of its footprint. What it detects is either a `curve`, or, flat,
    `p_detect` up to `range_m`."""

    footprint: str
    """What ground it sees: `side`, what lies beside its track; `wedge`, a sector ahead."""
    curve: OptionalCurve = None
    """Detection curve P(y): a bundled one's name (`muscle`), a mapping as below, or `package.module:Class` of what
    makes one."""
    sonar: Annotated[str, plug_in(SONAR)] | None = None
    """`package.module:Class` of a true sonar model of your own, which is given that curve and the seabed."""
    p_detect: PDetect | None = None
    """Instead of a curve: the same P_d at every range up to `range_m`."""
    range_m: Length | None = None
    """How far that P_d holds."""
    seabed_share: Share | None = None
    """Of what the seabed takes from P_d, the share that this sonar loses: less than 1 for one that looks from near and
    steeply down. Left out, all of it."""
    half_at_crab_deg: Annotated[float, Field(ge=1, le=90)] | None = None
    """The crab angle, in a current, at which half of P_d is lost; at half that angle a 17th is, at twice it all but a
    17th. Left out, crabbing does not matter."""
    noise_cell: Noise = _noise("noise_cell")
    """Standard deviation of P_d per cell, in logits; left out, the curve's own, or else that of `muscle`."""
    noise_track: Noise = _noise("noise_track")
    """The same per track."""
    estimate: Annotated[Estimate | None, AfterValidator(_none_if_right)] = None
    """How wrong the P_d is that the vehicle tells, on purpose; left out, right but for that noise."""
    false_alarms_per_km2: Annotated[float | None, Field(ge=0, le=100_000), AfterValidator(lambda one: one or None)] = (
        Field(default=None, json_schema_extra={"default": 0})
    )
    """How many contacts of nothing it reports a square kilometre that it sees."""
    others_up_to: Annotated[
        float | None, Field(ge=0.5, le=1), AfterValidator(lambda one: None if one == OTHERS_UP_TO else one)
    ] = Field(default=None, json_schema_extra={"default": OTHERS_UP_TO})
    """How high its recogniser scores what is no target, in truth: at most that, and less mostly (that times a beta
    distribution of 2 and 3). Targets score 0.5 to 1. The fleet takes it for 0.75, whatever it is."""
    along_bin_m: Bin = 5.0
    """Bin of a look along the track, in whole centimetres."""
    range_bin_m: Bin = 1.0
    """Bin of a look over range, in whole centimetres."""
    look_m: Annotated[Length, Field(validate_default=True)] = 20.0
    """Length of track in one look, a multiple of `along_bin_m`."""

    @field_validator("along_bin_m", "range_bin_m")
    @classmethod
    def _check_centimetres(cls, bin_m: float) -> float:
        # Looks travel in centimetres: with other bins they would gape or overlap.
        if round(bin_m * 100) < 1 or abs(bin_m * 100 - round(bin_m * 100)) > TOLERANCE:
            raise refused("must be a whole number of centimetres")
        return bin_m

    @field_validator("look_m")
    @classmethod
    def _check_whole_bins(cls, look_m: float, info: ValidationInfo) -> float:
        if "along_bin_m" in info.data:
            bins = look_m / info.data["along_bin_m"]
            if round(bins) < 1 or abs(bins - round(bins)) > TOLERANCE:
                raise refused(f"must be a multiple of along_bin_m, {info.data['along_bin_m']:g}")
        return look_m

    @model_validator(mode="after")
    def _check_one_curve(self) -> Self:
        flat = (self.p_detect is not None, self.range_m is not None)
        if any(flat) if self.curve is not None else not all(flat):
            raise refused("must have either curve, or p_detect and range_m")
        return self

    @property
    def reach_m(self) -> float:
        """The range up to which it detects anything."""
        return self.curve.range_m[-1] if self.curve is not None else self.range_m or 0.0

    def detection_curve(self, shape: SonarShape) -> DetectionCurve:
        """P_d over the range: the curve as given, or the flat one as far as it sees."""
        if self.curve is not None:
            return self.curve.detection_curve
        return DetectionCurve(np.array([shape.near_m, self.range_m]), np.array([self.p_detect, self.p_detect]))


class SideSensor(SensorBase):
    """A side-looking sonar: it sees what lies beside the vehicle, beyond the vehicle's nadir gap."""

    footprint: Literal["side"] = "side"

    def check_nadir_gap(self, nadir_gap_m: float) -> None:
        """Refuses a nadir gap that leaves nothing to be seen."""
        if self.reach_m < nadir_gap_m + LEAST:
            raise refused(f"must see beyond nadir_gap_m, {nadir_gap_m:g}, by {LEAST:g} or more")

    def shape(self, nadir_gap_m: float) -> SonarShape:
        """What ground it sees, from the nadir gap on."""
        return SonarShape(self.footprint, nadir_gap_m, self.reach_m, look_m=self.look_m)


class WedgeSensor(SensorBase):
    """A forward-looking sonar: from `near_m` on it sees what lies within `half_angle_deg` of the bow, to either side.
    Its `curve` is over the distance from the vehicle; it makes a look at the beginning of each `look_m`."""

    footprint: Literal["wedge"]
    half_angle_deg: Annotated[float, Field(ge=1, le=90)]
    """Of a wedge: how far it sees to either side of the bow."""
    near_m: LengthOrZero = 0.0
    """Of a wedge: from which distance on it sees; the farthest is `range_m`, or its curve's last."""

    @field_validator("estimate")
    @classmethod
    def _check_estimate(cls, estimate: Estimate | None) -> Estimate | None:
        if estimate is not None and estimate.noise_along_m is not None:
            raise refused("must be left out with footprint wedge, whose looks overlap", ("noise_along_m",))
        return estimate

    @model_validator(mode="after")
    def _check_depth(self) -> Self:
        if self.reach_m < self.near_m + self.look_m + LEAST:
            least_m = self.near_m + self.look_m
            raise refused(f"must see farther than near_m and look_m together, {least_m:g}, by {LEAST:g} or more")
        return self

    def check_nadir_gap(self, nadir_gap_m: float) -> None:
        """Refuses any: it sees the ground that its vehicle will pass over."""
        if nadir_gap_m > 0:
            raise refused(f"must be of another footprint than {self.footprint}, or nadir_gap_m 0")

    def shape(self, nadir_gap_m: float) -> SonarShape:
        """What ground it sees."""
        # As it travels: with another last digit the coordinator would take its swath for a cell narrower.
        half_angle_rad = round(math.radians(self.half_angle_deg), 6)
        return SonarShape(self.footprint, self.near_m, self.reach_m, half_angle_rad, self.look_m)


SENSORS: dict[str, type[SensorBase]] = {"side": SideSensor, "wedge": WedgeSensor}


def footprint(sensor: object) -> object:
    """The kind that a sensor names, side where it names none."""
    named = sensor.get("footprint", "side") if isinstance(sensor, dict) else getattr(sensor, "footprint", "side")
    return named if isinstance(named, str) else repr(named)


Sensor = Annotated[Annotated[SideSensor, Tag("side")] | Annotated[WedgeSensor, Tag("wedge")], Discriminator(footprint)]
