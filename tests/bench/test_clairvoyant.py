"""The clairvoyant of bench/: its parts against brute force and by hand, and no schedule above its bound."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.clairvoyant_bound import Relaxation, upper_bound
from bench.clairvoyant_schedule import best_schedule
from bench.legs import Leg, Simulator
from bench.removable import LegHelper, LegSensor, Removable, leg_helpers
from bench.row_packing import RowPacking
from bench.swath import Swath
from comms.said.messages import CoverageTile, Maneuver, ManeuverKind
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
from sim_world.targets import Recogniser, Targets
from sim_world.vehicle import Stretch
from vehicle_agent.coverage import CoverageLayer

BRIEF = Path(__file__).parents[1] / "support" / "brief.yaml"
ROWS, COLUMNS = 6, 12


def helper(run_in_m: float = 5.0) -> LegHelper:
    sensor = LegSensor(Swath(3), np.full((3, ROWS, COLUMNS), 0.5))
    return LegHelper("helper", Pose(0, -10, 0), 2.0, 2.0, run_in_m, 1e6, sensor)


def mission(
    risk: FloatArray, released_s: FloatArray | float = 0.0, ends_s: float = 60.0, helpers: int = 1
) -> Removable:
    """Cells of 5 m, helpers of 2 m/s that see one column to either side with P_d 0.5."""
    grid = GridSpec(SweepFrame(0, 0, 0), 5.0, COLUMNS, ROWS)
    inside = np.ones(grid.shape, dtype=np.bool_)
    released = np.broadcast_to(np.asarray(released_s, dtype=np.float64), grid.shape).copy()
    return Removable(grid, inside, risk, released, ends_s / 1.05, ends_s, (helper(),) * helpers)


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


class TestRowPacking:
    @settings(max_examples=80)
    @given(st.integers(1, 7), st.integers(1, 5), st.integers(0, 2**32 - 1), st.floats(0.05, 2.0))
    def test_it_finds_what_trying_everything_finds(self, columns: int, width: int, seed: int, price: float) -> None:
        chance = np.random.default_rng(seed)
        first = chance.uniform(0, 1, (2, columns))
        values = [first, first * chance.uniform(0, 1), first * 0.0]
        prices = price * chance.uniform(0.5, 1.5, (2, columns))
        packed = RowPacking(values, Swath(width)).solve(prices)

        def worth(row: int, crossings: tuple[int, ...]) -> float:
            looks = np.zeros(columns, dtype=int)
            for column in crossings:
                looks[Swath(width).columns(column, columns)] += 1
            gained = sum(float(values[look][row, looks > look].sum()) for look in range(3))
            return gained - sum(float(prices[row, column]) for column in crossings)

        for row, far in itertools.product(range(2), range(columns)):
            every = (
                subset for size in range(5) for subset in itertools.combinations_with_replacement(range(far + 1), size)
            )
            best = max(worth(row, subset) for subset in every)
            found = packed.crossings(row, far)
            assert packed.best_to[far, row] == pytest.approx(worth(row, tuple(found)), abs=1e-9)
            assert packed.best_to[far, row] >= best - 1e-9


class TestLegs:
    def test_a_leg_straight_ahead_by_hand(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS))))
        leg = Leg(0, 0, ROWS)
        # From (0, -10): 5 m to the run-in, 5 m of it, at 2 m/s.
        assert simulator.begins_s(0, [leg]) == [5.0]
        # Columns 0 and 1, 6 rows, 25 m2, half of it.
        assert simulator.removed_m2(((leg,),)) == pytest.approx(2 * 6 * 25 * 0.5)

    def test_a_second_look_removes_half_of_what_is_left(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), ends_s=500))
        legs = (Leg(0, 0, ROWS), Leg(0, 0, ROWS, up=False))
        assert simulator.removed_m2((legs,)) == pytest.approx(2 * 6 * 25 * 0.75)

    def test_it_waits_for_what_is_released_late_or_does_without(self) -> None:
        released_s = np.zeros((ROWS, COLUMNS))
        released_s[3] = 30.0
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), released_s))
        # Row 3 is passed 3.5 cells of 5 m after the begin, at 2 m/s.
        assert simulator.begins_s(0, [Leg(0, 0, ROWS)]) == [30 - 3.5 * 2.5]
        hasty = Leg(0, 0, ROWS, waits=False)
        assert simulator.begins_s(0, [hasty]) == [5.0]
        assert simulator.removed_m2(((hasty,),)) == pytest.approx(2 * 5 * 25 * 0.5)
        assert simulator.begins_s(0, [replace(hasty, from_s=7.0)]) == [7.0]

    def test_what_is_passed_after_the_deadline_does_not_count(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), ends_s=5.0 + 2 * 2.5))
        assert simulator.removed_m2(((Leg(0, 0, ROWS),),)) == pytest.approx(2 * 2 * 25 * 0.5)
        assert simulator.in_time(((Leg(0, 0, ROWS), Leg(3, 0, ROWS)),)) == ((Leg(0, 0, ROWS),),)

    def test_a_turn_to_the_next_leg_is_a_dubins_path(self) -> None:
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(helper(run_in_m=0.0),)))
        # Half a circle of 2 m about, 10 m sideways, of which 4 m are the circle's.
        way_m = simulator.way_m(0, Leg(1, 0, ROWS), Leg(3, 0, ROWS, up=False))
        assert way_m == pytest.approx(2 * math.pi + 6)

    def test_of_an_even_number_of_columns_the_line_lies_between_two(self) -> None:
        sensor = LegSensor(Swath(4), np.full((4, ROWS, COLUMNS), 0.5))
        below = replace(helper(), sensor=sensor, start=Pose(7.5, -10, 0))
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(below,)))
        # The line of column 2 lies at 7.5 m: straight on for 5 m to the run-in, and 5 m of that.
        assert simulator.way_m(0, None, Leg(2, 0, ROWS)) == pytest.approx(10)
        # Columns 0 to 3.
        assert simulator.removed_m2(((Leg(2, 0, ROWS),),)) == pytest.approx(4 * 6 * 25 * 0.5)
        # Columns 0 and 1 alone, the line half a cell outside.
        assert simulator.removed_m2(((Leg(0, 0, ROWS),),)) == pytest.approx(2 * 6 * 25 * 0.5)

    def test_nothing_counts_that_would_begin_after_the_endurance(self) -> None:
        lasting = replace(helper(), lasts_s=10.0)
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS)), ends_s=500), helpers=(lasting,)))
        legs = (Leg(0, 0, ROWS), Leg(0, 0, ROWS, up=False))  # 5 s, and 20 s later
        assert simulator.removed_m2((legs,)) == pytest.approx(2 * 6 * 25 * 0.5)


class TestALegOnTheMap:
    """What a leg is credited with, beside what the fleet's map makes of the looks of a helper that flies it."""

    @pytest.mark.parametrize("up", [True, False])
    @pytest.mark.parametrize(
        ("range_m", "width"), [(6, 2), (12.4, 4), (12.5, 5), (14.9, 5), (15, 6), (25, 10), (27.5, 11)]
    )
    def test_both_tell_the_same(self, range_m: float, width: int, up: bool) -> None:
        overrides = ("noise_cell=0", "noise_track=0", f"range_m={range_m}")
        scenario = load_scenario(BRIEF, [f"vehicles.helper.sensor.{one}" for one in overrides], 1)
        fleet = build_fleet(scenario, record=False)
        grid = fleet.run_info.grid.spec
        inside = np.ones(grid.shape, dtype=np.bool_)
        (flown_by,) = leg_helpers(scenario, grid, inside)
        assert flown_by.sensor.swath.width == width
        strip = strip_of(grid, Window(4, 16, 20, 20 + width), 1)
        (leg,) = legs_over_strip(strip, 2 * range_m)
        leg = leg if up else replace(leg, start=leg.end, end=leg.start)

        world = fleet.specs["world"].config
        config = next(body for body in world.vehicles if body.vehicle == "helper")
        looks = Looks(
            config,
            sonar=CurveSonar(config.sensor.curve, make_seabed(world.seabed, world.area, world.seed)),
            targets=Targets(world.area, 0, 0),
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
        made = Removable(grid, inside, risk, np.zeros(grid.shape), 1000, 1050, (flown_by,))
        column = 20 + flown_by.sensor.swath.left
        removed_m2 = Simulator(made).removed_m2(((Leg(column, 4, 16, up),),))
        assert np.count_nonzero(fleet_map.risk < 1) == 12 * width
        assert removed_m2 == pytest.approx(credited_m2, rel=0.005)  # the map tells levels of 0.02

    def test_by_hand(self) -> None:
        # Ten columns of 5 m, 80 rows, all of it missed so far, P_d 0.7: one leg of 400 m and 25 m to either side.
        scenario = load_scenario("tellaro")
        grid = build_fleet(scenario, record=False).run_info.grid.spec
        inside = np.ones(grid.shape, dtype=np.bool_)
        everything = Removable(
            grid, inside, np.ones(grid.shape), np.zeros(grid.shape), 1000, 1050, leg_helpers(scenario, grid, inside)
        )
        assert Simulator(everything).removed_m2(((Leg(20, 0, 80),),)) == pytest.approx(400 * 50 * 0.7)


class TestTheBound:
    @settings(max_examples=40, deadline=None)
    @given(st.integers(0, 2**32 - 1), st.integers(1, 2))
    def test_no_schedule_is_above_it(self, seed: int, helpers: int) -> None:
        chance = np.random.default_rng(seed)
        risk = chance.uniform(0, 1, (ROWS, COLUMNS)) ** 2
        released_s = np.sort(chance.uniform(0, 80, COLUMNS))[:: chance.choice([-1, 1])] + np.zeros((ROWS, 1))
        made = mission(risk, released_s, ends_s=100, helpers=helpers)
        bound = upper_bound(made, 5)
        assert bound.removed_m2 >= bound.optimum_m2 - 1e-6
        simulator = Simulator(made)
        for _ in range(40):
            schedule = tuple(
                tuple(
                    Leg(int(chance.integers(COLUMNS)), first, int(chance.integers(first + 1, ROWS + 1)), *flags)
                    for first in chance.integers(0, ROWS, chance.integers(1, 6)).tolist()
                    for flags in (chance.integers(0, 2, 2).astype(bool).tolist(),)
                )
                for _ in range(helpers)
            )
            assert simulator.removed_m2(schedule) <= bound.removed_m2 + 1e-6

    @pytest.mark.parametrize("seed", range(6))
    def test_the_best_schedule_found_is_near_it_and_not_above(self, seed: int) -> None:
        chance = np.random.default_rng(seed)
        # What is worth most lies far away, settles late, and leaves hardly the time.
        risk = chance.uniform(0, 0.2, (ROWS, COLUMNS))
        risk[:, 9:] = chance.uniform(0.8, 1, (ROWS, 3))
        released_s = np.broadcast_to(np.linspace(0, 40, COLUMNS), risk.shape)
        made = replace(mission(risk, released_s, ends_s=60 + 5 * seed), helpers=(helper(run_in_m=0.0),))
        bound = upper_bound(made, 5)
        best = best_schedule(made, bound, 0.8, seed)
        assert 0.55 * bound.removed_m2 <= best.removed_m2 <= bound.removed_m2 + 1e-6

    def test_waiting_and_the_way_sideways_by_hand(self) -> None:
        # Columns are released from left to right, one every 10 s; 5 m sideways take 2.5 s.
        released_s = np.broadcast_to(np.arange(COLUMNS) * 10.0, (ROWS, COLUMNS))
        relaxed = Relaxation(mission(np.ones((ROWS, COLUMNS)), released_s, ends_s=500))
        lost_s = 500 + relaxed.kind.turn_s - relaxed.free_s[0]
        # A leg at column 1 sees column 0 at once, so that the way to column 10 is the least: 9 columns.
        assert lost_s[[0, 1, 2, 10]] == pytest.approx(np.array([0, 0, 2.5, 22.5]))
        # From 60 s on: column 7 is the first of which nothing could be seen before.
        at_60 = relaxed.from_s.tolist().index(60.0)
        lost_s = 500 - 60 + relaxed.kind.turn_s - relaxed.free_s[at_60]
        assert lost_s[[3, 6, 7, 10]] == pytest.approx(np.array([0, 0, 0, 7.5]))

    def test_it_is_all_there_is_where_there_is_time_for_everything(self) -> None:
        made = mission(np.ones((ROWS, COLUMNS)), ends_s=1e6)
        assert upper_bound(made, 5).removed_m2 >= 0.99 * made.total_m2

    def test_one_leg_in_the_time_for_one_leg(self) -> None:
        # 30 m at 2 m/s, and not even the turn that the bound forgives; three columns of the best.
        risk = np.ones((ROWS, COLUMNS))
        bound = upper_bound(mission(risk, ends_s=15.0), 5).removed_m2
        assert 3 * 6 * 25 * 0.5 <= bound <= 1.5 * 3 * 6 * 25 * 0.5

    def test_the_schedule_found_comes_near_it_on_an_easy_mission(self) -> None:
        risk = np.zeros((ROWS, COLUMNS))
        risk[:, [2, 3, 4, 8, 9, 10]] = 1.0
        made = mission(risk, ends_s=300)
        bound = upper_bound(made, 5)
        best = best_schedule(made, bound, 3.0, 1)
        assert 0.8 * bound.removed_m2 <= best.removed_m2 <= bound.removed_m2
        assert best.removed_m2 == pytest.approx(Simulator(made).removed_m2(best.schedule))
