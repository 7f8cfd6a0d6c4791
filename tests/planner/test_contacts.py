"""Contacts joined to objects: of whom a contact is, and how likely that is a mine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from told_tile import whole_map

from planner.contacts import (
    LISTED_FROM,
    Objects,
    ObjectsOnMap,
    Sighting,
    are_listed,
    likelihood_ratio,
    surer_by,
)
from planner.fleet_map import FleetMap
from planner.risk import NATS_PER_LEVEL
from planner.types import GridSpec, SweepFrame


def count(objects: Objects) -> int:
    """How many objects there are."""
    return len(objects.seen().x_m)


def test_a_contact_near_another_is_of_the_same_object_and_one_farther_off_is_not() -> None:
    objects = Objects()
    objects.hear(Sighting("primary", 100.0, 100.0, 0.0, 0.8))
    objects.hear(Sighting("primary", 102.0, 100.0, 0.0, 0.7))
    assert count(objects) == 1
    objects.hear(Sighting("primary", 101.0, 102.1, 0.0, 0.7))
    assert count(objects) == 2


def test_what_two_vehicles_know_less_well_may_lie_farther_apart() -> None:
    objects = Objects()
    objects.hear(Sighting("helper", 0.0, 0.0, 3.0, 0.8))
    objects.hear(Sighting("primary", 15.0, 0.0, 4.0, 0.8))  # 3 times 5 m
    assert count(objects) == 1
    objects.hear(Sighting("primary", 60.0, 0.0, 4.0, 0.8))
    assert count(objects) == 2
    farther = Objects()
    farther.hear(Sighting("helper", 0.0, 0.0, 3.0, 0.8))
    farther.hear(Sighting("primary", 15.4, 0.0, 4.0, 0.8))
    assert count(farther) == 2


def test_a_vehicle_is_off_by_as_much_as_it_was_but_for_its_drift() -> None:
    for apart_m, later_sigma_m, found in ((2.0, 9.0, 1), (2.1, 9.0, 2), (5.9, 11.0, 1), (6.1, 11.0, 2), (5.9, 7.0, 1)):
        objects = Objects()
        objects.hear(Sighting("primary", 0.0, 0.0, 9.0, 0.8))
        objects.hear(Sighting("primary", apart_m, 0.0, later_sigma_m, 0.8))
        assert count(objects) == found, apart_m


def test_a_vehicle_has_an_object_where_and_as_its_contacts_of_it_are_on_average() -> None:
    for last_m, found in ((5.4, 1), (5.6, 2)):  # at 1 m, told to 10 m: 1.5 m of drift since
        objects = Objects()
        for x_m, sigma_m in ((0.0, 9.0), (2.0, 11.0), (last_m, 11.5)):
            objects.hear(Sighting("primary", x_m, 0.0, sigma_m, 0.8))
        assert count(objects) == found, last_m


def test_an_object_lies_as_surely_as_who_of_those_that_saw_it_knows_its_place_best() -> None:
    objects = Objects()
    # The second joins the first's object by what it may be off; the third, 10 m off, knows its place as the first does.
    for name, x_m, sigma_m in (("helper", 0.0, 0.0), ("second", 5.0, 10.0), ("third", 10.0, 0.0)):
        objects.hear(Sighting(name, x_m, 0.0, sigma_m, 0.8))
    assert sorted(objects.seen().contacts.tolist()) == [1.0, 2.0]


def test_what_one_vehicle_has_told_apart_another_does_not_join() -> None:
    objects = Objects()
    objects.hear(Sighting("helper", 0.0, 0.0, 0.0, 0.8))
    for x_m in (-11.0, 11.0):  # both within 3 times 5 m
        objects.hear(Sighting("primary", x_m, 0.0, 5.0, 0.8))
    seen = objects.seen()
    assert sorted(seen.contacts.tolist()) == [1.0, 2.0]


def test_who_knows_nothing_of_its_place_joins_no_more_than_what_is_near() -> None:
    objects = Objects()
    objects.hear(Sighting("primary", 0.0, 0.0, 1e9, 0.8))
    objects.hear(Sighting("helper", 60.0, 0.0, 0.0, 0.8))
    assert count(objects) == 1
    assert objects.seen().x_m == pytest.approx([60.0])  # the helper is as good as certain
    objects = Objects()
    objects.hear(Sighting("primary", -0.1, 0.0, 1e9, 0.8))
    objects.hear(Sighting("helper", 60.0, 0.0, 0.0, 0.8))
    assert count(objects) == 2


@pytest.mark.parametrize(("east_m", "north_m"), [(56.9, 0), (-56.9, 0), (0, 56.9), (0, -56.9), (40, -40), (-40, 40)])
def test_an_object_is_found_from_wherever_it_is_within_reach(east_m: float, north_m: float) -> None:
    for times, found in ((1.0, 1), (1.1, 2)):
        objects = Objects()
        objects.hear(Sighting("primary", 10.0, -10.0, 0.0, 0.8))
        objects.hear(Sighting("helper", 10.0 + times * east_m, -10.0 + times * north_m, 20.0, 0.8))
        assert count(objects) == found


@pytest.mark.parametrize("turned", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_an_object_is_found_again_however_far_it_lies_from_where_the_vehicle_has_drifted(
    turned: tuple[int, int],
) -> None:
    objects = Objects()
    for name, away_m, sigma_m in (("helper", 60.1, 0.0), ("primary", 3.2, 20.0), ("primary", -53.7, 40.0)):
        objects.hear(Sighting(name, turned[0] * away_m, turned[1] * away_m, sigma_m, 0.8))
    assert count(objects) == 1


def test_an_object_lies_at_the_mean_of_its_contacts_each_by_how_sure_it_is() -> None:
    objects = Objects()
    for x_m, y_m, score in ((0.0, 0.0, 0.6), (1.2, -0.6, 0.55)):
        objects.hear(Sighting("primary", x_m, y_m, 0.0, score))
    seen = objects.seen()
    assert (seen.x_m.tolist(), seen.y_m.tolist()) == (pytest.approx([0.6]), pytest.approx([-0.3]))
    objects.hear(Sighting("helper", 1.0, 0.5, 0.2, 0.7))  # to a decimetre and to two of them: as 4 to 1
    seen = objects.seen()
    assert seen.x_m == pytest.approx([0.6 + 0.4 / 9], abs=0.02)
    assert seen.y_m == pytest.approx([-0.3 + 0.8 / 9], abs=0.02)
    assert (seen.sigma_m.tolist(), seen.contacts.tolist()) == ([0.2], [3.0])
    ratios = (12 * s * (1 - s) / (16 * o * (1 - o) ** 2) for s, o in ((0.2, 0.8), (0.1, 11 / 15), (0.4, 14 / 15)))
    assert seen.log_ratio == pytest.approx([sum(map(math.log, ratios))])


def test_contacts_of_vehicles_that_are_off_are_laid_over_each_other() -> None:
    """Some 12 m apart, told up to 21 m off: what more than one has seen tells how far."""
    rng = np.random.default_rng(3)
    places = 12.0 * np.array([(row, column) for row in range(12) for column in range(12)], dtype=float)
    places = (places + rng.uniform(-4.0, 4.0, places.shape))[rng.random(len(places)) < 0.6]
    off_m = {"primary": (14.0, -15.0), "helper": (0.0, 9.9), "second": (-3.0, 0.0)}
    objects, seen_by_any = Objects(), set()
    for name, (east_m, north_m) in off_m.items():
        for place in np.flatnonzero(rng.random(len(places)) < 0.6).tolist():
            seen_by_any.add(place)
            x_m, y_m = (places[place] + (east_m, north_m)).tolist()
            objects.hear(Sighting(name, x_m, y_m, 20.0 if name == "primary" else 10.0, 0.8))
    seen = objects.seen()
    assert len(seen.x_m) == len(seen_by_any)
    found = np.stack([seen.x_m, seen.y_m], axis=1) - off_m["helper"]  # who knows its place best, and first by its name
    apart_m = np.hypot(*(found[:, np.newaxis] - places[sorted(seen_by_any)]).T)
    assert apart_m.min(axis=0).max() < 0.1


def test_of_two_just_as_near_a_contact_is_of_the_one_heard_of_first() -> None:
    objects = Objects()
    for x_m in (1.0, 5.0, 3.0):
        objects.hear(Sighting("primary", x_m, 0.0, 0.5, 0.8))
    seen = objects.seen()
    assert dict(zip(seen.x_m.tolist(), seen.contacts.tolist(), strict=True)) == {2.0: 2.0, 5.0: 1.0}


def test_objects_are_told_by_place_from_west_to_east_and_south_to_north() -> None:
    objects = Objects()
    for x_m, y_m in ((50.0, 0.0), (-50.0, 0.0), (-50.0, -40.0), (10.0, 90.0), (10.0, -90.0)):
        objects.hear(Sighting("primary", x_m, y_m, 0.0, 0.8))
    seen = objects.seen()
    assert list(zip(seen.x_m.tolist(), seen.y_m.tolist(), strict=True)) == [
        *((-50.0, -40.0), (-50.0, 0.0), (10.0, -90.0), (10.0, 90.0), (50.0, 0.0)),
    ]


def test_a_score_that_only_a_mine_has_or_none_is_as_good_as_sure() -> None:
    objects = Objects()
    for x_m, scores in ((0.0, [0.8]), (50.0, [0.3]), (100.0, [0.8, 0.8, 0.3])):
        for score in scores:
            objects.hear(Sighting("primary", x_m, 0.0, 0.3, score))
    seen = objects.seen()
    assert seen.log_ratio.tolist() == [50.0, -50.0, 50.0]
    assert seen.along.all()
    assert not seen.across.any()


def test_an_object_lies_within_three_deviations_and_within_2_to_60_m() -> None:
    objects = Objects()
    for place, sigma_m in enumerate((0.1, 5.0, 30.0)):
        objects.hear(Sighting("primary", 200.0 * place, 0.0, sigma_m, 0.8))
    assert objects.seen().gate_m.tolist() == [2.0, 15.0, 60.0]


def test_the_nearest_is_taken() -> None:
    objects = Objects()
    objects.hear(Sighting("primary", 0.0, 0.0, 0.0, 0.8))
    objects.hear(Sighting("primary", 10.0, 0.0, 0.0, 0.8))
    objects.hear(Sighting("helper", 6.0, 0.0, 3.0, 0.8))  # within reach of both, nearer to the second
    seen = objects.seen()
    assert dict(zip(seen.x_m.round().tolist(), seen.contacts.tolist(), strict=True)) == {0.0: 1.0, 10.0: 2.0}


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
        objects.hear(Sighting("primary", 5.0 * x, 5.0 * y, 0.3, 0.9))
    assert count(objects) == len(places)


def test_a_ratio_is_that_of_the_densities_of_mines_and_of_false_alarms() -> None:
    # At 0.6: mines 12 (0.2)(0.8) = 1.92; false alarms 16 (0.8)(0.2)^2 = 0.512.
    assert likelihood_ratio(0.6) == pytest.approx(1.92 / 0.512)
    assert likelihood_ratio(0.3) == 0.0
    assert likelihood_ratio(0.8) == math.inf
    assert likelihood_ratio(0.0) == 0.0
    assert likelihood_ratio(1.0) == math.inf  # who is surest of a mine has it taken for one
    # Mines score above 0.5, false alarms below 0.75.
    assert likelihood_ratio(0.5) == 0.0
    assert likelihood_ratio(0.75) == math.inf
    over = 0.74 / 0.75
    assert likelihood_ratio(0.74) == pytest.approx(12 * 0.48 * 0.52 / (16 * over * (1 - over) ** 2))


def test_what_was_heard_before_is_not_heard_again() -> None:
    objects = Objects()
    assert objects.hear(Sighting("primary", 0.0, 0.0, 1.0, 0.8), ("primary", 1))
    assert not objects.hear(Sighting("primary", 0.0, 0.0, 1.0, 0.8), ("primary", 1))
    assert objects.hear(Sighting("helper", 0.0, 0.0, 1.0, 0.8), ("helper", 1))
    assert objects.seen().contacts.tolist() == [2.0]


def test_it_is_told_from_where_an_object_was_seen() -> None:
    objects = Objects()
    objects.hear(Sighting("primary", 0.0, 0.0, 1.0, 0.8))
    objects.hear(Sighting("primary", 100.0, 0.0, 1.0, 0.8, across=True))
    objects.hear(Sighting("primary", 0.5, 0.0, 1.0, 0.8, across=True))
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
            objects.hear(Sighting("primary", 10.0 * place, 0.0, 0.0, float(score)))
    seen = objects.seen()
    chances = seen.chances(np.full(seen.x_m.shape, 1.2))
    assert chances.sum(axis=1) == pytest.approx(1.0)
    assert chances[:, 0].sum() == pytest.approx(found, abs=4.0)


def test_who_is_looked_at_and_not_seen_again_is_less_likely_to_lie_there() -> None:
    objects = Objects()
    for place in range(60):
        objects.hear(Sighting("primary", 10.0 * place, 0.0, 0.0, 0.6))
        if place % 6 == 0:
            objects.hear(Sighting("primary", 10.0 * place, 0.0, 0.0, 0.6))
    seen = objects.seen()
    once = seen.contacts == 1
    poorly, well = seen.chances(np.full(60, 0.3)), seen.chances(np.where(once, 3.0, 0.3))
    assert well[once, 2].mean() > poorly[once, 2].mean() + 0.2
    assert (poorly[~once, 2] < 0.05).all()


def test_what_objects_are_is_worked_out_once_until_there_is_news() -> None:
    objects = ObjectsOnMap()
    objects.hear(Sighting("primary", 0.0, 0.0, 0.0, 0.6))
    seen, chances = objects.known()
    assert chances.tolist() == seen.chances(np.zeros(1)).tolist()
    assert objects.known()[1] is chances
    objects.hear(Sighting("primary", 50.0, 0.0, 0.0, 0.7))
    seen, chances = objects.known()
    assert seen.x_m.tolist() == [0.0, 50.0]
    assert (seen.along.tolist(), seen.across.tolist()) == ([True, True], [False, False])
    assert objects.mines == pytest.approx(seen.chances(np.zeros(2))[:, 0].sum())


def test_an_alarm_is_raised_again_once_in_a_thousand_times() -> None:
    objects = Objects()
    for place, often in enumerate((1, 1, 1, 2, 2)):
        for _ in range(often):
            objects.hear(Sighting("primary", 10.0 * place, 0.0, 0.0, 0.6))
    chances = objects.seen().chances(np.full(5, 0.4))
    # Who lies there is seen twice, and not once, 0.4 / 2 times as often.
    alarms_to_clutter = chances[:, 2] / chances[:, 1]
    assert alarms_to_clutter[3] == pytest.approx(alarms_to_clutter[0] * 0.001 / 0.2)


@settings(max_examples=40)
@given(
    heard=st.lists(
        st.lists(st.sampled_from([0.4, 0.55, 0.6, 0.7, 0.8]), min_size=1, max_size=4), min_size=1, max_size=6
    ),
    nats=st.lists(st.sampled_from([0.0, 0.2, 1.1, 4.0]), min_size=6, max_size=6),
)
def test_chances_are_those_under_which_what_was_heard_is_likeliest(heard: list[list[float]], nats: list[float]) -> None:
    """By Bayes' rule for each, and the shares from all of them, again and again."""
    objects, likely = Objects(), []
    for place, (scores, seen_nats) in enumerate(zip(heard, nats, strict=False)):
        for score in scores:
            objects.hear(Sighting("primary", 50.0 * place, 0.0, 0.0, score))
        often, mean = len(scores), max(seen_nats, 1e-3)
        seen_so_often = mean**often * math.exp(-mean) / math.factorial(often) / (1.0 - math.exp(-mean))
        logs = [math.log(ratio) if 0.0 < (ratio := likelihood_ratio(one)) < math.inf else 0.0 for one in scores]
        sure = 50.0 * (scores.count(0.8) - scores.count(0.4))
        ratio = math.exp(min(max(sum(logs) + sure, -50.0), 50.0))
        likely.append([seen_so_often * ratio, seen_so_often, 0.001 ** (often - 1)])
    shares = [1 / 3] * 3
    for _ in range(200):
        weighed = [[one * share for one, share in zip(row, shares, strict=True)] for row in likely]
        found = [[one / sum(row) for one in row] for row in weighed]
        shares = [(sum(column) + 1.0) / (len(found) + 3.0) for column in zip(*found, strict=True)]
    told = objects.seen().chances(np.array(nats[: len(heard)]))
    assert told == pytest.approx(np.array(found), rel=1e-6, abs=1e-12)


def test_what_objects_are_goes_by_what_the_map_has_seen_at_their_places_so_far() -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 10.0, columns=3, rows=2))
    objects = ObjectsOnMap()
    objects.hear(Sighting("primary", 5.0, 15.0, 0.0, 0.6), ("primary", 1))
    objects.hear(Sighting("primary", 25.0, 5.0, 0.0, 0.6))
    objects.hear(Sighting("primary", 25.0, 5.0, 0.0, 0.7))
    assert len(objects.known()[0].x_m) == 2
    unseen = objects.known()[1]
    objects.hear(Sighting("primary", 25.0, 5.0, 0.0, 0.7), ("primary", 1))
    assert objects.known()[1] is unseen
    objects.map = fleet
    assert objects.known()[1] is not unseen
    assert objects.known()[1].tolist() == unseen.tolist()
    levels = np.arange(10, 70, 10, dtype=np.uint8).reshape(2, 3)
    fleet.join("primary", 0, whole_map(levels, levels))
    seen, chances = objects.known()
    nats = fleet.nats_at(seen.x_m, seen.y_m)
    assert nats == pytest.approx(NATS_PER_LEVEL * np.array([40.0, 30.0]))
    assert chances.tolist() == seen.chances(nats).tolist() != unseen.tolist()
    assert objects.known()[1] is chances
    assert objects.mines == pytest.approx(chances[0, 0] + chances[1, 0])


def test_what_is_seen_hundreds_of_times_where_next_to_nothing_was_looked_at_still_is_something() -> None:
    objects = Objects()
    for _ in range(300):
        objects.hear(Sighting("primary", 0.0, 0.0, 0.0, 0.6))
    assert objects.seen().chances(np.zeros(1))[0] == pytest.approx([0.0, 0.0, 1.0])


def test_what_is_as_likely_a_mine_as_not_is_listed_and_that_of_which_nothing_is_known_is_not() -> None:
    assert 1 / 3 < LISTED_FROM < 0.5
    assert are_listed(np.array([0.349, 0.351])).tolist() == [False, True]
    nearly = LISTED_FROM - 1e-12  # what another processor may make of just as much
    assert are_listed(np.array([0.3333, 0.349999, nearly, LISTED_FROM, 0.5])).tolist() == [
        False,
        False,
        True,
        True,
        True,
    ]


def test_nothing_heard_is_no_mine() -> None:
    objects = Objects()
    assert count(objects) == 0
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


def test_what_is_learned_is_the_variance_of_what_is_believed_after_a_look() -> None:
    mine, clutter, nothing, sees = 0.5, 0.3, 0.2, 0.6
    scores = np.arange(0.025, 1.0, 0.05)  # as many as are told apart
    up, over = np.clip(2 * scores - 1, 0, 1), np.clip(scores / 0.75, 0, 1)
    of_mines, of_others = 12 * up * (1 - up), 16 * over * (1 - over) ** 2
    of_mines, of_others = of_mines / of_mines.sum(), of_others / of_others.sum()
    found = [(mine * sees * one, clutter * sees * other) for one, other in zip(of_mines, of_others, strict=True)]
    found.append((mine * 0.4, clutter * 0.4 + nothing))
    expected = sum((one + other) * (one / (one + other) - mine) ** 2 for one, other in found if one + other > 0.0)
    chances = np.array([[mine, clutter, nothing], [nothing, mine, clutter]])
    by = surer_by(chances, np.array([-math.log(1 - sees), 0.0]))
    assert by == pytest.approx([expected, 0.0], abs=1e-9)


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
