"""Bits in a row: codes worked out by hand, what is read is what was written, and pieces give the whole again."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.said.bits import BitReader, BitWriter
from comms.said.wire import WireError


def _text(writer: BitWriter) -> str:
    return f"{writer.value:0{writer.bits}b}" if writer.bits else ""


@pytest.mark.parametrize(
    ("value", "order", "bits"),
    [
        (0, 0, "1"),
        (1, 0, "010"),
        (2, 0, "011"),
        (3, 0, "00100"),
        (0, 2, "100"),
        (3, 2, "111"),
        (4, 2, "01000"),
        (11, 2, "01111"),
        (12, 2, "0010000"),
    ],
)
def test_a_count_is_the_shorter_the_smaller_it_is(value: int, order: int, bits: str) -> None:
    writer = BitWriter()
    writer.write_count(value, order)
    assert _text(writer) == bits


@pytest.mark.parametrize(("value", "bits"), [(0, "1"), (1, "010"), (-1, "011"), (2, "00100"), (-2, "00101")])
def test_a_signed_number_is_the_shorter_the_nearer_to_0(value: int, bits: str) -> None:
    writer = BitWriter()
    writer.write_signed(value, 0)
    assert _text(writer) == bits


def test_bits_are_filled_up_to_bytes_with_zeros() -> None:
    writer = BitWriter()
    assert writer.to_bytes() == b""
    writer.write(5, 3)
    writer.write(0, 0)
    writer.write(65, 7)
    assert (writer.bits, writer.value) == (10, 0b101_1000001)
    assert writer.to_bytes() == bytes([0b10110000, 0b01000000])


numbers = st.one_of(
    st.tuples(st.just("plain"), st.integers(0, 2**20 - 1), st.just(20)),
    st.tuples(st.just("count"), st.integers(0, 2**40), st.integers(0, 12)),
    st.tuples(st.just("signed"), st.integers(-(2**40), 2**40), st.integers(0, 12)),
)


@given(written=st.lists(numbers, max_size=12), most_bits=st.integers(1, 99))
def test_what_is_read_is_what_was_written_also_put_together_from_pieces(
    written: list[tuple[str, int, int]], most_bits: int
) -> None:
    whole, together = BitWriter(), BitWriter()
    for how, value, size in written:
        {"plain": whole.write, "count": whole.write_count, "signed": whole.write_signed}[how](value, size)
    pieces = whole.pieces(most_bits)
    assert all(bits == most_bits for _, bits in pieces[:-1])
    for piece, bits in pieces:
        together.write(piece, bits)
    assert (together.bits, together.value) == (whole.bits, whole.value)
    reader = BitReader(together.to_bytes())
    for how, value, size in written:
        read = {"plain": reader.read, "count": reader.read_count, "signed": reader.read_signed}[how]
        assert read(size) == value
    assert 0 <= reader.left < 8


@pytest.mark.parametrize("value", [-1, 8])
def test_a_number_that_does_not_fit_its_bits_is_not_written(value: int) -> None:
    writer = BitWriter()
    with pytest.raises(WireError, match=f"^{value} does not fit 3 bits$"):
        writer.write(value, 3)
    assert writer.bits == 0


def test_a_count_below_0_is_not_written() -> None:
    with pytest.raises(WireError, match=r"^-1 is below 0$"):
        BitWriter().write_count(-1, 4)


@pytest.mark.parametrize("packed", [b"", b"\x00", b"\x00\x00\x01", b"\x01\xff"])
def test_nothing_is_read_beyond_the_end(packed: bytes) -> None:
    with pytest.raises(WireError, match=r"left$"):
        BitReader(packed).read(8 * len(packed) + 1)
    with pytest.raises(WireError, match=r"^[0-9]+ bits are to be read, [0-9]+ are left$"):
        BitReader(packed).read_count(3)
