"""The legs of tracks laid side by side, flown to and fro."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.area import SurveyArea, lawnmower
from planner.spacing import track_offsets

AREA = SurveyArea(((0, 0), (1212, 0), (1212, 400), (0, 400)), 0)


def test_the_papers_control_mission() -> None:
    tracks = lawnmower(AREA, track_offsets(1212, 40, 120), 120)
    assert [track.number for track in tracks] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert [track.across_m for track in tracks] == [120, 200, 440, 520, 760, 840, 1012, 1092]
    assert [(track.start[1], track.end[1]) for track in tracks] == [(0, 400), (400, 0)] * 4


@given(st.lists(st.floats(0, 1212), max_size=9), st.integers(1, 20), st.booleans())
def test_legs_keep_the_order_of_offsets_and_alternate(
    offsets_m: list[float], first_number: int, first_reverse: bool
) -> None:
    tracks = lawnmower(AREA, offsets_m, 100, first_number=first_number, first_reverse=first_reverse)
    assert [track.across_m for track in tracks] == offsets_m
    assert [track.number for track in tracks] == list(range(first_number, first_number + len(offsets_m)))
    southward = [track.end[1] < track.start[1] for track in tracks]
    assert southward == [first_reverse ^ bool(k % 2) for k in range(len(offsets_m))]


def test_a_plan_taken_up_again_goes_on_where_it_was() -> None:
    offsets_m = track_offsets(1212, 40, 130)
    whole = lawnmower(AREA, offsets_m, 130)
    assert whole == lawnmower(AREA, offsets_m[:3], 130) + lawnmower(
        AREA, offsets_m[3:], 130, first_number=4, first_reverse=True
    )


def test_an_offset_out_of_reach_takes_no_number_and_no_change_of_direction() -> None:
    triangle = SurveyArea(((0, 0), (300, 0), (0, 300)), 0)
    tracks = lawnmower(triangle, [50, 900, 150], 50)
    assert [(track.number, track.across_m) for track in tracks] == [(1, 50), (2, 150)]
    assert np.sign([track.end[1] - track.start[1] for track in tracks]).tolist() == [1, -1]


def test_no_offsets_no_legs() -> None:
    assert lawnmower(AREA, [], 100) == []
    with pytest.raises(ValueError, match="reach"):
        lawnmower(AREA, [10], 0)
