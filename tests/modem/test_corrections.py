"""What a map tells beyond its stretches: any part of it, in whatever order and however often it comes, makes one map,
and all of it makes the vehicle's own."""

from __future__ import annotations

import random
from functools import partial

import numpy as np
import pytest
from along_a_track import CURVE, GRID, LOOKS, P_DETECT, PRIMARY, gathered, layer
from fleets import state
from hypothesis import given
from hypothesis import strategies as st
from modems import Waters

from comms.said.bits import BitReader, BitWriter, folded
from comms.said.messages import CoverageTile, Look, Mode
from comms.said.over_water import Around
from comms.said.packing import get_message, put_message
from comms.said.wire import WireError
from modem.correcting import FINE_AFTER_MS, Correcting
from modem.corrections import STEP_NATS, Correction, Corrections, correction_of
from modem.stretches import LayerOf, Stretch, Told
from planner.risk import MOST_LEVELS, NATS_PER_LEVEL, to_levels
from planner.tiles import tiles

AROUND = Around(0.0, 0.0, 400.0, 400.0, 0)
TILES = tiles(GRID)
STRETCHES = gathered(LOOKS[:10])  # 200 m north along x 200


def own_tiles(seen: np.ndarray) -> list[CoverageTile]:
    """A vehicle's map as its agent tells it, in nats per cell."""
    levels = to_levels(seen)
    return [
        CoverageTile(1, one.first_row, one.first_column, levels[one.window], levels[one.window], levels[one.window] > 0)
        for one in TILES
    ]


def by_stretches() -> np.ndarray:
    """What the coordinator's modem makes of the stretches alone, in nats."""
    told = LayerOf(PRIMARY, GRID)
    told.hear_curve(CURVE)
    return NATS_PER_LEVEL * layer([one for stretch in STRETCHES for one in told.hear(stretch)])


def patchy(share: float = 0.5) -> np.ndarray:
    """What was truly seen there: less in a patch of 30 m by 40 m to starboard, and a little that varies from cell to
    cell."""
    seen = by_stretches()
    seen[4:12, 48:54] *= share
    return np.clip(seen + np.random.default_rng(1).normal(0, 0.1, seen.shape) * (seen > 0), 0.0, None)


def all_corrections(seen: np.ndarray) -> list[Correction]:
    """All that a modem tells where there is always room."""
    correcting = Correcting(PRIMARY, GRID)
    correcting.hear_curve(CURVE)
    for stretch in STRETCHES:
        correcting.hear_stretch(stretch, 1000)
    for tile in own_tiles(seen):
        correcting.hear_tile(tile, 2000)
    found = []
    while (one := correcting.next(700_000)) is not None:
        found.append(one)
        assert len(found) < 200
    return found


def told_by(parts: list[Stretch | Correction]) -> np.ndarray:
    """The map of what has come, in nats."""
    told, found = LayerOf(PRIMARY, GRID), list[Told]()
    told.hear_curve(CURVE)
    for part in parts:
        found += told.correct(part) if isinstance(part, Correction) else told.hear(part)
    return NATS_PER_LEVEL * layer(found)


class TestWhatIsToldFirst:
    def test_blocks_come_before_cells_and_what_is_most_wrong_first(self) -> None:
        found = all_corrections(patchy())
        parts = [one.part for one in found]
        first_fine = next(place for place, part in enumerate(parts) if part)
        assert first_fine > 0
        assert TILES[found[0].tile].window[1].start == 40  # the tile that holds most of the patch
        assert TILES[found[0].tile].window[0].start == 0

    def test_each_one_brings_the_map_nearer_to_what_was_seen(self) -> None:
        seen = patchy()
        off = [
            np.abs(told_by([*STRETCHES, *all_corrections(seen)[:count]]) - seen).sum() for count in (0, 1, 2, 4, 200)
        ]
        assert off == sorted(off, reverse=True)
        assert off[1] < 0.95 * off[0]

    def test_in_the_end_it_is_what_was_seen(self) -> None:
        seen = patchy()
        off = np.abs(told_by([*STRETCHES, *all_corrections(seen)]) - seen)
        assert off.max() <= STEP_NATS / 2 + NATS_PER_LEVEL

    def test_where_all_is_right_nothing_is_told(self) -> None:
        assert all_corrections(by_stretches()) == []

    def test_a_full_sum_tells_of_no_more_than_that_it_is_full(self) -> None:
        seen = by_stretches()
        seen[2, 50] = MOST_LEVELS * NATS_PER_LEVEL
        assert (told_by([*STRETCHES, *all_corrections(seen)])[2, 50]) >= (MOST_LEVELS - 3) * NATS_PER_LEVEL

    def test_cell_by_cell_it_is_told_when_nobody_has_looked_there_for_a_while(self) -> None:
        correcting = Correcting(PRIMARY, GRID)
        correcting.hear_curve(CURVE)
        for stretch in STRETCHES:
            correcting.hear_stretch(stretch, 1000)
        for tile in own_tiles(patchy()):
            correcting.hear_tile(tile, 2000)
        soon = list(iter(partial(correcting.next, 1000 + FINE_AFTER_MS - 1), None))
        later = list(iter(partial(correcting.next, 1000 + FINE_AFTER_MS), None))
        assert {one.part for one in soon} == {0}
        assert {one.part for one in later} >= {1, 2, 3, 4}

    def test_what_was_looked_at_since_its_agent_has_told_of_it_waits(self) -> None:
        correcting = Correcting(PRIMARY, GRID)
        correcting.hear_curve(CURVE)
        for tile in own_tiles(patchy()):
            correcting.hear_tile(tile, 2000)
        for stretch in STRETCHES:
            correcting.hear_stretch(stretch, 2500)
        assert correcting.next(700_000) is None
        for tile in own_tiles(patchy()):
            correcting.hear_tile(tile, 3000)
        assert correcting.next(700_000) is not None


class TestInWhateverOrder:
    @given(st.integers(0, 10**6))
    def test_what_has_come_makes_one_map(self, seed: int) -> None:
        drawn = random.Random(seed)
        known: list[Stretch | Correction] = [*STRETCHES, *drawn.sample(all_corrections(patchy()), 6)]
        expected = told_by(known)
        again = [*known, *drawn.choices(known, k=4)]
        drawn.shuffle(again)
        assert np.abs(told_by(again) - expected).max() < NATS_PER_LEVEL * 1.01

    def test_a_newer_one_takes_the_place_of_an_older(self) -> None:
        more = correction_of(2, 1, len(STRETCHES), np.full((5, 20), 0.3))
        less = correction_of(2, 1, len(STRETCHES) - 1, np.full((5, 20), 0.9))
        both = told_by([*STRETCHES, more, less])
        assert np.array_equal(both, told_by([*STRETCHES, less, more]))
        assert np.array_equal(both, told_by([*STRETCHES, more]))

    def test_it_waits_for_the_stretches_that_it_corrects(self) -> None:
        more = correction_of(2, 1, len(STRETCHES), np.full((5, 20), 0.3))
        assert np.array_equal(told_by([*STRETCHES[1:], more]), told_by(list(STRETCHES[1:])))


class TestWhatIsNone:
    @pytest.mark.parametrize(
        "correction",
        [
            Correction(len(TILES), 0, 0, (0,) * 25),
            Correction(0, 5, 0, (0,) * 100),
            Correction(0, 0, 0, (0,) * 24),
            Correction(0, 2, 0, (0,) * 101),
        ],
    )
    def test_is_refused(self, correction: Correction) -> None:
        with pytest.raises(WireError, match=r"the grid has no tile|a correction of \d+ cells"):
            Corrections(GRID).take(correction)

    def test_what_is_far_beyond_anything_seen_is_cut_off(self) -> None:
        known = Corrections(GRID)
        tile = known.take(Correction(0, 1, 0, (folded(2**30),) * 100))
        assert tile is not None
        assert known.corrected(tile, np.zeros((20, 20)))[:5].max() == pytest.approx(10.0)
        known.take(Correction(0, 1, 1, (folded(-(2**29)),) * 100))
        assert known.corrected(tile, np.ones((20, 20)))[:5].max() == 0.0


@given(st.integers(0, 15), st.integers(0, 4), st.integers(0, 9), st.data())
def test_it_comes_out_of_the_water_as_it_went_in(tile: int, part: int, after: int, data: st.DataObject) -> None:
    off = data.draw(st.lists(st.integers(0, 40), min_size=100 if part else 25, max_size=100 if part else 25))
    one, writer = Correction(tile, part, after, tuple(off)), BitWriter()
    put_message(writer, one, AROUND)
    assert get_message(BitReader(writer.to_bytes()), Correction, AROUND) == one


def test_where_there_is_room_the_coordinators_map_ends_as_the_vehicles_own() -> None:
    lost = random.Random(1)
    waters = Waters(arrives=lambda *_: lost.random() < 0.9, frame_bits=512, frames=2, reports=True, maps="corrected")
    waters.say("alpha", "agent/alpha/curve", CURVE)
    waters.say("alpha", "agent/alpha/state", state(Mode.SURVEY))
    share = np.ones((2, 20, 146))
    share[1, :, 50:80] = 0.3  # to starboard
    for number in range(10):
        p_detect = np.broadcast_to(P_DETECT, (2, 20, 146)) * share
        look = Look(number, 1, 200.0, 0.0, 0.0, 20.0 * number, 1.0, 1.0, p_detect, 5.0, 0.0, True, ())
        waters.say("world", "veh/alpha/look", look)
        waters.run(waters.now_ms + 10_000)
    seen = patchy()
    for tile in own_tiles(seen):
        name = f"{tile.first_row // 20}-{tile.first_column // 20}"
        waters.say("alpha", f"agent/alpha/coverage/{name}", tile)
    waters.run(3_000_000)
    come = [
        Told(one.key.rsplit("/", 1)[1], one.message)
        for _, to, one in waters.heard
        if to == "ship" and isinstance(one.message, CoverageTile)
    ]
    assert np.abs(NATS_PER_LEVEL * layer(come) - seen).max() <= STEP_NATS / 2 + 2 * NATS_PER_LEVEL
    assert not any(modem.dropped for modem in waters.modems.values())
