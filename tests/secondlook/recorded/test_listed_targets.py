"""Which targets are on a list of mines: by hand, and however things lie, one to one and the nearest first."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from secondlook.recorded.listed_targets import matched

ALONG = [(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)]
ALL = [True, True, True]


def of(
    listed: list[tuple[float, float]], gates_m: list[float], targets: list[tuple[float, float]], detected: list[bool]
) -> tuple[list[bool], list[bool]]:
    listed_m, targets_m = (np.array(one, dtype=np.float64).reshape(-1, 2) for one in (listed, targets))
    is_target, is_listed = matched(listed_m, np.array(gates_m), targets_m, np.array(detected, dtype=np.bool_))
    return is_target.tolist(), is_listed.tolist()


def test_what_lies_within_reach_is_a_target_and_what_does_not_is_none() -> None:
    assert of([(0.0, 2.0), (10.0, 2.1), (20.0, 2.1)], [2.0, 2.0, 2.5], ALONG, ALL) == (
        [True, False, True],
        [True, False, True],
    )


def test_an_object_is_one_target_and_a_target_one_object_however_far_they_reach() -> None:
    assert of([(9.0, 0.0)], [30.0], ALONG, ALL) == ([True], [False, True, False])
    assert of([(9.0, 0.0), (10.5, 0.0)], [2.0, 2.0], ALONG, ALL) == ([False, True], [False, True, False])


def test_the_nearest_pair_comes_first_and_who_lost_takes_the_next_nearest() -> None:
    # The one at 12 m is nearer to the target at 10 m than the one at 7 m, which takes that at 0 m.
    assert of([(7.0, 0.0), (12.0, 0.0)], [7.5, 5.0], ALONG, ALL) == ([True, True], [True, True, False])
    # Of two as near the first one comes first.
    assert of([(5.0, 0.0), (5.0, 0.0)], [5.0, 5.0], ALONG[:1], [True]) == ([True, False], [True])
    assert of([(5.0, 0.0), (15.0, 0.0)], [5.0, 5.0], ALONG[:2], ALL[:2]) == ([True, True], [True, True])


def test_what_nobody_has_detected_is_on_no_list() -> None:
    assert of([(0.0, 0.0), (9.0, 0.0)], [15.0, 15.0], ALONG, [False, True, True]) == (
        [False, True],
        [False, True, False],
    )
    assert of([(0.0, 0.0)], [2.0], ALONG, [False, True, True]) == ([False], [False, False, False])


def test_targets_that_the_sonar_cannot_tell_apart_are_one_object() -> None:
    together = [(0.0, 0.0), (2.0, 0.0), (-2.1, 0.0)]
    assert of([(1.0, 0.0)], [2.0], together, ALL) == ([True], [True, True, False])
    assert of([(1.0, 0.0)], [2.0], together, [True, False, True]) == ([True], [True, False, False])
    assert of([(1.0, 0.0), (1.0, 0.0)], [2.0, 2.0], together, ALL) == ([True, True], [True, True, False])


def test_nothing_is_a_target_where_there_is_none() -> None:
    assert of([(0.0, 0.0)], [2.0], [], []) == ([False], [])
    assert of([], [], ALONG, ALL) == ([], [False, False, False])


places = st.lists(
    st.tuples(st.integers(0, 12).map(lambda at: at * 4.0), st.integers(0, 12).map(lambda at: at * 4.0)), max_size=8
)


@given(listed=places, targets=places, gate_m=st.floats(1.0, 80.0))
def test_every_object_has_a_target_and_no_pair_within_reach_is_left(
    listed: list[tuple[float, float]], targets: list[tuple[float, float]], gate_m: float
) -> None:
    is_target, is_listed = of(listed, [gate_m] * len(listed), targets, [True] * len(targets))
    of_their_own = {target for target, found in zip(targets, is_listed, strict=True) if found}
    assert len(of_their_own) <= sum(is_target) <= sum(is_listed)  # places are metres apart, or alike
    for place, taken in zip(listed, is_target, strict=True):
        for target, found in zip(targets, is_listed, strict=True):
            assert taken or found or np.hypot(*np.subtract(place, target)) > gate_m
