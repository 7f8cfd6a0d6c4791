from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.fleet_map import FleetMap
from planner.risk import LevelArray
from planner.types import BoolArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0.0, 0.0, 0.0), 5.0, columns=7, rows=5)
# Windows of a 5 x 7 grid in tiles of 3 x 4: (first row, first column, rows, columns).
PLACES = ((0, 0, 3, 4), (0, 4, 3, 3), (3, 0, 2, 4), (3, 4, 2, 3))


@dataclass(frozen=True, eq=False)
class TileNews:
    vehicle: str
    version: tuple[int, int]
    place: tuple[int, int, int, int]
    sum_levels: LevelArray
    largest_levels: LevelArray
    settled: BoolArray

    def give(self, fleet: FleetMap) -> bool:
        row, column, _, _ = self.place
        arrays = (self.sum_levels, self.largest_levels, self.settled)
        return fleet.take(self.vehicle, self.version, row, column, *arrays)


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
    best: dict[tuple[str, tuple[int, int, int, int]], TileNews] = {}
    for news in sorted(told, key=lambda news: news.version):
        best[news.vehicle, news.place] = news
    return list(best.values())


def joined(told: list[TileNews], rho: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The map from scratch, cell by cell as the formula says it."""
    sums, largest = np.zeros(GRID.shape), np.zeros(GRID.shape)
    for news in newest(told):
        row, column, rows, columns = news.place
        window = np.s_[row : row + rows, column : column + columns]
        sums[window] += news.sum_levels
        largest[window] = np.maximum(largest[window], news.largest_levels)
    return np.exp(-0.02 * (largest + (1 - rho) * (sums - largest)))


@given(st.data(), published(), st.sampled_from([0.0, 0.3, 1.0]))
def test_any_order_with_losses_and_repeats_ends_in_one_map(
    data: st.DataObject, told: list[TileNews], rho: float
) -> None:
    latest = newest(told)
    # Of what is not the newest anything may be lost; anything may come again, and late.
    older = [news for news in told if news not in latest]
    arriving = latest + data.draw(st.lists(st.sampled_from(told), max_size=8) if told else st.just([]))
    arriving += [news for news in older if data.draw(st.booleans())]
    fleet = FleetMap(GRID, rho)
    for news in data.draw(st.permutations(arriving)):
        news.give(fleet)
    np.testing.assert_allclose(fleet.risk, joined(told, rho), rtol=1e-12)


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
    assert fleet.risk[0, 4] == 1.0


def test_a_restarted_vehicle_starts_its_layer_anew() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 9), PLACES[0], 50).give(fleet)
    assert tile("alpha", (1, 0), PLACES[0], 10).give(fleet)
    assert fleet.risk[0, 0] == pytest.approx(math.exp(-0.2))
    assert not tile("alpha", (0, 10), PLACES[0], 99).give(fleet)


def test_layers_can_be_told_apart() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
    tile("beta", (0, 1), PLACES[1], 30).give(fleet)
    risk, seen = fleet.risk_of({"alpha"})
    assert (risk[0, 0], risk[0, 4]) == (pytest.approx(math.exp(-1.0)), 1.0)
    assert (seen[0, 0], seen[0, 4]) == (True, False)
    assert np.count_nonzero(fleet.seen()) == 12 + 9


def test_settled_is_what_one_of_them_says() -> None:
    fleet = FleetMap(GRID)
    tile("alpha", (0, 1), PLACES[0], 50).give(fleet)
    tile("beta", (0, 1), PLACES[1], 30).give(fleet)
    tile("gamma", (0, 1), PLACES[2], 30).give(fleet)
    assert np.count_nonzero(fleet.settled_by(["alpha"])) == 12
    assert np.count_nonzero(fleet.settled_by(["alpha", "beta", "silent"])) == 12 + 9
    assert not fleet.settled_by([]).any()


@pytest.mark.parametrize("place", [(3, 0, 3, 4), (0, 4, 3, 4)])
def test_a_tile_beside_the_grid_is_refused(place: tuple[int, int, int, int]) -> None:
    with pytest.raises(ValueError, match="is not on the grid"):
        tile("alpha", (0, 1), place, 50).give(FleetMap(GRID))


def test_channels_of_different_shape_are_refused() -> None:
    fleet = FleetMap(GRID)
    levels = np.zeros((2, 2), dtype=np.uint8)
    with pytest.raises(ValueError, match="is not on the grid"):
        fleet.take("alpha", (0, 1), 0, 0, levels, levels[:1], np.zeros((2, 2), dtype=np.bool_))
    with pytest.raises(ValueError, match="is not on the grid"):
        fleet.take("alpha", (0, 1), 0, 0, levels, levels, np.zeros((1, 2), dtype=np.bool_))
    assert fleet.changes == 0
