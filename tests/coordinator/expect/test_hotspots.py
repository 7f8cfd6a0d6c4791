"""Hotspots as they are heard, drawn on the grid."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from coordinator_by_hand import ELSEWHERE, GRID, HOT, HOT_CELLS, box
from hypothesis import given
from hypothesis import strategies as st

from comms.said.announcement import Vertex
from comms.said.messages import Hotspot, HotspotState
from coordinator.expect.hotspots import MOST_CHANGED, Hotspots
from planner.fleet_map import MOST_STARTS

Box = tuple[float, float, float, float]
ELSEWHERE_CELLS = np.s_[10:70, 60:70]
FIRST = (0, 1)


def hotspot(place: Box | None = HOT, mean_risk: float = 0.5) -> Hotspot:
    """One with this outline; none withdraws it."""
    state = HotspotState.WITHDRAWN if place is None else HotspotState.ACTIVE
    return Hotspot(1, state, () if place is None else box(*place), mean_risk, 600, False, 0)


@pytest.fixture
def hotspots() -> Hotspots:
    return Hotspots(GRID, np.ones(GRID.shape, dtype=np.bool_))


def drawn(hotspots: Hotspots) -> np.ndarray:
    """The told risk, after it was made sure that it is told where hotspots are, and only there."""
    hot, told = hotspots.drawn()
    assert ((told > 0) == hot).all()
    return told


def told(*places: tuple[tuple[slice, slice], float]) -> np.ndarray:
    values = np.zeros(GRID.shape)
    for cells, risk in places:
        values[cells] = risk
    return values


def test_it_holds_the_cells_whose_centres_lie_in_it(hotspots: Hotspots) -> None:
    assert not drawn(hotspots).any()
    assert hotspots.hear(("p", 1), FIRST, hotspot())
    assert (drawn(hotspots) == told((HOT_CELLS, 0.5))).all()


def test_of_revisions_the_newest_counts_whenever_it_comes(hotspots: Hotspots) -> None:
    assert hotspots.hear(("p", 1), (0, 2), hotspot(HOT, 0.5))
    assert not hotspots.hear(("p", 1), (0, 2), hotspot(ELSEWHERE, 0.7))
    assert not hotspots.hear(("p", 1), (0, 1), hotspot(ELSEWHERE, 0.7))
    assert (drawn(hotspots) == told((HOT_CELLS, 0.5))).all()


def test_whoever_is_started_anew_takes_none_of_its_hotspots_away(hotspots: Hotspots) -> None:
    hotspots.hear(("p", 1), (0, 2), hotspot(HOT, 0.5))
    assert hotspots.hear(("p", 1), (1, 1), hotspot(ELSEWHERE, 0.7))
    both = told((HOT_CELLS, 0.5), (ELSEWHERE_CELLS, 0.7))
    assert (drawn(hotspots) == both).all()
    assert hotspots.hear(("p", 1), (0, 3), hotspot(HOT, 0.6))  # a late word of the start before
    assert hotspots.hear(("p", 1), (1, 2), hotspot(None))
    assert (drawn(hotspots) == told((HOT_CELLS, 0.6))).all()


def test_of_many_starts_the_oldest_stay_as_they_are(hotspots: Hotspots) -> None:
    hotspots.hear(("p", 1), (0, 1), hotspot(HOT, 0.5))
    for incarnation in range(1, MOST_STARTS + 1):
        hotspots.hear(("p", 1), (incarnation, 1), hotspot(ELSEWHERE, 0.7))
    assert not hotspots.hear(("p", 1), (0, 2), hotspot(None))
    assert hotspots.hear(("p", 1), (1, 2), hotspot(ELSEWHERE, 0.8))
    assert hotspots.hear(("q", 1), (0, 1), hotspot(None))
    assert (drawn(hotspots) == told((HOT_CELLS, 0.5), (ELSEWHERE_CELLS, 0.8))).all()
    assert hotspots.hear(("p", 1), (MOST_STARTS + 1, 1), hotspot(None))
    assert not hotspots.hear(("p", 1), (1, 3), hotspot(None))
    assert (drawn(hotspots) == told((HOT_CELLS, 0.5), (ELSEWHERE_CELLS, 0.8))).all()


def test_one_that_is_withdrawn_holds_nothing(hotspots: Hotspots) -> None:
    hotspots.hear(("p", 1), FIRST, hotspot(HOT))
    hotspots.hear(("p", 2), FIRST, hotspot(ELSEWHERE))
    assert drawn(hotspots).any()
    assert hotspots.hear(("p", 1), (0, 2), hotspot(None))
    assert (drawn(hotspots) == told((ELSEWHERE_CELLS, 0.5))).all()


def test_where_two_lie_on_each_other_the_worse_counts(hotspots: Hotspots) -> None:
    hotspots.hear(("p", 1), FIRST, hotspot(HOT, 0.8))
    hotspots.hear(("q", 1), FIRST, hotspot((97.5, 0.0, 397.5, 200.0), 0.6))
    assert (drawn(hotspots) == told((np.s_[0:40, 20:80], 0.6), (HOT_CELLS, 0.8))).all()


def test_what_lies_outside_the_area_is_left_out() -> None:
    inside = np.ones(GRID.shape, dtype=np.bool_)
    inside[:, 25:] = False
    hotspots = Hotspots(GRID, inside)
    hotspots.hear(("p", 1), FIRST, hotspot())
    assert (drawn(hotspots) == told((np.s_[10:70, 20:25], 0.5))).all()


@pytest.mark.parametrize("place", [(900.0, 0.0, 950.0, 100.0), (0.0, -200.0, 50.0, -100.0), (101.0, 51.0, 102.0, 52.0)])
def test_one_that_holds_no_cell_is_heard_and_draws_nothing(hotspots: Hotspots, place: Box) -> None:
    assert hotspots.hear(("p", 1), FIRST, hotspot(place))
    assert not drawn(hotspots).any()


def test_three_corners_make_one_and_two_do_not(hotspots: Hotspots) -> None:
    # Half of a square of ten cells: of row 10 nine cells, of row 18 one.
    corners = (Vertex(97.5, 50.0), Vertex(147.5, 50.0), Vertex(97.5, 100.0))
    assert hotspots.hear(("p", 1), FIRST, replace(hotspot(), outline=corners[:2]))
    assert not drawn(hotspots).any()
    assert hotspots.hear(("p", 1), (0, 2), replace(hotspot(), outline=corners))
    assert [int(np.count_nonzero(row)) for row in drawn(hotspots)[10:20]] in (
        [10, 9, 8, 7, 6, 5, 4, 3, 2, 1],
        list(range(9, -1, -1)),
    )


def test_one_that_is_withdrawn_holds_nothing_whatever_its_outline(hotspots: Hotspots) -> None:
    assert hotspots.hear(("p", 1), FIRST, replace(hotspot(), state=HotspotState.WITHDRAWN))
    assert not drawn(hotspots).any()


def test_cells_centred_on_its_edges_are_in_its_window(hotspots: Hotspots) -> None:
    # Columns 20 and 30 are centred at 100 and 150 m, rows 10 and 70 at 52.5 and 352.5 m.
    window, _ = hotspots._cells_within([(100.0, 52.5), (150.0, 52.5), (150.0, 352.5), (100.0, 352.5)])
    assert window == (slice(10, 71), slice(20, 31))


def test_two_hotspots_of_one_start_are_two(hotspots: Hotspots) -> None:
    for number, (place, risk) in enumerate(((HOT, 0.5), (ELSEWHERE, 0.7)), 1):
        assert hotspots.hear(("p", number), FIRST, hotspot(place, risk))
        assert not hotspots.hear(("p", number), FIRST, hotspot(place, risk))
    assert (drawn(hotspots) == told((HOT_CELLS, 0.5), (ELSEWHERE_CELLS, 0.7))).all()


WORDS = st.tuples(st.integers(1, 4), st.integers(0, 11), st.integers(0, 2), st.booleans())


@given(st.lists(WORDS, min_size=1, max_size=24), st.sampled_from([3, MOST_CHANGED]))
def test_asked_in_between_it_has_drawn_what_one_has_that_is_asked_at_the_end(
    words: list[tuple[int, int, int, bool]], most_changed: int
) -> None:
    everywhere = np.ones(GRID.shape, dtype=np.bool_)
    one, other = Hotspots(GRID, everywhere), Hotspots(GRID, everywhere)
    for revision, (number, place, starts_ago, asked) in enumerate(words):
        x_m, y_m = 50.0 + 40.0 * (place % 4), 60.0 * (place // 4)  # which lie on their neighbours, but for the last
        message = hotspot(None if place == 11 else (x_m, y_m, x_m + 60, y_m + 80), 0.5 + place / 100)
        # Each is of a start of its own, or of one shortly before: of the oldest starts in the end nothing new is heard.
        for hotspots in (one, other):
            with patch("coordinator.expect.hotspots.MOST_CHANGED", most_changed):
                hotspots.hear(("p", number), (max(0, revision - starts_ago), revision), message)
        if asked:
            drawn(one)
    assert (drawn(one) == drawn(other)).all()
