"""A vehicle's looks, told by stretches, become nearly the layer that its agent sums up."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest
from along_a_track import CURVE, GRID, HELPER, LOOKS, P_DETECT, PRIMARY, gathered, layer, look

from comms.said.messages import Curve, Look
from modem.stretches import CHUNK_M, Gathering, LayerOf
from planner.risk import NATS_PER_LEVEL
from vehicle_agent.coverage import CoverageLayer


def test_looks_along_a_track_are_one_stretch_of_four_chunks_at_most() -> None:
    stretches = gathered([*LOOKS, look(20, 400.0), look(21, 440.0), look(22, 460.0, maneuver=2)])
    assert [(one.number, one.y_m, one.length_m, len(one.seen)) for one in stretches] == [
        (1, 0.0, 400.0, 4), (2, 400.0, 20.0, 1), (3, 440.0, 20.0, 1), (4, 460.0, 20.0, 1)
    ]  # fmt: skip
    assert {one.curve for one in stretches} == {2}


def test_what_is_not_valid_is_in_no_stretch() -> None:
    stretches = gathered([LOOKS[0], look(1, 20.0, valid=False), LOOKS[2]])
    assert [(one.y_m, one.length_m) for one in stretches] == [(0.0, 20.0), (40.0, 20.0)]


def test_how_much_was_seen_is_told_by_side_in_quarters_of_a_halving() -> None:
    (one,) = gathered(LOOKS[:5])
    halves = np.log1p(-0.5 * P_DETECT).sum() / np.log1p(-P_DETECT).sum()
    steps = round(4 * math.log2(halves))
    assert one.seen[0].starboard == 0
    assert one.seen[0].port == -2 * steps  # folded: a number below 0 at an even place


@pytest.mark.parametrize("curve", [CURVE, None])
def test_the_layer_is_that_of_the_agent_but_for_what_is_rounded(curve: Curve | None) -> None:
    agent = CoverageLayer("alpha", GRID)
    for one in LOOKS:
        agent.add(one)
    own = LayerOf(PRIMARY, GRID)
    tiles = own.hear_curve(CURVE) if curve else []
    tiles += [tile for one in gathered(LOOKS, curve) for tile in own.hear(one)]
    told, seen = layer(tiles), agent.layer.sum_levels.astype(float)
    assert abs(told.sum() - seen.sum()) <= 0.06 * seen.sum()
    if curve is not None:
        assert np.abs(told - seen).max() <= 0.1 * seen.max()
        assert ((told > 0) == (seen > 0)).mean() > 0.99


def test_the_layer_does_not_hang_on_the_order_and_nothing_counts_twice() -> None:
    stretches = gathered([*LOOKS[:12], *(look(40 + place, 20.0 * place, 0.5, maneuver=2) for place in range(12))])
    assert len(stretches) >= 2
    found = []
    for order in permutations(stretches):
        own, tiles = LayerOf(PRIMARY, GRID), []
        for one in order:
            tiles += own.hear(one) + own.hear(one)
        tiles += own.hear_curve(CURVE)
        found.append(layer(tiles))
    assert found[0].any()
    for other in found[1:]:
        np.testing.assert_array_equal(found[0], other)


def test_a_stretch_waits_for_the_curve_by_which_it_is_told() -> None:
    own, (one,) = LayerOf(PRIMARY, GRID), gathered(LOOKS[:5])
    assert own.hear(one) == []
    assert own.hear_curve(Curve(0, 1.0, P_DETECT, 100)) == []
    tiles = own.hear_curve(CURVE)
    assert layer(tiles).sum() > 0


def test_of_a_sonar_that_was_announced_what_it_sees_is_flat_between_its_ranges() -> None:
    flat = np.where(np.arange(40) <= 25, 0.7, 0.0)
    p_detect = np.broadcast_to(flat, (2, 20, 40)).copy()
    gathering = Gathering(HELPER)
    for place in range(5):
        gathering.add(Look(place, 1, 200.0, 0.0, 0.0, 20.0 * place, 1.0, 1.0, p_detect, 5.0, 0.0, True, ()))
    one = gathering.flush()
    assert one is not None
    assert (one.curve, len(one.seen), one.seen[0].port, one.seen[0].starboard) == (0, 1, 0, 0)
    told = layer(LayerOf(HELPER, GRID).hear(one))
    cells = told[: round(CHUNK_M / 5), 35:46]  # centres 25 m to port to 25 m to starboard
    assert set(np.unique(cells)) == {round(-math.log(0.3) / NATS_PER_LEVEL)}
    assert told.sum() == cells.sum()


def test_each_start_of_a_modem_numbers_its_stretches_by_itself() -> None:
    before, anew = Gathering(PRIMARY), Gathering(PRIMARY, start=2)
    numbers = set[int]()
    for gathering in (before, anew):
        for one in LOOKS[:3]:
            gathering.add(one)
            ended = gathering.flush()
            assert ended is not None
            numbers.add(ended.number)
    assert len(numbers) == 6
