"""A vehicle's coverage layer: which tiles are told, under which version, and which are told again."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from by_hand import flat, look

from comms.node import Publication
from comms.said.messages import CoverageTile, Maneuver, ManeuverKind
from comms.said.tally import tally
from planner.types import GridSpec, Strip, SweepFrame
from vehicle_agent import coverage
from vehicle_agent.coverage import CoverageLayer

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 40, 40)  # four tiles, each 100 m wide and long
FIRST, LAST = "0-0", "1-1"


def seen(layer: CoverageLayer, x_m: float = 50, y_m: float = 0, p_detect: float = 0.3) -> None:
    """A look at 20 m to either side of 20 m of a track northwards; what it tells of reaches 140 m."""
    track = Maneuver(1, ManeuverKind.FOLLOW, x_m, y_m, x_m, y_m + 100, 20)
    layer.add(look(track, 1, 0, 4, flat(p_detect, 0, 20)))


def told(publications: Iterable[Publication]) -> list[tuple[str, int]]:
    """Of each tile its name and version."""
    found = []
    for one in publications:
        assert isinstance(one.message, CoverageTile)
        found.append((one.key.removeprefix("agent/alpha/coverage/"), one.message.version))
    return found


def two_tiles() -> CoverageLayer:
    """The first tile told under version 1, the last under 2."""
    layer = CoverageLayer("alpha", GRID)
    seen(layer)
    assert told(layer.changed_tiles()) == [(FIRST, 1)]
    seen(layer, 150, 120)
    assert told(layer.changed_tiles()) == [(LAST, 2)]
    return layer


def test_a_tile_is_told_when_it_has_changed() -> None:
    layer = two_tiles()
    assert layer.changed_tiles() == []
    seen(layer, p_detect=0.0)
    assert layer.changed_tiles() == []
    seen(layer)
    seen(layer, 150, 120)
    assert told(layer.changed_tiles()) == [(FIRST, 3), (LAST, 4)]
    assert layer.told() == tally([3 + 4])


def test_tiles_that_changed_at_once_are_told_row_by_row_and_stay_as_they_were_told() -> None:
    layer = CoverageLayer("alpha", GRID)
    for x_m, y_m in ((150, 120), (50, 120), (150, 0), (50, 0)):
        seen(layer, x_m, y_m)
    publications = layer.changed_tiles()
    assert told(publications) == [("0-0", 1), ("0-1", 2), ("1-0", 3), ("1-1", 4)]
    messages = [one.message for one in publications]
    assert [(one.first_row, one.first_column) for one in messages if isinstance(one, CoverageTile)] == [
        *((0, 0), (0, 20), (20, 0), (20, 20)),
    ]
    before = [one.sum_levels.tolist() for one in messages if isinstance(one, CoverageTile)]
    seen(layer)
    assert told(layer.changed_tiles()) == [("0-0", 5)]
    assert [one.sum_levels.tolist() for one in messages if isinstance(one, CoverageTile)] == before
    assert layer.told() == tally([5 + 2 + 3 + 4])
    assert layer.told() != CoverageLayer("alpha", GRID).told() == tally([0])


def test_it_holds_what_was_seen_and_what_is_settled() -> None:
    layer = two_tiles()
    settled = np.zeros(GRID.shape, dtype=np.bool_)
    settled[25, 30] = True
    layer.settled = settled
    (one,) = layer.changed_tiles()
    assert told([one]) == [(LAST, 3)]
    assert isinstance(one.message, CoverageTile)
    assert (one.message.first_row, one.message.first_column) == (20, 20)
    assert np.argwhere(one.message.settled).tolist() == [[5, 10]]
    # Rows centred at 122.5 to 137.5 m, columns at 130 to 170 m.
    rows, columns = np.nonzero(one.message.sum_levels)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (4, 7, 6, 14)
    assert (one.message.sum_levels == one.message.largest_levels).all()
    layer.settled = settled.copy()  # as it was
    assert layer.changed_tiles() == []


@pytest.mark.parametrize(
    ("layer", "counts"),
    [
        (CoverageLayer("alpha", GRID), 0.2),
        (CoverageLayer("alpha", GRID, 0.0), 0.2),
        (CoverageLayer("alpha", GRID, 0.3), 0.3),
        (CoverageLayer("alpha", GRID, 1.0), 0.3),
    ],
)
def test_where_the_best_look_counts_a_cell_has_the_mean_of_its_bins(layer: CoverageLayer, counts: float) -> None:
    """The bins at cells' centres tell 0.2, all bins on a cell 0.3 on average."""
    by_place = np.array([0.2, 0.4, 0.3, 0.3, 0.3])  # 0 m to 4 m beside a cell's centre
    track = Maneuver(1, ManeuverKind.FOLLOW, 50, 0, 50, 100, 20)
    layer.add(look(track, 1, 0, 4, lambda range_m: by_place[range_m.astype(int) % 5]))
    cells = layer.layer.nats()[1][0, 12:36]  # from 10 m beside the track on
    assert cells == pytest.approx(-np.log1p(-counts))


def test_of_those_told_the_fewest_times_the_oldest_are_told_again(monkeypatch: pytest.MonkeyPatch) -> None:
    layer = two_tiles()
    monkeypatch.setattr(coverage, "MOST_AGAIN", 1)
    assert [told(layer.again()) for _ in range(3)] == [[(FIRST, 1)], [(LAST, 2)], [(FIRST, 1)]]
    seen(layer)
    layer.changed_tiles()  # the first one anew, which counts as told once
    assert told(layer.again()) == [(FIRST, 3)]
    assert CoverageLayer("alpha", GRID).again() == []


def test_who_asks_is_told_all_those_told_the_fewest_times_first() -> None:
    layer = two_tiles()
    assert told(layer.again()) == [(FIRST, 1), (LAST, 2)]
    seen(layer)
    layer.changed_tiles()
    assert told(layer.again()) == [(FIRST, 3), (LAST, 2)]


def test_who_asks_is_told_no_more_than_200_tiles_at_a_time() -> None:
    layer = CoverageLayer("alpha", GridSpec(SweepFrame(0, 0, 0), 5, 202 * 20, 1))
    layer.settled = np.ones((1, 202 * 20), dtype=np.bool_)
    assert len(layer.changed_tiles()) == 202
    assert [version for _, version in told(layer.again())] == list(range(1, 201))
    assert [version for _, version in told(layer.again())] == [201, 202, *range(1, 199)]


def test_nothing_is_told_more_than_eight_times_unasked() -> None:
    layer = two_tiles()
    for _ in range(7):
        assert told(layer.all_again()) == [(FIRST, 1), (LAST, 2)]
    assert layer.all_again() == []


def test_what_lies_about_a_strip_is_told_if_it_ever_was() -> None:
    layer = two_tiles()
    assert told(layer.again_at(Strip(1, (150, 20), 0, 160, 50))) == [(LAST, 2)]
    assert told(layer.again_at(Strip(1, (50, 20), 0, 40, 50))) == [(FIRST, 1)]
