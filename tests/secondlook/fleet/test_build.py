"""From a scenario to a fleet: what everyone is told, and what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from one_node import received

from comms.said.announcement import Role, RosterVehicle, RunInfo
from comms.said.topics import RUN
from comms.said.wire import record_of
from planner.area import SurveyArea
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet, world_config
from secondlook.scenario import ScenarioError, load_scenario, make_scenario
from sim_world.config import CurrentConfig, EstimateConfig, SettlingConfig, TargetsConfig
from sim_world.layouts import Clusters, Given, Layout, Lines, Uniform


def announced(*overrides: str) -> RunInfo:
    """The run's announcement as everyone hears it."""
    run_info = build_fleet(load_scenario("tellaro", overrides), record=False).run_info
    message = received("run", run_info).message
    assert isinstance(message, RunInfo)
    return message


def helper(run: RunInfo) -> RosterVehicle:
    return next(vehicle for vehicle in run.vehicles if vehicle.role is Role.REVISIT)


def askew(points: Sequence[tuple[float, float]], heading_deg: float) -> str:
    """These places of the sweep frame, as a polygon far from the origin."""
    sin, cos = math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg))
    return f"area.polygon_m={[[5000 + u * cos + v * sin, -3000 - u * sin + v * cos] for u, v in points]}"


def around(x_m: float, y_m: float, radius_m: float, corners: int) -> list[list[float]]:
    """An outline about a place, each second corner of which is a dent."""
    return [
        [
            x_m + (radius_m - index % 2) * math.sin(math.tau * index / corners),
            y_m + (radius_m - index % 2) * math.cos(math.tau * index / corners),
        ]
        for index in range(corners)
    ]


class TestGroundToKeepOutOf:
    ROCK = "area.keep_out_m=[[[100, 100], [200, 100], [150.004, 200]]]"

    def test_it_is_announced_with_how_far_all_stay_off(self) -> None:
        run = announced(self.ROCK)
        assert run.keep_out_outlines == (((100, 100), (200, 100), (150, 200)),)
        assert run.keep_out_margin_m == 1.5
        off = announced(self.ROCK, "vehicles.helper.position_error_m=4", "vehicles.primary.position_drift_m_per_h=9")
        assert off.keep_out_margin_m == 51.5  # 9 m an hour for the 20,000 s that the mission may last

    def test_without_it_nothing_of_it_is_said(self) -> None:
        with_it, without = (record_of(RunInfo).encode(announced(*said)) for said in ((self.ROCK,), ()))
        assert len(with_it) == len(without) + 2
        assert without == with_it[:2] + without[2:3] + with_it[3:-2]  # but the scenario's hash

    def test_a_start_in_it_or_too_near_to_it_is_refused(self) -> None:
        def beside(x_m: float) -> str:
            return f"area.keep_out_m=[[[-100, -100], [{x_m}, -100], [{x_m}, 0], [-100, 0]]]"

        with pytest.raises(ScenarioError, match=r"vehicles\.primary\.start: .* must lie outside area\.keep_out_m$"):
            announced(beside(-30))
        with pytest.raises(
            UserError, match=r"vehicles\.primary\.start must be 1\.5 m or more from ground to keep out of"
        ):
            announced(beside(-41))
        assert announced(beside(-42)).keep_out

    def test_so_is_a_home(self) -> None:
        def home(x_m: float) -> str:
            return f"vehicles.helper.home={{x_m: {x_m}, y_m: 150}}"

        with pytest.raises(ScenarioError, match=r"vehicles\.helper\.home: .* must lie outside area\.keep_out_m$"):
            announced(self.ROCK, home(150))
        with pytest.raises(
            UserError, match=r"vehicles\.helper\.home must be 1\.5 m or more from ground to keep out of"
        ):
            announced(self.ROCK, home(124))
        assert announced(self.ROCK, home(120)).keep_out


class TestTheAnnouncement:
    def test_the_trials(self) -> None:
        run = announced()
        assert [(corner.x_m, corner.y_m) for corner in run.area] == [(0, 0), (1212, 0), (1212, 400), (0, 400)]
        assert (run.grid.columns, run.grid.rows, run.grid.cell_m) == (243, 80, 5)
        assert [(vehicle.vehicle, vehicle.role) for vehicle in run.vehicles] == [
            ("primary", Role.SURVEY),
            ("helper", Role.REVISIT),
        ]
        assert (helper(run).far_m, helper(run).p_detect, helper(run).endurance_ms) == (25, 0.7, 14_400_000)

    @pytest.mark.parametrize("heading_deg", [1, 37, 90, 200.5])
    def test_corners_along_straight_sides_do_no_harm_when_they_are_rounded(self, heading_deg: float) -> None:
        corners = [(0, 0), (303, 0), (600, 0), (1212, 0), (1212, 123.3), (1212, 400), (611, 400), (0, 400), (0, 111)]
        run = announced(askew(corners, heading_deg), f"area.track_heading_deg={heading_deg}")
        area = SurveyArea(tuple((corner.x_m, corner.y_m) for corner in run.area), run.grid.heading_rad)
        assert (area.width_m, area.length_m) == pytest.approx((1212, 400), abs=0.02)

    def test_of_an_area_with_a_hole(self) -> None:
        run = announced("area.holes_m=[[[100, 100], [200, 100], [150, 200.004]]]")
        assert run.hole_outlines == (((100, 100), (200, 100), (150, 200)),)
        assert announced().holes == ()

    @pytest.mark.parametrize("seed", [2**31, 2**32 - 1])
    def test_of_every_seed_that_a_scenario_may_have(self, seed: int) -> None:
        assert announced(f"seed={seed}").seed == seed

    def test_of_the_largest_fleet_and_the_longest_outlines_that_a_scenario_may_have(self) -> None:
        # Dents, so that no corner is left out as one of a convex outline; holes side by side.
        outline = around(0, 0, 2000, 1000)
        holes = [around(150 * column, 150 * row, 60, 50) for column in range(-2, 3) for row in range(-2, 2)]
        data = load_scenario("tellaro").model_dump(mode="json", exclude_none=True)
        helper = data["vehicles"]["helper"]
        data["vehicles"] |= {f"{number:a>32}": helper for number in range(62)}
        data["area"] |= {"polygon_m": outline, "holes_m": holes}
        run = build_fleet(make_scenario(data | {"name": "n" * 40}), record=False).run_info
        heard = received("run", run)
        assert isinstance(heard.message, RunInfo)
        assert (len(heard.message.area), [len(one.outline) for one in heard.message.holes]) == (1000, [50] * 20)
        assert len(heard.message.vehicles) == 64
        assert len(heard.payload) <= RUN.max_bytes

    def test_of_an_area_that_is_concave_has_every_corner(self) -> None:
        corners = [(0.0, 0.0), (1212.0, 0.0), (1212.0, 400.0), (606.0, 200.0), (0.0, 400.0)]
        assert announced(f"area.polygon_m={[list(one) for one in corners]}").outline == tuple(corners)

    def test_of_a_heading_left_to_us(self) -> None:
        run = announced("area.track_heading_deg=auto")
        assert run.grid.heading_rad == pytest.approx(math.pi / 2, abs=1e-6)
        assert (run.grid.columns, run.grid.rows) == (81, 243)

    def test_a_helpers_typical_p_detect_is_its_mean_over_the_swath(self) -> None:
        run = announced(
            "vehicles.helper.sensor={curve: {range_m: [0, 20, 40], p_detect: [0.2, 0.8, 0.2]}}",
        )
        assert (helper(run).far_m, helper(run).p_detect) == (40, 0.5)

    @pytest.mark.parametrize("half_angle_deg", [45, 60, 33.3, 71.7])
    def test_of_a_wedge_the_fleet_hears_the_very_sonar_that_its_agent_has(self, half_angle_deg: float) -> None:
        # At 45 degrees its swath is 60 m, twelve cells; a millionth less would be eleven.
        sensor = f"{{footprint: wedge, half_angle_deg: {half_angle_deg}, range_m: 50, look_m: 10, p_detect: 0.4}}"
        overrides = [f"vehicles.helper.sensor={sensor}"]
        own = load_scenario("tellaro", overrides).vehicles["helper"].sonar
        assert helper(announced(*overrides)).sonar == own


class TestTheWorld:
    def test_what_lowers_p_detect_comes_to_it_in_radians(self) -> None:
        overrides = (
            "seabed.ripple_crests_deg=[90, 180]",
            "current={drift_mps: 0.5, set_deg: 180, period_s: 3000}",
            "vehicles.primary.settling={share: 0.9, length_m: 150}",
            "vehicles.primary.sensor.half_at_crab_deg=45",
            "vehicles.helper.sensor.seabed_share=0.5",
        )
        world = build_fleet(load_scenario("patchy", overrides), record=False).specs["world"].config
        assert world.seabed.ripple_crests_rad == (math.pi / 2, math.pi)
        assert world.current == CurrentConfig(0.5, math.pi, 3000)
        primary, helper = world.vehicles
        assert (primary.settling, helper.settling) == (SettlingConfig(0.9, 150), None)
        assert (primary.sensor.half_at_crab_rad, helper.sensor.half_at_crab_rad) == (math.pi / 4, None)
        assert (primary.sensor.seabed_share, helper.sensor.seabed_share) == (1, 0.5)

    def test_what_is_left_out_lowers_nothing(self) -> None:
        world = build_fleet(load_scenario("patchy"), record=False).specs["world"].config
        assert (world.seabed.ripple_crests_rad, world.current) == (None, None)
        for vehicle in world.vehicles:
            sensor = vehicle.sensor
            assert (vehicle.settling, sensor.half_at_crab_rad, sensor.seabed_share) == (None, None, 1)


@pytest.mark.parametrize(
    ("layout", "made"),
    [
        ("{kind: uniform}", Uniform()),
        ("{kind: lines, heading_deg: 90, rows_apart_m: 30, jitter_m: 2}", Lines(math.pi / 2, 30.0, 2.0)),
        ("{kind: clusters, clusters: 3, spread_m: 20}", Clusters(3, 20.0)),
        ("{kind: places, places_m: [[1, 2], [3, 4]]}", Given(((1.0, 2.0), (3.0, 4.0)))),
    ],
)
def test_the_world_lays_targets_as_the_scenario_says(layout: str, made: Layout) -> None:
    targets = world_config(load_scenario("tellaro", [f"targets={{layout: {layout}}}"])).targets
    assert targets == TargetsConfig(2 if isinstance(made, Given) else 200, made)


def test_the_world_is_told_what_is_true_and_each_vehicle_how_it_errs() -> None:
    plain = world_config(load_scenario("tellaro"))
    assert plain.targets == TargetsConfig(200)
    assert [one.sensor.estimate for one in plain.vehicles] == [EstimateConfig()] * 2
    assert [one.sensor.false_alarms_per_km2 for one in plain.vehicles] == [0.0, 0.0]
    estimate = (
        "{bias: 0.1, bias_at_reach: 0.2, bias_after_turn: 0.3, turn_m: 40, blind_to_seabed: true, drift_per_km: 0.5"
    )
    odd = world_config(
        load_scenario(
            "tellaro",
            [
                "targets={count: 7, correlation: 0.4, aspect_deg: 45, kinds: mines, clutter_per_km2: 40}",
                f"vehicles.primary.sensor.estimate={estimate}, noise_along_m: 60}}",
                "vehicles.helper.sensor.false_alarms_per_km2=8",
            ],
        )
    )
    assert odd.targets == TargetsConfig(7, correlation=0.4, aspect_rad=math.pi / 4, kinds="mines", clutter_per_km2=40.0)
    primary, helper = odd.vehicles
    assert primary.sensor.estimate == EstimateConfig(0.1, 0.2, 0.3, 40.0, True, 0.5, 60.0)
    assert (primary.sensor.false_alarms_per_km2, helper.sensor.false_alarms_per_km2) == (0.0, 8.0)


@pytest.mark.parametrize(
    ("overrides", "looks"),
    [
        ((), False),
        (("targets.clutter_per_km2=5",), True),
        (("vehicles.helper.sensor.false_alarms_per_km2=5",), True),
        (("targets.clutter_per_km2=5", "coordinator.contacts=false"), False),
        (("coordinator.contacts=true",), True),
        (("targets.clutter_per_km2=5", "link.profile=micromodem-1"), False),
    ],
)
def test_contacts_are_looked_at_again_where_some_are_of_no_target(overrides: tuple[str, ...], looks: bool) -> None:
    fleet = build_fleet(load_scenario("tellaro", overrides), record=False)
    assert fleet.specs["coordinator"].config.contacts is looks
