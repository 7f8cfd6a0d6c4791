"""What the seabed leaves, from what was seen against what was expected."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from comms.messages import Curve, Plan, PlannedTrack
from coordinator.seabed_share import ABOUT_M, LEAST_SHARE, SeabedShare
from planner.fleet_map import VehicleLayer
from planner.risk import NATS_PER_LEVEL
from planner.types import BoolArray, FloatArray, GridSpec, SweepFrame

GRID = GridSpec(SweepFrame(0, 0, 0), 5, 41, 60)  # 200 m across, 300 m along
INSIDE: BoolArray = np.ones(GRID.shape, dtype=np.bool_)
P_DETECT = 0.6
CURVE = Curve(1, 10, np.full(11, P_DETECT), 100)  # as good everywhere, to 100 m
UP = PlannedTrack(1, 100, 100, 0, 100, 300, True)  # in the middle: sees all


def plan(*tracks: PlannedTrack) -> Plan:
    return Plan(1, tracks, (), (), "")


def layer(share: FloatArray) -> VehicleLayer:
    """What a primary has seen that the seabed leaves these shares of what the curve tells."""
    nats = -np.log1p(-P_DETECT) * share
    levels = np.rint(nats / NATS_PER_LEVEL).astype(np.uint8)
    return VehicleLayer(levels, levels, INSIDE, INSIDE)


@pytest.fixture
def seabed() -> SeabedShare:
    """After one track."""
    found = SeabedShare(GRID, INSIDE)
    found.take_curve("primary", CURVE)
    assert found.take_plan("primary", plan(UP))
    return found


def test_before_anything_is_flown_all_is_clear() -> None:
    found = SeabedShare(GRID, INSIDE)
    found.take_curve("primary", CURVE)
    assert not found.take_plan("primary", plan(PlannedTrack(1, 100, 100, 0, 100, 300, False)))
    found.learn({})
    assert (found.share == 1).all()


def test_a_track_tells_once(seabed: SeabedShare) -> None:
    assert not seabed.take_plan("primary", plan(UP))
    assert seabed.take_plan("other", plan(UP)) is False  # of whom no curve is known
    seabed.take_curve("other", CURVE)
    assert seabed.take_plan("other", plan(UP))


def test_where_less_is_seen_than_elsewhere_the_seabed_takes_it(seabed: SeabedShare) -> None:
    share = np.ones(GRID.shape)
    share[:15] = 0.5  # the first 75 m: a quarter
    seabed.learn({"primary": layer(share)})
    about = round(ABOUT_M / GRID.cell_m)
    assert seabed.share[: 15 - about] == pytest.approx(0.5, abs=0.02)
    assert seabed.share[15 + about :] == pytest.approx(1.0, abs=0.02)
    assert (np.diff(seabed.share[:, 20]) >= -1e-9).all()  # in between it rises


def test_what_is_seen_everywhere_alike_is_clear_however_much_the_curve_tells(seabed: SeabedShare) -> None:
    seabed.learn({"primary": layer(np.full(GRID.shape, 0.4))})
    assert seabed.share == pytest.approx(1.0)


def test_the_least_share_holds_where_nothing_is_seen(seabed: SeabedShare) -> None:
    share = np.ones(GRID.shape)
    share[:15] = 0.0
    seabed.learn({"primary": layer(share)})
    assert seabed.share.min() == LEAST_SHARE


def test_where_no_track_has_passed_the_seabed_is_as_it_is_on_average(seabed: SeabedShare) -> None:
    beyond = SeabedShare(GRID, INSIDE)
    beyond.take_curve("primary", CURVE)
    beyond.take_plan("primary", plan(PlannedTrack(1, 0, 0, 0, 0, 300, True)))  # sees the western half
    share = np.ones(GRID.shape)
    share[:15] = 0.5
    beyond.learn({"primary": layer(share)})
    told = beyond.share[:, :15]
    assert beyond.share[:, -5:] == pytest.approx(told.mean(), abs=0.01)


def test_the_curve_of_earlier_missions_counts_until_there_is_one() -> None:
    found = SeabedShare(GRID, INSIDE)
    found.take_curve("primary", Curve(0, 10, np.full(11, 0.9), 100))
    found.take_curve("primary", Curve(1, 10, np.full(6, P_DETECT), 50))
    found.take_plan("primary", plan(UP))
    found.learn({"primary": layer(np.ones(GRID.shape))})
    # By the track's own curve nothing is expected beyond 50 m: what was seen there tells nothing.
    far = np.abs(GRID.across_m - 100) > 50 + ABOUT_M
    assert np.unique(found.share[:, far]).size == 1


@settings(max_examples=40, deadline=None)
@given(arrays.arrays(np.float64, GRID.shape, elements=st.sampled_from([0.0, 0.2, 0.9, 1.0])))
def test_shares_keep_their_range(share: FloatArray) -> None:
    found = SeabedShare(GRID, INSIDE)
    found.take_curve("primary", CURVE)
    found.take_plan("primary", plan(UP))
    found.learn({"primary": layer(share)})
    assert (found.share >= LEAST_SHARE).all()
    assert (found.share <= 1).all()


def test_a_curve_without_points_is_none() -> None:
    found = SeabedShare(GRID, INSIDE)
    found.take_curve("primary", Curve(1, 10, np.zeros(0), 0))
    assert not found.take_plan("primary", plan(UP))
