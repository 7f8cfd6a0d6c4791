"""Why a strip lies where it does, in words: causes and tracks by hand, and words for whatever plan there is."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import PRIMARY, SECOND_HELPER, vehicle
from hypothesis import given
from hypothesis import strategies as st

from comms.said.announcement import Role
from comms.said.messages import Plan, PlannedTrack
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.reasons import Reasons
from coordinator.vehicles import KnownVehicle
from planner.types import DetectionCurve, GridSpec, SweepFrame
from secondlook.testing.checks.any_mail import any_message

GRID = GridSpec(SweepFrame(0, 0, 0), 5.0, 81, 80)  # columns centred at 0, 5, ... 400 m
FLAT = np.ones(GRID.shape)
# Half of the best is passed between 15 and 20 m, and between 65 and 70 m.
CURVE = DetectionCurve(np.arange(0.0, 90, 5), np.array([0.1] * 4 + [0.8] * 9 + [0.6, 0.3, 0.2, 0.1, 0.0]))


def primary(*tracks_x_m: float, flown: int = 0, name: str = PRIMARY) -> KnownVehicle:
    """One with tracks to the north, numbered from 1, of which the first `flown` are flown."""
    tracks = (PlannedTrack(n, x_m, x_m, 0, x_m, 300, n <= flown) for n, x_m in enumerate(tracks_x_m, 1))
    return KnownVehicle(vehicle(name, Role.SURVEY), 0, plan=Plan(1, tuple(tracks), (60,), (), ""), curves={1: CURVE})


def lane(first_m: float, end_m: float, *, foreseen: bool = True, rows: tuple[int, int] = (0, 40)) -> Cut:
    """A strip to the north between two columns of cells."""
    return Cut(Window(*rows, round(first_m / 5), round(end_m / 5) + 1), 100, 100, foreseen)


def why(cut: Cut, *primaries: KnownVehicle, risk: np.ndarray = FLAT) -> str:
    return Reasons(GRID, {one.entry.vehicle: one for one in primaries}, risk).why(cut)


def test_near_below_a_track_is_the_nadir_gap() -> None:
    assert why(lane(90, 110), primary(100, 250)) == "expected beside track 1: nadir gap"


def test_where_a_track_sees_as_well_right_below_it_there_is_no_gap() -> None:
    one = primary(100)
    one.curves[1] = DetectionCurve(np.array([0.0, 60.0]), np.array([0.8, 0.8]))
    assert why(lane(100, 100), one) == "expected beside track 1: even where tracks see best"


def test_far_from_tracks_is_the_ranges_end() -> None:
    # From 170 m on, track 1 at 100 m is 70 m away or more; to 180 m, track 2 at 250 m likewise.
    assert why(lane(170, 180), primary(100, 250)) == "expected beside tracks 1 and 2: range's end"


def test_between_the_two_tracks_see_best() -> None:
    assert why(lane(120, 150), primary(100, 300)) == "expected beside track 1: even where tracks see best"


def test_before_and_behind_tracks_are_their_ends() -> None:
    assert why(lane(90, 110, rows=(62, 80)), primary(100)) == "expected beside track 1: ends of tracks"


def test_what_was_found_is_told_of_tracks_that_are_flown() -> None:
    assert why(lane(240, 260), primary(200, 250, flown=1)) == "expected beside track 2: nadir gap"
    assert why(lane(240, 260, foreseen=False), primary(200, 250, flown=1)) == (
        "seen badly by track 1: even where tracks see best"
    )


def test_what_weighs_most_comes_first_and_what_weighs_little_not_at_all() -> None:
    wide = lane(80, 190)
    risk = np.full(GRID.shape, 0.01)
    risk[:, 34:37] = 0.9  # 170 to 180 m
    risk[:, 18:23] = 1.0  # 90 to 110 m
    told = why(wide, primary(100, 250), risk=risk)
    assert told.endswith(": nadir gap and range's end")
    risk[:, 34:37] = 0.01
    assert why(wide, primary(100, 250), risk=risk) == "expected beside track 1: nadir gap"


def test_of_several_primaries_it_is_told_whose_track_it_is() -> None:
    told = why(lane(170, 180), primary(100), primary(250, name=SECOND_HELPER))
    assert told == f"expected beside {PRIMARY}'s track 1 and {SECOND_HELPER}'s track 1: range's end"


@pytest.mark.parametrize(("foreseen", "words"), [(True, "expected to be badly seen"), (False, "badly seen")])
def test_while_no_plan_is_known_it_is_told_without_tracks(foreseen: bool, words: str) -> None:
    nobody = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0)
    assert why(lane(0, 50, foreseen=foreseen), nobody) == words


@given(plan=any_message(Plan), foreseen=st.booleans(), risk=st.sampled_from([0.0, 0.5, 1.0]))
def test_whatever_the_plan_it_is_told_in_words(plan: Plan, foreseen: bool, risk: float) -> None:
    one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0, plan=plan)
    told = why(lane(0, 50, foreseen=foreseen), one, risk=np.full(GRID.shape, risk))
    assert told.startswith("expected" if foreseen else ("seen badly", "badly seen"))
    assert (": " in told) is bool(plan.tracks)
