"""Residual risk across the tracks: what hand-worked profiles come to, and that moving tracks makes nothing worse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner import across as across_module
from planner.across import MEAN_WEIGHT, Across, HelperLooks, Measured, Worth, _moves
from planner.types import DetectionCurve

HALF = DetectionCurve(np.array([0.0, 10.0]), np.array([0.5, 0.5]))
"""P_d 0.5 up to 10 m."""
GAPPED = DetectionCurve(np.array([9.0, 10.0, 40.0]), np.array([0.0, 0.4, 0.2]))
"""Nothing up to 9 m, then less and less."""


def across(*flown: float, width_m: float = 20.0, rho: float = 0.0, helpers: HelperLooks | None = None) -> Across:
    seen = [Measured(across_m, HALF, 10.0) for across_m in flown]
    return Across(width_m, seen, HALF, 10.0, 1.0, rho, helpers or HelperLooks())


def test_looks_multiply() -> None:
    assert across().worst30([10]) == pytest.approx(0.5)
    assert across(10.0).worst30([10]) == pytest.approx(0.25)
    assert across(10.0).worst30([]) == pytest.approx(0.5)
    # Of 40 m a track in the middle of the left half sees that: the worst 30 % lie beyond.
    assert across(width_m=40.0).worst30([10]) == pytest.approx(1.0)


def test_of_correlated_looks_the_best_counts() -> None:
    assert across(10.0, rho=1.0).worst30([10]) == pytest.approx(0.5)
    assert across(10.0, rho=0.5).worst30([10]) == pytest.approx(0.5**1.5)


def test_helpers_look_where_most_is_left() -> None:
    # 0.5 everywhere; 16 of 20 m come down to 0.25, so of the worst 6 m there are 4 at 0.5 and 2 at 0.25.
    helpers = HelperLooks(16.0, 0.5)
    assert across(helpers=helpers).worst30([10]) == pytest.approx((4 * 0.5 + 2 * 0.25) / 6)
    # Two tracks take twice as long: 32 m are all once and 12 m twice; 0.25 is 0.125 and 0.0625.
    assert across(10.0, helpers=helpers).worst30([10]) == pytest.approx(0.125)
    # 5 to 10 m are seen twice. Half a metre for each of two tracks: of one of those metres seen once.
    twice = across(15.0, width_m=10.0, helpers=HelperLooks(0.5, 0.5))
    assert twice.worth([0]).risk == pytest.approx(0.5 + MEAN_WEIGHT * (4 * 0.5 + 6 * 0.25) / 10)
    # Of looks that are half alike 0.75 counts as the root of 0.25: all 20 m come down to a half of it.
    assert across(rho=0.5, helpers=HelperLooks(20.0, 0.75)).worst30([10]) == pytest.approx(0.25)


def test_what_is_asked_and_not_seen_is_lost() -> None:
    asked = across()
    asked.ask_for([Measured(10.0, HALF, 10.0)])
    assert asked.worth([10]).lost_m == 0
    assert asked.worth([15]).lost_m == 5
    assert asked.lost_m([Measured(10.5, HALF, 10.0)]) == 1  # of the first metre it sees half
    assert asked.worth([15, 5]).lost_m == 0
    # Within r_eff is not the same as beyond it.
    beyond = Across(20.0, [], HALF, 5.0, 1.0)
    beyond.ask_for([Measured(10.0, HALF, 10.0)])
    assert beyond.worth([10]).lost_m == 10


def test_tracks_lie_within_the_width_or_no_farther_outside_than_those_that_are_asked_for() -> None:
    ground = across(width_m=40.0)
    assert (ground._first, ground._last) == (0, 40)
    ground.ask_for([Measured(5.0, HALF, 10.0), Measured(35.0, HALF, 10.0)])
    assert (ground._first, ground._last) == (0, 40)
    ground.ask_for([Measured(-3.5, HALF, 10.0), Measured(20.0, HALF, 10.0), Measured(43.5, HALF, 10.0)])
    assert (ground._first, ground._last) == (-3, 43)
    coarse = across(width_m=12_001.0)
    assert (coarse._first, coarse._last) == (0, 4000)
    coarse.ask_for([Measured(-7.0, HALF, 10.0), Measured(12_008.0, HALF, 10.0)])
    assert (coarse._first, coarse._last) == (-2, 4002)
    between = across(width_m=20.5)
    assert (between._first, between._last) == (0, 20)


def test_bins_are_of_so_many_whole_metres_that_there_are_no_more_than_5000() -> None:
    assert [across(width_m=width_m).step_m for width_m in (0.4, 5000.0, 5000.5, 10_000.0, 10_001.0)] == [1, 1, 2, 2, 3]


def test_a_bin_is_seen_where_all_of_it_is_beyond_the_nadir_gap_and_not_beyond_the_range() -> None:
    # From 50 m 9 to 40 m either side, of these 9 to 30 m within r_eff; at 9 m itself nothing is seen.
    ground = Across(100.0, [], GAPPED, 30.0, 5.0)
    ground.ask_for([Measured(50.0, GAPPED, 30.0)])
    assert (ground.lost_m([]), ground.worth([]).lost_m) == (60, 60)
    assert (ground.lost_m([Measured(50.0, GAPPED, 25.0)]), ground.lost_m([Measured(50.0, GAPPED, 30.0)])) == (10, 0)
    # From 55 m 15 to 45 m and 65 to 95 m are seen, of what is asked 15 to 40 m and 65 to 90 m; within r_eff 25 to 45 m
    # and 65 to 85 m, of 20 to 40 m and 60 to 80 m.
    assert ground.lost_m([Measured(55.0, GAPPED, 30.0)]) == ground.worth([55]).lost_m == 5 + 5 + 5
    assert ground.worth([50]).lost_m == 0


def test_a_track_so_far_outside_that_it_sees_nothing_changes_nothing() -> None:
    ground = across(10.0, width_m=30.0)
    ground.ask_for([Measured(-11.0, HALF, 10.0), Measured(41.0, HALF, 10.0), Measured(20.0, HALF, 10.0)])
    for far in (-900, -11, 41, 900):
        assert ground.worth([20, far]) == ground.worth([20])
    assert ground.worth([-10]) != ground.worth([])


def test_better_is_what_loses_less_and_else_leaves_less_by_more_than_a_millionth() -> None:
    assert Worth(4.0, 0.9).is_better(Worth(5.0, 0.1))
    assert Worth(4.0, 0.3).is_better(Worth(4.0, 0.300002))
    assert not Worth(4.0, 0.3).is_better(Worth(4.0, 0.3000005))
    assert not Worth(5.0, 0.1).is_better(Worth(4.0, 0.9))


def test_one_more_goes_where_nothing_is_seen_and_one_less_where_it_is_not_missed() -> None:
    wide = across(10.0, width_m=40.0)
    assert wide.with_one_more([]) == [32]
    assert wide.with_one_less([10, 30]) == [30]


def test_one_more_may_go_where_the_width_ends_and_no_farther() -> None:
    far, near = (
        DetectionCurve(np.array([0.0, 17.0]), np.full(2, 0.5)),
        DetectionCurve(np.array([0.0, 3.0]), np.full(2, 0.5)),
    )
    seen = [Measured(17.0, far, 17.0)]  # from 34 m on nothing is; tried is every eighth metre
    assert Across(40.0, seen, near, 3.0, 1.0).with_one_more([]) == [40]
    assert Across(39.0, seen, near, 3.0, 1.0).with_one_more([]) == [32]


def test_two_tracks_are_moved_together_where_either_alone_would_leave_a_gap() -> None:
    # Of the places, a metre apart, each sees 21: the first two see 2 to 22 and 23 to 43, the third 42 to the last one.
    assert across(width_m=63.0).refined([12, 33, 52]) == [10, 31, 52]


def test_tracks_are_moved_one_by_one_two_by_two_all_from_one_on_drawn_out_and_every_second() -> None:
    # Those that move the first tracks farthest come first.
    assert [(group, tuple(shifts[-1].tolist())) for group, shifts in _moves(4)] == [
        ((0, 1, 2, 3), (32, 32, 32, 32)),
        ((0, 1), (32, 32)),
        ((0, 2), (32, 32)),
        ((0,), (32,)),
        ((0, 1, 2, 3), (8, 16, 24, 32)),
        ((1, 2, 3), (32, 32, 32)),
        ((1, 2), (32, 32)),
        ((1, 3), (32, 32)),
        ((1,), (32,)),
        ((1, 2, 3), (11, 21, 32)),
        ((2, 3), (32, 32)),
        ((2,), (32,)),
        ((2, 3), (16, 32)),
        ((3,), (32,)),
    ]
    (group, shifts) = _moves(1)[0]
    assert (group, shifts.ravel().tolist()) == ((0,), [-1, 1, -2, 2, -4, 4, -8, 8, -16, 16, -32, 32])


def moved_in_turn(ground: Across, bins: list[int], rounds: int) -> list[int]:
    """The first ten of some tracks moved one way after the other, each time to where they are worth most."""
    found = sorted(min(max(one, ground._first), ground._last) for one in bins)
    for group, shifts in _moves(min(len(found), 10)) * rounds:
        tried = []
        for shift in shifts.tolist():
            moved = list(found)
            for index, by in zip(group, shift, strict=True):
                moved[index] = min(max(moved[index] + by, ground._first), ground._last)
            tried.append(moved)
        best = min(tried, key=ground.worth)
        if ground.worth(best).is_better(ground.worth(found)):
            found = best
    return sorted(found)


@pytest.mark.parametrize("rounds", [1, 3])
@pytest.mark.parametrize("seed", [9, 14, 19, 24])  # in which one way more would be one for the better
def test_ways_to_move_are_gone_through_in_turn(seed: int, rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(across_module, "MOST_ROUNDS", rounds)
    rng = np.random.default_rng(seed)
    flown = [Measured(float(one), GAPPED, 30.0) for one in rng.integers(0, 400, 2)]
    rho = 0.4 if seed % 2 else 0.0
    ground = Across(700.0, flown, GAPPED, 30.0, 5.0, rho, HelperLooks(30.0 * (seed % 4), 0.5))
    ground.ask_for([Measured(float(one), GAPPED, 30.0) for one in rng.integers(-20, 720, 4)])
    bins = rng.integers(0, 700, (4, 12, 7, 3)[seed % 4]).tolist()
    assert ground.refined(bins) == moved_in_turn(ground, bins, rounds)


def test_of_two_places_just_as_good_the_left_one_is_taken() -> None:
    ground = across(31.0, width_m=62.0)
    ground.ask_for([Measured(10.0, HALF, 10.0), Measured(52.0, HALF, 10.0)])
    assert ground.worth([31 - 16]) == ground.worth([31 + 16])  # the first places tried that are better
    assert ground.refined([31]) == [10]


def test_where_there_is_no_track_none_is_moved() -> None:
    assert across().refined([]) == []


def test_a_wide_part_is_looked_at_in_coarser_bins() -> None:
    wide = Across(12_000.0, [], GAPPED, 40.0, 5.0)
    assert wide.step_m == 3
    assert 0.99 < wide.worst30([100]) <= 1.0
    # From its middle, bin 2000, all of it is seen, so far does P(y) reach.
    far = DetectionCurve(np.array([0.0, 6003.0]), np.full(2, 0.5))
    wide = Across(12_000.0, [], far, 6003.0, 5.0)
    assert wide.worst30([2000]) == pytest.approx(0.5)
    wide.ask_for([Measured(6000.0, far, 6003.0)])
    assert (wide.lost_m([]), wide.worth([]).lost_m, wide.worth([2000]).lost_m) == (12_000, 12_000, 0)
    # Cells of 6 m are two bins of 3 m each; of the 2000 those that begin 1800 to 2198 bins on are seen.
    near = DetectionCurve(np.array([0.0, 600.0]), np.full(2, 0.5))
    wide = Across(12_000.0, [], near, 600.0, 6.0)
    risk = 1.0 + MEAN_WEIGHT * (1.0 - 0.5 * 200 / 2000)
    assert wide.worth([1999]).risk == pytest.approx(risk)
    flown = Across(12_000.0, [Measured(5997.0, near, 600.0)], near, 600.0, 6.0)
    assert flown.worth([]).risk == pytest.approx(risk)
    wide.ask_for([Measured(5997.0, near, 600.0)])
    assert wide.lost_m([]) == 1200
    helped = Across(12_000.0, [Measured(-900.0, near, 600.0)], near, 600.0, 6.0, helpers=HelperLooks(6000.0, 0.5))
    assert helped.worth([]).risk == pytest.approx(1.0 + MEAN_WEIGHT * 0.75)


def test_a_narrow_part_has_a_bin_and_what_is_left_of_the_last_one_counts_as_one() -> None:
    narrow = across(width_m=0.4)
    narrow.ask_for([Measured(5.0, HALF, 10.0)])
    assert narrow.lost_m([]) == 1
    between = across(width_m=20.5)
    between.ask_for([Measured(11.0, HALF, 10.0)])
    assert between.lost_m([]) == 20
    assert across(11.0, width_m=4.0).worst30([]) == pytest.approx(1.0)  # of the first cell, which it does not see


@given(
    flown=st.lists(st.integers(-20, 120), max_size=3),
    bins=st.lists(st.integers(-20, 120), max_size=3),
    rho=st.sampled_from([0.0, 0.4, 1.0]),
)
def test_risk_is_that_of_the_map(flown: list[int], bins: list[int], rho: float) -> None:
    ground = Across(100.0, [Measured(float(one), GAPPED, 30.0) for one in flown], GAPPED, 30.0, 5.0, rho)
    cells_m = np.arange(0.0, 100.0, 5.0)
    nats = np.array([np.zeros(20), *(-np.log1p(-GAPPED.at(np.abs(cells_m - one))) for one in [*flown, *bins])])
    risk = np.sort(np.exp(-(nats.max(axis=0) + (1 - rho) * (nats.sum(axis=0) - nats.max(axis=0)))))
    assert ground.worst30(bins) == pytest.approx(risk[-6:].mean())
    assert ground.worth(bins).risk == pytest.approx(risk[-6:].mean() + MEAN_WEIGHT * risk.mean())


@given(
    flown=st.lists(st.integers(-20, 220), max_size=3),
    bins=st.lists(st.integers(-20, 220), min_size=1, max_size=4),
    asked=st.lists(st.integers(-20, 220), max_size=4),
    rho=st.sampled_from([0.0, 0.4]),
    helped_m=st.sampled_from([0.0, 60.0]),
)
def test_moving_makes_nothing_worse(
    flown: list[int], bins: list[int], asked: list[int], rho: float, helped_m: float
) -> None:
    seen = [Measured(float(one), GAPPED, 30.0) for one in flown]
    ground = Across(200.0, seen, GAPPED, 30.0, 5.0, rho, HelperLooks(helped_m, 0.5))
    ground.ask_for([Measured(float(one), GAPPED, 30.0) for one in asked])
    found = ground.refined(bins)
    assert len(found) == len(bins)
    assert found == ground.refined(bins)
    assert ground.worth(found) <= ground.worth(bins)


@settings(max_examples=50)
@given(
    flown=st.lists(st.integers(-20, 220), max_size=3),
    bins=st.lists(st.integers(-20, 220), min_size=1, max_size=3),
    asked=st.lists(st.integers(-20, 220), max_size=3),
    helped_m=st.sampled_from([0.0, 30.0]),
)
# Each is a survey in which a step that is left out, or another, leaves a track where it could be moved.
@example([], [199], [99, 51], 0.0)
@example([], [180, 72], [28, 214, 194], 0.0)
@example([-8], [105, 127, 198], [180, 42], 0.0)
@example([100], [48], [128, 120], 0.0)
@example([130, 198, -12], [42, 170], [86, 150, 24], 0.0)
@example([-13, 208, 193], [90, 135], [], 0.0)
@example([174, 95, 100], [77, 181, 33], [], 0.0)
@example([], [20, 30], [], 30.0)
def test_no_track_can_be_moved_by_a_step_for_the_better(
    flown: list[int], bins: list[int], asked: list[int], helped_m: float
) -> None:
    seen = [Measured(float(one), GAPPED, 30.0) for one in flown]
    ground = Across(200.0, seen, GAPPED, 30.0, 5.0, helpers=HelperLooks(helped_m, 0.5))
    ground.ask_for([Measured(float(one), GAPPED, 30.0) for one in asked])
    found = ground.refined(bins)
    worth = ground.worth(found)
    for step in (1, 2, 4, 8, 16, 32):
        for shift in (-step, step):
            for place, at in enumerate(found):
                moved = min(max(at + shift, ground._first), ground._last)
                assert not ground.worth([*found[:place], moved, *found[place + 1 :]]).is_better(worth)
