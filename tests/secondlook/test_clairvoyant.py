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

from bench.clairvoyant import one_seed
from bench.clairvoyant_bound import Relaxation, upper_bound
from bench.clairvoyant_schedule import best_schedule
from bench.flown_legs import FlownLegs
from bench.legs import Leg, Simulator
from bench.removable import Clairvoyance, LegHelper, LegSensor, Removable, geometry
from bench.row_packing import RowPacking
from comms.messages import Look, StripState, StripStatus
from comms.node import Received
from planner.dubins import Pose
from planner.footprint import look_on_grid
from planner.types import FloatArray, GridSpec, SweepFrame
from secondlook.mission import RunOptions, run_mission
from secondlook.scenario import load_scenario

BRIEF = Path(__file__).parent.parent / "support" / "brief.yaml"
ROWS, COLUMNS = 6, 12


def helper(run_in_m: float = 5.0) -> LegHelper:
    sensor = LegSensor(1, np.full((2, ROWS, COLUMNS), 0.5))
    return LegHelper("helper", Pose(0, -10, 0), 2.0, 2.0, run_in_m, 1e6, sensor)


def mission(
    risk: FloatArray, released_s: FloatArray | float = 0.0, ends_s: float = 60.0, helpers: int = 1
) -> Removable:
    """Cells of 5 m, helpers of 2 m/s that see one column to either side with P_d 0.5."""
    grid = GridSpec(SweepFrame(0, 0, 0), 5.0, COLUMNS, ROWS)
    inside = np.ones(grid.shape, dtype=np.bool_)
    released = np.broadcast_to(np.asarray(released_s, dtype=np.float64), grid.shape).copy()
    return Removable(grid, inside, risk, released, ends_s / 1.05, ends_s, (helper(),) * helpers)


class TestRowPacking:
    @settings(max_examples=60)
    @given(st.integers(1, 7), st.integers(1, 2), st.integers(0, 2**32 - 1), st.floats(0.05, 2.0))
    def test_it_finds_what_trying_everything_finds(self, columns: int, reach: int, seed: int, price: float) -> None:
        chance = np.random.default_rng(seed)
        first = chance.uniform(0, 1, (2, columns))
        values = [first, first * chance.uniform(0, 1), first * 0.0]
        prices = price * chance.uniform(0.5, 1.5, (2, columns))
        packed = RowPacking(values, reach).solve(prices)

        def worth(row: int, crossings: tuple[int, ...]) -> float:
            looks = np.zeros(columns, dtype=int)
            for column in crossings:
                looks[max(0, column - reach) : column + reach + 1] += 1
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

    def test_what_is_passed_after_the_deadline_does_not_count(self) -> None:
        simulator = Simulator(mission(np.ones((ROWS, COLUMNS)), ends_s=5.0 + 2 * 2.5))
        assert simulator.removed_m2(((Leg(0, 0, ROWS),),)) == pytest.approx(2 * 2 * 25 * 0.5)
        assert simulator.in_time(((Leg(0, 0, ROWS), Leg(3, 0, ROWS)),)) == ((Leg(0, 0, ROWS),),)

    def test_a_turn_to_the_next_leg_is_a_dubins_path(self) -> None:
        simulator = Simulator(replace(mission(np.ones((ROWS, COLUMNS))), helpers=(helper(run_in_m=0.0),)))
        # Half a circle of 2 m about, 10 m sideways, of which 4 m are the circle's.
        way_m = simulator.way_m(0, Leg(1, 0, ROWS), Leg(3, 0, ROWS, up=False))
        assert way_m == pytest.approx(2 * math.pi + 6)


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


class TestAFlownMission:
    def test_what_its_looks_removed_is_what_was_measured_but_for_noise(self, tmp_path: Path) -> None:
        scenario = load_scenario(BRIEF)
        clairvoyance = Clairvoyance(scenario)
        looks: list[Look] = []

        def watch(received: Received) -> None:
            clairvoyance.take(received)
            if isinstance(received.message, Look) and received.vehicle == "helper":
                looks.append(received.message)

        summary = run_mission(scenario, RunOptions(tmp_path, "local", record=False, watch=watch))
        made = clairvoyance.removable()
        assert made.ends_s == pytest.approx(1.05 * summary["time"]["primary_s"])
        assert made.risk[made.inside].mean() == pytest.approx(summary["risk_primary_alone"]["mean"])
        assert (made.released_s[made.inside] <= made.primary_s + 0.1).all()
        # The helper's legs lie between columns or on them; its sensor sees 15 m, three columns.
        assert made.helpers[0].sensor.reach == 3
        nats = np.zeros(made.grid.shape)
        for look in looks:
            rows, columns, p_detect = look_on_grid(made.grid, geometry(look), look.p_detect)
            nats[rows, columns] -= np.log1p(-np.where(p_detect > 0, made.helpers[0].sensor.best[rows, columns], 0.0))
        removed = float((made.risk * -np.expm1(-nats)).sum()) / made.inside.sum()
        measured = summary["risk_primary_alone"]["mean"] - summary["risk"]["mean"]
        assert removed == pytest.approx(measured, rel=0.03)

    def test_a_seed_is_flown_and_solved(self) -> None:
        row = one_seed(load_scenario(BRIEF, (), 1), ["greedy", "none"], 2.0)
        greedy, none = row.removed_m2["greedy"], row.removed_m2["none"]
        assert greedy is not None
        assert none == 0
        assert 0 < greedy < row.bound_m2 < row.there_m2
        assert row.best_m2 <= row.bound_m2


class TestFlownLegs:
    def test_they_are_what_the_helpers_swept_in_order_and_direction(self, tmp_path: Path) -> None:
        flown, strips = FlownLegs(), []

        def watch(received: Received) -> None:
            flown.take(received)
            if isinstance(received.message, StripStatus) and received.message.state is StripState.UNDER_WAY:
                strips.append(received.message)

        run_mission(load_scenario(str(BRIEF), (), 1), RunOptions(tmp_path, "local", record=False, watch=watch))
        grid = GridSpec(SweepFrame(0, 0, 0), 5, 61, 20)
        (legs,) = flown.schedule(grid, ["helper"])
        assert len(legs) == len(strips) > 0
        for leg, strip in zip(legs, strips, strict=True):
            assert abs(leg.column * 5 - strip.start_x_m) <= 2.5
            assert (leg.end - leg.first) * 5 == strip.length_m
            assert leg.first * 5 in (strip.start_y_m, strip.start_y_m - strip.length_m)
        assert {leg.up for leg in legs} == {True, False}

    def test_a_search_that_knows_them_finds_nothing_worse(self) -> None:
        row = one_seed(load_scenario(str(BRIEF), (), 1), ["plan"], 0.3)
        removed_m2 = row.removed_m2["plan"]
        assert removed_m2 is not None
        assert row.best_m2 >= row.started_m2 > 0.9 * removed_m2
