"""Contacts joined to objects: of whom a contact is, and how likely that is a mine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.contacts import LEAST_GATE_M, Objects, likelihood_ratio


def test_a_contact_near_another_is_of_the_same_object_and_one_farther_off_is_not() -> None:
    objects = Objects()
    objects.hear(100.0, 100.0, 0.0, 0.8)
    objects.hear(100.0 + LEAST_GATE_M, 100.0, 0.0, 0.7)
    assert len(objects) == 1
    objects.hear(100.0, 104.0, 0.0, 0.7)
    assert len(objects) == 2


def test_what_is_known_less_well_may_lie_farther_apart() -> None:
    objects = Objects()
    objects.hear(0.0, 0.0, 3.0, 0.8)
    objects.hear(15.0, 0.0, 4.0, 0.8)  # 3 times 5 m
    assert len(objects) == 1
    objects.hear(60.0, 0.0, 4.0, 0.8)
    assert len(objects) == 2


def test_who_knows_nothing_of_its_place_joins_no_more_than_what_is_near() -> None:
    objects = Objects()
    objects.hear(0.0, 0.0, 1e9, 0.8)
    objects.hear(59.0, 0.0, 0.0, 0.8)
    assert len(objects) == 1
    objects.hear(-61.0, 0.0, 1e9, 0.8)
    assert len(objects) == 2


def test_the_nearest_is_taken_and_the_surer_place_counts_more() -> None:
    objects = Objects()
    objects.hear(0.0, 0.0, 1.0, 0.8)
    objects.hear(10.0, 0.0, 1.0, 0.8)
    objects.hear(6.0, 0.0, 3.0, 0.8)  # within reach of both, nearer to the second
    objects.hear(-4.0, 0.0, 1.0, 0.8)  # the first lies where it lay
    assert len(objects) == 2


@given(
    places=st.lists(st.tuples(st.integers(-40, 40), st.integers(-40, 40)), min_size=1, max_size=30, unique=True),
    order=st.randoms(use_true_random=False),
)
def test_places_well_apart_are_as_many_objects_however_often_they_are_seen(
    places: list[tuple[int, int]], order: object
) -> None:
    seen = [place for place in places for _ in range(3)]
    order.shuffle(seen)  # type: ignore[attr-defined]
    objects = Objects()
    for x, y in seen:
        objects.hear(5.0 * x, 5.0 * y, 0.3, 0.9)
    assert len(objects) == len(places)


def test_a_ratio_is_that_of_the_densities_of_mines_and_of_false_alarms() -> None:
    # At 0.6: mines 12 (0.2)(0.8) = 1.92; false alarms 16 (0.8)(0.2)^2 = 0.512.
    assert likelihood_ratio(0.6) == pytest.approx(1.92 / 0.512)
    assert likelihood_ratio(0.3) == 0.0
    assert likelihood_ratio(0.8) == math.inf
    assert likelihood_ratio(0.0) == likelihood_ratio(1.0) == 0.0


@pytest.mark.parametrize(("mines", "false"), [(60, 0), (60, 60), (20, 200), (0, 40)])
def test_as_many_are_expected_to_be_mines_as_are(mines: int, false: int) -> None:
    rng = np.random.default_rng(5)
    objects = Objects()
    scores = [*(0.5 + 0.5 * rng.beta(2, 2, mines)), *(0.75 * rng.beta(2, 3, false))]
    for place, score in enumerate(scores):
        objects.hear(10.0 * place, 0.0, 0.0, float(score))
    assert len(objects) == mines + false
    assert objects.mines == pytest.approx(mines, abs=4.0)


def test_nothing_heard_is_no_mine() -> None:
    assert (len(Objects()), Objects().mines) == (0, 0.0)
