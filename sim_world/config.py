"""What the simulated sea is made of: the world's configuration, checked where it is built.

All positions are in the mission frame (ENU metres), headings are compass radians. Whatever is out of its range raises
ValueError with the field's name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from comms.said.messages import FARTHEST_M
from comms.said.wire import IDENTIFIER
from planner.contacts import OTHERS_UP_TO
from planner.currents import FlowGrid
from planner.keep_out import NOWHERE, KeepOut
from planner.risk import HIGHEST_P_DETECT
from planner.types import DetectionCurve, Point, SonarShape
from sim_world.channel_config import ChannelConfig, require
from sim_world.footprints import FOOTPRINTS
from sim_world.kinds import ALIKE, MIXTURES
from sim_world.layouts import Given, Layout, Uniform
from sim_world.sonar import CheckedSonar, CurveSonar, Seabed, SonarModel, SufferedSeabed

FARTHEST_RANGE_M = 1e4
LARGEST_LOOK_CELLS = 65_536
LARGEST_LOOK_TARGETS = 1_000
LARGEST_NOISE = 2.0
BIASES = -0.9, 9.0
ROUNDING_RAD = 1e-9
"""Half a turn told in degrees may be as much more."""
LEAST_ASPECT_RAD, LARGEST_ASPECT_RAD = math.radians(5.0) - ROUNDING_RAD, math.pi + ROUNDING_RAD


@dataclass(frozen=True)
class SeabedConfig:
    """The seabed's kind: `uniform` weakens nothing; `patchy` has ripple fields and vegetation patches.

    `scale_m`: smallest and largest length of a patch, measured where its effect has fallen to one half, > 0.
    `strength`: smallest and largest share of P_d that a patch takes away at its centre, within [0, 1).
    `ripple_crests_rad`: from which to which compass heading the crests of ripples run, [0, 2 pi), at most half a turn
    apart; None stands for any.
    """

    kind: Literal["uniform", "patchy"] = "uniform"
    ripple_fields: int = 0
    vegetation_patches: int = 0
    scale_m: tuple[float, float] = (40.0, 200.0)
    strength: tuple[float, float] = (0.3, 0.8)
    ripple_crests_rad: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        require(self.kind in ("uniform", "patchy"), "kind", self.kind, "uniform or patchy")
        for name in ("ripple_fields", "vegetation_patches"):
            require(0 <= getattr(self, name) <= 10_000, name, getattr(self, name), "0 to 10000")
        low, high = self.scale_m
        require(0.1 <= low <= high <= FARTHEST_M, "scale_m", self.scale_m, f"ascending, 0.1 to {FARTHEST_M:.0f} m")
        low, high = self.strength
        require(0.0 <= low <= high < 1.0, "strength", self.strength, "ascending, within [0, 1)")
        low, high = self.ripple_crests_rad or (0.0, 0.0)
        apart = 0.0 <= low <= high < 2 * math.pi and high - low <= math.pi + ROUNDING_RAD
        require(apart, "ripple_crests_rad", self.ripple_crests_rad, "ascending, 0 to 2 pi, at most pi apart")


@dataclass(frozen=True)
class EstimateConfig:
    """How a vehicle's estimate of its own P_d is wrong beyond the noise that `SensorConfig` tells; by nothing as it is.

    `bias`: by what share of it P_d is told too high, below 0 too low, -0.9 to 9; `bias_at_reach`: the same at the
    sonar's farthest range, growing evenly with the range; `bias_after_turn`: the same where a turn ends, evenly less
    until the vehicle has gone straight for `turn_m` > 0. They multiply. `blind_to_seabed`: it tells what P_d would be
    on a seabed that takes nothing. `drift_per_km`: standard deviation, on the logit scale, to which a random walk of
    the error comes over a kilometre looked at, 0 to 2. `noise_along_m`: over which distance along a track the errors of
    cells stay alike to 1 / e; None for errors of each cell's own.
    """

    bias: float = 0.0
    bias_at_reach: float = 0.0
    bias_after_turn: float = 0.0
    turn_m: float = 100.0
    blind_to_seabed: bool = False
    drift_per_km: float = 0.0
    noise_along_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("bias", "bias_at_reach", "bias_after_turn"):
            low, high = BIASES
            require(low <= getattr(self, name) <= high, name, getattr(self, name), f"{low:g} to {high:g}")
        require(0.01 <= self.turn_m <= 1e4, "turn_m", self.turn_m, "0.01 to 10000 m")
        require(0.0 <= self.drift_per_km <= LARGEST_NOISE, "drift_per_km", self.drift_per_km, "0 to 2")
        along_m = self.noise_along_m
        require(along_m is None or 0.01 <= along_m <= 1e4, "noise_along_m", along_m, "0.01 to 10000 m")

    @property
    def without_chance(self) -> EstimateConfig:
        """The same where nothing is drawn."""
        return replace(self, drift_per_km=0.0, noise_along_m=None)


@dataclass(frozen=True)
class SensorConfig:
    """A sonar.

    `curve`: true P_d over range on a seabed that weakens nothing; nothing is seen beyond its last range. `footprint`,
    `near_m`, `half_angle_rad`: what ground it sees besides, see `planner.types.SonarShape`. A look stands for `look_m`
    of track, a whole number of bins `along_bin_m`; its lateral bins are centred at whole multiples of `range_bin_m`.
    `noise_cell` and `noise_track`: standard deviations, on the logit scale, of the error of the P_d that the vehicle
    estimates, drawn once a cell and once a track, 0 to 2. `sonar` makes the true model, called with the keywords
    `curve` and `seabed`; None stands for `sim_world.sonar.CurveSonar`. `seabed_share`: of what the seabed takes away
    the share that this sonar loses, [0, 1]. `half_at_crab_rad`: the crab angle at which half of P_d is lost, up to
    pi / 2; None for a sonar that does not mind, see `sim_world.steadiness`.
    """

    curve: DetectionCurve
    along_bin_m: float = 5.0
    range_bin_m: float = 5.0
    look_m: float = 20.0
    noise_cell: float = 0.0
    noise_track: float = 0.0
    sonar: Callable[..., SonarModel] | None = None
    footprint: str = "side"
    near_m: float = 0.0
    half_angle_rad: float = 0.0
    seabed_share: float = 1.0
    half_at_crab_rad: float | None = None
    estimate: EstimateConfig = field(default_factory=EstimateConfig)
    false_alarms_per_km2: float = 0.0
    others_up_to: float = OTHERS_UP_TO

    def __post_init__(self) -> None:
        ranges, values = self.curve.range_m, self.curve.p_detect
        require(
            ranges.ndim == 1 and ranges.shape == values.shape and ranges.size >= 2,
            "curve", f"{ranges.size} ranges and {values.size} values", "as many values as ranges, at least two",
        )  # fmt: skip
        require(
            bool(ranges[0] >= 0.0 and np.all(np.diff(ranges) > 0.0) and ranges[-1] <= FARTHEST_RANGE_M),
            "curve", "its ranges", f"ascending, 0 to {FARTHEST_RANGE_M:.0f} m",
        )  # fmt: skip
        sound = bool(np.all((values >= 0.0) & (values <= HIGHEST_P_DETECT)))
        require(sound, "curve", "its values", f"0 to {HIGHEST_P_DETECT}")
        for name in ("along_bin_m", "range_bin_m", "look_m"):
            require(0.01 <= getattr(self, name) <= 1e4, name, getattr(self, name), "0.01 to 10000 m")
        per_look = self.look_m / self.along_bin_m
        require(
            round(per_look) >= 1 and math.isclose(per_look, round(per_look), rel_tol=1e-9),
            "look_m", self.look_m, f"a whole multiple of along_bin_m, {self.along_bin_m}",
        )  # fmt: skip
        require(self.footprint in FOOTPRINTS, "footprint", self.footprint, " or ".join(FOOTPRINTS))
        cells = 2 * math.prod(self.look_bins)
        require(cells <= LARGEST_LOOK_CELLS, "look_m", f"{cells} cells a look", f"at most {LARGEST_LOOK_CELLS}")
        for name in ("noise_cell", "noise_track"):
            require(0.0 <= getattr(self, name) <= LARGEST_NOISE, name, getattr(self, name), "0 to 2")
        require(0.0 <= self.seabed_share <= 1.0, "seabed_share", self.seabed_share, "0 to 1")
        half_rad = self.half_at_crab_rad
        require(half_rad is None or 1e-3 <= half_rad <= math.pi / 2, "half_at_crab_rad", half_rad, "0.001 to pi / 2")
        alarms = self.false_alarms_per_km2
        require(0.0 <= alarms <= 1e6, "false_alarms_per_km2", alarms, "0 to 1e6")
        require(0.0 < self.others_up_to <= 1.0, "others_up_to", self.others_up_to, "above 0, to 1")
        # The looks of a sector ahead overlap: their cells do not lie one behind the other.
        beside = self.footprint == "side" or self.estimate.noise_along_m is None
        require(beside, "estimate.noise_along_m", self.estimate.noise_along_m, "None but for the footprint side")

    def sonar_over(self, seabed: Seabed, vehicle: str) -> SonarModel:
        """The true model of a vehicle's sonar over a seabed, of which it loses its share."""
        suffered = seabed if self.seabed_share == 1.0 else SufferedSeabed(seabed, self.seabed_share)
        if self.sonar is None:
            return CurveSonar(self.curve, suffered)
        return CheckedSonar(self.sonar(curve=self.curve, seabed=suffered), vehicle)

    def believed_over(self, seabed: Seabed, vehicle: str) -> SonarModel | None:
        """What the vehicle takes its sonar for over a seabed, where that is not the true model."""
        if not self.estimate.blind_to_seabed:
            return None
        return replace(self, seabed_share=0.0).sonar_over(seabed, vehicle)

    @cached_property
    def bins_per_look(self) -> int:
        """Along-track bins of the stretch of track that a whole look stands for."""
        return round(self.look_m / self.along_bin_m)

    @property
    def look_bins(self) -> tuple[int, int]:
        """Along-track bins of a whole look, and range bins of each of its sides."""
        bins_m = self.along_bin_m, self.range_bin_m
        return FOOTPRINTS[self.footprint].bins_of(self.shape, self.bins_per_look, bins_m)

    @cached_property
    def shape(self) -> SonarShape:
        """What ground it sees."""
        return SonarShape(self.footprint, self.near_m, float(self.curve.range_m[-1]), self.half_angle_rad, self.look_m)


@dataclass(frozen=True)
class SettlingConfig:
    """How a vehicle settles after a turn: it loses `share` of P_d, [0, 1), at the turn's end, and evenly less down to
    nothing once it has gone straight for `length_m` > 0."""

    share: float
    length_m: float

    def __post_init__(self) -> None:
        require(0.0 <= self.share < 1.0, "share", self.share, "0 to below 1")
        require(0.01 <= self.length_m <= 1e4, "length_m", self.length_m, "0.01 to 10000 m")


@dataclass(frozen=True)
class CurrentConfig:
    """A current towards the compass heading `set_rad`. With `period_s` it flows to and fro, at `drift_mps` at most.
    `over_ground`: vehicles keep their speed over the ground; else that through the water. With a `grid` it flows as
    that tells, at `drift_mps` at most."""

    drift_mps: float
    set_rad: float
    period_s: float | None = None
    over_ground: bool = False
    grid: FlowGrid | None = None

    def __post_init__(self) -> None:
        require(0.0 <= self.drift_mps <= 100.0, "drift_mps", self.drift_mps, "0 to 100")
        require(-7.0 <= self.set_rad <= 7.0, "set_rad", self.set_rad, "-7 to 7")
        require(self.period_s is None or 1.0 <= self.period_s <= 1e7, "period_s", self.period_s, "1 to 1e7 s")


@dataclass(frozen=True)
class VehicleConfig:
    """A simulated vehicle and where it waits for its first manoeuvre.

    `position_error_m`: the constant distance, in a random direction, between where the vehicle is and where it
    believes it is. `position_drift_mps`: what comes to that, growing with the mission's time, in a random direction of
    its own. The start pose is the believed one. `settling`: how it settles after a turn; None for one that is steady at
    once. `endurance_ms`: how long its battery lasts from the mission's start, unless it lies at `home` before; where
    that is None, where it starts. None for a battery without end.
    """

    vehicle: str
    start_x_m: float
    start_y_m: float
    start_heading_rad: float
    speed_mps: float
    turn_radius_m: float
    altitude_m: float
    sensor: SensorConfig
    position_error_m: float = 0.0
    position_drift_mps: float = 0.0
    settling: SettlingConfig | None = None
    endurance_ms: int | None = None
    home: Point | None = None

    def __post_init__(self) -> None:
        require(bool(IDENTIFIER.fullmatch(self.vehicle)), "vehicle", self.vehicle, f"a match of {IDENTIFIER.pattern}")
        for name, low, high in (
            ("start_x_m", -FARTHEST_M, FARTHEST_M),
            ("start_y_m", -FARTHEST_M, FARTHEST_M),
            ("start_heading_rad", -7.0, 7.0),
            ("speed_mps", 0.01, 100.0),
            ("turn_radius_m", 0.01, 1e4),
            ("altitude_m", -1e4, 1e4),
            ("position_error_m", 0.0, 1e4),
            ("position_drift_mps", 0.0, 1.0),
        ):
            require(low <= getattr(self, name) <= high, name, getattr(self, name), f"{low:g} to {high:g}")


@dataclass(frozen=True)
class TargetsConfig:
    """The targets in the area: how many, at most 1000, where they lie, how alike they are, and what looks at one share.

    `correlation`: how far the looks at one target share their chance, [0, 1], and `aspect_rad`: how far apart the
    bearings of two of them are where they share nothing any more, 5 degrees to pi, None where bearings do not matter,
    see `sim_world.strengths`. `kinds`: the mixture that targets are drawn from, one of `sim_world.kinds.MIXTURES`.
    `clutter_per_km2`: how many things are expected to lie there, a square kilometre, that are seen as targets are and
    are none, 0 to 1000.
    """

    count: int = 0
    layout: Layout = field(default_factory=Uniform)
    correlation: float = 0.0
    aspect_rad: float | None = None
    kinds: str = ALIKE
    clutter_per_km2: float = 0.0

    def __post_init__(self) -> None:
        require(0 <= self.count <= LARGEST_LOOK_TARGETS, "count", self.count, f"0 to {LARGEST_LOOK_TARGETS}")
        given = not isinstance(self.layout, Given) or len(self.layout.places_m) == self.count
        require(given, "count", self.count, "as many as there are places")
        require(0.0 <= self.correlation <= 1.0, "correlation", self.correlation, "0 to 1")
        aspect_rad = self.aspect_rad
        wide = aspect_rad is None or LEAST_ASPECT_RAD <= aspect_rad <= LARGEST_ASPECT_RAD
        require(wide, "aspect_rad", aspect_rad, "5 degrees to pi")
        require(self.kinds in MIXTURES, "kinds", self.kinds, " or ".join(MIXTURES))
        require(0.0 <= self.clutter_per_km2 <= 1000.0, "clutter_per_km2", self.clutter_per_km2, "0 to 1000")


@dataclass(frozen=True)
class WorldConfig:
    """The whole sea. `area`, `holes`: outlines of the survey area and of what is left out of it, at least three corners
    each. `vehicles`: those simulated here, all of them faster than the current. `keep_out`: what none of them may
    enter, and where no target lies. `channel`: between the modems of these vehicles, and of platforms that lie still;
    None where there are no modems."""

    seed: int
    area: tuple[Point, ...]
    vehicles: tuple[VehicleConfig, ...]
    seabed: SeabedConfig = field(default_factory=SeabedConfig)
    targets: TargetsConfig = field(default_factory=TargetsConfig)
    holes: tuple[tuple[Point, ...], ...] = ()
    current: CurrentConfig | None = None
    keep_out: KeepOut = NOWHERE
    channel: ChannelConfig | None = None

    def __post_init__(self) -> None:
        require(self.seed >= 0, "seed", self.seed, "0 or more")
        for name, outline in (("area", self.area), *(("holes", hole) for hole in self.holes)):
            require(len(outline) >= 3, name, f"{len(outline)} corners", "at least three")
            require(
                all(abs(coordinate) <= FARTHEST_M for corner in outline for coordinate in corner),
                name, "its corners", f"at most {FARTHEST_M:.0f} m from the origin along each axis",
            )  # fmt: skip
        names = [vehicle.vehicle for vehicle in self.vehicles]
        require(len(set(names)) == len(names), "vehicles", ", ".join(names), "different names")
        slowest_mps = min((vehicle.speed_mps for vehicle in self.vehicles), default=math.inf)
        holds = self.current is None or self.current.drift_mps < slowest_mps
        require(holds, "current", self.current, f"slower than every vehicle, {slowest_mps:g} m/s")
        if self.channel is not None:
            placed = {*names, *(name for name, _ in self.channel.still)}
            here = {*self.channel.platforms} <= placed
            require(here, "channel", ", ".join(self.channel.platforms), "vehicles of the world and what lies still")
