"""When what changes often is drawn."""

from __future__ import annotations

from viz.canvas import Pace


def test_it_is_due_once_in_a_while_and_not_before_all_of_one_time_is_in() -> None:
    pace = Pace(60)
    assert pace.due(10) is None  # nothing has changed
    pace.note(10)
    assert pace.due(10) is None  # more may come of that time
    assert pace.due(11) == 10
    pace.note(30)
    assert [pace.due(time_ms) for time_ms in (31, 70, 71, 72)] == [None, None, 30, None]


def test_a_change_that_comes_late_is_drawn_over_those_after_it() -> None:
    pace = Pace(0)
    pace.note(40)
    pace.note(20)
    assert pace.due(30) is None
    assert pace.due(41) == 40


def test_what_is_left_is_drawn_however_soon_it_is() -> None:
    pace = Pace(60)
    pace.note(10)
    assert (pace.due(11), pace.rest()) == (10, None)
    pace.note(12)
    assert (pace.due(13), pace.rest(), pace.rest()) == (None, 12, None)
