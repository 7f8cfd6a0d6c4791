"""The fleet's map: tiles in any order, lost and repeated, end in one map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from told_tile import Tile

from planner.fleet_map import MOST_STARTS, FleetMap
from planner.risk import LevelArray
from planner.types import EVERYWHERE, BoolArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=23, rows=22)
# Its four tiles: (first row, first column, rows, columns).
PLACES = ((0, 0, 20, 20), (0, 20, 20, 3), (20, 0, 2, 20), (20, 20, 2, 3))


@dataclass(frozen=True, eq=False)
class TileNews:
    vehicle: str
    version: tuple[int, int]
    place: tuple[int, int, int, int]
    sum_levels: LevelArray
    largest_levels: LevelArray
    settled: BoolArray

    def give(self, fleet: FleetMap) -> bool:
        incarnation, version = self.version
        tile = Tile(version, *self.place[:2], self.sum_levels, self.largest_levels, self.settled)
        return fleet.join(self.vehicle, incarnation, tile)


def tile(
    vehicle: str, version: tuple[int, int], place: tuple[int, int, int, int], levels: int, largest: int | None = None
) -> TileNews:
    shape = place[2:]
    return TileNews(
        vehicle,
        version,
        place,
        np.full(shape, levels, dtype=np.uint8),
        np.full(shape, levels if largest is None else largest, dtype=np.uint8),
        np.full(shape, levels > 0),
    )


@st.composite
def published(draw: st.DrawFn) -> list[TileNews]:
    """What a fleet has published: every (vehicle, place, version) once, with contents of its own."""
    which = draw(
        st.sets(
            st.tuples(
                st.sampled_from(["alpha", "beta", "gamma"]),
                st.tuples(st.integers(0, 1), st.integers(1, 3)),
                st.sampled_from(PLACES),
            ),
            max_size=12,
        )
    )
    generator = np.random.Generator(np.random.PCG64(draw(st.integers(0, 2**32 - 1))))
    told = []
    for vehicle, version, place in sorted(which):
        sums = generator.integers(0, 256, place[2:], dtype=np.uint8)
        largest = (sums * generator.uniform(0, 1, place[2:])).astype(np.uint8)
        told.append(TileNews(vehicle, version, place, sums, largest, generator.integers(0, 2, place[2:]).astype(bool)))
    return told


def newest(told: list[TileNews]) -> list[TileNews]:
    """Of each start of a vehicle, and each tile, the newest."""
    best: dict[tuple[str, int, tuple[int, int, int, int]], TileNews] = {}
    for news in sorted(told, key=lambda news: news.version):
        best[news.vehicle, news.version[0], news.place] = news
    return list(best.values())


def joined(told: list[TileNews], rho: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The map from scratch, cell by cell as the formula says it; a vehicle's sum is at most 255."""
    sums, largest = np.zeros(GRID.shape), np.zeros(GRID.shape)
    for vehicle in {news.vehicle for news in told}:
        its_sums = np.zeros(GRID.shape)
        for news in newest(told):
            if news.vehicle == vehicle:
                row, column, rows, columns = news.place
                window = np.s_[row : row + rows, column : column + columns]
                its_sums[window] += news.sum_levels
                largest[window] = np.maximum(largest[window], news.largest_levels)
        sums += np.minimum(its_sums, 255)
    return np.exp(-0.02 * (largest + (1 - rho) * (sums - largest)))


@given(st.data(), published(), st.sampled_from([0.0, 0.3, 1.0]))
def test_any_order_with_losses_and_repeats_ends_in_one_map(
    data: st.DataObject, told: list[TileNews], rho: float
) -> None:
    # Anything may be lost, come again, and late.
    arriving = data.draw(st.lists(st.sampled_from(told), max_size=20)) if told else []
    fleet, other = FleetMap(GRID, rho), FleetMap(GRID, rho)
    for news in arriving:
        news.give(fleet)
    for news in data.draw(st.permutations(arriving)):
        news.give(other)
    np.testing.assert_allclose(fleet.risk, joined(arriving, rho), rtol=1e-12)
    np.testing.assert_array_equal(fleet.risk, other.risk)
    np.testing.assert_array_equal(fleet.seen(), other.seen())
    np.testing.assert_array_equal(fleet.settled_by(["alpha", "gamma"]), other.settled_by(["alpha", "gamma"]))


@given(st.data(), published())
def test_two_listeners_who_tell_each_other_what_they_heard_agree(data: st.DataObject, told: list[TileNews]) -> None:
    heard = [data.draw(st.lists(st.sampled_from(told))) if told else [] for _ in range(2)]
    one, other, both = FleetMap(GRID), FleetMap(GRID), FleetMap(GRID)
    for news in heard[0] + newest(heard[1]):
        news.give(one)
    for news in heard[1] + newest(heard[0]):
        news.give(other)
    for news in newest(heard[0] + heard[1]):
        news.give(both)
    np.testing.assert_array_equal(one.risk, both.risk)
    np.testing.assert_array_equal(other.risk, both.risk)


@given(published(), st.sampled_from([0.0, 0.3, 1.0]))
def test_what_is_seen_is_what_has_a_risk_below_1(told: list[TileNews], rho: float) -> None:
    fleet = FleetMap(GRID, rho)
    for news in told:
        # A layer's largest look has a level where the sum has.
        replace(news, largest_levels=np.maximum(news.largest_levels, np.minimum(news.sum_levels, 1))).give(fleet)
    np.testing.assert_array_equal(fleet.seen(), fleet.risk < 1)
    risk, seen = fleet.risk_of_layers(fleet.layers.values())
    np.testing.assert_array_equal(risk, fleet.risk)
    np.testing.assert_array_equal(seen, fleet.seen())


@given(published(), st.sampled_from([0.0, 0.3]))
def test_a_window_alone_has_the_risk_that_it_has_in_the_whole(told: list[TileNews], rho: float) -> None:
    fleet = FleetMap(GRID, rho)
    for news in told:
        # A layer's largest look has a level where the sum has.
        replace(news, largest_levels=np.maximum(news.largest_levels, np.minimum(news.sum_levels, 1))).give(fleet)
    for row, column, rows, columns in PLACES:
        window = (slice(row, row + rows), slice(column, column + columns))
        vehicles = {news.vehicle for news in told if news.place[:2] == (row, column)}
        levels, risk = fleet.levels_within(window, vehicles)
        np.testing.assert_allclose(risk[levels], fleet.risk[window], rtol=0 if rho == 0 else 0.001)
        np.testing.assert_array_equal(levels == 0, fleet.risk[window] == 1)


@given(published(), st.tuples(*[st.integers(0, 30)] * 4))
def test_what_is_told_in_a_window_is_what_is_told_there_of_the_whole(
    told: list[TileNews], bounds: tuple[int, int, int, int]
) -> None:
    fleet, (row, end_row, column, end_column) = FleetMap(GRID), bounds
    for news in told:
        news.give(fleet)
    window = slice(row, max(row, end_row)), slice(column, max(column, end_column))
    sums, largest = (np.zeros(GRID.shape, dtype=np.int64) for _ in range(2))
    for layer in fleet.layers.values():
        sums += layer.sum_levels
        largest = np.maximum(largest, layer.largest_levels)
    np.testing.assert_array_equal(fleet.sums(EVERYWHERE, fleet.layers), sums)
    np.testing.assert_array_equal(fleet.sums(window, fleet.layers), sums[window])
    np.testing.assert_array_equal(fleet.largest(window), largest[window])
    settled = fleet.settled_by(fleet.layers)
    np.testing.assert_array_equal(fleet.settled_by(fleet.layers, window), settled[window])
    assert (settled == np.any([layer.settled for layer in fleet.layers.values()], axis=0)).all()
    assert not fleet.sums(window, []).any()


def test_a_window_is_told_in_levels_and_with_a_rho_in_parts_of_them() -> None:
    window = (slice(0, 20), slice(0, 20))
    for rho, counting in ((0.0, 80), (0.5, 16 * (0.5 * 50 + 0.5 * 80))):
        fleet = FleetMap(GRID, rho)
        tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
        tile("beta", (0, 1), PLACES[0], 30).give(fleet)
        levels, _ = fleet.levels_within(window, ["alpha", "beta"])
        assert (levels == counting).all()


@given(published())
def test_what_is_known_already_is_no_news(told: list[TileNews]) -> None:
    fleet = FleetMap(GRID)
    taken = [news.give(fleet) for news in sorted(told, key=lambda news: news.version)]
    assert all(taken)
    assert fleet.changes == len(told)
    before = fleet.risk.copy()
    assert not any(news.give(fleet) for news in told)
    assert fleet.changes == len(told)
    np.testing.assert_array_equal(fleet.risk, before)


def test_sums_add_and_maxima_take_the_maximum() -> None:
    fleet = FleetMap(GRID, rho=0.5)
    tile("alpha", (0, 1), PLACES[0], 50, largest=40).give(fleet)
    tile("beta", (0, 1), PLACES[0], 30).give(fleet)
    # Sum 80, largest 40: exp(-0.02 (40 + 0.5 * 40)).
    assert fleet.risk[0, 0] == pytest.approx(math.exp(-1.2))
    assert fleet.risk[0, 20] == 1.0


def test_the_looks_of_a_vehicle_that_is_started_anew_count_beside_those_before() -> None:
    fleet = FleetMap(GRID, rho=0.5)
    tile("alpha", (0, 9), PLACES[0], 50).give(fleet)
    assert tile("alpha", (1, 0), PLACES[0], 10).give(fleet)
    assert fleet.risk[0, 0] == pytest.approx(math.exp(-0.02 * (50 + 0.5 * 10)))
    assert tile("alpha", (0, 10), PLACES[0], 60).give(fleet)  # late
    assert not tile("alpha", (0, 9), PLACES[0], 50).give(fleet)
    assert tile("alpha", (1, 1), PLACES[0], 20).give(fleet)
    assert fleet.risk[0, 0] == pytest.approx(math.exp(-0.02 * (60 + 0.5 * 20)))
    assert fleet.layers["alpha"].sum_levels[0, 0] == 80
    tile("alpha", (2, 1), PLACES[0], 250).give(fleet)
    assert fleet.layers["alpha"].sum_levels[0, 0] == 255


def test_what_one_start_has_settled_stays_settled() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
    tile("alpha", (1, 1), PLACES[0], 0).give(fleet)
    assert np.count_nonzero(fleet.settled_by(["alpha"])) == 400


@given(st.permutations(range(MOST_STARTS)))
def test_many_starts_in_any_order_end_in_one_map_and_take_no_more_memory(order: list[int]) -> None:
    fleet = FleetMap(GRID)
    for incarnation in order:
        tile("alpha", (incarnation, 1), PLACES[0], incarnation + 1).give(fleet)
    layer = fleet.layers["alpha"]
    assert layer.sum_levels[0, 0] == sum(range(1, MOST_STARTS + 1))
    for incarnation in range(MOST_STARTS, 3 * MOST_STARTS):
        assert tile("alpha", (incarnation, 1), PLACES[0], 1).give(fleet)
        assert len(layer.versions[0, 0]) == MOST_STARTS == 8
    assert layer.sum_levels[0, 0] == sum(range(1, MOST_STARTS + 1)) + 2 * MOST_STARTS
    # Nothing more is taken of what is held as one; of the others it is.
    for incarnation in range(2 * MOST_STARTS + 1):
        assert not tile("alpha", (incarnation, 2**31 - 1), PLACES[0], 200).give(fleet)
    assert tile("alpha", (2 * MOST_STARTS + 1, 2), PLACES[0], 3).give(fleet)
    assert layer.sum_levels[0, 0] == sum(range(1, MOST_STARTS + 1)) + 2 * MOST_STARTS + 2


def test_what_was_seen_at_a_point_is_the_sum_of_all_levels_of_its_cell_and_nothing_beyond_the_grid() -> None:
    # Cells of 5 m: columns are centred at 0, 5, ..., 110 m, rows at 2.5, 7.5, ..., 107.5 m.
    fleet = FleetMap(GRID)
    for place in PLACES:
        tile("alpha", (0, 1), place, 50).give(fleet)
    tile("beta", (0, 1), PLACES[0], 30).give(fleet)
    x_m = np.array([0.0, -2.4, 50.0, 110.0, 114.9, -2.6, 115.1, 50.0, 50.0])
    y_m = np.array([2.5, 0.1, 50.0, 109.9, 50.0, 50.0, 50.0, -0.1, 110.1])
    assert fleet.nats_at(x_m, y_m) == pytest.approx([1.6, 1.6, 1.6, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])


def test_layers_can_be_told_apart() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
    tile("beta", (0, 1), PLACES[1], 30).give(fleet)
    risk, seen = fleet.risk_of_layers([fleet.layers["alpha"]])
    assert (risk[0, 0], risk[0, 20]) == (pytest.approx(math.exp(-1.0)), 1.0)
    assert (seen[0, 0], seen[0, 20]) == (True, False)
    assert np.count_nonzero(fleet.seen()) == 400 + 60


def test_settled_is_what_one_of_them_says() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
    tile("beta", (0, 1), PLACES[1], 30).give(fleet)
    tile("gamma", (0, 1), PLACES[2], 30).give(fleet)
    assert np.count_nonzero(fleet.settled_by(["alpha"])) == 400
    assert np.count_nonzero(fleet.settled_by(["alpha", "beta", "silent"])) == 400 + 60
    assert not fleet.settled_by([]).any()


@pytest.mark.parametrize(
    "place",
    [
        (20, 0, 20, 20),
        (0, 20, 20, 20),
        (40, 0, 2, 20),
        (-20, 0, 20, 20),
        (0, -20, 20, 20),
        (-1, -1, 20, 20),
        (2, 0, 20, 20),
        (0, 3, 20, 20),
        (0, 0, 19, 20),
        (0, 0, 20, 19),
        (0, 0, 22, 23),
        (0, 0, 0, 0),
        (2**31 - 1, 0, 20, 20),
        (0, 2**80, 20, 20),
    ],
)
def test_what_is_no_tile_of_the_grid_is_refused(place: tuple[int, int, int, int]) -> None:
    check_refused(tile("alpha", (5, 1), place, 50))
    check_refused(tile("stranger", (0, 1), place, 50))


@pytest.mark.parametrize(
    "spoilt",
    [
        {"sum_levels": np.zeros((20, 19), dtype=np.uint8)},
        {"largest_levels": np.zeros((19, 20), dtype=np.uint8)},
        {"settled": np.zeros((1, 20), dtype=np.bool_)},
        {"settled": np.zeros(20, dtype=np.bool_)},
        {"sum_levels": np.zeros((20, 20, 1), dtype=np.uint8)},
        {"sum_levels": np.uint8(3)},
    ],
)
def test_arrays_of_another_shape_are_refused(spoilt: dict[str, Any]) -> None:
    check_refused(replace(tile("alpha", (5, 1), PLACES[0], 50), **spoilt))


def test_who_is_refused_is_told_where_and_by_how_much_it_does_not_fit() -> None:
    misfit = replace(tile("alpha", (0, 1), PLACES[1], 50), settled=np.zeros((20, 4), dtype=np.bool_))
    told = r"^the tile at 0, 20 has \(20, 3\) cells, not \(20, 3\), \(20, 3\) and \(20, 4\)$"
    with pytest.raises(ValueError, match=told):
        misfit.give(FleetMap(GRID))


def check_refused(misfit: TileNews) -> None:
    """It raises and changes nothing."""
    fleet, twin = FleetMap(GRID), FleetMap(GRID)
    for one in (fleet, twin):
        tile("alpha", (0, 1), PLACES[0], 50).give(one)
        tile("beta", (0, 2), PLACES[3], 20).give(one)
    with pytest.raises(ValueError, match="tile"):
        misfit.give(fleet)
    assert fleet.changes == 2
    assert set(fleet.layers) == {"alpha", "beta"}
    np.testing.assert_array_equal(fleet.risk, twin.risk)
    # Nor did it use up a version.
    assert tile("alpha", (0, 2), PLACES[0], 60).give(fleet)
    for vehicle, layer in twin.layers.items():
        if vehicle != "alpha":
            np.testing.assert_array_equal(fleet.layers[vehicle].sum_levels, layer.sum_levels)
            np.testing.assert_array_equal(fleet.layers[vehicle].settled, layer.settled)
            assert fleet.layers[vehicle].versions == layer.versions
