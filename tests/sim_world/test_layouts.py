"""Where targets lie: in the ground, as many as asked for, and laid as the layout says."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from planner.types import FloatArray, Point
from sim_world.area import Ground
from sim_world.config import TargetsConfig
from sim_world.layouts import Clusters, Given, Layout, Lines, Uniform
from sim_world.targets import make_targets

SQUARE: tuple[Point, ...] = ((0.0, 0.0), (400.0, 0.0), (400.0, 300.0), (0.0, 300.0))
# An L with a hole, and a zone to keep out of that reaches beyond it.
GROUND = Ground(
    ((0.0, 0.0), (500.0, 0.0), (500.0, 100.0), (200.0, 100.0), (200.0, 400.0), (0.0, 400.0)),
    (((50.0, 200.0), (120.0, 200.0), (120.0, 260.0), (50.0, 260.0)), ((450.0, -50.0), (600.0, -50.0), (450.0, 90.0))),
)


def laid(layout: Layout, count: int, seed: int = 1, ground: Ground = GROUND) -> FloatArray:
    return layout.places(ground, count, np.random.default_rng(seed))


@given(
    layout=st.one_of(
        st.just(Uniform()),
        st.builds(Lines, st.floats(0.0, 6.28), st.floats(5.0, 400.0), st.sampled_from([0.0, 3.0, 200.0])),
        st.builds(Clusters, st.integers(1, 9), st.floats(1.0, 300.0)),
    ),
    count=st.integers(0, 60),
    seed=st.integers(0, 1000),
)
def test_as_many_as_asked_for_lie_in_the_ground(layout: Layout, count: int, seed: int) -> None:
    places = laid(layout, count, seed)
    assert places.shape == (count, 2)
    # Those that lie in their rows may lie on the very edge.
    assert shapely.covers(GROUND.polygon.buffer(1e-6), shapely.points(places)).all()
    assert np.array_equal(places, laid(layout, count, seed))


def test_rows_lie_apart_as_told_and_targets_in_them_evenly() -> None:
    # Rows to the north over 300 m, 90 m apart: four or five of them, and 60 targets evenly over their length.
    places = laid(Lines(0.0, 90.0), 60, ground=Ground(SQUARE))
    rows = np.unique(np.round(places[:, 0], 6))
    assert np.diff(rows) == pytest.approx(np.full(rows.size - 1, 90.0))
    assert rows[0] < 90.0
    assert rows[-1] > 400.0 - 90.0
    apart_m = 300.0 * rows.size / 60
    for row in rows:
        along = np.sort(places[np.isclose(places[:, 0], row), 1])
        assert np.diff(along) == pytest.approx(np.full(along.size - 1, apart_m))


def test_rows_run_along_their_heading() -> None:
    # To the east-north-east: across a compass heading of 60 degrees targets lie in whole multiples of 50 m.
    places = laid(Lines(math.radians(60.0), 50.0), 80)
    across_m = places @ np.array([math.cos(math.radians(60.0)), -math.sin(math.radians(60.0))])
    offset_m = (across_m - across_m[0]) / 50.0
    assert offset_m == pytest.approx(np.rint(offset_m), abs=1e-6)
    assert np.unique(np.rint(offset_m)).size > 3


def test_a_row_is_broken_where_there_is_no_ground() -> None:
    # A single row along x 0 to 500 at most, between y 200 and 260 through the hole.
    ground = Ground(SQUARE, (((100.0, -10.0), (300.0, -10.0), (300.0, 310.0), (100.0, 310.0)),))
    places = laid(Lines(math.pi / 2, 300.0), 20, ground=ground)
    east = np.sort(places[:, 0])
    assert np.unique(np.round(places[:, 1], 6)).size == 1
    # 200 m of row for 20 targets: 10 m from each to the next, and 210 m across the gap.
    assert np.sort(np.diff(east)) == pytest.approx([10.0] * 18 + [210.0])


def test_jitter_is_normal_about_the_row() -> None:
    wide: tuple[Point, ...] = ((0.0, 0.0), (1e5, 0.0), (1e5, 1e5), (0.0, 1e5))
    rows, off = (laid(Lines(0.0, 500.0, jitter_m), 4000, ground=Ground(wide)) for jitter_m in (0.0, 7.0))
    # All rows but those at the edge keep what is drawn.
    inner = (rows[:, 0] > 100.0) & (rows[:, 0] < 1e5 - 100.0)
    differs = (off - rows)[inner]
    assert differs.mean() == pytest.approx(0.0, abs=4 * 7.0 / math.sqrt(differs.size))
    assert differs.std() == pytest.approx(7.0, rel=0.05)


def test_clusters_are_as_many_and_as_wide_as_told() -> None:
    wide: tuple[Point, ...] = ((0.0, 0.0), (1e5, 0.0), (1e5, 1e5), (0.0, 1e5))
    places = laid(Clusters(6, 20.0), 3000, ground=Ground(wide))
    middles: list[FloatArray] = []
    for place in places:
        if all(math.dist(place, middle) > 500.0 for middle in middles):
            middles.append(place)
    assert len(middles) == 6
    near = [places[np.hypot(*(places - middle).T) < 500.0] for middle in middles]
    assert sum(len(one) for one in near) == 3000
    assert [len(one) for one in near] == pytest.approx([500.0] * 6, abs=4 * math.sqrt(3000 * 1 / 6 * 5 / 6))
    assert np.concatenate([one - one.mean(axis=0) for one in near]).std() == pytest.approx(20.0, rel=0.05)


def test_clusters_far_wider_than_the_ground_lie_evenly_in_it() -> None:
    places = laid(Clusters(2, 1e5), 3000, ground=Ground(((0.0, 0.0), (10.0, 0.0), (10.0, 40.0), (0.0, 40.0))))
    assert places.mean(axis=0) == pytest.approx([5.0, 20.0], rel=0.05)
    assert places.std(axis=0) == pytest.approx([10.0 / math.sqrt(12.0), 40.0 / math.sqrt(12.0)], rel=0.05)


def test_places_that_are_given_are_taken_as_they_are() -> None:
    given_m = ((3.5, 4.0), (1.0, 2.25))
    truth = make_targets(TargetsConfig(2, Given(given_m)), SQUARE, 1).truth()
    assert [(one.x_m, one.y_m) for one in truth.targets] == list(given_m)
    assert make_targets(TargetsConfig(0, Given(())), SQUARE, 1).truth().targets == ()


@pytest.mark.parametrize("seed", range(10))
def test_rows_are_drawn_until_one_passes_over_the_ground(seed: int) -> None:
    # One row, and a zone over all but the westernmost tenth.
    ground = Ground(SQUARE, (((40.0, -10.0), (410.0, -10.0), (410.0, 310.0), (40.0, 310.0)),))
    places = laid(Lines(0.0, 400.0), 5, seed, ground)
    assert len(places) == 5
    assert (places[:, 0] <= 40.0).all()


def test_ground_that_no_row_passes_over_is_refused() -> None:
    # All but a strip that is a millimetre wide is a hole.
    ground = Ground(SQUARE, (((-1.0, -1.0), (399.999, -1.0), (399.999, 301.0), (-1.0, 301.0)),))
    with pytest.raises(ValueError, match="no row"):
        laid(Lines(0.0, 400.0), 5, ground=ground)


def test_what_targets_are_does_not_move_them() -> None:
    plain = make_targets(TargetsConfig(20), SQUARE, 1).truth()
    assert make_targets(TargetsConfig(20, correlation=0.7, aspect_rad=1.0, kinds="mines"), SQUARE, 1).truth() == plain
