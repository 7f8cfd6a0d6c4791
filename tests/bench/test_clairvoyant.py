"""The clairvoyant of bench/: its parts against brute force and by hand, and no schedule above its bound."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench import clairvoyant
from bench.clairvoyant_bound import most_looks, upper_bound
from bench.clairvoyant_schedule import best_schedule, lanes
from bench.legs import Leg, Simulator
from bench.removable import LegHelper, LegSensor, Removable, leg_helpers
from bench.swath import Swath
from comms.said.messages import CoverageTile, Maneuver, ManeuverKind
from coordinator.cut.ground import OBJECTIVES
from coordinator.cut.strips import strip_of
from coordinator.cut.window import Window
from planner.dubins import Pose
from planner.fleet_map import FleetMap
from planner.sweep import legs_over_strip
from planner.types import FloatArray, GridSpec, SweepFrame
from secondlook.fleet.build import build_fleet
from secondlook.scenario import load_scenario
from sim_world.looks import Looks
from sim_world.seabed import make_seabed
from sim_world.sonar import CurveSonar
from sim_world.targets import NO_TARGETS, Recogniser
from sim_world.vehicle import Stretch
from vehicle_agent.coverage import CoverageLayer

BRIEF = Path(__file__).parents[1] / "support" / "brief.yaml"
ROWS, COLUMNS = 6, 12


def helper(run_in_m: float = 5.0, width: int = 3) -> LegHelper:
    shapes = (width, ROWS, COLUMNS), (width, COLUMNS, ROWS)
    along, across = (LegSensor(Swath(width), np.full(shape, 0.5)) for shape in shapes)
    return LegHelper("helper", Pose(0, -10, 0), 2.0, 2.0, run_in_m, 1e6, (along, across))


def mission(risk: FloatArray, ends_s: float = 60.0, helpers: int = 1) -> Removable:
    """Cells of 5 m, helpers of 2 m/s that see one column, or row, to either side with P_d 0.5."""
    grid = GridSpec(SweepFrame(0, 0, 0), 5.0, COLUMNS, ROWS)
    return Removable(grid, np.ones(grid.shape, dtype=np.bool_), risk, ends_s, (helper(),) * helpers)


class TestTheSwath:
    def test_ten_columns_lie_about_a_line_between_two_of_them(self) -> None:
        swath = Swath.of(GridSpec(SweepFrame(0, 0, 0), 5, 40, 20), 50)
        assert (swath.width, swath.left, swath.right) == (10, 5, 4)
        assert swath.columns(20, 40) == slice(15, 25)
        assert swath.line(20) == 19.5

    def test_eleven_columns_lie_about_a_line_on_one_of_them(self) -> None:
        swath = Swath.of(GridSpec(SweepFrame(0, 0, 0), 5, 40, 20), 59.9)
        assert (swath.width, swath.left, swath.right) == (11, 5, 5)
        assert swath.line(20) == 20

    def test_it_ends_with_the_grid(self) -> None:
        assert Swath(10).columns(3, 40) == slice(0, 8)
        assert Swath(10).columns(38, 40) == slice(33, 40)

    @given(st.integers(1, 12), st.integers(0, 8))
    def test_a_leg_lies_where_the_strip_of_its_columns_does(self, width: int, first: int) -> None:
        grid, swath = GridSpec(SweepFrame(0, 0, 0), 5, 20, 20), Swath(width)
        column = first + swath.left
        assert swath.columns(column, 20) == slice(first, first + width)
        strip = strip_of(grid, Window(0, 8, first, first + width), 1)
        assert swath.line(column) * 5 == strip.start[0]
        assert swath.column_at(strip.start[0] / 5) == column


class TestLegs:
    def test_a_leg_straight_ahead_by_hand(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS))))
        leg = Leg(0, 0, ROWS)
        # From (0, -10): 5 m to the run-in, 5 m of it, at 2 m/s.
        assert simulator.begins_s(0, [leg]) == [5.0]
        # Columns 0 and 1, 6 rows, 25 m2, half of it.
        assert simulator.gain_m2(((leg,),)) == pytest.approx(2 * 6 * 25 * 0.5)

    def test_a_second_look_removes_half_of_what_is_left(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), ends_s=500))
        legs = (Leg(0, 0, ROWS), Leg(0, 0, ROWS, up=False))
        assert simulator.gain_m2((legs,)) == pytest.approx(2 * 6 * 25 * 0.75)

    def test_what_is_passed_after_the_deadline_does_not_count(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), ends_s=5.0 + 2 * 2.5))
        assert simulator.gain_m2(((Leg(0, 0, ROWS),),)) == pytest.approx(2 * 2 * 25 * 0.5)
        assert simulator.in_time(((Leg(0, 0, ROWS), Leg(3, 0, ROWS)),)) == ((Leg(0, 0, ROWS),),)

    def test_a_turn_to_the_next_leg_is_a_dubins_path(self) -> None:
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(helper(run_in_m=0.0),)))
        # Half a circle of 2 m about, 10 m sideways, of which 4 m are the circle's.
        way_m = simulator.way_m(0, Leg(1, 0, ROWS), Leg(3, 0, ROWS, up=False))
        assert way_m == pytest.approx(2 * math.pi + 6)

    def test_of_an_even_number_of_columns_the_line_lies_between_two(self) -> None:
        below = replace(helper(width=4), start=Pose(7.5, -10, 0))
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(below,)))
        # The line of column 2 lies at 7.5 m: straight on for 5 m to the run-in, and 5 m of that.
        assert simulator.way_m(0, None, Leg(2, 0, ROWS)) == pytest.approx(10)
        # Columns 0 to 3.
        assert simulator.gain_m2(((Leg(2, 0, ROWS),),)) == pytest.approx(4 * 6 * 25 * 0.5)
        # Columns 0 and 1 alone, the line half a cell outside.
        assert simulator.gain_m2(((Leg(0, 0, ROWS),),)) == pytest.approx(2 * 6 * 25 * 0.5)

    def test_a_leg_across_by_hand(self) -> None:
        beside = replace(helper(), start=Pose(-12.5, 2.5, math.pi / 2))
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(beside,)))
        leg = Leg(0, 0, COLUMNS, across=True)
        # Column 0 begins at -2.5 m, row 0 has its middle at 2.5 m: 5 m to the run-in, 5 m of it, at 2 m/s.
        assert simulator.begins_s(0, [leg]) == [5.0]
        # Rows 0 and 1, 12 columns.
        assert simulator.gain_m2(((leg,),)) == pytest.approx(2 * 12 * 25 * 0.5)
        # In 60 s it comes back along column 11, of which it then sees 10 and 11, their first two rows once more.
        back = Leg(COLUMNS - 1, 0, ROWS)
        assert simulator.gain_m2(((leg, back),)) == pytest.approx(25 * (2 * 12 * 0.5 + 4 * 0.25 + 8 * 0.5))

    def test_the_way_from_a_leg_along_to_one_across_is_a_dubins_path(self) -> None:
        turning = replace(helper(run_in_m=0.0), turn_radius_m=2.5)
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(turning,)))
        # From (0, 30) northward to (17.5, 32.5) eastward: a quarter of a circle of 2.5 m, and 15 m.
        beyond = Leg(ROWS, 4, 6, across=True)
        way_m = 2.5 * math.pi / 2 + 15
        assert simulator.way_m(0, Leg(0, 0, ROWS), beyond) == pytest.approx(way_m)
        # The same way from (15, 25) to (32.5, 27.5), now known already.
        shifted = Leg(ROWS - 1, 7, 9, across=True)
        assert simulator.way_m(0, Leg(3, 0, ROWS - 1), shifted) == pytest.approx(way_m)
        # From (15, 0) southward it is another, and so it is to (42.5, 27.5) westward.
        assert simulator.way_m(0, Leg(3, 0, ROWS - 1, up=False), shifted) > way_m + 15
        assert simulator.way_m(0, Leg(3, 0, ROWS - 1), shifted._replace(up=False)) > way_m + 10
        # Back from (17.5, 32.5), where a leg westward ends, to (0, 30) southward.
        assert simulator.way_m(0, beyond._replace(up=False), Leg(0, 0, ROWS, up=False)) == pytest.approx(way_m)

    def test_of_a_leg_across_what_is_passed_in_time_counts(self) -> None:
        beside = replace(helper(), start=Pose(-12.5, 2.5, math.pi / 2))
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS)), ends_s=5.0 + 3.4 * 2.5), helpers=(beside,)))
        assert simulator.gain_m2(((Leg(0, 0, COLUMNS, across=True),),)) == pytest.approx(2 * 3 * 25 * 0.5)

    def test_nothing_counts_that_would_begin_after_the_endurance(self) -> None:
        lasting = replace(helper(), lasts_s=10.0)
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS)), ends_s=500), helpers=(lasting,)))
        legs = (Leg(0, 0, ROWS), Leg(0, 0, ROWS, up=False))  # 5 s, and 20 s later
        assert simulator.gain_m2((legs,)) == pytest.approx(2 * 6 * 25 * 0.5)


class TestALegOnTheMap:
    """What a leg is credited with, beside what the fleet's map makes of the looks of a helper that flies it."""

    @pytest.mark.parametrize("across", [False, True])
    @pytest.mark.parametrize("up", [True, False])
    @pytest.mark.parametrize(
        ("range_m", "width"), [(6, 2), (12.4, 4), (12.5, 5), (14.9, 5), (15, 6), (25, 10), (27.5, 11)]
    )
    def test_both_tell_the_same(self, range_m: float, width: int, up: bool, across: bool) -> None:
        overrides = ("noise_cell=0", "noise_track=0", f"range_m={range_m}")
        scenario = load_scenario(BRIEF, [f"vehicles.helper.sensor.{one}" for one in overrides], 1)
        fleet = build_fleet(scenario, record=False)
        grid = fleet.run_info.grid.spec
        inside = np.ones(grid.shape, dtype=np.bool_)
        (flown_by,) = leg_helpers(scenario, grid, inside)
        swath = flown_by.sensor(across=across).swath
        assert swath.width == width
        window = Window(4, 4 + width, 20, 32, across=True) if across else Window(4, 16, 20, 20 + width)
        strip = strip_of(grid, window, 1)
        (leg,) = legs_over_strip(strip, 2 * range_m)
        leg = leg if up else replace(leg, start=leg.end, end=leg.start)

        world = fleet.specs["world"].config
        config = next(body for body in world.vehicles if body.vehicle == "helper")
        looks = Looks(
            config,
            sonar=CurveSonar(config.sensor.curve, make_seabed(world.seabed, world.area, world.seed)),
            targets=NO_TARGETS,
            recogniser=Recogniser(config.sensor.curve, false_alarms_per_km2=0),
            seed=1,
        )
        coverage, fleet_map = CoverageLayer("helper", grid), FleetMap(grid)
        maneuver = Maneuver(1, ManeuverKind.FOLLOW, *leg.start, *leg.end, 5)
        for first_along_m in (0.0, 20.0, 40.0):
            stretch = Stretch(maneuver, leg.heading_rad, first_along_m, 4)
            coverage.add(looks.look(stretch, 0, (0, 0), 0)[0])
        for _, tile in coverage.changed_tiles():
            assert isinstance(tile, CoverageTile)
            fleet_map.join("helper", 0, tile)

        # What is there is different everywhere, so that a leg in the wrong place would show.
        risk = np.random.default_rng(1).uniform(0, 1, grid.shape)
        credited_m2 = float((risk * (1 - fleet_map.risk)).sum()) * 25
        made = Removable(grid, inside, risk, 1050, (flown_by,))
        flown = Leg(4 + swath.left, 20, 32, up, across) if across else Leg(20 + swath.left, 4, 16, up)
        removed_m2 = Simulator(made).gain_m2(((flown,),))
        assert np.count_nonzero(fleet_map.risk < 1) == 12 * width
        assert removed_m2 == pytest.approx(credited_m2, rel=0.005)  # the map tells levels of 0.02

    def test_by_hand(self) -> None:
        # Ten columns of 5 m, 80 rows, all of it missed so far, P_d 0.7: one leg of 400 m and 25 m to either side.
        scenario = load_scenario("tellaro")
        grid = build_fleet(scenario, record=False).run_info.grid.spec
        inside = np.ones(grid.shape, dtype=np.bool_)
        everything = Removable(grid, inside, np.ones(grid.shape), 1050, leg_helpers(scenario, grid, inside))
        assert Simulator(everything).gain_m2(((Leg(20, 0, 80),),)) == pytest.approx(400 * 50 * 0.7)


class TestTheBound:
    @settings(max_examples=60, deadline=None)
    @given(st.integers(0, 2**32 - 1), st.integers(1, 2))
    def test_no_schedule_is_above_it(self, seed: int, helpers: int) -> None:
        chance = np.random.default_rng(seed)
        risk = chance.uniform(0, 1, (ROWS, COLUMNS)) ** 2
        along, across = (
            LegSensor(Swath(width), chance.uniform(0, 0.9, (width, *shape)) * chance.integers(0, 2, shape))
            for width, shape in ((3, (ROWS, COLUMNS)), (4, (COLUMNS, ROWS)))
        )
        other = replace(helper(run_in_m=float(chance.choice([0, 5]))), sensors=(along, across))
        ends_s = float(chance.uniform(10, 150))
        made = replace(mission(risk, ends_s), helpers=(other, helper())[:helpers])
        bound = upper_bound(made)
        simulator = Simulator(made)

        def leg() -> Leg:
            across = bool(chance.integers(2))
            steps, lines = made.extent(across=across)
            first = int(chance.integers(steps))
            end = int(chance.integers(first + 1, steps + 1)) if chance.integers(2) else steps
            return Leg(int(chance.integers(lines)), first, end, bool(chance.integers(2)), across)

        for _ in range(40):
            schedule = tuple(tuple(leg() for _ in range(chance.integers(1, 8))) for _ in made.helpers)
            assert simulator.gain_m2(schedule) <= bound.removed_m2 + 1e-6

    def test_by_hand_it_is_as_many_looks_as_there_is_time_for(self) -> None:
        # A helper of 2 m/s flies 60 m in 30 s; half a cell more may be seen, and a quarter turn of 2 m is forgiven.
        # Of each 60 m, the longer side, 5 m and a quarter turn are no leg; a step of 5 m is three looks.
        made = mission(np.ones((ROWS, COLUMNS)), ends_s=30.0)
        looks = (60 + 2.5 + math.pi) / (1 + (5 + math.pi) / 60) / 5 * 3
        assert most_looks(made, helper()) == pytest.approx(looks)
        # 34.7 looks at 72 cells of 25 m2, each of which removes half: none is looked at again.
        assert upper_bound(made).removed_m2 == pytest.approx(looks * 25 * 0.5)

    def test_looks_go_where_they_bring_most(self) -> None:
        risk = np.full((ROWS, COLUMNS), 0.1)
        risk[2:5, :4] = 1.0  # 12 cells: 12.5 m2 at the first look, 6.25, 3.1 and 1.6 at the next, as 1.25 elsewhere
        made = mission(risk, ends_s=30.0)
        looks = most_looks(made, helper())
        assert 24 < looks < 36
        bound = upper_bound(made)
        assert bound.removed_m2 == pytest.approx(12 * 25 * 0.75 + (looks - 24) * 25 * 0.125)
        assert bound.price_m2 == pytest.approx(25 * 0.125)

    def test_it_is_all_there_is_where_there_is_time_for_everything(self) -> None:
        made = mission(np.ones((ROWS, COLUMNS)), ends_s=1e6)
        assert 0.99 * made.total_m2 <= upper_bound(made).removed_m2 <= made.total_m2

    def test_nothing_where_nothing_is_left(self) -> None:
        assert upper_bound(mission(np.zeros((ROWS, COLUMNS)))).removed_m2 == 0


class TestTheSearch:
    @pytest.mark.parametrize("seed", range(6))
    def test_it_comes_near_the_bound_and_not_above(self, seed: int) -> None:
        chance = np.random.default_rng(seed)
        # What is worth most lies far away, and there is hardly the time.
        risk = chance.uniform(0, 0.2, (ROWS, COLUMNS))
        risk[:, 9:] = chance.uniform(0.8, 1, (ROWS, 3))
        made = replace(mission(risk, ends_s=60 + 5 * seed), helpers=(helper(run_in_m=0.0),))
        bound = upper_bound(made)
        best = best_schedule(made, bound, 4_000, seed)
        assert 0.55 * bound.removed_m2 <= best.gain_m2 <= bound.removed_m2 + 1e-6
        assert best.gain_m2 == pytest.approx(Simulator(made).gain_m2(best.schedule))
        for leg in best.schedule[0]:
            steps, lines = made.extent(across=leg.across)
            assert 0 <= leg.first < leg.end <= steps
            assert 0 <= leg.place < lines

    def test_time_for_one_leg_across_is_spent_on_it(self) -> None:
        # Rows 2 to 4 are bad, and 50 s suffice to get there and along them once; legs along meet them three cells at
        # a time, with a turn between.
        risk = np.zeros((ROWS, COLUMNS))
        risk[2:5] = 1.0
        made = mission(risk, ends_s=50.0)
        best = best_schedule(made, upper_bound(made), 5_000, 1)
        assert [leg[:3] for leg in best.schedule[0] if leg.across] == [(3, 0, COLUMNS)]
        assert best.gain_m2 >= 3 * COLUMNS * 25 * 0.5

    def test_by_the_worst_it_goes_where_it_is_bad_and_by_the_mean_where_much_is_removed(self) -> None:
        # Helpers see a third of the area in 60 s. Far away 30 % of it are bad, near by looks take more.
        risk = np.full((ROWS, COLUMNS), 0.6)
        risk[:, 8:] = 1.0
        made = mission(risk, ends_s=60.0)
        sensors = made.helpers[0].sensors
        for sensor, columns in zip(sensors, (np.s_[:, :, 8:], np.s_[:, 8:, :]), strict=True):
            sensor.p_detect[columns] = 0.2
        left = {
            name: made.left(
                Simulator(made).left(best_schedule(made, upper_bound(made), 5_000, 1, (), OBJECTIVES[name]).schedule)
            )
            for name in ("mean", "worst30")
        }
        assert left["mean"].mean < left["worst30"].mean
        assert left["worst30"].worst30_mean < left["mean"].worst30_mean

    def test_what_is_gained_by_hand(self) -> None:
        risk = np.linspace(0, 1, ROWS * COLUMNS).reshape(ROWS, COLUMNS)
        made = mission(risk)
        # All of it is halved: 72 cells of a mean of 0.5, the worst 22 of them of 1 - 21 / 71 / 2.
        assert made.gain_m2(risk / 2, OBJECTIVES["mean"]) == pytest.approx(0.25 * 72 * 25)
        worst = 1 - 21 / 71 / 2
        assert made.gain_m2(risk / 2, OBJECTIVES["worst30"]) == pytest.approx(worst / 2 * 72 * 25)
        both = (0.7 * 0.25 + 0.3 * worst / 2) * 72 * 25
        assert made.gain_m2(risk / 2, OBJECTIVES["both"]) == pytest.approx(both)

    def test_the_same_steps_find_the_same_and_more_of_them_more(self) -> None:
        made = mission(np.random.default_rng(1).uniform(0, 1, (ROWS, COLUMNS)), ends_s=60, helpers=2)
        found = [best_schedule(made, upper_bound(made), steps, 1) for steps in (300, 300, 3_000)]
        assert found[0] == found[1]
        assert found[2].gain_m2 > found[0].gain_m2 > found[0].started_m2

    def test_it_is_no_worse_than_what_it_knows(self) -> None:
        risk = np.random.default_rng(1).uniform(0, 1, (ROWS, COLUMNS))
        made = mission(risk, ends_s=60, helpers=2)
        known = ((Leg(3, 1, 5), Leg(6, 0, 4, up=False)), (Leg(4, 2, 9, across=True),))
        best = best_schedule(made, upper_bound(made), 100, 1, [known])
        assert best.gain_m2 >= best.started_m2 >= Simulator(made).gain_m2(known) > 0

    @pytest.mark.parametrize("across", [False, True])
    def test_lanes_cover_the_area_once(self, across: bool) -> None:
        made = mission(np.ones((ROWS, COLUMNS)), ends_s=1e6, helpers=2)
        assert Simulator(made).gain_m2(lanes(made, across=across)) == pytest.approx(made.total_m2 / 2)


@pytest.mark.parametrize("other", [["--told"], ["--allocators", "greedy"], ["--set", "mission.rho=1"]])
def test_a_recorded_run_is_judged_as_it_was_flown(other: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["clairvoyant", "--run", "runs/nowhere", *other])
    with pytest.raises(SystemExit, match=r"^--run: is not allowed with --told"):
        clairvoyant.main()
