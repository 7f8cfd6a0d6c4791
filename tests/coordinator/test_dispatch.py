"""Offers on their way: whether anybody gives way to anybody."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import HELPER
from coordinator_by_hand import coordinator

from coordinator.agenda import Item
from coordinator.coordinator import Coordinator
from coordinator.dispatch import _lies_inside
from planner.types import GridSpec, Point, SweepFrame


@pytest.mark.parametrize(("separation_m", "keeps_apart"), [(0.0, False), (0.5, True), (15.0, True)])
def test_vehicles_are_kept_apart_by_whatever_is_asked_for(separation_m: float, keeps_apart: bool) -> None:
    node = coordinator(separation_m=separation_m).node.node
    assert isinstance(node, Coordinator)
    assert (node._dispatch._right_of_way is not None) is keeps_apart


def test_whoever_is_heard_when_a_check_is_due_or_later_has_it_made() -> None:
    node = coordinator(separation_m=15.0).node.node
    assert isinstance(node, Coordinator)
    dispatch, right = node._dispatch, node._dispatch._right_of_way
    assert right is not None
    node._agenda.strike(Item.KEEP_APART, 90_000)
    right.check_s = 90.0
    for now_ms, due_ms in ((89_999, None), (90_000, 90_000)):
        dispatch.note_state(HELPER, now_ms, does_another=False)
        assert node._agenda.deadline_ms(Item.KEEP_APART) == due_ms


@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ((0.0, 1.0), True),  # of the first row and column
        ((11.0, 14.0), True),  # of the last ones
        ((-3.0, 1.0), False),
        ((13.0, 1.0), False),
        ((0.0, -1.0), False),
        ((0.0, 16.0), False),
        ((5.0, 7.0), False),  # a cell that is not
    ],
)
def test_who_stands_aside_does_so_in_the_area(place: Point, inside: bool) -> None:
    # Columns centred at 0, 5 and 10 m, rows from 0 to 15 m.
    cells = np.ones((3, 3), dtype=np.bool_)
    cells[1, 1] = False
    assert _lies_inside(GridSpec(SweepFrame(0, 0, 0), 5, columns=3, rows=3), cells, place) is inside
