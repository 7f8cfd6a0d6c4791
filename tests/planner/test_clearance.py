"""How many mines may be left: by hand, against another library's distribution, and as often right as it says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from told_tile import whole_map

from planner.clearance import (
    CAUTIOUS_MINES,
    MOST_SCATTER,
    PRIOR_MINES,
    UNKNOWN_SCATTER,
    Detected,
    MinesLeft,
    mines_left,
    mines_left_by,
    scatter_of,
    scatter_of_all,
)
from planner.contacts import LISTED_FROM, ObjectsOnMap, Sighting
from planner.fleet_map import FleetMap
from planner.risk import to_levels
from planner.types import DetectionCurve, GridSpec, SweepFrame

CELL_M2 = 25.0
ALL = np.ones((8, 10), dtype=np.bool_)


def surely(found: float, unlisted: Sequence[float] = (), there: Sequence[float] | float = 1.0) -> Detected:
    """So many mines that are listed: all for certain, but for one of which a part is expected; and others."""
    whole = math.floor(found)
    listed = [1.0] * whole + [found - whole] * (found > whole)
    mines, is_listed = np.array([*listed, *unlisted]), np.arange(len(listed) + len(unlisted)) < len(listed)
    return Detected(mines, is_listed, there if isinstance(there, float) else np.array(there))


def all_listed(chances: Sequence[float]) -> Detected:
    mines = np.array(chances, dtype=np.float64)
    return Detected(mines, np.ones(mines.shape, dtype=np.bool_))


def left_of(risk: float | np.ndarray, found: float, scatter: float = 0.0, place: np.ndarray = ALL) -> MinesLeft:
    told = mines_left(np.broadcast_to(risk, ALL.shape).astype(np.float64), ALL, place, CELL_M2, surely(found), scatter)
    assert told is not None
    return told


def with_objects(fleet: FleetMap, mines: int, doubtful: int = 0) -> ObjectsOnMap:
    """So many mines for certain, side by side on the southernmost row, and so many objects of which some may be one."""
    objects = ObjectsOnMap(fleet)
    for number in range(mines + doubtful):
        objects.hear(Sighting("one", 2.5 * number, 1.0, 0.0, 1.0 if number < mines else 0.51))
    return objects


def negative_binomial(mines: float, chance: float) -> Any:
    from scipy.stats import nbinom  # it takes half a second to import

    return nbinom(mines, chance)


def test_of_an_area_that_is_half_seen_about_as_many_are_left_as_were_found() -> None:
    told = left_of(0.5, 20)
    assert told.mean == pytest.approx(20.5)
    assert told.none == pytest.approx(0.5**20.5)
    assert told.clearance == pytest.approx(0.5)
    assert told == left_of(0.5, 20) != left_of(0.5, 21)
    assert told.found == 20.0
    assert "ed=" not in repr(told)  # hundreds of numbers are `reached` or `listed`


@pytest.mark.parametrize(("risk", "found"), [(0.2, 40), (0.5, 3), (0.05, 0), (0.9, 12), (0.01, 200), (0.001, 1e6)])
def test_it_is_the_negative_binomial_distribution_of_scipy(risk: float, found: float) -> None:
    told, true = left_of(risk, found), negative_binomial(found + PRIOR_MINES, 1.0 - risk)
    assert (told.low, told.high) == (true.ppf(0.05), true.ppf(0.95))
    assert told.none == pytest.approx(true.pmf(0))
    assert told.mean == pytest.approx(true.mean())


@pytest.mark.parametrize("found", [0, 1, 12])
def test_with_one_mine_more_more_may_be_left(found: float) -> None:
    told = mines_left(np.full(ALL.shape, 0.5), ALL, ALL, CELL_M2, surely(found), 0.0, prior_mines=CAUTIOUS_MINES)
    assert told is not None
    true = negative_binomial(found + 1, 0.5)
    assert (told.none, told.mean, told.high) == pytest.approx((true.pmf(0), true.mean(), true.ppf(0.95)))
    assert told.none < left_of(0.5, found).none


@pytest.mark.parametrize(("found", "scatter"), [(12, 0.1), (12, 0.3), (12, 0.9), (400, 0.3), (130, 0.6)])
def test_with_scatter_it_is_an_integral_over_how_much_was_seen(found: int, scatter: float) -> None:
    west = np.broadcast_to(np.arange(10) < 3, ALL.shape)
    told = left_of(np.where(west, 0.6, 0.2), found, scatter, place=west)
    mean, clearance, numbers = 0.0, 0.0, np.arange(6000)
    reached = np.zeros(numbers.size)
    normal = np.linspace(-7.0, 7.0, 141)
    weights = np.exp(-(normal**2) / 2)
    for node, share in zip(normal, weights / weights.sum(), strict=True):
        exponent = math.exp(scatter * node - scatter**2 / 2)
        here, elsewhere = 0.6**exponent, 0.2**exponent
        mines = found + PRIOR_MINES
        expected = mines * 3 * here / (3 * (1 - here) + 7 * (1 - elsewhere))
        mean += share * expected
        clearance += share * (1 - here)
        reached += share * negative_binomial(mines, mines / (mines + expected)).cdf(numbers)
    assert told.mean == pytest.approx(mean, rel=1e-6)
    assert told.clearance == pytest.approx(clearance, rel=1e-6)
    assert told.none == pytest.approx(reached[0], rel=1e-3, abs=1e-9)
    assert told.reached == pytest.approx(reached[: told.reached.size], abs=2e-3)
    assert [told.low, told.high] == pytest.approx(np.searchsorted(reached, [0.05, 0.95]), abs=0.01 * told.high)


@pytest.mark.parametrize("scatter", [0.0, 0.3, 0.5, 0.9])
def test_the_mean_is_that_of_the_chances(scatter: float) -> None:
    told = left_of(0.4, 12, scatter)
    assert told.mean == pytest.approx((1.0 - told.reached).sum())
    assert 0.0 < told.clearance < 1.0


def test_of_a_place_without_a_cell_nothing_is_left() -> None:
    told = left_of(0.5, 12, 0.1, place=~ALL)
    assert (told.mean, told.low, told.high) == (0.0, 0, 0)
    assert [told.none, told.clearance, told.chance_of_clearance(1.0), told.clearance_with(0.9)] == pytest.approx(
        [1.0] * 4
    )


def test_of_a_place_that_is_partly_seen_for_certain_the_rest_is_left() -> None:
    risk = np.where(np.arange(10) < 3, 0.0, 0.5)
    half = left_of(np.full(ALL.shape, 0.5), 12, 0.5)
    assert left_of(risk, 12, 0.5).none > half.none > 0.0
    assert left_of(risk, 12, 1.0).reached[-1] == pytest.approx(1.0)


def test_no_more_numbers_of_mines_are_told_of_than_count() -> None:
    assert 40 < left_of(0.5, 3).reached.size < 100


def test_of_an_area_of_which_a_hundredth_of_a_square_metre_was_seen_something_can_be_said() -> None:
    one = np.zeros(ALL.shape, dtype=np.bool_)
    one[2, 3] = True
    told = mines_left(np.full(ALL.shape, 0.9), one, one, 0.1, surely(2), 0.0)
    assert told is not None
    assert told.mean == pytest.approx(2.5 * 9)


def test_what_was_found_elsewhere_tells_of_a_place_and_a_place_well_seen_is_cleared() -> None:
    risk = np.full(ALL.shape, 0.5)
    risk[:, :2] = 0.0
    risk[:, 2:4] = 1.0
    west = np.zeros(ALL.shape, dtype=np.bool_)
    west[:, :2] = True
    unseen = np.roll(west, 2, axis=1)
    assert (left_of(risk, 9, place=west).high, left_of(risk, 9, place=west).none) == (0, 1.0)
    # Of 10 columns 2 are seen wholly and 6 half, 5 columns' worth: 9.5 mines in 5 columns are 3.8 in 2.
    assert left_of(risk, 9, place=unseen).mean == pytest.approx(3.8)
    assert left_of(risk, 9, place=unseen).clearance == 0.0


def test_a_place_may_be_smaller_than_a_square_metre() -> None:
    one = np.zeros(ALL.shape, dtype=np.bool_)
    one[0, 0] = True
    told = mines_left(np.full(ALL.shape, 0.25), ALL, one, 0.5, surely(7.5), 0.0)
    assert told is not None
    assert told.clearance == pytest.approx(0.75)
    assert told.mean == pytest.approx(8.0 / 80 / 3)


def test_where_mines_lie_denser_more_are_left() -> None:
    weights = np.ones(ALL.shape)
    weights[:, :5] = 3.0
    west = np.zeros(ALL.shape, dtype=np.bool_)
    west[:, :5] = True
    told = mines_left(np.full(ALL.shape, 0.5), ALL, west, CELL_M2, surely(7.5), 0.0, weights)
    assert told is not None
    assert told.mean == pytest.approx(8.0 * 3 / 4)


def test_with_more_scatter_steadily_more_are_left() -> None:
    scatters = np.arange(0.0, 1.0, 0.001)
    steps = np.array([left_of(0.2, 24, scatter).mean for scatter in scatters])
    assert (np.diff(steps) > 0.0).all()
    normal = np.linspace(-8.0, 8.0, 4001)
    for scatter in (0.0, 0.3, 0.312, 0.6):
        missed = 0.2 ** np.exp(scatter * normal - scatter**2 / 2)
        weights = np.exp(-(normal**2) / 2)
        expected = 24.5 * np.average(missed / (1.0 - missed), weights=weights)
        assert steps[np.isclose(scatters, scatter)] == pytest.approx(expected, rel=1e-4)


def test_so_many_mines_and_more_are_told_as_one_number() -> None:
    """Where they may be 100,000 and more: nothing is lost of the chance that there are."""
    told = left_of(0.999, 304, 0.3)
    assert told.mean > 3e5
    assert (told.low, told.high) == (100_000, 100_000)
    assert told.reached[-1] == pytest.approx(1.0)
    assert left_of(0.995, 304, 0.3).low < left_of(0.997, 304, 0.3).low < 100_000


@pytest.mark.parametrize(("risk", "found"), [(0.2, 40), (0.5, 3), (0.05, 0)])
def test_of_mines_that_are_found_for_certain_so_many_may_be_left_for_a_clearance(risk: float, found: int) -> None:
    told, true = left_of(risk, found), negative_binomial(found + PRIOR_MINES, 1.0 - risk)
    for share, may_be_left in ((1.0, 0), (0.75, found // 3), (0.5, found), (0.25, 3 * found), (0.003, 332 * found)):
        assert told.chance_of_clearance(share) == pytest.approx(true.cdf(may_be_left))
    for chance in (0.1, 0.5, 0.9):
        most = true.ppf(chance)
        assert told.clearance_with(chance) == pytest.approx(found / (found + most) if most else 1.0)


def test_what_is_likely_a_mine_counts_by_its_chance_for_a_clearance() -> None:
    """Three that are listed, with 0.9985 each: one may be left of 3 for a clearance of 75 %, none of 2 or fewer."""
    told = mines_left(np.full(ALL.shape, 0.2), ALL, ALL, CELL_M2, all_listed([0.9985] * 3), 0.0)
    assert told is not None
    assert told.found == pytest.approx(2.9955)
    all_three = 0.9985**3
    expected = all_three * told.reached[1] + (1.0 - all_three) * told.reached[0]
    assert told.chance_of_clearance(0.75) == pytest.approx(expected)


@given(
    listed=st.lists(st.floats(0.0, 1.0), max_size=6),
    risk=st.floats(0.01, 0.9),
    share=st.floats(0.01, 1.0),
    chance=st.floats(0.01, 0.99),
)
def test_a_clearance_is_that_of_every_number_found_and_left(
    listed: list[float], risk: float, share: float, chance: float
) -> None:
    told = mines_left(np.full(ALL.shape, risk), ALL, ALL, CELL_M2, all_listed(listed), 0.0)
    assert told is not None
    left = np.diff(told.reached, prepend=0.0)
    by_share: dict[float, float] = {}
    for are_mines in product([True, False], repeat=len(listed)):
        likely = math.prod(one if is_mine else 1.0 - one for one, is_mine in zip(listed, are_mines, strict=True))
        for number, is_left in enumerate(left):
            of_all = sum(are_mines) / (sum(are_mines) + number) if number else 1.0
            by_share[of_all] = by_share.get(of_all, 0.0) + likely * is_left
    expected = sum(likely for of_all, likely in by_share.items() if of_all >= share - 1e-12)
    assert told.chance_of_clearance(share) == pytest.approx(expected, abs=1e-9)
    with_chance = told.clearance_with(chance)
    assert with_chance == 0.0 or round(told.chance_of_clearance(with_chance), 9) >= chance
    assert sum(likely for of_all, likely in by_share.items() if of_all >= with_chance - 1e-8) >= chance - 2e-9
    assert sum(likely for of_all, likely in by_share.items() if of_all > with_chance + 1e-8) < chance + 2e-9


def test_a_share_is_told_that_has_its_chance_also_where_it_is_rounded() -> None:
    # One may be left of two found: two thirds, which is less than 0.666666667.
    told = MinesLeft(0.1, 0, 1, 0.5, 0.9, np.array([0.5, 1.0]), np.ones(2))
    assert told.clearance_with(0.9) == 0.666666666
    assert told.chance_of_clearance(0.666666666) == 1.0
    assert told.chance_of_clearance(0.666666667) == 0.5


def test_of_many_objects_the_sum_of_their_chances_is_told() -> None:
    from scipy.stats import binom

    told = mines_left(np.full(ALL.shape, 1e-9), ALL, ALL, CELL_M2, surely(1, [0.01] * 20_000), 0.0)
    assert told is not None
    numbers = np.arange(150, 260)
    assert told.reached[numbers] == pytest.approx(binom(20_000, 0.01).cdf(numbers), abs=1e-6)


@pytest.mark.parametrize("rho", [0.0, 0.5])
@pytest.mark.parametrize("of_a_part", [False, True])
def test_of_a_map_it_is_what_its_cells_tell(rho: float, of_a_part: bool) -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=10, rows=8), rho)
    for number, vehicle in enumerate(("one", "other")):
        levels = np.random.default_rng(number).integers(0, 120, ALL.shape).astype(np.uint8)
        fleet.join(vehicle, 0, whole_map(levels, levels // 2))
    inside = ALL.copy()
    inside[5:, :4] = False  # no object lies there
    west = np.broadcast_to(np.arange(10) < 6, ALL.shape)
    found, place = with_objects(fleet, 20), (inside & west).astype(np.float64) if of_a_part else None
    told = mines_left_by(found, inside, 0.1, place)
    expected = mines_left(fleet.risk, inside, inside & west if of_a_part else inside, CELL_M2, surely(20), 0.1)
    cautious = mines_left_by(found, inside, 0.1, place, CAUTIOUS_MINES)
    assert told is not None
    assert expected is not None
    assert cautious is not None
    assert cautious.mean == pytest.approx(told.mean * 21.0 / 20.5)
    assert told.mean == pytest.approx(expected.mean, rel=1e-3 if rho else 1e-9)
    assert told.clearance == pytest.approx(expected.clearance, rel=1e-3 if rho else 1e-9)
    assert (told.low, told.high) == (expected.low, expected.high)


def test_of_a_place_so_much_of_each_cell_counts_as_lies_there() -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=10, rows=8))
    levels = to_levels(-np.log(np.where(np.arange(10) < 5, 0.25, 0.5) * np.ones(ALL.shape)))
    fleet.join("one", 0, whole_map(levels, levels))
    place = np.zeros(ALL.shape)
    place[0, 0], place[0, 9], place[1, 9] = 0.1, 0.5, 1.0
    told = mines_left_by(with_objects(fleet, 7), ALL, 0.0, place)
    assert told is not None
    # Seen is the worth of 40 cells times 0.75 and 40 times 0.5; left are 0.1 x 0.25 + 1.5 x 0.5 cells.
    assert told.mean == pytest.approx(7.5 * 0.775 / 50.0, rel=1e-2)
    assert told.clearance == pytest.approx((1.6 - 0.775) / 1.6, rel=1e-2)
    # A place may hold what is not in the area's cells, and nobody looked.
    levels = np.zeros_like(levels)
    levels[:, 1:] = 100
    other = FleetMap(fleet.grid)
    other.join("one", 0, whole_map(levels, levels))
    beside = np.zeros(ALL.shape)
    beside[:, 0] = 0.2
    told = mines_left_by(with_objects(other, 7), np.broadcast_to(np.arange(10) > 0, ALL.shape), 0.0, beside)
    assert told is not None
    assert told.clearance == 0.0
    assert told.mean == pytest.approx(7.5 * 1.6 / (72.0 * (1.0 - other.risk[0, 1])))


def test_a_mine_that_is_not_listed_is_left() -> None:
    """What is left is the sum of those not seen and of those not listed, each with its own chance."""
    unlisted, half = [0.3, 0.1, 0.2], np.full(ALL.shape, 0.5)
    told = mines_left(half, ALL, ALL, CELL_M2, surely(5, unlisted), 0.0)
    assert told is not None
    assert told.found == 5.0
    assert told.mean == pytest.approx(6.1 + 0.6)
    # Of 12.2 that lie there, with the prior's half, 6.1 were seen, of which 5.5 count as found.
    assert told.clearance == pytest.approx(5.5 / 12.2)
    # Where one lies a quarter within a place, and the others do not.
    some = mines_left(half, ALL, ALL, CELL_M2, surely(5, unlisted, [1.0] * 5 + [0.25, 0.0, 0.0]), 0.0)
    assert some is not None
    assert some.mean == pytest.approx(6.1 + 0.075)
    assert told.none < some.none < left_of(0.5, 5.6).none
    # The chance that a mine has been found does not hang on what happens to lie there.
    assert some.clearance == told.clearance


@pytest.mark.parametrize(
    ("listed", "unlisted", "risk"),
    [([0.6] * 40, [], 0.33), ([0.6] * 40, [0.1] * 100, 0.33), ([0.4] * 60, [], 0.5), ([0.7] * 10, [0.1] * 30, 0.2)],
)
def test_that_it_is_not_sure_what_is_a_mine_makes_the_interval_wider(
    listed: list[float], unlisted: list[float], risk: float
) -> None:
    chances, rng = np.array([*listed, *unlisted]), np.random.default_rng(5)
    told = mines_left(
        np.full(ALL.shape, risk), ALL, ALL, CELL_M2, Detected(chances, np.arange(chances.size) < len(listed)), 0.0
    )
    assert told is not None
    are_mines = rng.random((40_000, chances.size)) < chances
    unseen = rng.poisson(rng.gamma(are_mines.sum(axis=1) + PRIOR_MINES) * risk / (1.0 - risk))
    left = unseen + are_mines[:, len(listed) :].sum(axis=1)
    assert told.mean == pytest.approx(left.mean(), rel=0.01)
    assert math.sqrt((np.arange(told.reached.size) ** 2 * np.diff(told.reached, prepend=0.0)).sum() - told.mean**2) == (
        pytest.approx(left.std(), rel=0.02)
    )
    assert 0.89 < ((told.low <= left) & (left <= told.high)).mean() < 0.94


def test_of_a_place_wholly_seen_what_is_not_listed_there_is_left() -> None:
    told = mines_left(np.where(ALL, 0.0, 0.5), ALL, ALL, CELL_M2, surely(5, [0.3, 0.2]), 0.0)
    assert told is not None
    assert told.reached == pytest.approx([0.7 * 0.8, 1.0 - 0.3 * 0.2, 1.0])
    assert [told.mean, told.low, told.high] == pytest.approx([0.5, 0, 2])  # at most one with 94 %


def test_clearance_is_of_the_search_and_not_of_what_it_happened_to_find() -> None:
    one = np.zeros(ALL.shape, dtype=np.bool_)
    one[0, 0] = True
    risk = np.where(one, 0.3, 0.5)
    for there in (0.0, 1.0):
        told = mines_left(risk, ALL, one, CELL_M2, surely(5, there=there), 0.0)
        assert told is not None
        assert told.clearance == pytest.approx(0.7)
        assert told.found == 5 * there
        # Of what is found there, and not elsewhere, a share is told.
        assert (told.chance_of_clearance(0.8) < 0.99) == (there == 0.0)


def test_of_a_fleets_objects_those_count_as_found_that_are_listed_and_the_others_where_they_lie() -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=10, rows=8))
    levels = to_levels(np.full(ALL.shape, 0.7))
    fleet.join("one", 0, whole_map(levels, levels))
    objects = with_objects(fleet, 8, 4)
    mines = objects.known()[1][:, 0]
    assert mines[:8] == pytest.approx(1.0)
    assert (mines[8:] > 0.1).all()
    assert (mines[8:] < LISTED_FROM).all()
    told = mines_left_by(objects, ALL, 0.1)
    expected = mines_left(fleet.risk, ALL, ALL, CELL_M2, Detected(mines, mines > LISTED_FROM), 0.1)
    assert told is not None
    assert expected is not None
    assert (told.found, told.mean, told.none) == pytest.approx((8.0, expected.mean, expected.none))
    # On the row's cells from the ninth object on: 20, 22.5, 25 and 27.5 m east, in columns of 5 m from -2.5 m on.
    place = np.zeros(ALL.shape)
    place[0, 4], place[0, 6] = 1.0, 0.5
    place[1, 4] = 3.0
    at_edge, weighty = place.copy(), place.copy()
    at_edge[7, 9], weighty[0, 4] = 0.25, 3.0
    there = mines_left_by(objects, ALL, 0.1, place)
    without = mines_left_by(with_objects(fleet, 8), ALL, 0.1, place)
    assert there is not None
    assert without is not None
    columns = np.rint(np.array([20.0, 22.5, 25.0, 27.5]) / 5.0)
    share = np.where(columns == 4, 1.0, np.where(columns == 6, 0.5, 0.0))
    assert there.mean == pytest.approx(without.mean * (8.5 + mines[8:].sum()) / 8.5 + (mines[8:] * share).sum())
    # An object lies in a cell once at the most, whatever the cell counts.
    there, without = (mines_left_by(one, ALL, 0.1, weighty) for one in (objects, with_objects(fleet, 8)))
    assert there is not None
    assert without is not None
    assert there.mean == pytest.approx(without.mean * (8.5 + mines[8:].sum()) / 8.5 + (mines[8:] * share).sum())
    assert mines_left_by(ObjectsOnMap(), ALL, 0.1) is None


def test_of_several_vehicles_the_one_whose_tracks_differ_most_counts() -> None:
    alike, other = curve(0.4), curve(0.6)
    assert scatter_of_all([[alike, alike], [alike, other]]) == scatter_of([alike, other]) > 0.0
    assert scatter_of_all([]) == UNKNOWN_SCATTER


def test_where_nothing_was_seen_nothing_can_be_said() -> None:
    assert mines_left(np.ones(ALL.shape), ALL, ALL, CELL_M2, surely(0), 0.0) is None
    assert mines_left(np.ones(ALL.shape), ALL, ALL, CELL_M2, surely(0), 0.2) is None


def test_what_lies_beyond_the_area_does_not_count_but_for_what_may_lie_in_it() -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=10, rows=8))
    levels = to_levels(np.full(ALL.shape, 0.7))
    fleet.join("one", 0, whole_map(levels, levels))
    west = np.broadcast_to(np.arange(10) < 5, ALL.shape)  # up to 22.5 m
    objects, alone = with_objects(fleet, 8), with_objects(fleet, 8)
    for x_m, y_m, sigma_m in ((33.0, 2.0, 0.0), (900.0, 900.0, 0.0), (-900.0, -900.0, 0.0), (37.0, 38.0, 5.0)):
        objects.hear(Sighting("one", x_m, y_m, sigma_m, 1.0))
    told, without = (mines_left_by(one, west, 0.0) for one in (objects, alone))
    assert told is not None
    assert without is not None
    assert [told.found, without.found] == pytest.approx([9.0, 8.0])  # that at 37 m may lie at 22 m
    assert told.mean == pytest.approx(without.mean * 9.5 / 8.5)


@pytest.mark.parametrize(
    ("x_m", "y_m", "cell"), [(0.0, -3.0, (0, 0)), (0.0, 43.0, (7, 0)), (-6.0, 1.0, (0, 0)), (49.0, 1.0, (0, 9))]
)
def test_what_lies_beside_the_grid_counts_in_the_nearest_cell(x_m: float, y_m: float, cell: tuple[int, int]) -> None:
    fleet = FleetMap(GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=10, rows=8))
    levels = to_levels(np.full(ALL.shape, 0.7))
    fleet.join("one", 0, whole_map(levels, levels))
    objects = ObjectsOnMap(fleet)
    objects.hear(Sighting("one", x_m, y_m, 0.0, 1.0))
    place = np.zeros(ALL.shape)
    place[cell] = 0.5
    there, elsewhere = (mines_left_by(objects, ALL, 0.0, one) for one in (place, np.where(place > 0.0, 0.0, 1.0)))
    assert there is not None
    assert elsewhere is not None
    assert [there.found, elsewhere.found] == pytest.approx([0.5 * objects.mines, 0.0])


@pytest.mark.parametrize("scatter", [-0.1, 1.1, math.nan])
def test_a_scatter_that_makes_no_sense_is_refused(scatter: float) -> None:
    with pytest.raises(ValueError, match="scatter must be from 0 to 1, not"):
        left_of(0.5, 3, scatter)


@pytest.mark.parametrize("risk", [-0.1, 1.1, math.nan])
def test_a_risk_that_is_none_is_refused(risk: float) -> None:
    with pytest.raises(ValueError, match="risk must be from 0 to 1"):
        left_of(np.where(np.arange(10) < 1, risk, 0.5), 3)


@pytest.mark.parametrize("chance", [-0.1, 1.1, math.nan])
def test_a_chance_that_is_none_is_refused(chance: float) -> None:
    for chances in ([0.5, chance], [chance]):
        with pytest.raises(ValueError, match="an object must be a mine with a chance from 0 to 1"):
            all_listed(chances)


@pytest.mark.parametrize("share", [-1.0, 0.0, 1.1, math.nan])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with pytest.raises(ValueError, match="a share must be above 0 and at most 1"):
        left_of(0.5, 3).chance_of_clearance(share)


@given(risk=st.floats(0.001, 0.99), found=st.integers(0, 500), scatter=st.floats(0.0, 0.3), more=st.floats(1.001, 1.2))
def test_more_risk_leaves_more_and_less_knowledge_tells_less(
    risk: float, found: int, scatter: float, more: float
) -> None:
    told, worse = left_of(risk, found, scatter), left_of(min(0.999, risk * more), found, scatter)
    assert told.mean < worse.mean
    assert told.none >= worse.none
    assert told.low <= worse.low
    assert told.high <= worse.high
    assert 0 <= told.low <= told.high
    sure = left_of(risk, found)
    assert sure.high - sure.low <= told.high - told.low


def test_ninety_percent_intervals_hold_nine_times_in_ten() -> None:
    rng = np.random.default_rng(3)
    risk = rng.uniform(0.0, 0.8, ALL.shape)
    held = 0
    for _ in range(2000):
        mines = rng.poisson(rng.uniform(0.2, 1.5), ALL.shape)
        missed = rng.binomial(mines, risk)
        told = left_of(risk, int((mines - missed).sum()))
        held += told.low <= missed.sum() <= told.high
    assert 0.88 <= held / 2000 <= 0.94  # of whole numbers a little more than 0.9 lie between two of them


def curve(peak: float) -> DetectionCurve:
    return DetectionCurve(np.array([0.0, 50.0, 100.0]), np.array([peak, peak, peak]))


def test_tracks_that_saw_alike_tell_surely_and_such_that_differ_do_not() -> None:
    assert scatter_of([curve(0.5)] * 4) == pytest.approx(0.0, abs=1e-12)
    one, other = -math.log(0.6), -math.log(0.4)
    mean, deviation = (one + other) / 2, (other - one) / math.sqrt(2)
    assert scatter_of([curve(0.4), curve(0.6)]) == pytest.approx(deviation / mean / math.sqrt(2))
    # Summed up over range: of one alike up to 10 m and half as much 30 m farther on, of the other twice that.
    one, other = -math.log(0.9), -math.log(0.95)
    falling = DetectionCurve(np.array([0.0, 10.0, 40.0]), np.array([0.1, 0.1, 0.05]))
    twice = replace(falling, p_detect=1.0 - (1.0 - falling.p_detect) ** 2)
    three_times = replace(falling, p_detect=1.0 - (1.0 - falling.p_detect) ** 3)
    assert scatter_of([falling, twice, three_times]) == pytest.approx(1.0 / 2.0 / math.sqrt(3))
    flat = DetectionCurve(np.array([0.0, 25.0]), np.array([0.1, 0.1]))
    areas = np.array([10 * one + 30 * (one + other) / 2, 25 * one])
    assert scatter_of([falling, flat]) == pytest.approx(areas.std(ddof=1) / areas.mean() / math.sqrt(2))
    # So are tracks of a sonar that hardly sees anything.
    little = [curve(1.0 - math.exp(-0.004)), curve(1.0 - math.exp(-0.008))]
    assert scatter_of(little) == pytest.approx(0.002 / 0.006)
    # A track that has seen nothing tells nothing.
    assert scatter_of([curve(0.4), curve(0.0), curve(0.6)]) == scatter_of([curve(0.4), curve(0.6)])
    assert scatter_of([curve(0.5)]) == scatter_of([]) == scatter_of([curve(0.0)] * 2) == UNKNOWN_SCATTER == 0.3


@given(st.lists(st.floats(1e-16, 1.0, exclude_max=True), min_size=1, max_size=6))
def test_no_tracks_scatter_more_than_one_may_ask_for(peaks: list[float]) -> None:
    scatter = scatter_of([curve(peak) for peak in peaks])
    assert 0.0 <= scatter <= MOST_SCATTER
    assert left_of(0.5, 3, scatter).mean > 0.0
