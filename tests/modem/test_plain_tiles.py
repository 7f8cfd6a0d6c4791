"""A tile crosses cell by cell, in steps of 0.1 nats, and comes out in its place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from modems import RUN_INFO, Waters, config_of

from comms.said.bits import BitReader, BitWriter
from comms.said.messages import CoverageTile
from comms.said.over_water import Around
from comms.said.packing import get_message, put_message
from comms.said.wire import WireError
from modem.plain_tiles import LEVELS_A_STEP, MOST_STEPS, PlainTile, plain, told

GRID = RUN_INFO.grid.spec
AROUND = Around(0.0, 0.0, 400.0, 400.0, 0)
LEVELS = arrays(np.uint8, (20, 20), elements=st.integers(0, LEVELS_A_STEP * MOST_STEPS))


def tile_of(sums: np.ndarray, largest: np.ndarray, *, row: int = 20, column: int = 40) -> CoverageTile:
    return CoverageTile(3, row, column, sums, np.minimum(largest, sums), np.ones(sums.shape, dtype=np.bool_))


@given(LEVELS, LEVELS)
def test_what_has_crossed_is_off_by_half_a_step_at_most(sums: np.ndarray, largest: np.ndarray) -> None:
    tile, writer = tile_of(sums, largest), BitWriter()
    put_message(writer, plain(tile, GRID), AROUND)
    name, come = told(get_message(BitReader(writer.to_bytes()), PlainTile, AROUND), GRID, 77)
    assert (name, come.version, come.first_row, come.first_column) == ("1-2", 77, 20, 40)
    for field in ("sum_levels", "largest_levels"):
        off = getattr(come, field).astype(int) - getattr(tile, field)
        assert np.abs(off).max() <= LEVELS_A_STEP // 2
    assert not come.settled.any()


def test_a_smooth_tile_takes_little_more_than_two_bits_a_cell() -> None:
    sums = np.repeat(np.linspace(0, 60, 20).astype(np.uint8)[:, None], 20, axis=1)
    writer = BitWriter()
    put_message(writer, plain(tile_of(sums, sums), GRID), AROUND)
    assert 800 < writer.bits < 900


@pytest.mark.parametrize(
    ("tile", "why"),
    [(PlainTile(16, (0,) * 400, (0,) * 400), "no tile 16"), (PlainTile(3, (0,) * 400, (0,) * 399), "so many cells")],
)
def test_what_is_no_tile_of_the_grid_is_refused(tile: PlainTile, why: str) -> None:
    with pytest.raises(WireError, match=why):
        told(tile, GRID, 1)


def test_a_vehicles_newest_tile_reaches_the_coordinator() -> None:
    waters, levels = Waters(maps="tiles"), np.full((20, 20), 50, dtype=np.uint8)
    for version, part in ((1, levels // 2), (2, levels)):
        tile = CoverageTile(version, 20, 40, part, part, np.zeros((20, 20), dtype=np.bool_))
        waters.say("alpha", "agent/alpha/coverage/1-2", tile)
    waters.run(120_000)
    ((_, platform, heard),) = waters.heard
    assert (platform, heard.key, heard.sender) == ("ship", "agent/alpha/coverage/1-2", "alpha")
    assert isinstance(heard.message, CoverageTile)
    assert (heard.message.sum_levels == 50).all()


def test_small_frames_have_no_room_for_tiles() -> None:
    with pytest.raises(ValueError, match=r"link\.maps: tiles do not cross in frames of 34 bits"):
        config_of("alpha", frame_bits=34, maps="tiles")
