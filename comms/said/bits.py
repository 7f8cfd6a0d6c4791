"""Bits in a row, written and read: numbers of a known size, and exp-Golomb codes, the shorter the smaller the number.

The most significant bit of a number comes first.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate

from comms.said.wire import WireError


class BitWriter:
    """Bits in the order in which they are written: `bits` of them, which read as a number are `value`."""

    def __init__(self) -> None:
        self.value = 0
        self.bits = 0

    def write(self, value: int, bits: int) -> None:
        """A number from 0 in so many bits. Raises WireError where it does not fit."""
        if not 0 <= value < 1 << bits:
            raise WireError(f"{value} does not fit {bits} bits")
        self.value = self.value << bits | value
        self.bits += bits

    def write_count(self, value: int, order: int) -> None:
        """A number from 0 without a bound, as an exp-Golomb code: `order` + 1 bits below 2^order, two more for the
        2^(order + 1) numbers after these, and so on. Raises WireError where it is below 0."""
        if value < 0:
            raise WireError(f"{value} is below 0")
        beyond = value + (1 << order)
        self.write(beyond, 2 * beyond.bit_length() - 1 - order)

    def write_counts(self, values: Iterable[int], order: int) -> None:
        """The same of many numbers. Raises WireError where one is below 0."""
        value, bits, beyond = 0, 0, 1 << order
        for one in values:
            if one < 0:
                raise WireError(f"{one} is below 0")
            size = 2 * (one + beyond).bit_length() - 1 - order
            value, bits = value << size | one + beyond, bits + size
        self.write(value, bits)

    def write_signed(self, value: int, order: int) -> None:
        """A number of either sign, as the exp-Golomb code of its place in 0, 1, -1, 2, -2 and so on."""
        self.write_count(folded(value), order)

    def to_bytes(self) -> bytes:
        """The bits, filled up with zeros to whole bytes."""
        size = (self.bits + 7) // 8
        return (self.value << 8 * size - self.bits).to_bytes(size, "big")

    def pieces(self, most_bits: int, first_bits: int | None = None) -> list[tuple[int, int]]:
        """The bits cut into pieces of at most `most_bits` > 0, the first of at most `first_bits` > 0 if that is given,
        each as its number and how many bits it has: `write` puts them together again."""
        first = min(self.bits, first_bits or most_bits)
        sizes = [first] * bool(first) + [min(most_bits, self.bits - at) for at in range(first, self.bits, most_bits)]
        ends = accumulate(sizes)
        return [(self.value >> self.bits - end & (1 << size) - 1, size) for size, end in zip(sizes, ends, strict=True)]


class BitReader:
    """Reads what a `BitWriter` has written; `left`: how many bits are yet to be read, the zeros that fill up the last
    byte among them. Every method raises WireError where there are not as many as it needs."""

    def __init__(self, packed: bytes) -> None:
        self._value = int.from_bytes(packed, "big")
        self.left = 8 * len(packed)

    def read(self, bits: int) -> int:
        """The number in the next bits."""
        if bits > self.left:
            raise WireError(f"{bits} bits are to be read, {self.left} are left")
        self.left -= bits
        return self._value >> self.left & (1 << bits) - 1

    def read_count(self, order: int) -> int:
        """The number of an exp-Golomb code."""
        rest = self._value & (1 << self.left) - 1
        return self.read(2 * (self.left - rest.bit_length()) + 1 + order) - (1 << order)

    def read_counts(self, order: int, count: int) -> tuple[int, ...]:
        """The numbers of so many exp-Golomb codes."""
        left, beyond, found = self.left, 1 << order, []
        rest = self._value & (1 << left) - 1
        for _ in range(count):
            size = 2 * (left - rest.bit_length()) + 1 + order
            if size > left:
                raise WireError(f"{size} bits are to be read, {left} are left")
            left -= size
            found.append((rest >> left) - beyond)
            rest &= (1 << left) - 1
        self.left = left
        return tuple(found)

    def read_signed(self, order: int) -> int:
        """The number of either sign that `write_signed` has written."""
        return unfolded(self.read_count(order))


def folded(value: int) -> int:
    """A number's place in 0, 1, -1, 2, -2 and so on."""
    return 2 * value - 1 if value > 0 else -2 * value


def unfolded(place: int) -> int:
    """The number at a place there."""
    return (place + 1) // 2 if place % 2 else -place // 2
