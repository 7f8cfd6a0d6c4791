"""Random generators that are numbered one after the other: those of `comms.node.random_stream`, of many at a time.

numpy takes five times as long to make a generator as the world to draw from it. What a seed comes to is worked out here
for a block of numbers together, by numpy's algorithm (`numpy.random.SeedSequence`), which it promises to keep.
"""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
from numpy.random import PCG64, Generator
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

BLOCK = 256
"""Numbers that are worked out together."""
MOST_WORDS = 8
"""Of a seed: the seed's own, a name's each and the number's."""
_POOL = 4

WordArray = NDArray[np.uint32]


class NumberedStreams:
    """`random_stream(seed, *names, str(number))` for each number >= 0; there are 2 to 6 names."""

    def __init__(self, seed: int, *names: str) -> None:
        self._words = np.array([[seed, *(zlib.crc32(name.encode()) for name in names)]], dtype=np.uint32)
        self._block = -1
        self._states = np.zeros((0, _POOL), dtype=np.uint64)

    def __call__(self, number: int) -> Generator:
        """The generator of a number, always the same one."""
        block, place = divmod(number, BLOCK)
        if block != self._block:
            first = block * BLOCK
            last_words = [[zlib.crc32(b"%d" % one)] for one in range(first, first + BLOCK)]
            same = self._words.repeat(BLOCK, axis=0)
            self._states = states_of(np.concatenate([same, np.array(last_words, dtype=np.uint32)], axis=1))
            self._block = block
        return Generator(PCG64(_Seed(self._states[place])))  # type: ignore[arg-type]  # numpy's stubs know no other seeds


class _Seed(ISeedSequence):
    """A seed that says what it has been worked out to."""

    def __init__(self, state: NDArray[np.uint64]) -> None:
        self._state = state

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> NDArray[Any]:
        """The state that a `PCG64` asks for: 4 words of 64 bits."""
        return self._state


def _constants(first: int, factor: int, count: int) -> WordArray:
    """The constants of so many steps of hashing, and one more: each is the one before times the factor."""
    return np.array([first * pow(factor, step, 2**32) % 2**32 for step in range(count + 1)], dtype=np.uint32)


_MIXING = _constants(0x43B0D7E5, 0x931E8875, MOST_WORDS * _POOL)
_TELLING = _constants(0x8B51F9DD, 0x58F38DED, 2 * _POOL)


def states_of(words: WordArray) -> NDArray[np.uint64]:
    """What `SeedSequence(row).generate_state(4, np.uint64)` tells for each row of words; shape (rows, 4).

    `words`: shape (rows, n), 4 <= n <= `MOST_WORDS`.
    """
    pool, used = _hashed(words[:, :_POOL], _MIXING[: _POOL + 1]), _POOL
    for source in range(_POOL):
        others = [place for place in range(_POOL) if place != source]
        into = _MIXING[used : used + _POOL]
        pool[:, others] = _mixed(pool[:, others], _hashed(pool[:, source, np.newaxis], into))
        used += _POOL - 1
    for word in words.T[_POOL:]:
        pool = _mixed(pool, _hashed(word[:, np.newaxis], _MIXING[used : used + _POOL + 1]))
        used += _POOL
    told = _hashed(np.concatenate([pool, pool], axis=1), _TELLING).astype("<u4")
    return told.view("<u8").astype(np.uint64)


def _hashed(words: WordArray, constants: WordArray) -> WordArray:
    """Words, by column, hashed by one constant after the other, each with the next one."""
    hashed: WordArray = (words ^ constants[:-1]) * constants[1:]
    hashed ^= hashed >> np.uint32(16)
    return hashed


def _mixed(words: WordArray, others: WordArray) -> WordArray:
    mixed: WordArray = np.uint32(0xCA01F9DD) * words - np.uint32(0x4973F715) * others
    mixed ^= mixed >> np.uint32(16)
    return mixed
