"""When a goal is reached: by hand, from how many mines are left with which chance; and which ground a lane has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.clearance import PRIOR_MINES, Detected, MinesLeft, mines_left
from planner.goal import Goal, Lane, goal_of_lane
from planner.region import Region
from planner.types import GridSpec, SweepFrame

ALL = np.ones((8, 10), dtype=np.bool_)
SQUARE = Region(((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)))
GRID = GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=21, rows=20)  # columns at 0, 5, ... 100 m, rows at 2.5 ...


def left_of(risk: float, found: int) -> MinesLeft:
    told = mines_left(
        np.full(ALL.shape, risk), ALL, ALL, 25.0, Detected(np.ones(found), np.ones(found, dtype=np.bool_)), 0.0
    )
    assert told is not None
    return told


def test_of_100_that_are_found_25_may_be_left_for_a_clearance_of_80_percent() -> None:
    from scipy.stats import nbinom  # it takes half a second to import

    left, true = left_of(0.15, 100), nbinom(100.0 + PRIOR_MINES, 0.85)
    goal = Goal(0.8, 0.9)
    assert goal.chance_now(left) == pytest.approx(true.cdf(25))
    assert goal.is_reached(left)
    assert not Goal(0.8, float(true.cdf(25)) + 0.001).is_reached(left)
    # With 90 % no more than so many are left, so that of all so many are found.
    assert left.clearance_with(0.9) == pytest.approx(100.0 / (100.0 + true.ppf(0.9)))
    assert (
        goal.words_now(left)
        == f"the chance is {math.floor(true.cdf(25) * 1000) / 1000}, and with 0.9 the clearance is 0.806"
    )
    assert goal.words == "a clearance of 0.8 with a chance of 0.9"


@pytest.mark.parametrize("last_bits", [-1e-13, 0.0, 1e-13])
def test_the_last_bits_of_a_chance_decide_nothing(last_bits: float) -> None:
    left = MinesLeft(0.1, 0, 1, 0.9, 0.99, np.array([0.9 + last_bits, 1.0]), np.ones(10))
    assert Goal(1.0, 0.9).is_reached(left)
    assert not Goal(1.0, 0.900001).is_reached(left)


def test_so_many_nats_lack_as_what_is_left_is_more_than_may_be() -> None:
    left = left_of(0.15, 100)
    cleared = left.clearance_with(0.9)
    assert Goal(cleared, 0.9).nats_lacking(left) == pytest.approx(0.0)
    # Of 1 - cleared half may be left, and a quarter.
    assert Goal((1.0 + cleared) / 2.0, 0.9).nats_lacking(left) == pytest.approx(math.log(2.0))
    assert Goal((3.0 + cleared) / 4.0, 0.9).nats_lacking(left) == pytest.approx(math.log(4.0))
    assert Goal(cleared / 2.0, 0.9).nats_lacking(left) < 0.0


def test_where_none_may_be_left_so_many_nats_lack_as_more_are_expected_than_may_be() -> None:
    # None is left with chances of 0.9 and of 0.9 ** 4: a tenth and some, and four times as much.
    left = MinesLeft(0.1, 0, 1, 0.9**4, 0.99, np.array([0.9**4, 1.0]), np.ones(10))
    assert Goal(1.0, 0.9).nats_lacking(left) == pytest.approx(math.log(4.0))
    assert Goal(1.0, 0.9**8).nats_lacking(left) == pytest.approx(-math.log(2.0))
    for chance, nats in ((0.0, math.inf), (1.0, -math.inf)):
        assert Goal(1.0, 0.9).nats_lacking(replace(left, reached=np.array([chance, 1.0]))) == nats


def test_what_is_missed_by_little_is_not_told_as_reached() -> None:
    left = MinesLeft(0.1, 0, 1, 0.8996, 0.99, np.array([0.8996, 1.0]), np.ones(10))
    assert Goal(1.0, 0.9).words_now(left) == "the chance is 0.899"
    assert goal_of_lane(Lane(((0.0, 0.0), (10.0, 0.0)), 5.0), 0.1).words_now(left) == "the risk is 0.101"
    assert Goal(1.0, 0.9).words_now(replace(left, reached=np.array([0.9 - 1e-13, 1.0]))) == "the chance is 0.900"


def test_none_is_left_with_the_chance_of_0() -> None:
    left = left_of(0.001, 10)
    goal = Goal(1.0, 0.95)
    assert goal.chance_now(left) == pytest.approx(0.999**10.5)
    assert goal.is_reached(left)
    assert not Goal(1.0, 0.99).is_reached(left)
    assert goal.words_now(left) == "the chance is 0.989"  # 0.98955


def test_where_nothing_was_found_and_much_was_seen_a_clearance_is_that_none_is_left() -> None:
    left = left_of(0.1, 0)
    assert Goal(0.9, 0.5).chance_now(left) == Goal(1.0, 0.5).chance_now(left) == pytest.approx(0.9**0.5)
    assert left.clearance_with(0.9) == 1.0


def test_where_nothing_was_seen_nothing_is_reached() -> None:
    goal = Goal(0.5, 0.1)
    assert (goal.chance_now(None), goal.is_reached(None)) == (0.0, False)
    assert goal.words_now(None) == "nothing was seen"


def test_a_lane_has_so_much_of_each_cell_as_lies_within_half_its_width() -> None:
    lane = Lane(((50.0, 20.0), (50.0, 80.0)), 30.0)
    expected = np.zeros(GRID.shape)
    expected[4:16, 7:14] = 1.0
    expected[4:16, [7, 13]] = 0.5  # their centres lie on its edges, 35 and 65 m east
    goal = goal_of_lane(lane, 0.05)
    np.testing.assert_array_equal(goal.place(SQUARE, GRID), expected)
    assert Goal(0.5, 0.5).place(SQUARE, GRID) is None
    left = left_of(0.001, 10)
    assert goal.is_reached(left)
    assert not goal_of_lane(lane, 0.005).is_reached(left)
    assert goal.words == "a risk of at most 0.05 that a mine is left in the lane"
    assert goal.words_now(left) == "the risk is 0.011"  # 0.01045


def test_what_a_lane_goes_round_is_not_in_it() -> None:
    round_about = Lane(((10.0, 10.0), (90.0, 10.0), (90.0, 90.0), (10.0, 90.0), (10.0, 5.0)), 10.0)
    place = goal_of_lane(round_about, 0.05).place(SQUARE, GRID)
    assert place is not None
    assert (place[2, 10], place[10, 2], place[10, 10]) == (1.0, 1.0, 0.0)


@pytest.mark.parametrize("width_m", [1.0, 4.0, 5.0])
def test_a_lane_between_the_centres_of_cells_is_as_large_as_it_is(width_m: float) -> None:
    place = goal_of_lane(Lane(((52.5, 20.0), (52.5, 80.0)), width_m), 0.05).place(SQUARE, GRID)
    assert place is not None
    assert place.sum() * GRID.cell_area_m2 == pytest.approx(60.0 * width_m)
    np.testing.assert_array_equal(place[:, 10], place[:, 11])  # centred 2.5 m to either side of its middle


def test_a_lane_reaches_half_its_width_also_at_a_sharp_bend() -> None:
    lane = Lane(((10.0, 50.0), (80.0, 50.0), (10.0, 51.0)), 20.0)
    west, south, east, north = lane.outline.bounds
    assert (east, south, north) == pytest.approx((90.0, 40.0, 61.0), abs=0.05)
    assert west > 9.0


@pytest.mark.parametrize(("clearance", "chance"), [(0.0, 0.5), (1.1, 0.5), (0.5, 0.0), (0.5, 1.0)])
def test_what_makes_no_sense_is_refused(clearance: float, chance: float) -> None:
    with pytest.raises(ValueError, match="must be in"):
        Goal(clearance, chance)


def test_of_a_lane_no_clearance_can_be_wanted() -> None:
    with pytest.raises(ValueError, match="clearance must be 1"):
        Goal(0.9, 0.9, Lane(((0.0, 0.0), (10.0, 0.0)), 5.0))
