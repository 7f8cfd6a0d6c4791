"""Numbered random streams: the same bits as those that are made one by one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.node import random_stream
from sim_world.streams import BLOCK, NumberedStreams, states_of

WORDS = st.integers(0, 2**32 - 1)


@given(st.integers(4, 8).flatmap(lambda count: st.lists(st.lists(WORDS, min_size=count, max_size=count), min_size=1)))
def test_the_states_are_those_that_numpy_finds(rows: list[list[int]]) -> None:
    words = np.array(rows, dtype=np.uint32)
    expected = [np.random.SeedSequence(row).generate_state(4, np.uint64) for row in words]
    assert np.array_equal(states_of(words), expected)


@pytest.mark.parametrize("names", [("world", "noise"), ("world", "helper", "noise")])
@pytest.mark.parametrize("seed", [0, 7, 2**32 - 1])
def test_streams_draw_what_those_of_that_name_draw_in_any_order(seed: int, names: tuple[str, ...]) -> None:
    streams = NumberedStreams(seed, *names)
    for number in (1, 2, BLOCK - 1, BLOCK, 0, 10 * BLOCK + 3, 2, 2):
        expected = random_stream(seed, *names, str(number))
        assert streams(number).bit_generator.state == expected.bit_generator.state
        assert np.array_equal(streams(number).standard_normal(5), expected.standard_normal(5))
