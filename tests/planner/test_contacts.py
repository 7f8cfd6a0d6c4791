"""Contacts joined to objects: of whom a contact is, and how likely that is a mine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.contacts import LEAST_GATE_M, Objects, ObjectsOnMap, likelihood_ratio, surer_by


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
    farther = Objects()
    farther.hear(0.0, 0.0, 3.0, 0.8)
    farther.hear(15.1, 0.0, 4.0, 0.8)
    assert len(farther) == 2


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


def test_what_was_heard_before_is_not_heard_again() -> None:
    objects = Objects()
    assert objects.hear(0.0, 0.0, 1.0, 0.8, ("primary", 1))
    assert not objects.hear(0.0, 0.0, 1.0, 0.8, ("primary", 1))
    assert objects.hear(0.0, 0.0, 1.0, 0.8, ("helper", 1))
    assert objects.seen().contacts.tolist() == [2.0]


def test_it_is_told_from_where_an_object_was_seen() -> None:
    objects = Objects()
    objects.hear(0.0, 0.0, 1.0, 0.8)
    objects.hear(100.0, 0.0, 1.0, 0.8, across=True)
    objects.hear(0.5, 0.0, 1.0, 0.8, across=True)
    seen = objects.seen()
    assert dict(zip(seen.x_m.tolist(), zip(seen.along.tolist(), seen.across.tolist(), strict=True), strict=True)) == {
        0.25: (True, True),
        100.0: (False, True),
    }


@pytest.mark.parametrize(
    ("mines", "clutter", "alarms"), [(60, 0, 0), (60, 60, 0), (60, 0, 100), (20, 60, 100), (0, 40, 40)]
)
def test_as_many_are_expected_to_be_mines_as_are(mines: int, clutter: int, alarms: int) -> None:
    """In a world as it is taken for: each is passed by looks that see 1.2 nats in all."""
    rng, objects, found = np.random.default_rng(5), Objects(), 0
    for place in range(mines + clutter + alarms):
        is_mine = place < mines
        often = rng.poisson(1.2) if place < mines + clutter else 1
        found += is_mine and often > 0
        for _ in range(often):
            score = 0.5 + 0.5 * rng.beta(2, 2) if is_mine else 0.75 * rng.beta(2, 3)
            objects.hear(10.0 * place, 0.0, 0.0, float(score))
    seen = objects.seen()
    chances = seen.chances(np.full(seen.x_m.shape, 1.2))
    assert chances.sum(axis=1) == pytest.approx(1.0)
    assert chances[:, 0].sum() == pytest.approx(found, abs=4.0)


def test_who_is_looked_at_and_not_seen_again_is_less_likely_to_lie_there() -> None:
    objects = Objects()
    for place in range(60):
        objects.hear(10.0 * place, 0.0, 0.0, 0.6)
        if place % 6 == 0:
            objects.hear(10.0 * place, 0.0, 0.0, 0.6)
    seen = objects.seen()
    once = seen.contacts == 1
    poorly, well = seen.chances(np.full(60, 0.3)), seen.chances(np.where(once, 3.0, 0.3))
    assert well[once, 2].mean() > poorly[once, 2].mean() + 0.2
    assert (poorly[~once, 2] < 0.05).all()


def test_what_objects_are_is_worked_out_once_until_there_is_news() -> None:
    objects = ObjectsOnMap()
    objects.hear(0.0, 0.0, 0.0, 0.6)
    seen, chances = objects.known()
    assert chances.tolist() == seen.chances(np.zeros(1)).tolist()
    assert objects.known()[1] is chances
    objects.hear(50.0, 0.0, 0.0, 0.7)
    seen, chances = objects.known()
    assert seen.x_m.tolist() == [0.0, 50.0]
    assert objects.mines == pytest.approx(seen.chances(np.zeros(2))[:, 0].sum())


def test_an_alarm_is_raised_again_once_in_a_thousand_times() -> None:
    objects = Objects()
    for place, often in enumerate((1, 1, 1, 2, 2)):
        for _ in range(often):
            objects.hear(10.0 * place, 0.0, 0.0, 0.6)
    chances = objects.seen().chances(np.full(5, 0.4))
    # Who lies there is seen twice, and not once, 0.4 / 2 times as often.
    alarms_to_clutter = chances[:, 2] / chances[:, 1]
    assert alarms_to_clutter[3] == pytest.approx(alarms_to_clutter[0] * 0.001 / 0.2)


def test_nothing_heard_is_no_mine() -> None:
    objects = Objects()
    assert len(objects) == 0
    assert objects.seen().chances(np.zeros(0)).shape == (0, 3)


def test_a_look_at_what_is_sure_makes_nothing_surer() -> None:
    sure = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0]])
    assert surer_by(sure, 2.0)[:3] == pytest.approx(0.0, abs=1e-9)
    assert surer_by(sure, 0.0) == pytest.approx(0.0, abs=1e-9)  # nor one that sees nothing


def test_a_look_that_sees_all_tells_mines_from_nothing() -> None:
    # A half chance has a variance of 0.25; where the other half is nothing, to see it or not tells all.
    assert surer_by(np.array([[0.5, 0.0, 0.5]]), 40.0) == pytest.approx(0.25)
    # Who sees half of them and sees nothing, as in 3 of 4 cases, still takes it for a mine with 1 / 3: what is left of
    # the variance is 3 / 4 times 1 / 3 times 2 / 3.
    assert surer_by(np.array([[0.5, 0.0, 0.5]]), math.log(2)) == pytest.approx(0.25 - 3 / 4 * 1 / 3 * 2 / 3)
    # Where it is clutter its score must tell: by the overlap of the two densities less is learned.
    (by_score,) = surer_by(np.array([[0.5, 0.5, 0.0]]), 40.0)
    assert 0.15 < by_score < 0.25


@given(
    parts=st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3).filter(lambda some: sum(some) > 0.01),
    nats=st.floats(0.0, 6.0),
    more=st.floats(0.0, 3.0),
)
def test_a_better_look_makes_it_no_less_sure_and_none_more_than_it_can(
    parts: list[float], nats: float, more: float
) -> None:
    chances = np.array([parts]) / sum(parts)
    (by,), (by_more,) = surer_by(chances, nats), surer_by(chances, nats + more)
    mine = chances[0, 0]
    assert 0.0 <= by <= by_more + 1e-9
    assert by_more <= mine * (1.0 - mine) + 1e-9
