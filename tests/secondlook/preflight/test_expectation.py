"""What a mission is expected to come to, held to hand-computed surveys and to what is flown."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from flights import BRIEF, TWO_PRIMARIES

from comms.node import Received
from comms.said.messages import AgentState, Nav
from planner.dubins import Pose
from planner.reckoning import Course, Trace
from secondlook import check_mission
from secondlook.errors import UserError
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.launch.processes import RunFailedError
from secondlook.preflight import MissionExpectation, expected_mission
from secondlook.scenario import Scenario, load_scenario, make_scenario
from secondlook.scenario.bundled import scenario_names
from secondlook.scenario.text import Value

TOLERANCE = 0.01
"""Where the same tracks are laid only rounding differs. With another noise one more or one less may be."""


@dataclass
class Flown:
    """What came of a mission. `ways`: of each vehicle when its survey had ended, or it was home: when, and how far it
    had come."""

    summary: dict[str, Any] = field(default_factory=dict)
    ways: dict[str, tuple[float, float]] = field(default_factory=dict)
    _traces: dict[str, Trace] = field(default_factory=dict)
    _last: dict[str, Pose] = field(default_factory=dict)
    _way_m: dict[str, float] = field(default_factory=dict)

    def watch(self, said: Received) -> None:
        """Told each message."""
        message, vehicle = said.message, said.vehicle
        if isinstance(message, Nav):
            trace = self._traces.setdefault(vehicle, Trace())
            self._go(vehicle, trace.hear(Course.of(message, said.header.sent_ms)))
        elif isinstance(message, AgentState) and message.mode.has_ended and vehicle not in self.ways:
            self._go(vehicle, self._traces[vehicle].end(said.header.sent_ms))
            self.ways.setdefault(vehicle, (said.t_s, self._way_m.get(vehicle, 0.0)))

    def _go(self, vehicle: str, places: list[tuple[int, Pose]]) -> None:
        for _, pose in places:
            further_m = math.dist(pose[:2], self._last.get(vehicle, pose)[:2])
            self._way_m[vehicle] = self._way_m.get(vehicle, 0.0) + further_m
            self._last[vehicle] = pose


def fly(scenario: Scenario, folder: Path) -> Flown:
    flown = Flown()
    options = RunOptions(folder, bus="local", record=False, watch=flown.watch)
    flown.summary = run_mission(scenario, options)
    return flown


def assert_comes_to(expected: MissionExpectation, flown: Flown) -> None:
    """Ways and durations of all surveys, and all batteries."""
    summary = flown.summary
    assert expected.refusals == ()
    assert expected.survey_s == pytest.approx(summary["time"]["primary_s"], rel=TOLERANCE)
    assert summary["time"]["mission_s"] <= expected.latest_s * (1 + TOLERANCE)
    for one in expected.surveys:
        over_s, way_m = flown.ways[one.vehicle]
        assert one.flown == one.tracks == summary["vehicles"][one.vehicle]["tracks"]
        assert (one.over_s, one.way_m) == pytest.approx((over_s, way_m), rel=TOLERANCE)
    left = {vehicle: told["battery_left"] for vehicle, told in summary["vehicles"].items()}
    assert expected.battery_left == pytest.approx(left, abs=0.015)  # strips may be done before the deadline


@pytest.mark.parametrize("name", scenario_names())
def test_the_surveys_of_a_bundled_mission_come_to_what_is_told_before(name: str, tmp_path: Path) -> None:
    mission = load_scenario(name)
    if name in ("wide", "armada"):  # ways and durations are the same on fewer cells, and with longer looks
        longer = [f"vehicles.{vehicle}.sensor.look_m=400" for vehicle in mission.survey_vehicles]
        shorter = ["area.polygon_m=[[0, 0], [10000, 0], [10000, 2500], [0, 2500]]"] if name == "armada" else []
        mission = load_scenario(name, ["area.cell_m=50", *longer, *shorter])
    alone = mission.model_copy(update={"vehicles": mission.survey_vehicles})  # a helper never holds them up
    expected = check_mission(alone)
    assert_comes_to(expected, fly(alone, tmp_path))
    assert expected.latest_s == expected.survey_s


@pytest.mark.parametrize("name", ["tellaro", "two-helpers"])
def test_a_bundled_mission_with_helpers_comes_to_what_is_told_before(name: str, tmp_path: Path) -> None:
    mission = load_scenario(name, ["area.cell_m=10"])  # on fewer cells strips are cut sooner
    expected = check_mission(mission)
    assert_comes_to(expected, fly(mission, tmp_path))
    assert expected.latest_s == pytest.approx(1.05 * expected.survey_s)


@pytest.mark.parametrize(
    "setting",
    [
        "current={set_deg: 60, drift_mps: 3}",
        "current={set_deg: 0, drift_mps: 3, period_s: 90}",
        "area.keep_out_m=[[[120, 30], [160, 30], [160, 60], [120, 60]]]",
        "vehicles.primary.begin=ne",
        "vehicles.primary.spacing=profile",
    ],
)
def test_currents_ground_to_keep_out_of_and_spacing_are_reckoned_with(setting: str, tmp_path: Path) -> None:
    mission = load_scenario(BRIEF, [setting])
    alone = mission.model_copy(update={"vehicles": mission.survey_vehicles})
    expected = check_mission(alone)
    assert_comes_to(expected, fly(alone, tmp_path))
    assert expected.survey_s != pytest.approx(check_mission(BRIEF).survey_s, rel=0.001)


def two_tracks(**changes: Any) -> MissionExpectation:
    """Of a vehicle that is on its first run-in already, and whose second track lies two turn radii beside the first."""
    data: dict[str, Value] = {
        "name": "two",
        "area": {"polygon_m": [[0, 0], [120, 0], [120, 400], [0, 400]], "track_heading_deg": 0},
        "vehicles": {
            "primary": {
                "role": "survey",
                "start": {"x_m": 40, "y_m": -20},
                "speed_mps": 2,
                "turn_radius_m": 20,
                "endurance_s": 10_000,
                "nadir_gap_m": 0,
                "range_m": 40,
                "spacing": "fixed",
                "sensor": {"p_detect": 0.5, "range_m": 40},
            }
        },
    }
    return check_mission(make_scenario(data, [f"{key}={value}" for key, value in changes.items()]))


WAY_M = 20 + 400 + 20 + 20 * math.pi + 20 + 400


def test_two_tracks_and_the_half_circle_between_them() -> None:
    expected = two_tracks()
    (survey,) = expected.surveys
    assert (survey.tracks, survey.flown) == (2, 2)
    assert survey.way_m == pytest.approx(WAY_M, rel=1e-3)
    assert survey.ends_s == pytest.approx((420 / 2, WAY_M / 2), abs=0.01)
    assert expected.survey_s == expected.latest_s == survey.over_s == survey.ends_s[-1]
    assert expected.battery_left == {"primary": pytest.approx(1 - WAY_M / 2 / 10_000)}
    assert expected.sentences == [
        "primary: about 2 tracks and 0.9 km with turns in 461 s",
        "the survey ends after about 461 s, and with it the mission; battery left then: primary 95%",
    ]
    assert (expected.warnings, expected.refusals) == ([], ())


@pytest.mark.parametrize(("key", "limit_s"), [("time_limit_s", 400), ("deadline_s", 400), ("time_limit_s", 200)])
def test_a_limit_is_told_with_what_it_cuts_and_by_how_much(key: str, limit_s: int) -> None:
    changes = {f"mission.{key}": limit_s} | ({"mission.deadline_factor": "null"} if key == "deadline_s" else {})
    (told,) = two_tracks(**changes).refusals
    assert told == (
        f"mission.{key}: {limit_s} s ends the survey after about {limit_s // 210} of 2 tracks, as it takes about "
        f"462 s; must be larger by about {462 - limit_s} s, or flown with --anyway"
    )


@pytest.mark.parametrize("key", ["mission.time_limit_s", "mission.deadline_s", "vehicles.primary.endurance_s"])
@pytest.mark.parametrize("given_s", [50, 60.4, 70.6])
def test_a_limit_that_is_larger_by_what_is_told_is_refused_no_more(key: str, given_s: float) -> None:
    alone = ["mission.deadline_factor=null"] if key == "mission.deadline_s" else []

    def refusals(value_s: float) -> tuple[str, ...]:
        return check_mission(BRIEF, [*alone, f"{key}={value_s}"]).refusals

    (told,) = refusals(given_s)
    told_s, lacking_s = (int(re.findall(pattern, told)[0]) for pattern in (rf"{key}: (\d+) s", r"by about (\d+) s"))
    assert refusals(told_s + lacking_s) == refusals(given_s + lacking_s) == ()
    (still,) = refusals(math.floor(given_s) + lacking_s - 1)
    assert "must be larger by about 1 s" in still


class TestBatteries:
    def test_one_that_is_too_small_is_told_with_what_it_lacks(self) -> None:
        # Home is where it starts: from behind the first track's run-out it is longer than from behind the second's.
        expected = two_tracks(**{"vehicles.primary.endurance_s": 500})
        (survey,) = expected.surveys
        assert (survey.flown, survey.tracks) == (0, 2)
        (told,) = expected.refusals
        lacking_s = survey.needs_s - 500
        assert told == (
            "vehicles.primary.endurance_s: 500 s ends its survey after about 0 of 2 tracks, as it must come home; must "
            f"be larger by about {math.ceil(lacking_s)} s, or flown with --anyway"
        )
        assert two_tracks(**{"vehicles.primary.endurance_s": math.ceil(survey.needs_s) + 1}).refusals == ()
        assert two_tracks(**{"vehicles.primary.endurance_s": math.floor(survey.needs_s) - 1}).refusals != ()

    @pytest.mark.parametrize(
        "settings",
        [
            ["vehicles.primary.endurance_s=80"],
            # To and fro, an agent reckons with the slower way; the vehicle tells when the first track ends, on which it
            # has set out before it knew where it was.
            [
                *("vehicles.primary.endurance_s=72", "vehicles.primary.reserve_s=0"),
                "current={set_deg: 90, drift_mps: 4, period_s: 600}",
            ],
        ],
        ids=["still water", "tide"],
    )
    def test_home_with_what_is_left_as_it_is_flown(self, settings: list[str], tmp_path: Path) -> None:
        expected = check_mission(BRIEF, settings)
        flown = fly(load_scenario(BRIEF, settings), tmp_path)
        told = flown.summary["vehicles"]["primary"]
        (survey,) = expected.surveys
        assert (survey.flown, told["survey_cut_short"]) == (told["tracks"], True)
        assert survey.over_s == pytest.approx(told["ended_s"], abs=0.1)
        assert expected.battery_left["primary"] == pytest.approx(told["battery_left"], abs=0.01)
        assert survey.sentence.endswith(f" km with turns, home after {told['ended_s']:.0f} s")
        assert len(expected.refusals) == 1

    def test_one_that_never_comes_home(self) -> None:
        far = {"vehicles.primary.home": "{x_m: 50000, y_m: 0}", "vehicles.primary.endurance_s": 900}
        expected = two_tracks(**far)
        assert expected.surveys[0].sentence.endswith(", its battery empty after 900 s")
        assert expected.battery_left == {"primary": 0.0}
        assert len(expected.refusals) == 1

    def test_what_another_primary_has_the_time_to_take_is_no_reason_to_stay_ashore(self) -> None:
        two = str(TWO_PRIMARIES)
        expected = check_mission(two)
        assert expected.refusals == ()
        (told,) = expected.warnings
        assert re.fullmatch(
            r"vehicles\.west\.endurance_s: 80 s ends its survey after about \d of \d tracks, as it must come home; "
            "other primaries have the time to take the rest",
            told,
        )
        assert len(check_mission(two, ["vehicles.east.revisits=false"]).refusals) == 1
        assert len(check_mission(two, ["mission.deadline_s=110"]).refusals) == 1

    def test_who_must_be_home_before_the_end_is_reckoned_there(self) -> None:
        expected = check_mission("tellaro", ["vehicles.helper.endurance_s=3000"])
        # A tenth is its reserve, and it has 10 s to spare.
        assert expected.battery_left["helper"] == pytest.approx(310 / 3000)

    def test_nobody_has_more_than_all_of_its_battery_left(self) -> None:
        assert check_mission("tellaro", ["vehicles.helper.endurance_s=1"]).battery_left["helper"] == 1.0


_RING = (
    [[-60, -60], [-50, -60], [-50, 160], [-60, 160]],
    [[-60, -60], [360, -60], [360, -50], [-60, -50]],
    [[350, -60], [360, -60], [360, 160], [350, 160]],
    [[-60, 150], [360, 150], [360, 160], [-60, 160]],
)
WALLS = f"area.keep_out_m={list(_RING)}"


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        (["coordinator.allocator=none"], "coordinator.allocator is none, which gives strips to nobody"),
        (
            ["vehicles.helper.start={x_m: -115, y_m: 50}", WALLS],
            "no way leads from its start to the area past ground to keep out of",
        ),
        (
            # Its sonar sees 15 m: 1,000 m there, 30 m of strip and 1,000 m home at 12 m/s.
            ["vehicles.helper.start={x_m: -1015, y_m: 50}", "vehicles.helper.endurance_s=180"],
            "it needs 170 s or more for the shortest strip, the way there (1000 m) and home (1000 m), and its "
            "endurance_s of 180 is for 152 s beside its reserve",
        ),
        (
            ["vehicles.helper.start={x_m: -4015, y_m: 50}"],
            "it needs 334 s or more to the area, and the mission is over after {latest_s:.0f} s at the latest",
        ),
        (
            # Its sonar's swath is 30 m: strips of 330 m might just fit.
            ["coordinator.min_strip_m=331", "coordinator.max_strip_m=400"],
            "a strip is 331 m long or longer (coordinator.min_strip_m), and in the area none is longer than 300 m",
        ),
    ],
)
def test_a_helper_that_can_do_nothing_is_told_and_does_nothing(settings: list[str], why: str, tmp_path: Path) -> None:
    expected = check_mission(BRIEF, settings)
    assert expected.idle == {"helper": why.format(latest_s=expected.latest_s)}
    assert expected.warnings == [f"helper: can do nothing: {expected.idle['helper']}"]
    flown = fly(load_scenario(BRIEF, settings), tmp_path)
    assert flown.summary["hotspots"]["revisited"] == 0


def test_the_same_of_several_is_told_once() -> None:
    expected = check_mission("two-helpers", ["coordinator.allocator=none"])
    assert expected.warnings == [
        "west, east: can do nothing: coordinator.allocator is none, which gives strips to nobody"
    ]


def test_of_helpers_that_may_do_something_nothing_is_said() -> None:
    assert [check_mission(name).idle for name in scenario_names()] == [{}] * len(scenario_names())
    assert check_mission(BRIEF, ["coordinator.allocator=none", "coordinator.strips=lanes"]).idle == {}


def test_a_primary_that_revisits_needs_time_after_its_survey() -> None:
    expected = two_tracks(**{"vehicles.primary.revisits": "true", "mission.deadline_factor": 1})
    assert expected.idle == {"primary": "it revisits, but the mission is over when its survey is"}


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (("1 of 2", "2 of 2"), []),
        ((None, None), ["one, two: each surveys the whole area; vehicles.ID.part gives each a share of its own"]),
        (
            ("1 of 2", "2 of 2", "2 of 2"),
            ["two, three: each surveys share 2 of 2; vehicles.ID.part gives each a share of its own"],
        ),
    ],
)
def test_primaries_that_survey_the_same_ground_are_remarked_on(parts: Sequence[str | None], told: list[str]) -> None:
    scenario = load_scenario(BRIEF)
    primary, helper = scenario.survey_vehicles["primary"], scenario.revisit_vehicles["helper"]
    names = ("one", "two", "three")[: len(parts)]
    shares = {name: primary.model_copy(update={"part": part}) for name, part in zip(names, parts, strict=True)}
    fleet = scenario.model_copy(update={"vehicles": {**shares, "helper": helper}})
    assert expected_mission(fleet).warnings == told


def test_a_time_limit_between_the_surveys_end_and_the_deadline_is_remarked_on(tmp_path: Path) -> None:
    expected = check_mission("tellaro", ["mission.time_limit_s=3300"])
    assert expected.refusals == ()
    assert expected.warnings == [
        "mission.time_limit_s: 3300 s ends the mission if strips are left then, as a failure; its deadline is after "
        f"about {math.ceil(expected.latest_s)} s"
    ]


@pytest.mark.parametrize(
    ("platform", "heard_m", "told"),
    [
        # The ship lies at -40, -20, in the middle of the starts, the farthest corner at 300, 100: 360.6 m away.
        ("ship", 361, ""),
        ("ship", 360, "the area reaches 361 m from the ship"),
        ("primary", 317, ""),
        ("primary", 310, "two vehicles in the area may be 316 m from each other"),
    ],
)
def test_who_may_be_out_of_earshot_is_remarked_on(platform: str, heard_m: int, told: str) -> None:
    profile = (
        f"{{name: near, frame_bits: 256, rate_bps: 99, max_range_m: {heard_m}, loss: {{range_m: [0], share: [0]}}}}"
    )
    settings = [f"link.profile={profile}", f"coordinator.platform={platform}"]
    expected = check_mission(BRIEF, settings)
    heard = f"link.profile: a modem of near is heard up to {heard_m} m away, and {told}"
    assert expected.warnings == ([f"{heard}: who is farther off is not heard there"] if told else [])
    assert check_mission(BRIEF, [*settings, "link.carried_by=drivers"]).warnings == []


def test_a_limit_cuts_what_is_told(tmp_path: Path) -> None:
    settings = ["mission.time_limit_s=2000"]
    (told,) = check_mission("paper", settings).refusals
    with contextlib.suppress(RunFailedError):
        fly(load_scenario("paper", settings), tmp_path)
    flown = yaml.safe_load((tmp_path / "summary.json").read_text())["vehicles"]["primary"]["tracks"]
    assert f"ends the survey after about {flown} of 8 tracks" in told


def test_a_spacing_planner_of_the_users_that_fails_is_told() -> None:
    with pytest.raises(UserError, match="stubborn_spacing:Stubborn has failed to lay tracks: RuntimeError: not today"):
        check_mission("tellaro", ["vehicles.primary.spacing=stubborn_spacing:Stubborn"])


def test_of_a_large_fleet_batteries_that_are_alike_are_told_together() -> None:
    few = expected_mission(load_scenario(str(BRIEF)))
    few = replace(few, battery_left={f"v{number}": 0.75 if number == 3 else 0.5 for number in range(9)})
    assert few.sentences[-1].endswith("; battery left then: 8 vehicles 50%, v3 75%")


def test_across_the_water_the_mission_is_over_later_as_the_end_of_the_survey_is_heard_late() -> None:
    # A turn of rate 1 takes 7.8 s here, a cycle 3 of them; a word and its answer come within 11 cycles.
    plain, linked = check_mission("tellaro"), check_mission("tellaro", ["link.profile=micromodem-1"])
    late_s = 11 * 3 * 7.829
    assert linked.survey_s == plain.survey_s
    assert linked.latest_s == pytest.approx(1.05 * (plain.survey_s + late_s), abs=0.1)
    assert linked.battery_left["helper"] < plain.battery_left["helper"]
    absolute = ["mission.deadline_s=3300", "mission.deadline_factor=null"]
    assert check_mission("tellaro", ["link.profile=micromodem-1", *absolute]).latest_s == 3300
