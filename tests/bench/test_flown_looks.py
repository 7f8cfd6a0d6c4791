"""What contenders flew, as the clairvoyant of bench/ counts it: look by look, at any heading, by the true P_d."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.clairvoyant import Row, one_seed, summary
from bench.flown_looks import FlownLooks, legs_flown
from bench.legs import Leg, Simulator
from bench.removable import Clairvoyance, Removable, leg_helpers
from bench.swath import Swath
from bench.told import told_beforehand
from comms.node import Received
from comms.said import topics
from comms.said.codec import Header
from comms.said.messages import Look, Maneuver, ManeuverKind, Message, StripState, StripStatus
from coordinator.cut.ground import OBJECTIVES
from planner.types import FloatArray
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.launch.mission import RunOptions, run_mission
from secondlook.scenario import Scenario, load_scenario

BRIEF = Path(__file__).parents[1] / "support" / "brief.yaml"
CLEAR_GROUND = ("seabed={kind: uniform}",)
ALL_OF_IT = 0.7 * 25  # what one look of the helper takes of a cell of 5 m


def everything(scenario: Scenario) -> Removable:
    """The scenario's area of 100 m by 300 m, of which nothing has been seen yet."""
    grid = build_fleet(scenario, record=False).run_info.grid.spec
    inside = np.ones(grid.shape, dtype=np.bool_)
    return Removable(grid, inside, np.ones(grid.shape), 105, leg_helpers(scenario, grid, inside))


def look_at(flown: FlownLooks, x_m: float, y_m: float, heading_rad: float, at_ms: int = 9000) -> None:
    """The helper looks at 20 m of track from there on, and estimates P_d quite wrongly."""

    def heard(topic: topics.Topic, message: Message) -> None:
        flown.hear(Received(topic.key(vehicle="helper"), topic, "helper", Header("x", 0, 0, at_ms), message))

    end = x_m + 40 * math.sin(heading_rad), y_m + 40 * math.cos(heading_rad)
    heard(topics.MANEUVER, Maneuver(1, ManeuverKind.FOLLOW, x_m, y_m, *end, 5))
    wrong = np.full((2, 4, 16), 0.01)
    heard(topics.LOOK, Look(1, 1, x_m, y_m, heading_rad, 0, 5, 1, wrong, 5, 0, valid=True, contacts=()))


def left_by_hand(mission: Removable, x_m: float, y_m: float, heading_rad: float) -> FloatArray:
    """0.3 of each cell whose centre lies beside those 20 m, no farther than the bin of 15 m reaches."""
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    left = np.ones(mission.grid.shape)
    for row, column in np.ndindex(left.shape):
        dx, dy = 5 * column - x_m, 5 * row + 2.5 - y_m
        if 0 < dx * sin + dy * cos < 20 and abs(dx * cos - dy * sin) < 15.5:
            left[row, column] = 0.3
    return left


def removed_m2(flown: FlownLooks, mission: Removable) -> float:
    """The risk that looks remove, times the area."""
    return mission.gain_m2(flown.left(mission), OBJECTIVES["mean"])


class TestALook:
    def test_across_the_grid_by_hand(self) -> None:
        scenario = load_scenario(BRIEF, CLEAR_GROUND)
        flown, mission = FlownLooks(scenario), everything(scenario)
        look_at(flown, 51, 51, math.pi / 2)
        # Columns at 55, 60, 65 and 70 m; rows at 37.5 to 62.5 m, 13.5 m below and 11.5 m above the track.
        left = np.ones(mission.grid.shape)
        left[7:13, 11:15] = 0.3
        assert flown.leaves(mission.grid) == pytest.approx(left)
        assert removed_m2(flown, mission) == pytest.approx(24 * ALL_OF_IT)
        look_at(flown, 51, 51, math.pi / 2)
        assert removed_m2(flown, mission) == pytest.approx(24 * 25 * (1 - 0.3**2))

    @pytest.mark.parametrize(
        ("x_m", "y_m", "heading_rad", "leg"),
        [
            # Six columns of 5 m, on a line between two of them: the third of them is at 97.5 + 2.5 m.
            (97.5, 20, 0.0, Leg(20, 4, 8)),
            (97.5, 40, math.pi, Leg(20, 4, 8, up=False)),
            # Six rows, on a line between two of them: row 6 begins at 30 m; column 20 begins at 97.5 m.
            (97.5, 30, math.pi / 2, Leg(6, 20, 24, across=True)),
            (117.5, 30, 3 * math.pi / 2, Leg(6, 20, 24, up=False, across=True)),
        ],
    )
    def test_along_the_grid_and_across_it_is_the_leg_by_hand(
        self, x_m: float, y_m: float, heading_rad: float, leg: Leg
    ) -> None:
        scenario = load_scenario(BRIEF, CLEAR_GROUND)
        flown, mission = FlownLooks(scenario), everything(scenario)
        look_at(flown, x_m, y_m, heading_rad)
        assert legs_flown(flown.looks, mission) == ((leg,),)
        assert removed_m2(flown, mission) == pytest.approx(4 * 6 * ALL_OF_IT)
        assert Simulator(mission).gain_m2(((leg,),)) == pytest.approx(4 * 6 * ALL_OF_IT)

    @pytest.mark.parametrize("heading_rad", [0.3, 0.8, 2.0, 3.1, 4.4, 6.0])
    def test_at_any_heading(self, heading_rad: float) -> None:
        scenario = load_scenario(BRIEF, CLEAR_GROUND)
        flown, mission = FlownLooks(scenario), everything(scenario)
        look_at(flown, 101.3, 50.9, heading_rad)
        left = left_by_hand(mission, 101.3, 50.9, heading_rad)
        assert np.count_nonzero(left < 1) > 15
        assert flown.leaves(mission.grid) == pytest.approx(left)
        assert legs_flown(flown.looks, mission) == ((),)  # not along the grid

    def test_it_lies_where_the_vehicle_truly_was(self) -> None:
        scenario = load_scenario(BRIEF, [*CLEAR_GROUND, "vehicles.helper.position_error_m=7"])
        flown = FlownLooks(scenario)
        look_at(flown, 100, 50, 0.0)
        look_at(flown, 100, 50, 0.0, at_ms=19_000)
        (first, second) = flown.looks["helper"]
        assert math.dist((100, 50), first.geometry.origin) == pytest.approx(7)
        assert first.geometry.origin == pytest.approx(second.geometry.origin)  # an error that stays

    def test_the_primarys_do_not_count(self) -> None:
        flown = FlownLooks(load_scenario(BRIEF))
        look = Look(1, 1, 0, 0, 0, 0, 5, 1, np.full((2, 4, 16), 0.5), 5, 0, valid=True, contacts=())
        flown.hear(Received(topics.LOOK.key(vehicle="primary"), topics.LOOK, "primary", Header("x", 0, 0, 0), look))
        assert not flown.looks


class TestAFlownMission:
    @pytest.mark.parametrize(
        "settings",
        [
            (),
            ("coordinator.strips=lanes",),
            ("coordinator.strips=lanes_across",),
            ("vehicles.helper.settling={share: 0.6, length_m: 25}",),
            (
                "vehicles.helper.sensor.half_at_crab_deg=10",
                "current={drift_mps: 4, set_deg: 70, period_s: 50, keeps: ground}",
            ),
            (
                "vehicles.helper.sensor={footprint: wedge, half_angle_deg: 60, near_m: 3, range_m: 30, p_detect: 0.4,"
                " look_m: 10, noise_cell: 0, noise_track: 0}",
            ),
        ],
    )
    def test_what_its_looks_removed_is_what_was_measured_without_noise(
        self, settings: tuple[str, ...], tmp_path: Path
    ) -> None:
        steady = ("vehicles.helper.sensor.noise_cell=0", "vehicles.helper.sensor.noise_track=0")
        scenario = load_scenario(BRIEF, [*steady, *settings])
        # The survey it would be told of by any mission: it refuses some of these, whose looks are counted all the same.
        flown, clairvoyance = FlownLooks(scenario), Clairvoyance(load_scenario(BRIEF))

        def watch(received: Received) -> None:
            clairvoyance.hear(received)
            flown.hear(received)

        summary = run_mission(scenario, RunOptions(tmp_path, "local", record=False, watch=watch))
        made = clairvoyance.removable()
        assert made.ends_s == pytest.approx(1.05 * summary["time"]["primary_s"])
        assert made.risk[made.inside].mean() == pytest.approx(summary["risk_primary_alone"]["mean"])
        measured = summary["risk_primary_alone"]["mean"] - summary["risk"]["mean"]
        assert measured > 0.02
        # The map tells levels of 0.02.
        assert removed_m2(flown, made) == pytest.approx(measured * made.inside.sum() * 25, rel=0.005)

    def test_what_was_swept_counts_though_a_primary_comes_again(self, tmp_path: Path) -> None:
        # Here the survey's tracks get so close to each other that it looks at settled cells once more.
        scenario = load_scenario("patchy", (), 4)
        flown, clairvoyance = FlownLooks(scenario), Clairvoyance(scenario)

        def watch(received: Received) -> None:
            clairvoyance.hear(received)
            flown.hear(received)

        summary = run_mission(scenario, RunOptions(tmp_path, "local", record=False, watch=watch))
        made = clairvoyance.removable()
        measured = summary["risk_primary_alone"]["mean"] - summary["risk"]["mean"]
        assert removed_m2(flown, made) == pytest.approx(measured * made.inside.sum() * 25, rel=0.03)

    def test_a_seed_is_flown_and_solved(self) -> None:
        row = one_seed(load_scenario(BRIEF, (), 1), ["greedy", "across", "none"], 3_000)
        greedy, across, none = (row.removed_m2[name] for name in ("greedy", "across", "none"))
        assert greedy is not None
        assert across is not None
        assert none == 0
        assert 0 < greedy <= row.best_m2 <= row.bound_m2 < row.there_m2
        assert 0 < across <= row.best_m2
        survey, left = row.worst30["survey"], row.worst30["greedy"]
        assert survey is not None
        assert left is not None
        assert row.worst30["none"] == survey > left > (row.left["greedy"] or 1.0)

    def test_who_is_told_sends_helpers_where_the_survey_will_see_badly_and_nowhere_else(self, tmp_path: Path) -> None:
        scenario, strips = load_scenario(BRIEF, (), 1), list[StripStatus]()
        mission = everything(scenario)
        mission.risk[:, : mission.grid.columns // 2] = 0.0  # as if it saw all of the half that lies towards the start

        def watch(received: Received) -> None:
            if isinstance(received.message, StripStatus):
                strips.append(received.message)

        with told_beforehand(mission):
            run_mission(scenario, RunOptions(tmp_path, "local", record=False, watch=watch))
        grid = build_fleet(scenario, record=False).run_info.grid.spec
        assert {one.state for one in strips} >= {StripState.DONE}
        for one in strips:
            across_m, _ = grid.frame.to_sweep(one.start_x_m, one.start_y_m)
            assert across_m >= grid.across_m[grid.columns // 2] - 5

    def test_a_seed_is_flown_once_more_by_who_is_told(self) -> None:
        row = one_seed(load_scenario(BRIEF, (), 1), ["plan"], 1_000, "both", told=True)
        assert [*row.removed_m2] == ["plan", "told"]
        assert row.removed_m2["told"] not in (row.removed_m2["plan"], None, 0.0)
        assert set(summary([row])) == {"best_to_bound", "plan", "told"}

    def test_a_search_that_knows_it_begins_with_it(self) -> None:
        row = one_seed(load_scenario(BRIEF, (), 1), ["plan"], 1_000)
        plan_m2 = row.removed_m2["plan"]
        assert plan_m2 is not None
        # Its legs on whole rows, where each look ended between two of them or not.
        assert row.found_m2 >= row.started_m2 >= 0.97 * plan_m2 > 0

    def test_legs_are_what_the_helpers_swept_in_order_and_direction(self, tmp_path: Path) -> None:
        scenario = load_scenario(BRIEF, (), 1)
        flown, clairvoyance = FlownLooks(scenario), Clairvoyance(scenario)
        strips = []

        def watch(received: Received) -> None:
            flown.hear(received)
            clairvoyance.hear(received)
            if isinstance(received.message, StripStatus) and received.message.state is StripState.DONE:
                strips.append(received.message)

        run_mission(scenario, RunOptions(tmp_path, "local", record=False, watch=watch))
        mission, swath = clairvoyance.removable(), Swath(6)
        (legs,) = legs_flown(flown.looks, mission)
        assert len(legs) in (len(strips), len(strips) + 1)  # the last may not be flown to its end
        assert strips
        for leg, strip in zip(legs, strips, strict=False):
            assert leg.across == (strip.heading_rad > 0)
            assert (leg.end - leg.first) * 5 == strip.length_m
            beside_m, along_m = strip.start_x_m, strip.start_y_m
            if leg.across:  # rows are centred half a cell further than columns are
                beside_m, along_m = strip.start_y_m - 2.5, strip.start_x_m + 2.5
            assert swath.line(leg.place) * 5 == pytest.approx(beside_m)
            assert leg.first * 5 in (along_m, along_m - strip.length_m)
        assert {leg.up for leg in legs} == {True, False}


class TestARow:
    ROW = Row(
        seed=3,
        area_m2=200.0,
        there_m2=100.0,
        bound_m2=80.0,
        found_m2=60.0,
        started_m2=50.0,
        legs=1,
        removed_m2={"plan": 50.0, "none": None},
        measured_m2={"plan": 51.0, "none": None},
        worst30={"survey": 0.9, "schedule": 0.5, "plan": 0.6, "none": None},
        steps=100,
    )

    def test_the_best_is_the_most_that_anybody_removed(self) -> None:
        assert (self.ROW.best_m2, self.ROW.best_by) == (60, "the best schedule")
        flown: dict[str, float | None] = {"plan": 50.0, "across": 70.0}
        worst30 = {**self.ROW.worst30, "across": 0.6}
        better = replace(self.ROW, removed_m2=flown, measured_m2=flown, worst30=worst30)
        assert (better.best_m2, better.best_by) == (70, "across")
        ratios = summary([better])
        assert ratios["across"]["to_best"]["most"] == 1
        assert ratios["plan"]["to_best"]["mean"] == pytest.approx(5 / 7)
        assert ratios["best_to_bound"]["mean"] == pytest.approx(7 / 8)

    def test_what_is_left_by_hand(self) -> None:
        assert self.ROW.left == {
            "survey": 0.5, "schedule": 0.2, "bound": 0.1, "best": 0.2, "plan": 0.25, "none": None
        }  # fmt: skip

    def test_what_is_gained_is_told_by_the_objective(self) -> None:
        # The mean falls from 0.5 to 0.2 and 0.25, the worst 30 % from 0.9 to 0.5 and 0.6.
        row = replace(self.ROW, objective="both")
        schedule, plan = 0.7 * 0.3 + 0.3 * 0.4, 0.7 * 0.25 + 0.3 * 0.3
        assert row.gained == {"schedule": pytest.approx(schedule), "plan": pytest.approx(plan), "none": None}
        assert summary([row])["plan"]["to_best"]["least"] == pytest.approx(plan / schedule)
        by_worst = summary([replace(self.ROW, objective="worst30")])["plan"]["to_best"]
        assert by_worst["mean"] == pytest.approx(0.3 / 0.4)

    def test_what_contradicts_itself_is_told(self) -> None:
        told = r"seed 3: plan removes 80\.1 m2, and the bound must be at least that, not 80\.0 m2"
        with pytest.raises(ValueError, match=told):
            replace(self.ROW, removed_m2={"plan": 80.1})
        with pytest.raises(ValueError, match=r"the best schedule removes 80\.1 m2, and the bound must be"):
            replace(self.ROW, found_m2=80.1)
        with pytest.raises(ValueError, match=r"the bound removes 100\.1 m2, and all that was there"):
            replace(self.ROW, bound_m2=100.1)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("mission.rho=0.5", r"mission\.rho: 0\.5 is not allowed here; must be 0"),
        ("area.priorities=[{polygon_m: [[0, 0], [100, 0], [0, 100]], weight: 2}]", r"area\.priorities: not allowed"),
        ("vehicles.helper.body=external", r"vehicles\.helper\.body: external is not allowed here; must be simulated"),
        (
            "vehicles.helper.sensor={footprint: wedge, half_angle_deg: 60, range_m: 30, p_detect: 0.4}",
            r"vehicles\.helper\.sensor\.footprint: wedge is not allowed here; must be side",
        ),
        ("vehicles.helper.settling={share: 0.5, length_m: 20}", r"vehicles\.helper\.settling: not allowed here"),
        ("vehicles.helper.sensor.half_at_crab_deg=10", r"sensor\.half_at_crab_deg: not allowed here in a current"),
    ],
)
def test_what_it_cannot_count_truly_is_refused(setting: str, told: str) -> None:
    with pytest.raises(UserError, match=told):
        one_seed(
            load_scenario(BRIEF, ["current={drift_mps: 0.5, set_deg: 0, keeps: ground}", setting]), ["nearest"], 100
        )
