"""What is no frame of this run, as it was sent, is noticed."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from modems import PLATFORMS, RUN_INFO, config_of

from comms.said.bits import BitWriter
from modem.frames import VERSION, FrameForm, crc_4, crc_8

SAID = BitWriter()
SAID.write(0b1011, 4)


def form_of(frame_bits: int) -> FrameForm:
    return FrameForm(config_of("alpha", frame_bits=frame_bits), RUN_INFO)


def with_flipped(frame: bytes, *bits: int) -> bytes:
    turned = int.from_bytes(frame, "big")
    for bit in bits:
        turned ^= 1 << bit
    return turned.to_bytes(len(frame), "big")


@pytest.mark.parametrize("frame_bits", [34, 127, 128, 256])
def test_a_frame_is_what_was_sent_and_no_one_or_two_of_its_bits_may_be_turned_over(frame_bits: int) -> None:
    form = form_of(frame_bits)
    frame = form.pack("beta", 3, SAID)
    opened = form.unpack(frame)
    assert opened is not None
    assert (opened[0], opened[1], opened[2].read(4)) == ("beta", 3, 0b1011)
    places = range(8 * len(frame))
    pairs = [*combinations(places, 2)]
    if frame_bits == 34:  # a tag of 4 bits tells of two behind it that are less than 7 apart
        pairs = [(low, high) for low, high in pairs if high < 36 and high - low < 7]
    for bits in (*((one,) for one in places), *pairs):
        assert form.unpack(with_flipped(frame, *bits)) is None, bits


@pytest.mark.parametrize("frame_bits", [34, 512, 2048])
@given(data=st.data())
def test_no_odd_number_of_its_bits_may_be_turned_over(frame_bits: int, data: st.DataObject) -> None:
    form = form_of(frame_bits)
    frame = form.pack("alpha", 0, SAID)
    bits = data.draw(st.sets(st.integers(0, 8 * len(frame) - 1), min_size=1).filter(lambda bits: len(bits) % 2))
    assert form.unpack(with_flipped(frame, *bits)) is None


@pytest.mark.parametrize("frame_bits", [34, 256])
def test_frames_of_another_run_or_version_are_none_of_this_one(frame_bits: int) -> None:
    config, form = config_of("alpha", frame_bits=frame_bits), form_of(frame_bits)
    others = {
        "seed": FrameForm(config, replace(RUN_INFO, seed=2)),
        "scenario": FrameForm(config, replace(RUN_INFO, scenario_sha256="1" * 64)),
        "version": FrameForm(config, RUN_INFO, version=VERSION + 1),
    }
    for name, other in others.items():
        for start in range(1 << form.start_bits):
            frame = other.pack("alpha", start, SAID)
            assert other.unpack(frame) is not None
            assert form.unpack(frame) is None, name


def test_a_frame_from_nobody_of_the_fleet_is_none() -> None:
    config = config_of("alpha")
    larger = FrameForm(replace(config, platforms=(*PLATFORMS, "gamma")), RUN_INFO)
    form = FrameForm(config, RUN_INFO)
    assert form.unpack(larger.pack("beta", 0, SAID)) is not None
    assert form.unpack(larger.pack("gamma", 0, SAID)) is None


def test_the_check_of_small_frames_is_the_one_that_others_reckon() -> None:
    # CRC-8/AUTOSAR's published check value: of "123456789" with the register and the result turned over.
    assert crc_8(b"123456789", 0xFF) ^ 0xFF == 0xDF


def test_the_check_of_tiny_frames_is_the_rest_of_a_division() -> None:
    for value in (1, 0xA5, 0xFF, 0x1234):
        rest = value << 4
        while rest.bit_length() > 4:
            rest ^= 0b11101 << rest.bit_length() - 5
        assert crc_4(value.to_bytes(2, "big"), 0) == rest
