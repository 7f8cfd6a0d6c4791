"""Why a strip lies where it does, in words: causes and tracks by hand, and words for whatever plan there is."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import PRIMARY, SECOND_HELPER, vehicle
from compiling import needs_compiling, times_compiled
from hypothesis import given
from hypothesis import strategies as st

from comms.said.announcement import Role
from comms.said.messages import Plan, PlannedTrack
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.reasons import Reasons, _apart, _best_m, _evenly, _listed, _named, judged
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


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ((1, 1, 1, 1), "tracks 1, 2 and 3"),
        ((4, 1, 2, 3), "tracks 1 and 4"),
        ((3, 1, 0, 0), "tracks 1 and 2"),
        ((3, 0.99, 0, 0), "track 1"),
        ((0, 0.99, 3, 0), "track 3"),
    ],
)
def test_three_tracks_at_most_are_named_and_from_a_quarter_of_the_risk_on(
    weights: tuple[float, ...], words: str
) -> None:
    # One row right below each of four tracks, which are looked at all.
    tracks = tuple(PlannedTrack(n, 0, 300, 2.5 + 5 * n, 320, 2.5 + 5 * n, False) for n in range(1, 5))
    one = KnownVehicle(vehicle(PRIMARY, Role.SURVEY), 0, plan=Plan(1, tracks, (60,), (), ""), curves={1: CURVE})
    risk = np.zeros(GRID.shape)
    risk[1:5, 60:64] = np.array(weights)[:, np.newaxis]
    told = why(Cut(Window(1, 5, 60, 64), 100, 100, foreseen=True), one, risk=risk)
    assert told == f"expected beside {words}: nadir gap"


@pytest.mark.parametrize(
    ("apart_m", "cause"),
    [(15, "nadir gap"), (16, "even where tracks see best"), (69, "even where tracks see best"), (70, "range's end")],
)
def test_where_it_sees_best_it_sees_half_as_well_as_anywhere_or_better(apart_m: float, cause: str) -> None:
    assert why(lane(200, 200), primary(200 - apart_m)) == f"expected beside track 1: {cause}"
    assert why(lane(200, 200), primary(200 + apart_m)) == f"expected beside track 1: {cause}"


@pytest.mark.parametrize(
    ("p_detect", "best_m"),
    [
        ((0.4, 0.8, 0.4), (-1.0, 20.0)),  # just half of it is not low
        ((0.39, 0.8, 0.39), (0.0, 20.0)),
        ((0.1, 0.3, 0.39, 0.8, 0.5, 0.39, 0.1), (20.0, 50.0)),
        ((0.8, 0.1, 0.8, 0.1, 0.1), (-1.0, 10.0)),  # of two that are best the first
    ],
)
def test_between_which_ranges_it_sees_best(p_detect: tuple[float, ...], best_m: tuple[float, float]) -> None:
    assert _best_m(DetectionCurve(np.arange(0.0, 10.0 * len(p_detect), 10.0), np.array(p_detect))) == best_m


def test_places_are_apart_from_a_track_and_beyond_its_ends() -> None:
    # From (10, 20) 50 m up a slope of 3 to 4; beside it, before it, and behind it aside.
    slope = np.array([10.0, 20.0, 40.0, 60.0])
    places = (25 + 8.0, 40 - 6.0), (10 - 6.0, 20 - 8.0), (40 + 3.0 - 8.0, 60 + 4.0 + 6.0)
    assert np.array([_apart(x_m, y_m, slope) for x_m, y_m in places]) == pytest.approx(
        np.array([(10, 0), (10, 10), (np.hypot(5, 10), 5)])
    )
    assert _apart(4.0, 7.25, np.array([7.0, 7.0, 7.0, 7.5])) == pytest.approx((3.0, 0.0))


def test_a_place_half_a_metre_behind_a_track_is_beyond_it() -> None:
    track = np.array([3.0, 4.0, 3.0, 10.0])
    assert [_apart(3.0, y_m, track) for y_m in (10.0, 10.5)] == [(0.0, 0.0), (0.5, 0.5)]


@given(
    window=st.tuples(st.integers(0, 40), st.integers(1, 40), st.integers(0, 40), st.integers(1, 40)),
    heading_rad=st.floats(0.0, 6.28),
    seed=st.integers(0, 100),
    tracks=st.integers(1, 5),
)
def test_cells_are_judged_as_many_at_once_would_be(
    window: tuple[int, int, int, int], heading_rad: float, seed: int, tracks: int
) -> None:
    rng = np.random.default_rng(seed)
    grid = GridSpec(SweepFrame(-70.0, 300.0, heading_rad), 5.0, 81, 80)
    risk, ends, best_m = rng.random(grid.shape), rng.uniform(-300, 500, (tracks, 4)), rng.uniform(0, 90, (tracks, 2))
    place = Window(window[0], window[0] + window[1], window[2], window[2] + window[3])
    places = Reasons(grid, {}, risk)._places
    nearest, causes, weights = judged(places, place.bounds, ends, best_m)

    rows, columns = _evenly(place.first_row, place.end_row), _evenly(place.first_column, place.end_column)
    across_m, along_m = grid.across_m[columns][np.newaxis, :], grid.along_m[rows][:, np.newaxis]
    x_m, y_m = (one.ravel() for one in grid.frame.to_mission(across_m, along_m))
    start_x, start_y, end_x, end_y = ends.T[:, :, np.newaxis]
    length = np.hypot(end_x - start_x, end_y - start_y)
    east, north = (end_x - start_x) / length, (end_y - start_y) / length
    along = (x_m - start_x) * east + (y_m - start_y) * north
    across = (x_m - start_x) * north - (y_m - start_y) * east
    over = np.maximum(np.maximum(-along, along - length), 0.0)
    apart_m = np.hypot(across, over)
    assert nearest.tolist() == apart_m.argmin(axis=0).tolist()
    cells = np.arange(nearest.size)
    apart_m, is_beyond, (near_m, far_m) = apart_m[nearest, cells], over[nearest, cells] > 0, best_m[nearest].T
    holds = np.array([is_beyond, apart_m <= near_m, apart_m >= far_m, np.ones_like(is_beyond)])
    assert causes.tolist() == holds.argmax(axis=0).tolist()
    assert weights.tolist() == risk[np.ix_(rows, columns)].ravel().tolist()


def test_what_weighs_most_is_named_however_little_that_is() -> None:
    assert _named(np.array([2, 0, 4, 1, 3]), np.array([1.0, 1.0, 1.0, 1.1, 1.0])) == [1]


def test_at_most_twelve_cells_to_a_side_are_looked_at_evenly_with_both_ends() -> None:
    assert _evenly(5, 9).tolist() == [5, 6, 7, 8]
    assert _evenly(3, 4).tolist() == [3]
    assert _evenly(10, 22).tolist() == list(range(10, 22))
    assert _evenly(10, 33).tolist() == list(range(10, 33, 2))
    assert _evenly(0, 112).tolist() == [0, 10, 20, 30, 40, 50, 61, 71, 81, 91, 101, 111]


def test_words_are_listed_with_an_and_before_the_last() -> None:
    assert [_listed(words) for words in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]


def test_of_ground_without_risk_each_place_weighs_the_same() -> None:
    told = why(lane(90, 110), primary(100, 250), risk=np.zeros(GRID.shape))
    assert told == "expected beside track 1: nadir gap"


def test_of_several_primaries_each_sees_as_its_own_curve_tells_and_tracks_are_told_in_order() -> None:
    one, other = primary(100), primary(0, 250, name="a-second")
    other.curves = {1: DetectionCurve(np.array([0.0, 20, 25, 90]), np.array([0.8, 0.8, 0.1, 0.0]))}
    assert why(lane(130, 150), one, other) == f"expected beside {PRIMARY}'s track 1: even where tracks see best"
    assert why(lane(200, 220), one, other) == "expected beside a-second's track 2: range's end"
    half = np.zeros(GRID.shape)
    half[:, 34], half[:, 36] = 1.0, 2.0
    assert (
        why(lane(170, 180), one, other, risk=half)
        == f"expected beside a-second's track 2 and {PRIMARY}'s track 1: range's end"
    )


@needs_compiling
def test_for_places_of_all_kinds_judging_is_compiled_once() -> None:
    why(lane(90, 110), primary(100, 250), risk=np.zeros(GRID.shape))
    assert times_compiled(judged) == 1
