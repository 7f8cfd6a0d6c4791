"""What helpers fly of legs in time and what looks from there count: by hand, and beside what others say of the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from coordinator.cut.ground import OBJECTIVES, WORST, Ground
from coordinator.cut.legs import (
    LEG,
    MOST_LOOKS,
    Flier,
    Routes,
    Site,
    counts_of_looks_m2,
    exchange,
    look_at_what_differs,
    take,
    turn_for_shortest,
)
from coordinator.cut.search import Counts
from coordinator.cut.strips import strip_of
from coordinator.cut.window import Window
from planner.dubins import Pose, shortest_path
from planner.sweep import sweeps_over
from planner.types import FloatArray, GridSpec, IntArray, SweepFrame

BLOCK_M = 10.0
ROWS, COLUMNS = 20, 12
SHAPE = (ROWS, COLUMNS)
BLOCKS = GridSpec(SweepFrame(30.0, -20.0, 0.7), BLOCK_M, COLUMNS, ROWS)
CELLS = GridSpec(BLOCKS.frame, BLOCK_M / 2, 2 * COLUMNS, 2 * ROWS)
EDGE_M = CELLS.cell_m / 2
STRIP = 5  # blocks that a swath is wide
FROM_BELOW = Flier(22.5, -40.0, 0.0, 100.0, 10_000.0, 2.0, 15.0, 20.0, 0.0)  # before the middle of the first strip


def site_of(risk: FloatArray, look: float = 0.5, threshold: float = 1.0) -> Site:
    """Where a look counts its residual risk times m2, and above the threshold twice of what is above it."""
    size = np.ones(SHAPE)
    counts_m2 = counts_of_looks_m2(risk, look * size, 100.0 * size, 0.0 * size, Counts(1.0, 2.0, threshold))
    return Site(counts_m2, BLOCK_M, EDGE_M, 2, 30)


def routes_of(*legs: list[list[int]]) -> Routes:
    most = 8
    told = np.zeros((len(legs), most, LEG), dtype=np.int64)
    for one, its in enumerate(legs):
        told[one, : len(its)] = np.array(its, dtype=np.int64).reshape(-1, LEG)
    number = np.array([len(its) for its in legs])
    size = told.shape[:2]
    return Routes(told, number, np.zeros(size), np.zeros((*size, 4), np.int64), np.zeros(SHAPE, np.uint8))


def flown_at_first(site: Site, routes: Routes, *fliers: Flier) -> float:
    """Has all of it flown where nothing was; returns what that gains."""
    gained_m2 = 0.0
    for one in range(len(fliers)):
        nothing = Routes(
            np.zeros_like(routes.legs),
            np.zeros_like(routes.number),
            routes.way_m,
            np.zeros_like(routes.flown),
            routes.looks,
        )
        gained_m2 += exchange(site, np.array(fliers), nothing, routes, one)
    return gained_m2


class TestWhatLooksCount:
    def test_each_look_counts_what_those_before_it_have_left(self) -> None:
        one = np.ones((1, 1))
        told = counts_of_looks_m2(0.8 * one, 0.5 * one, 10.0 * one, 3.0 * one, Counts(0.7, 1.0, 0.3))
        # 0.8, 0.4, 0.2, 0.1: what is above 0.3 is 0.5, 0.1 and nothing; the objects count once.
        assert told[:, 0, 0].tolist() == pytest.approx(
            [10 * (0.7 * 0.4 + 0.4) + 3, 10 * (0.7 * 0.2 + 0.1), 10 * 0.7 * 0.1, 10 * 0.7 * 0.05]
        )

    @given(arrays(np.float64, SHAPE, elements=st.floats(0.0, 1.0)), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
    def test_together_they_count_what_ground_loses_of_the_objective(
        self, risk: FloatArray, look: float, threshold: float
    ) -> None:
        size = np.ones(SHAPE)
        ground = Ground(risk, look * size, 25.0 * size, risk > 2, OBJECTIVES["both"], threshold)

        def left_m2(risk: FloatArray) -> float:
            worst_m2 = np.maximum(risk - threshold, 0.0).sum() / WORST
            return float(25.0 * (ground.objective.mean * risk.sum() + ground.objective.worst * worst_m2))

        told = counts_of_looks_m2(ground.risk, ground.look, ground.weights, 0.0 * size, ground.counts)
        after = risk * (1.0 - look) ** MOST_LOOKS
        assert told.sum() == pytest.approx(left_m2(risk) - left_m2(after), abs=1e-6)


class TestWays:
    def test_a_leg_straight_ahead_begins_behind_its_run_in(self) -> None:
        routes = routes_of([[0, 20, 0, 5, 0, 1]])
        flown_at_first(site_of(np.ones(SHAPE)), routes, FROM_BELOW)
        assert routes.way_m[0, 0] == pytest.approx(40.0)  # 20 m to where the run-in begins, and 20 m of it
        assert routes.flown[0, 0].tolist() == [0, 20, 0, 5]

    @given(st.integers(0, 10), st.integers(1, 10), st.booleans(), st.booleans(), st.floats(-80, 80), st.floats(0, 6.3))
    def test_they_are_those_to_a_strips_sweep(
        self, first: int, more: int, across: bool, up: bool, x_m: float, lead_m: float
    ) -> None:
        bounds = (
            (2, 2 + STRIP, min(first, 11), min(first + more, 12)) if across else (first, first + more, 3, 3 + STRIP)
        )
        window = Window(*bounds, across=across)
        strip = strip_of(CELLS, window.in_cells(2, CELLS.shape), 1)
        heading_rad = x_m / 13.0  # any
        flier = FROM_BELOW._replace(across_m=x_m, along_m=-50.0, heading_rad=heading_rad, lead_m=lead_m)
        routes = routes_of([[*bounds, int(across), int(up)], [0, 20, 0, 5, 0, 1]])
        flown_at_first(site_of(np.ones(SHAPE)), routes, flier)
        radius_m, run_in_m = flier.turn_radius_m, flier.run_in_m
        swath_m = STRIP * BLOCK_M
        sweep = sweeps_over(strip, swath_m, radius_m, run_in_m, lead_m=lead_m)[0 if up else 1]
        place = BLOCKS.frame.to_mission(flier.across_m, flier.along_m)
        start = Pose(*place, heading_rad + BLOCKS.frame.heading_rad)
        assert routes.way_m[0, 0] == pytest.approx(
            shortest_path(start, sweep.entry, radius_m).length_m + run_in_m, abs=0.05
        )
        next_strip = strip_of(CELLS, Window(0, 40, 0, 10), 2)
        upwards = sweeps_over(next_strip, swath_m, radius_m, run_in_m, lead_m=lead_m)[0]
        assert routes.way_m[0, 1] == pytest.approx(
            shortest_path(sweep.leave, upwards.entry, radius_m).length_m + run_in_m, abs=0.05
        )

    def test_each_leg_is_turned_to_where_the_way_is_shorter_and_else_as_its_strip_runs(self) -> None:
        legs = routes_of([[0, 20, 0, 5, 0, 0], [0, 20, 5, 10, 0, 1]]).legs[0]
        turn_for_shortest(site_of(np.ones(SHAPE)), np.array(FROM_BELOW), legs, 2)
        assert legs[:2, LEG - 1].tolist() == [1, 0]  # up, and back down beside it
        straight_ahead = routes_of([[5, 10, 0, 4, 1, 0]]).legs[0]
        in_the_middle = FROM_BELOW._replace(across_m=20.0 - EDGE_M, along_m=-400.0)
        turn_for_shortest(site_of(np.ones(SHAPE)), np.array(in_the_middle), straight_ahead, 1)
        assert straight_ahead[0, LEG - 1] == 1


class TestTime:
    # It begins to look at 100 s + 40 m / 2 m/s = 120 s, and flies a block in 5 s.
    @pytest.mark.parametrize(("until_s", "rows"), [(500.0, 20), (170.0, 10), (172.4, 10), (172.6, 11), (90.0, 0)])
    def test_what_is_passed_in_time_counts(self, until_s: float, rows: int) -> None:
        up, down = routes_of([[0, 20, 0, 5, 0, 1]]), routes_of([[0, 20, 0, 5, 0, 0]])
        site, flier = site_of(np.ones(SHAPE)), FROM_BELOW._replace(ends_s=until_s)
        gained_m2 = flown_at_first(site, up, flier)
        assert gained_m2 == pytest.approx(100.0 * 0.5 * rows * STRIP)
        assert (up.looks.sum(), up.number[0]) == (rows * STRIP, min(rows, 1))
        from_above = flier._replace(along_m=240.0, heading_rad=math.pi)
        flown_at_first(site, down, from_above)
        if rows:
            assert down.flown[0, 0].tolist() == [20 - rows, 20, 0, 5]

    def test_what_would_begin_too_late_is_left_out(self) -> None:
        routes = routes_of([[0, 20, 0, 5, 0, 1], [0, 20, 5, 10, 0, 0], [0, 20, 0, 5, 0, 1]])
        flown_at_first(site_of(np.ones(SHAPE)), routes, FROM_BELOW._replace(ends_s=235.0))
        assert routes.number[0] == 1


def some_legs() -> st.SearchStrategy[list[list[int]]]:
    def leg(across: bool, first: int, more: int, side: int, up: int) -> list[int]:
        if across:
            return [side, side + STRIP, min(first, 11), min(first + more, 12), 1, up]
        return [first, first + more, min(side, 7), min(side, 7) + STRIP, 0, up]

    one = st.builds(leg, st.booleans(), st.integers(0, 10), st.integers(1, 10), st.integers(0, 15), st.integers(0, 1))
    return st.lists(one, max_size=5)


@given(some_legs(), some_legs(), some_legs(), st.floats(120.0, 900.0), st.floats(0.1, 1.0))
def test_routes_that_are_exchanged_gain_what_they_leave_less(
    before: list[list[int]], other: list[list[int]], after: list[list[int]], until_s: float, threshold: float
) -> None:
    chance = np.random.default_rng(3)
    site = site_of(chance.random(SHAPE), 0.6, threshold)
    fliers = (FROM_BELOW._replace(ends_s=until_s), FROM_BELOW._replace(across_m=110.0, ends_s=until_s))
    now = routes_of(before, other)
    now_m2 = flown_at_first(site, now, *fliers)
    assert now_m2 == pytest.approx(counted_m2(site, now), abs=1e-6)
    trial = routes_of([], [])._replace(looks=now.looks)
    take(now, trial, 0)
    take(now, trial, 1)
    trial.legs[0], trial.number[0] = routes_of(after).legs[0], len(after)
    gained_m2 = exchange(site, np.array(fliers), now, trial, 0)
    alone = routes_of(after, other)
    assert now_m2 + gained_m2 == pytest.approx(flown_at_first(site, alone, *fliers), abs=1e-6)
    assert trial.flown[0, : trial.number[0]].tolist() == alone.flown[0, : alone.number[0]].tolist()
    assert (trial.looks == alone.looks).all()
    assert look_at_what_differs(site, trial, now, 0) == pytest.approx(-gained_m2, abs=1e-6)
    assert counted_m2(site, now) == pytest.approx(now_m2, abs=1e-6)


def counted_m2(site: Site, routes: Routes) -> float:
    """What all parts count that are flown, block by block; held against the looks that were counted."""
    looks = np.zeros(SHAPE, dtype=np.int64)
    for one, number in enumerate(routes.number.tolist()):
        for first_row, end_row, first_column, end_column in routes.flown[one, :number].tolist():
            looks[first_row:end_row, first_column:end_column] += 1
    assert (looks == routes.looks).all()
    up_to: IntArray = np.arange(MOST_LOOKS)[:, np.newaxis, np.newaxis]
    return float(site.counts_m2[np.broadcast_to(up_to < looks, site.counts_m2.shape)].sum())
