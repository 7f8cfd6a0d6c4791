"""Messages packed where words are to be short: bits worked out by hand, and to what the receiver knows them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from comms.said.bits import BitReader, BitWriter
from comms.said.messages import (
    AgentState,
    Curve,
    Hotspot,
    Mode,
    Plan,
    PlannedTrack,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.over_water import COARSE_MS, Around
from comms.said.packing import get_message, put_message
from comms.said.wire import WireError

SENT_MS = 3_600_000
ALONG_RAD = math.radians(30)
AROUND = Around(0.0, 0.0, 2500.0, 2500.0, SENT_MS, coarse=True, heading_rad=ALONG_RAD)
# 626 places of 4 m a side, 10 bits, and 884 lengths of 4 m across, 10 bits.

TAKE = Task(TaskAction.TAKE, 5, 100.0, 201.0, ALONG_RAD + math.pi / 2, 799.0, 50.0)
STATE = AgentState(Mode.TRANSIT, 7, 0.5, SENT_MS + 100_001, 100.0, 201.0, ALONG_RAD + math.pi)
steps = st.integers(0, 625)


def _bits(message: Any, around: Around = AROUND) -> str:
    writer = BitWriter()
    put_message(writer, message, around)
    return f"{writer.value:0{writer.bits}b}"


def _got(message: Any, around: Around = AROUND, heard: Around | None = None) -> Any:
    writer = BitWriter()
    put_message(writer, message, around)
    return get_message(BitReader(writer.to_bytes()), type(message), heard or around)


def test_a_task_to_take_a_strip() -> None:
    assert _bits(TAKE) == "".join(
        [
            "000",
            "100101",  # strip 5: 32 + 5
            "0000011001",  # 25 times 4 m east
            "0000110010",  # 50.25 times 4 m north
            "101",  # across the tracks to starboard: the second of their four headings, 4 + 1
            "0011001000",  # 199.75 times 4 m
            "111001",  # 32 + 25 times 2 m
        ]
    )
    got = _got(TAKE)
    assert (got.start_x_m, got.start_y_m, got.length_m, got.width_m) == (100.0, 200.0, 800.0, 50.0)
    assert got.heading_rad == pytest.approx(TAKE.heading_rad, abs=1e-6)


def test_a_state_and_a_status() -> None:
    assert _bits(STATE) == "".join(
        [
            "001",
            "100111",  # 32 + 7
            "1000",  # 7.5 of 15, to the even one
            f"{1 + 463 % 511:09b}",  # 3,700.001 s are at the 463rd 8 s
            "0000011001",
            "0000110010",
            "110",  # down the tracks, 4 + 2
        ]
    )
    status = TaskStatus(5, TaskState.DONE, SENT_MS, "in words")
    assert _bits(status) == "100101" + "011"
    assert _got(status) == TaskStatus(5, TaskState.DONE, 0, "")


def test_of_a_curve_every_tenth_metre_crosses() -> None:
    p_detect = np.concatenate([np.zeros(40), np.linspace(0.9, 0.2, 100)])
    got = _got(Curve(3, 1.0, p_detect, 77))
    assert got.r_eff_m == 0
    assert got.p_detect.shape == p_detect.shape
    assert not got.p_detect[:40].any()
    assert np.abs(got.p_detect - p_detect).max() <= 0.034
    assert len(_bits(Curve(3, 1.0, p_detect, 77))) == 5 + 1 + 9 + 11 + 1 + 11 * 4


def test_tracks_side_by_side_take_few_bits() -> None:
    def track(number: int, across_m: float, flown: bool) -> PlannedTrack:
        sin, cos = math.sin(ALONG_RAD), math.cos(ALONG_RAD)
        ends = [(600 + across_m * cos + y * sin, 900 - across_m * sin + y * cos) for y in (0.0, 400.0)]
        (start, end) = ends if number % 2 else ends[::-1]
        return PlannedTrack(number, across_m, *start, *end, flown)

    across_m = [140, 240, 500, 590, 820, 910, 1130]
    tracks = tuple(track(place + 1, one, place < 3) for place, one in enumerate(across_m))
    bits = [len(_bits(Plan(4, tracks[:count], (), (), "", 1))) for count in range(1, 8)]
    assert bits[0] <= 80
    assert max(np.diff(bits)) <= 27
    got = _got(Plan(4, tracks, (), (), "", 1))
    for one, other in zip(got.tracks, tracks, strict=True):
        assert (one.number, one.flown) == (other.number, other.flown)
        for field in ("across_m", "start_x_m", "start_y_m", "end_x_m", "end_y_m"):
            assert abs(getattr(one, field) - getattr(other, field)) <= 2.001


@example(heading_rad=-4.78125, along_rad=0.71875, x=0, y=0)  # midway between two of the tracks' own
@given(heading_rad=st.floats(-7, 7), along_rad=st.floats(-7, 7), x=steps, y=steps)
def test_a_heading_is_got_to_a_512th_of_a_turn_and_the_nearer_the_tracks_the_shorter(
    heading_rad: float, along_rad: float, x: int, y: int
) -> None:
    around = replace(AROUND, heading_rad=along_rad)
    task = replace(TAKE, heading_rad=heading_rad, start_x_m=4.0 * x, start_y_m=4.0 * y)
    got = _got(task, around)
    assert abs(math.remainder(got.heading_rad - heading_rad, math.tau)) <= math.pi / 512 + 1e-4
    assert (got.start_x_m, got.start_y_m) == (task.start_x_m, task.start_y_m)
    assert len(_bits(replace(task, heading_rad=along_rad), around)) <= len(_bits(task, around))


@given(
    ahead_ms=st.integers(-500_000, 1_900_000), sent_ms=st.integers(600_000, 50_000_000), late_ms=st.integers(0, 90_000)
)
def test_a_moment_is_the_same_whenever_it_is_heard(ahead_ms: int, sent_ms: int, late_ms: int) -> None:
    said, heard = replace(AROUND, sent_ms=sent_ms), replace(AROUND, sent_ms=sent_ms + late_ms)
    at_ms = sent_ms + ahead_ms
    got = _got(replace(STATE, expected_end_ms=at_ms), said, heard)
    assert at_ms <= got.expected_end_ms < at_ms + COARSE_MS


def test_a_moment_too_far_ahead_is_told_as_the_farthest() -> None:
    got = _got(replace(STATE, expected_end_ms=SENT_MS + 9_000_000))
    assert SENT_MS + 2_000_000 < got.expected_end_ms < SENT_MS + 2_100_000
    assert _got(replace(STATE, expected_end_ms=0)).expected_end_ms == 0


def test_a_heading_that_was_never_put_is_refused() -> None:
    task = BitWriter()
    for value, bits in ((0, 3), (0b100101, 6), (0, 20)):
        task.write(value, bits)
    task.write_count(516, 2)
    task.write(0, 40)
    with pytest.raises(WireError, match=r"^Task\.heading_rad: 516 steps are no heading$"):
        get_message(BitReader(task.to_bytes()), Task, AROUND)


@pytest.mark.parametrize(
    "message_type", [AgentState, Plan, Curve, Hotspot, Task, TaskStatus], ids=lambda one: one.__name__
)
@given(packed=st.binary(max_size=60))
def test_any_bits_are_a_message_or_none_and_what_is_got_has_the_same_bits_again(
    message_type: type[Any], packed: bytes
) -> None:
    reader = BitReader(packed)
    try:
        got = get_message(reader, message_type, AROUND)
    except WireError:
        return
    bits = _bits(got)
    assert _bits(_got(got)) == bits
    assert len(bits) <= 8 * len(packed)
