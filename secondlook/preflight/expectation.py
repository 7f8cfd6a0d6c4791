"""What a mission is expected to come to, from its scenario alone: its duration, ways and batteries, and what its limits
cut of it; as figures, and in sentences for people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

from planner.way_home import MARGIN_S
from secondlook.fleet.build import build_fleet, vehicle_config, world_config
from secondlook.fleet.link import heard_within_ms_of, ship_position
from secondlook.fleet.survey_area import check_tracks, lays_tracks, region_of
from secondlook.preflight.dry_survey import DrySurvey, Sea, fly_dry
from secondlook.preflight.helpers import why_idle
from secondlook.progress import in_seconds
from secondlook.scenario import Scenario, SurveyVehicle, at_odds
from secondlook.scenario.vehicle import RESERVE_SHARE
from sim_world.seabed import make_seabed
from sim_world.steadiness import make_current
from vehicle_agent.config import SurveyRevisitConfig

OR_ANYWAY = "or flown with --anyway"
MOST_NAMED = 8  # vehicles, of each of which the battery is told


@dataclass(frozen=True)
class ExpectedSurvey:
    """One primary's survey.

    `tracks`: how many it takes; `flown`: how many of them its battery lasts for. `over_s`: when the last of those ends,
    or, where it does not last for all, when the vehicle is home; `way_m`: flown until then, turns and all. `ends_s`:
    when each track ends. `whole_s`: how long all tracks take, `needs_s`: and how large an `endurance_s` that needs.
    `is_empty`: the battery does not last for the way home.
    """

    vehicle: str
    tracks: int
    over_s: float
    way_m: float
    ends_s: tuple[float, ...]
    whole_s: float
    needs_s: float
    is_empty: bool

    @property
    def flown(self) -> int:
        """How many tracks its battery lasts for."""
        return len(self.ends_s)

    @property
    def is_cut_short(self) -> bool:
        """Whether its battery does not last for all of them."""
        return self.flown < self.tracks

    @property
    def sentence(self) -> str:
        """The same for people."""
        way = f"{self.way_m / 1000:.1f} km with turns"
        if not self.is_cut_short:
            return f"{self.vehicle}: about {_tracks(self.tracks)} and {way} in {in_seconds(self.over_s)}"
        ends = "its battery empty" if self.is_empty else "home"
        return (
            f"{self.vehicle}: about {self.flown} of {_tracks(self.tracks)} and {way}, {ends} after "
            f"{in_seconds(self.over_s)}"
        )


@dataclass(frozen=True)
class MissionExpectation:
    """What a mission is expected to come to; figures are estimates, as what is seen decides on tracks.

    `survey_s`: when the last survey ends. `latest_s`: when the mission is over at the latest, if its time limit lets it
    come to its end. `battery_left`: share of each vehicle's battery that is left then. `idle`: of the vehicles that are
    to take second looks those that can take none, and why. `remarks`: what else is worth knowing, a sentence each.
    `refusals`: why the mission cannot end within its limits, by how much and which key to change, a sentence each; none
    where it can.
    """

    surveys: tuple[ExpectedSurvey, ...]
    survey_s: float
    latest_s: float
    battery_left: Mapping[str, float]
    idle: Mapping[str, str]
    remarks: tuple[str, ...]
    refusals: tuple[str, ...]

    @property
    def sentences(self) -> list[str]:
        """What is expected, for people."""
        left = _batteries(self.battery_left)
        over = (
            f", the mission is over after about {in_seconds(self.latest_s)} at the latest"
            if self.latest_s > self.survey_s
            else ", and with it the mission"
        )
        mission = f"the survey ends after about {in_seconds(self.survey_s)}{over}; battery left then: {left}"
        return [*(one.sentence for one in self.surveys), mission]

    @property
    def warnings(self) -> list[str]:
        """Who can do nothing, and what else is worth knowing."""
        by_reason: dict[str, list[str]] = {}
        for name, why in self.idle.items():
            by_reason.setdefault(why, []).append(name)
        return [*(f"{', '.join(names)}: can do nothing: {why}" for why, names in by_reason.items()), *self.remarks]


def _batteries(left: Mapping[str, float]) -> str:
    """What is left of each battery; of a large fleet those that are alike together."""
    if len(left) <= MOST_NAMED:
        return ", ".join(f"{name} {share:.0%}" for name, share in left.items())
    alike: dict[str, list[str]] = {}
    for name, share in sorted(left.items(), key=lambda one: one[1]):
        alike.setdefault(f"{share:.0%}", []).append(name)
    return ", ".join(
        f"{names[0] if len(names) == 1 else f'{len(names)} vehicles'} {share}" for share, names in alike.items()
    )


def expected_mission(scenario: Scenario) -> MissionExpectation:
    """What a mission is expected to come to. Each survey is flown dry, by our agent in the scenario's sea, with what
    the sonar's curve lets it see there.

    Raises UserError where a room refuses the scenario (`secondlook.fleet.build.build_fleet`), and where a spacing
    planner of the user's fails.
    """
    surveys = _surveys(scenario)
    mission = scenario.mission
    survey_s = max(one.over_s for one in surveys)
    begins_s = {one.vehicle: one.over_s for one in surveys}
    may_revisit = [
        name
        for name, vehicle in scenario.vehicles.items()
        if not isinstance(vehicle, SurveyVehicle) or vehicle.revisits
    ]
    until_s = mission.ends_s(survey_s + heard_within_ms_of(scenario) / 1000)  # of when the coordinator hears of its end
    reasons = {name: why_idle(scenario, name, begins_s.get(name, 0.0), until_s) for name in may_revisit}
    idle = {name: why for name, why in reasons.items() if why}
    able = [name for name in may_revisit if name not in idle]
    # Where somebody may revisit strips are cut, and left open until then by those who can do nothing.
    latest_s = until_s if may_revisit else min(survey_s, until_s)
    refused, remarks = _flown_too_far(scenario, surveys, able, latest_s)
    remarks += [*_surveyed_twice(scenario), *filter(None, [at_odds(scenario), _out_of_earshot(scenario)])]
    limit_s = mission.time_limit_s
    if survey_s <= limit_s < latest_s:
        remarks.append(
            f"mission.time_limit_s: {in_seconds(limit_s)} ends the mission if strips are left then, as a failure; its "
            f"deadline is after about {in_seconds(math.ceil(latest_s))}"
        )
    return MissionExpectation(
        surveys=surveys,
        survey_s=min(survey_s, until_s),
        latest_s=latest_s,
        battery_left={name: _battery_left(scenario, name, latest_s, surveys) for name in scenario.vehicles},
        idle=idle,
        remarks=tuple(remarks),
        refusals=(*_too_late(scenario, surveys, survey_s), *refused),
    )


def _surveys(scenario: Scenario) -> tuple[ExpectedSurvey, ...]:
    fleet, world, found = build_fleet(scenario, record=False), world_config(scenario), list[ExpectedSurvey]()
    sea = Sea(
        make_seabed(world.seabed, world.area, world.seed), make_current(world.current, world.seed), world.keep_out
    )
    for name, vehicle in scenario.survey_vehicles.items():
        config, body = fleet.specs[name].config, vehicle_config(name, vehicle)
        survey = config.survey if isinstance(config, SurveyRevisitConfig) else config
        with lays_tracks(vehicle):
            flown = whole = fly_dry(survey, body, fleet.run_info, sea)
            if flown.is_cut_short:
                whole = fly_dry(survey, body, fleet.run_info, sea, for_ever=True)
        found.append(_survey(name, vehicle, flown, whole))
    return tuple(found)


def _survey(name: str, vehicle: SurveyVehicle, flown: DrySurvey, whole: DrySurvey) -> ExpectedSurvey:
    check_tracks(name, vehicle, whole.tracks)
    needs_s = whole.back_s + MARGIN_S
    return ExpectedSurvey(
        vehicle=name,
        tracks=len(whole.ends_s),
        over_s=flown.over_s,
        way_m=flown.way_m,
        ends_s=flown.ends_s,
        whole_s=whole.over_s,
        needs_s=needs_s / (1 - RESERVE_SHARE) if vehicle.reserve_s is None else needs_s + vehicle.reserve_s,
        is_empty=flown.is_empty,
    )


def _battery_left(scenario: Scenario, name: str, over_s: float, surveys: Sequence[ExpectedSurvey]) -> float:
    """When the mission is over; who has to be home before that rests there."""
    vehicle = scenario.vehicles[name]
    survey = next((one for one in surveys if one.vehicle == name), None)
    if survey is not None and survey.is_cut_short:
        return 0.0 if survey.is_empty else 1 - survey.over_s / vehicle.endurance_s
    # From the middle of the area, as nobody knows where it will be.
    middle = region_of(scenario).polygon.centroid
    home_s = math.dist((middle.x, middle.y), vehicle.home_m) / vehicle.speed_mps
    comes_home_s = vehicle.endurance_s - vehicle.kept_s - MARGIN_S
    rests_s = over_s if over_s + home_s <= comes_home_s else max(0.0, min(over_s, comes_home_s))
    return max(0.0, 1 - rests_s / vehicle.endurance_s)


def _too_late(scenario: Scenario, surveys: Sequence[ExpectedSurvey], survey_s: float) -> Iterator[str]:
    """What the time limit, or an earlier deadline, cuts off."""
    mission, key = scenario.mission, "time_limit_s"
    limit_s = mission.time_limit_s
    if mission.deadline_s is not None and mission.deadline_s < survey_s:
        limit_s, key = mission.deadline_s, "deadline_s"
    if survey_s > limit_s:
        done = sum(end_s <= limit_s for one in surveys for end_s in one.ends_s)
        yield (
            f"mission.{key}: {in_seconds(limit_s)} ends the survey after about {done} of "
            f"{_tracks(sum(one.tracks for one in surveys))}, as it takes about {in_seconds(math.ceil(survey_s))}; "
            f"{_too_small(limit_s, survey_s)}"
        )


def _flown_too_far(
    scenario: Scenario, surveys: Sequence[ExpectedSurvey], able: Sequence[str], latest_s: float
) -> tuple[list[str], list[str]]:
    """The surveys that batteries do not last for: a sentence each that refuses them, or, where other primaries have the
    time to take the rest, one that remarks on it."""
    short = [one for one in surveys if one.is_cut_short]
    left_s = sum(one.whole_s - max(one.ends_s, default=0.0) for one in short)
    spare_s = sum(
        max(0.0, min(latest_s, scenario.vehicles[one.vehicle].endurance_s - one.needs_s + one.over_s) - one.over_s)
        for one in surveys
        if one.vehicle in able and not one.is_cut_short
    )
    told = [
        f"vehicles.{one.vehicle}.endurance_s: {in_seconds(scenario.vehicles[one.vehicle].endurance_s)} ends its survey "
        f"after about {one.flown} of {_tracks(one.tracks)}, as it must come home"
        for one in short
    ]
    if left_s <= spare_s:
        return [], [f"{sentence}; other primaries have the time to take the rest" for sentence in told]
    return [
        f"{sentence}; {_too_small(scenario.vehicles[one.vehicle].endurance_s, one.needs_s)}"
        for sentence, one in zip(told, short, strict=True)
    ], []


def _too_small(given_s: float, needs_s: float) -> str:
    """By how much a limit must be larger, which is rounded so that it is enough."""
    return f"must be larger by about {in_seconds(math.ceil(needs_s) - math.floor(given_s))}, {OR_ANYWAY}"


def _surveyed_twice(scenario: Scenario) -> Iterator[str]:
    """Which primaries survey the same ground."""
    by_share: dict[tuple[int, int], list[str]] = {}
    for name, vehicle in scenario.survey_vehicles.items():
        by_share.setdefault(vehicle.share_of, []).append(name)
    for (share, shares), names in by_share.items():
        if len(names) > 1:
            ground = "the whole area" if shares == 1 else f"share {share} of {shares}"
            yield f"{', '.join(names)}: each surveys {ground}; vehicles.ID.part gives each a share of its own"


def _out_of_earshot(scenario: Scenario) -> str:
    """That vehicles may be so far from the coordinator's platform that no modem is heard; nothing where they are
    not."""
    link, corners = scenario.link, scenario.area.polygon_m
    if link is None or link.carried_by == "drivers":
        return ""
    ship = ship_position(scenario)
    far_m = max(math.dist(*pair) for pair in (combinations(corners, 2) if ship is None else product([ship], corners)))
    if far_m <= link.modem.max_range_m:
        return ""
    to_m = f"two vehicles in the area may be {far_m:.0f} m" if ship is None else f"the area reaches {far_m:.0f} m"
    whom = "each other" if ship is None else "the ship"
    return (
        f"link.profile: a modem of {link.modem.name} is heard up to {link.modem.max_range_m:g} m away, and {to_m} from "
        f"{whom}: who is farther off is not heard there"
    )


def _tracks(count: int) -> str:
    return f"{count} track{'' if count == 1 else 's'}"
