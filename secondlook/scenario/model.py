"""A scenario: what is surveyed, by whom, and how the mission ends."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

import shapely
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from comms.said.announcement import LARGEST_SEED, LONGEST_NAME, MOST_VEHICLES
from comms.said.routing import driver_of, modem_of
from modem.config import MOST_PLATFORMS, SECOND_BITS, SMALL_BITS, least_frame_bits, slots_of
from secondlook.scenario.area import Area
from secondlook.scenario.current import AnyCurrent, GridCurrent
from secondlook.scenario.degrees import Origin
from secondlook.scenario.goal import MOST_OUTSIDE, AnyGoal, share_outside
from secondlook.scenario.link import SHIP, Link, Position
from secondlook.scenario.plug_ins import ALLOCATOR, NODE
from secondlook.scenario.targets import PlacesLayout, Targets, first_outside
from secondlook.scenario.text import dump
from secondlook.scenario.values import (
    LEAST,
    Duration,
    Heading,
    Mapping,
    OpenShare,
    Share,
    all_refused,
    check_pair,
    check_utc,
    plug_in,
    refused,
)
from secondlook.scenario.vehicle import RevisitVehicle, Start, SurveyVehicle, Vehicle, VehicleId, body_of

DEADLINE_FACTOR = 1.05
MOST_TOLD = 5  # of what is missing
Extent = Annotated[float, Field(ge=0.1, le=1000)]
PartOf = Annotated[float, Field(ge=0, lt=1)]
Headings = Annotated[tuple[Heading, Heading], BeforeValidator(check_pair), Field(strict=False)]


class Mission(Mapping):
    """When the mission ends, and how its risk is computed."""

    deadline_s: Duration | None = None
    """The mission is over at the latest at this time, whether or not the survey is. Left out, `deadline_factor` tells
    when."""
    deadline_factor: Annotated[float, Field(ge=1, le=100)] | None = Field(
        default_factory=lambda data: None if data.get("deadline_s") else DEADLINE_FACTOR,
        json_schema_extra={"default": DEADLINE_FACTOR},
    )
    """The mission is over at the latest at so many times the survey's duration, of several the last one's; with a link
    counted from when the coordinator hears that it has ended. Not beside `deadline_s`, or null."""
    time_limit_s: Annotated[Duration, Field(validate_default=True)] = 20_000.0
    """The run fails if it is not over by then."""
    rho: Share = 0.0
    """Correlation of looks in the residual risk: 0 independent, as in the paper, 1 only the best look counts."""
    separation_m: Annotated[float, Field(ge=0, le=1000)] = 12.0
    """Helpers give way to whom they would come nearer, but not on their way home; 0: they need not."""
    goal: AnyGoal | None = None
    """What it is flown for: it ends as soon as that is reached. Left out, it goes on while a second look is worth it,
    or until its deadline. Not with a `link`, as contacts do not cross the water."""
    start_utc: Annotated[str, AfterValidator(check_utc)] | None = None
    """When second 0 is, ISO 8601, such as `2026-08-01T09:30:00Z`: report and exported files then tell times in UTC,
    too. Nothing in the mission depends on it."""

    def ends_s(self, survey_s: float) -> float:
        """When the mission is over at the latest, if the last survey ends at `survey_s`."""
        if self.deadline_s is not None:
            return self.deadline_s
        assert self.deadline_factor is not None
        return self.deadline_factor * survey_s

    @property
    def deadline(self) -> str:
        """In words."""
        if self.deadline_s is not None:
            return f"at {self.deadline_s:g} s"
        return f"at {self.deadline_factor:g} times the survey's duration"

    @field_validator("deadline_factor")
    @classmethod
    def _check_one_deadline(cls, factor: float | None, info: ValidationInfo) -> float | None:
        deadline_s = info.data.get("deadline_s")
        if factor is not None and deadline_s is not None:
            raise refused(f"must be left out, or null, beside deadline_s, {deadline_s:g}")
        if factor is None and "deadline_s" in info.data and deadline_s is None:
            raise refused("must be at least 1 without deadline_s")
        return factor

    @field_validator("time_limit_s")
    @classmethod
    def _check_limit(cls, time_limit_s: float, info: ValidationInfo) -> float:
        deadline_s = info.data.get("deadline_s")
        if deadline_s is not None and time_limit_s < deadline_s:
            raise refused(f"must be at least deadline_s, {deadline_s:g}")
        return time_limit_s


class UniformSeabed(Mapping):
    """A seabed that is the same everywhere."""

    kind: Literal["uniform"] = "uniform"
    """`uniform`: the same everywhere. `patchy`: P_d is lower in places, and the keys below are there."""


class PatchySeabed(Mapping):
    """A seabed with fields of sand ripples and patches of vegetation, which lower every vehicle's P_d."""

    kind: Literal["patchy"]
    ripple_fields: Annotated[int, Field(ge=0, le=1000)] = 4
    """How many fields of sand ripples."""
    vegetation_patches: Annotated[int, Field(ge=0, le=1000)] = 10
    """How many patches of vegetation."""
    scale_m: Annotated[tuple[Extent, Extent], BeforeValidator(check_pair), Field(strict=False)] = (40.0, 200.0)
    """Least and largest extent of one."""
    strength: Annotated[tuple[PartOf, PartOf], BeforeValidator(check_pair), Field(strict=False)] = (0.3, 0.8)
    """Least and largest share of P_d that one takes."""
    ripple_crests_deg: Headings | None = None
    """From which to which heading the crests of the ripples run, at most 180 degrees apart, as swell from one side
    makes them; left out, in any direction. A sonar that looks across crests sees least, along them as on flat
    ground."""

    @field_validator("scale_m", "strength", "ripple_crests_deg")
    @classmethod
    def _check_order(cls, pair: tuple[float, float] | None) -> tuple[float, float] | None:
        if pair is not None and pair[0] > pair[1]:
            raise refused("must be the least, then the largest")
        return pair

    @field_validator("ripple_crests_deg")
    @classmethod
    def _check_crests(cls, pair: tuple[float, float] | None) -> tuple[float, float] | None:
        if pair is not None and pair[1] - pair[0] > 180:
            raise refused("must be at most 180 degrees apart")
        return pair


class Coordinator(Mapping):
    """How strips are cut and given out."""

    allocator: Annotated[str, plug_in(ALLOCATOR)] = "plan"
    """Who is offered which strip: `plan`, `auction`, `cbba`, `greedy`, `nearest`, `first_come`, `none` (strips are cut,
    but given to nobody), or `package.module:Class` of your own."""
    node: Annotated[str, plug_in(NODE)] | None = None
    """`package.module:Class` of a whole coordinator of your own."""
    lost_after_s: Annotated[float, Field(ge=20, le=1e7)] = 30.0
    """A vehicle not heard of for so long counts as lost. Agents tell their state every 10 s: one may be late. With
    a `link` it is offered nothing from then on, and lost after 600 s, or more where cycles are long."""
    min_strip_m: Annotated[float, Field(ge=1, le=1000)] = 30.0
    """Least length of a strip."""
    max_strip_m: Annotated[float, Field(ge=1, le=10_000)] = 10_000.0
    """Largest length of a strip, at least `min_strip_m`."""
    worth_risk: OpenShare = 0.05
    """Mean residual risk, times the weight of the ground, over the helper's swath from which a further metre of strip
    is worth flying, whatever time there is."""
    strips: Literal["reacting", "beforehand", "lanes", "lanes_across"] = "reacting"
    """Where second looks go: `reacting` to all that is heard; to the best routes that can be planned `beforehand`; to
    `lanes` side by side that helpers mow from the first second, along the tracks or across. The last three are what the
    first is compared with: for them `allocator` counts for nothing."""
    across: bool = True
    """Whether strips may run across the tracks, too, where less is left by such."""
    objective: Literal["mean", "worst30", "both", "targets"] = "both"
    """What second looks are to bring down: the `mean` residual risk, that of the worst 30 % of the area (`worst30`),
    `both`, seven tenths the mean and three tenths the worst, or the share of `targets` expected to be missed. Helpers
    do the same for the last as for the mean, for a cell's risk is the chance that a target there is missed;
    `area.priorities` then tell where targets lie thicker. What differs is by what `secondlook compare` judges."""
    helpers_a_team: Annotated[int, Field(ge=1, le=MOST_VEHICLES)] = 3
    """So many helpers share a sector of the area; fewer than twice as many share all of it. What is decided in one
    sector rests on what lies in it and on its team; who is free joins another team where it is needed more."""
    switch_margin: Annotated[float, Field(ge=0, le=100)] = 0.2
    """A helper is turned round for a plan that is better by at least this share."""
    contacts: bool | None = None
    """Whether contacts that may be mines or not are looked at again, beside badly seen ground: where that makes it as
    much surer for its time how many mines there are. Left out, they are where there is clutter or sensors raise false
    alarms, and no `link`, as contacts do not cross the water."""
    platform: Annotated[str, Field(max_length=LONGEST_NAME)] | None = None
    """Where it is, which matters with a `link`: on a `ship`, or aboard a vehicle, by its id. Left out, on the ship."""
    position: Position | None = None
    """Where that ship lies. Left out, in the middle of where the vehicles start."""

    @field_validator("position")
    @classmethod
    def _check_ship(cls, position: Position | None, info: ValidationInfo) -> Position | None:
        platform = info.data.get("platform")
        if position is not None and platform not in (None, SHIP):
            raise refused(f"must be left out aboard a vehicle, {platform}")
        return position

    @field_validator("max_strip_m")
    @classmethod
    def _check_order(cls, max_strip_m: float, info: ValidationInfo) -> float:
        if max_strip_m < info.data.get("min_strip_m", 0.0):
            raise refused(f"must be at least min_strip_m, {info.data['min_strip_m']:g}")
        return max_strip_m


class Scenario(Mapping):
    """One mission."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$", max_length=LONGEST_NAME)]
    """a-z, 0-9, `_` and `-`."""
    description: Annotated[str, Field(max_length=1000)] = ""
    """For people."""
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 0
    """Of everything random in the mission."""
    area: Area
    """What is surveyed."""
    origin: Origin | None = None
    """Where x 0, y 0 is on Earth: for maps, and for what is given in degrees."""
    mission: Mission = Mission()
    """When the mission ends, and how its risk is computed."""
    seabed: Annotated[UniformSeabed | PatchySeabed, Field(discriminator="kind")] = UniformSeabed()
    """What lowers P_d, and where."""
    current: AnyCurrent | None = None
    """How the water flows; left out, not at all."""
    targets: Targets = Targets()
    """What there is to find."""
    vehicles: Annotated[dict[VehicleId, Vehicle], Field(max_length=MOST_VEHICLES)]
    """An entry for each vehicle, under its id (a-z, 0-9, `_` and `-`); at least one surveys."""
    coordinator: Coordinator = Coordinator()
    """How strips are cut and given out."""
    link: Link | None = None
    """How platforms talk. Left out, everybody hears everybody, at once."""

    @property
    def looks_at_contacts(self) -> bool:
        """Whether contacts are looked at again."""
        if self.coordinator.contacts is not None or self.link is not None:
            return bool(self.coordinator.contacts)
        return self.has_others

    @property
    def has_others(self) -> bool:
        """Whether there are contacts of what is no target: clutter or false alarms."""
        alarms = any(one.sensor.false_alarms_per_km2 for one in self.vehicles.values())
        return alarms or self.targets.clutter_per_km2 is not None

    @field_validator("mission")
    @classmethod
    def _check_lane(cls, mission: Mission, info: ValidationInfo) -> Mission:
        area: Area | None = info.data.get("area")
        lane = None if mission.goal is None else mission.goal.goal.lane
        if lane is not None and area is not None and (outside := share_outside(lane, area)) > MOST_OUTSIDE:
            raise refused(f"must lie in what is surveyed, but {outside:.0%} of the lane does not", ("goal", "lane_m"))
        return mission

    @field_validator("coordinator")
    @classmethod
    def _check_platform(cls, coordinator: Coordinator, info: ValidationInfo) -> Coordinator:
        vehicles: dict[str, Vehicle] | None = info.data.get("vehicles")
        if vehicles is not None and coordinator.platform not in (None, SHIP, *vehicles):
            raise refused(f"must be {_listed([SHIP, *vehicles])}", ("platform",))
        return coordinator

    @field_validator("link")
    @classmethod
    def _check_link(cls, link: Link | None, info: ValidationInfo) -> Link | None:
        if link is None or link.profile is None:
            return None  # the same fleet, so the same scenario
        mission: Mission | None = info.data.get("mission")
        if mission is not None and mission.goal is not None:
            raise refused("must be left out beside mission.goal, as contacts do not cross the water")
        vehicles: dict[str, Vehicle] = info.data.get("vehicles", {})
        coordinator: Coordinator | None = info.data.get("coordinator")
        if coordinator is not None and coordinator.contacts:
            raise refused("must be left out beside coordinator.contacts, as contacts do not cross the water")
        ship = coordinator is None or coordinator.platform in (None, SHIP)
        if ship and SHIP in vehicles:
            raise refused(f"must stand with no vehicle called {SHIP}, as the coordinator is on a ship of that name")
        external = [key for key, vehicle in vehicles.items() if vehicle.body == "external"]
        if external and link.carried_by == "world":
            raise refused(
                "must have carried_by: drivers with an external body, as the world does not know where "
                f"{external[0]} is"
            )
        platforms = [*([SHIP] if ship else []), *vehicles]
        if len(platforms) == 1:
            raise refused(f"must be left out, as there is one platform, {platforms[0]}, with the coordinator aboard")
        for number, outage in enumerate(link.outages if vehicles else ()):
            if outage.platform not in (None, *platforms):
                raise refused(f"must be {_listed(platforms)}", ("outages", number, "platform"))
        if vehicles:
            _check_modem(link, platforms, info.data.get("mission"))
            if ship and "area" in info.data:
                given = None if coordinator is None else coordinator.position
                _check_ship(link, given, [one.start for one in vehicles.values()], info.data["area"])
        return link

    @field_validator("current")
    @classmethod
    def _check_covers(cls, current: AnyCurrent | None, info: ValidationInfo) -> AnyCurrent | None:
        area: Area | None = info.data.get("area")
        if isinstance(current, GridCurrent) and area is not None and (told := current.outside(area.polygon_m)):
            raise refused(f"must cover the area, but {told}")
        return current

    @field_validator("targets")
    @classmethod
    def _check_places(cls, targets: Targets, info: ValidationInfo) -> Targets:
        area: Area | None = info.data.get("area")
        if isinstance(targets.layout, PlacesLayout) and area is not None:
            outside = first_outside(area, targets.layout.places_m)
            if outside is not None:
                raise refused("must lie in the area", ("layout", "places_m", outside))
        return targets

    @field_validator("vehicles")
    @classmethod
    def _check_vehicles(cls, vehicles: dict[str, Vehicle], info: ValidationInfo) -> dict[str, Vehicle]:
        area: Area | None = info.data.get("area")
        zones = [] if area is None else [shapely.Polygon(zone) for zone in area.keep_out]
        mistakes = list(_wrong_together(vehicles))
        for key, vehicle in vehicles.items():
            mistakes += _wrong_with(key, vehicle, zones, info.data.get("current"))
        if mistakes:
            raise all_refused(mistakes)
        return vehicles

    @property
    def survey_vehicles(self) -> dict[str, SurveyVehicle]:
        """The vehicles that survey, by id, in the scenario's order."""
        return {key: vehicle for key, vehicle in self.vehicles.items() if isinstance(vehicle, SurveyVehicle)}

    @property
    def thresholds(self) -> dict[str, float]:
        """The P_d from which data is admissible, of each vehicle that surveys."""
        return {key: vehicle.threshold for key, vehicle in self.survey_vehicles.items()}

    @property
    def revisit_vehicles(self) -> dict[str, RevisitVehicle]:
        """The vehicles that revisit, by id, in the scenario's order."""
        return {key: vehicle for key, vehicle in self.vehicles.items() if isinstance(vehicle, RevisitVehicle)}

    @property
    def external_vehicles(self) -> list[str]:
        """The vehicles whose bodies are programs of somebody else's."""
        return [key for key, vehicle in self.vehicles.items() if vehicle.body == "external"]

    def to_yaml(self) -> str:
        """This scenario as a file that loads as an equal one, defaults filled in and bundled curves written out."""
        return dump(self.model_dump(mode="json", exclude_none=True))


def _wrong_together(vehicles: dict[str, Vehicle]) -> Iterator[PydanticCustomError]:
    """What is wrong with the vehicles as a fleet."""
    shares = {one.share_of for one in vehicles.values() if isinstance(one, SurveyVehicle)}
    counts = {count for _, count in shares}
    missing = [
        f"{share} of {count}" for count in counts for share in range(1, count + 1) if (share, count) not in shares
    ]
    if not shares:
        yield refused("must have a vehicle with role survey")
    elif len(counts) > 1:
        yield refused("must all survey the whole area, or each a share of as many")
    elif missing:
        yield refused(f"must survey the whole area together, but nobody has share {_listed(missing)}")
    for key, vehicle in vehicles.items():
        if vehicle.body == "external" and body_of(key) in vehicles:
            yield refused(f"must have another id, as the external body of {key} is called so", (body_of(key),))


def _wrong_with(
    key: str, vehicle: Vehicle, zones: Sequence[shapely.Polygon], current: AnyCurrent | None
) -> Iterator[PydanticCustomError]:
    """What is wrong with one vehicle, `zones` being what it has to keep out of."""
    for name, place in (("start", vehicle.start), ("home", vehicle.home)):
        if place is None:
            continue
        place_m = place.x_m, place.y_m
        if isinstance(current, GridCurrent) and (told := current.outside([place_m])):
            yield refused(f"must lie where the current is given, but {told}", (key, name))
        if any(zone.intersects(shapely.Point(place_m)) for zone in zones):
            yield refused("must lie outside area.keep_out_m", (key, name))
    if current is not None:
        fastest_mps, where = current.fastest
        least_mps = fastest_mps + LEAST
        if vehicle.speed_mps < least_mps:
            yield refused(f"must be faster than the current, {least_mps:.4g} m/s or more{where}", (key, "speed_mps"))


CYCLE_UNDER_S = 1 << SECOND_BITS
"""Messages tell their second by so many bits alone."""


def _check_modem(link: Link, platforms: list[str], mission: Mission | None) -> None:
    """Whether modems of the profile can talk in this fleet."""
    if not 2 <= len(platforms) <= MOST_PLATFORMS:
        raise refused(f"must be left out with other than 2 to {MOST_PLATFORMS} platforms; there are {len(platforms)}")
    for platform in platforms:
        for node_id in (modem_of(platform), driver_of(platform)):
            if node_id in platforms:
                raise refused(f"must stand with no vehicle called {node_id}, as a node on {platform} is")
    profile, polled = link.modem, link.access == "polled"
    least = least_frame_bits(len(platforms), polled=polled)
    if profile.frame_bits < least:
        raise refused(
            f"a frame must have {least} bits or more with {len(platforms)} platforms", ("profile", "frame_bits")
        )
    if link.maps != "stretches" and profile.frame_bits < SMALL_BITS:
        raise refused(f"must be stretches with frames of fewer than {SMALL_BITS} bits", ("maps",))
    frame_s = profile.preamble_s + profile.frame_bits / profile.rate_bps
    turns = len(platforms) if polled else len(slots_of(tuple(platforms)))
    if mission is not None and frame_s * turns > mission.time_limit_s:
        most_s = mission.time_limit_s / turns
        raise refused(
            f"a frame must take {most_s:.6g} s or less, and not {frame_s:.6g} s, for each of {len(platforms)} "
            "platforms to have a turn within mission.time_limit_s",
            ("profile", "rate_bps"),
        )
    if link.reach_m is not None and link.reach_m > profile.max_range_m:
        raise refused(f"must be at most {profile.max_range_m:g}, as far as the modem is heard", ("reach_m",))
    guard_s = profile.guard_s if link.guard_s is None else link.guard_s
    packet_s = profile.preamble_s + (link.slot_frames or profile.frames) * profile.frame_bits / profile.rate_bps
    turn_s = packet_s + (link.reach_m or 0.0) / profile.speed_mps + guard_s
    most_s = min(CYCLE_UNDER_S, math.inf if mission is None else mission.time_limit_s) / turns
    if turn_s >= most_s:
        raise refused(
            f"a turn, the longest packet, the sound's way and the guard, must take less than {most_s:.6g} s, and not "
            f"{turn_s:.6g} s, for each of {len(platforms)} platforms to have one within mission.time_limit_s and "
            f"{CYCLE_UNDER_S} s",
            ("guard_s",) if link.guard_s is not None and guard_s > packet_s else (),
        )


def _check_ship(link: Link, given: Position | None, starts: Sequence[Start], area: Area) -> None:
    """Whether a ship is heard anywhere in the area."""
    x_m, y_m = ship_place(given, starts)
    apart_m, most_m = shapely.Point(x_m, y_m).distance(shapely.Polygon(area.polygon_m)), link.modem.max_range_m
    if apart_m > most_m:
        left_out = "" if given is not None else "; left out, it is in the middle of where the vehicles start"
        raise refused(
            f"must be heard farther than {most_m:g} m, or coordinator.position lie nearer to the area, from which it "
            f"is {apart_m:.0f} m away{left_out}",
            ("profile",),
        )


def ship_place(given: Position | None, starts: Sequence[Start]) -> tuple[float, float]:
    """Where the ship lies, mission frame: as given, or in the middle of where the vehicles start."""
    if given is not None:
        return given.x_m, given.y_m
    return math.fsum(one.x_m for one in starts) / len(starts), math.fsum(one.y_m for one in starts) / len(starts)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:MOST_TOLD]) + (", and so on" if len(names) > MOST_TOLD else "")


def scenario_hash(scenario: Scenario) -> str:
    """SHA-256 over all that a scenario says, 64 hexadecimal digits; equal scenarios have equal hashes."""
    content = scenario.model_dump(mode="json", exclude_none=True)
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()
