"""Messages packed to the bit: bits worked out by hand, what comes back of any message, and how large each is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from same_message import assert_same

from comms.said.announcement import RunInfo, Vertex
from comms.said.bits import BitReader, BitWriter
from comms.said.messages import (
    AgentState,
    Contact,
    CoverageTile,
    Curve,
    Hotspot,
    HotspotState,
    Look,
    MissionOver,
    Mode,
    Nav,
    Plan,
    PlannedTrack,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.over_water import Around
from comms.said.packing import get_message, put_message, skip_message
from comms.said.wire import LARGEST_MS, WireError
from planner.types import DetectionCurve
from secondlook.scenario import bundled
from secondlook.testing.checks.any_mail import any_message

CROSSING: tuple[type[Any], ...] = (AgentState, Plan, Curve, Hotspot, Task, TaskStatus, MissionOver, Contact)
SENT_MS = 3_600_000
AROUND = Around(0.0, 0.0, 2500.0, 2500.0, SENT_MS)
by_type = pytest.mark.parametrize("message_type", CROSSING, ids=lambda one: one.__name__)


def _put(message: Any, around: Around = AROUND) -> BitWriter:
    writer = BitWriter()
    put_message(writer, message, around)
    return writer


def _bits(message: Any, around: Around = AROUND) -> str:
    writer = _put(message, around)
    return f"{writer.value:0{writer.bits}b}" if writer.bits else ""


def _got(message: Any, around: Around = AROUND) -> Any:
    return get_message(BitReader(_put(message, around).to_bytes()), type(message), around)


# --- Worked out by hand. A box of 2,500 m has 5,001 places a side, 13 bits, and 3,536 whole metres across, 12 bits.

TAKE = Task(TaskAction.TAKE, 5, 100.0, 200.5, math.pi / 2, 800.0, 60.0)


def test_a_task_to_take_a_strip() -> None:
    assert _bits(TAKE) == "".join(
        [
            "000",  # the first of five actions
            "10101",  # strip 5: 16 + 5
            "0000011001000",  # 200 half metres east
            "0000110010001",  # 401 north
            "0100000000000",  # a quarter of 8,192
            "001100100000",  # 800 m
            "10111100",  # 128 + 60
        ]
    )
    assert_same(_got(TAKE), replace(TAKE, heading_rad=1.570796))


def test_a_task_that_needs_no_strip_is_short() -> None:
    assert _bits(replace(TAKE, action=TaskAction.GIVE_BACK, strip=20)) == "001" + "0100100"  # 16 + 20, in 6 bits
    assert _bits(replace(TAKE, action=TaskAction.TELL_AGAIN, strip=0)) == "011" + "10000"
    aside = replace(TAKE, action=TaskAction.STAND_ASIDE, strip=0)
    assert _bits(aside) == "010" + "10000" + "0000011001000" + "0000110010001"
    assert_same(_got(aside), Task(TaskAction.STAND_ASIDE, 0, 100.0, 200.5, 0.0, 0.0, 0.0))


def test_a_state() -> None:
    state = AgentState(Mode.REVISIT, 2, 1.0, SENT_MS + 99_001, 0.0, 2500.0, -math.pi, 12, 34)
    assert _bits(state) == "".join(
        [
            "011",  # the fourth of eight modes
            "100010",  # 32 + 2
            "1111111",
            "101010111101",  # 2,048 + 601 + 100 s
            "0000000000000",
            "1001110001000",  # 5,000
            "100000",  # half of 64
        ]
    )
    assert_same(_got(state), AgentState(Mode.REVISIT, 2, 1.0, SENT_MS + 100_000, 0.0, 2500.0, 3.141593))
    assert _bits(replace(state, expected_end_ms=0))[16:28] == "100000000000"


def test_a_task_status() -> None:
    status = TaskStatus(1, TaskState.DONE, SENT_MS, "as \u00fcsual")
    assert _bits(status) == "10001" + "011" + "101001011001"  # 2,048 + 601
    assert _got(status) == replace(status, reason="")


def test_a_hotspot() -> None:
    outline = (Vertex(1.0, 2.0), Vertex(1.0, 7.0), Vertex(-4.0, 7.0))
    hotspot = Hotspot(1, HotspotState.ACTIVE, outline, 1.0, 72, True, 0)
    around = Around(-10.0, -10.0, 21.5, 21.0, 0)  # 64 and 63 places
    assert _bits(hotspot, around) == "".join(
        [
            "10001",
            "0",
            "1011",  # 8 + 3 corners
            "010110" + "011000",  # 22 and 24 half metres from the box's corner
            "10000" + "0100011",  # 16 + 0; 10 is the 19th of 0, 1, -1, 2..., 16 + 19 = 35
            "0100100" + "10000",  # -10 is the 20th
            "1111111",
            "11001000",  # 128 + 72
            "1",
            "1",
        ]
    )
    assert _got(hotspot, around) == hotspot


def test_a_curve() -> None:
    curve = Curve(1, 1.0, np.array([0, 0, 0.999, 0.1, 0.9, 0.5, 0.5, 0.333]), 7)
    assert _bits(curve) == "".join(
        [
            "10001",
            "1",  # bins of 1 m
            "1001000",  # 64 + 8 of them
            "011",  # the third is the first to see anything
            "1",  # and none after the last
            "111111",  # P_d there: all of 0.999
            "010101",  # 5 m on a third of it
            "1000111",  # 64 + 7
        ]
    )
    got = _got(curve)
    assert (got.track, got.range_bin_m, got.r_eff_m) == (1, 1.0, 7)
    assert got.p_detect.tolist() == [0, 0, 0.999, 0.8658, 0.7326, 0.5994, 0.4662, 0.333]
    assert _bits(got) == _bits(curve)


def test_a_plan() -> None:
    def track(number: int, x_m: float, start_y_m: float, end_y_m: float) -> PlannedTrack:
        return PlannedTrack(number, x_m, x_m, start_y_m, x_m, end_y_m, number < 2)

    around = Around(0.0, 0.0, 31.5, 0.5, 0)  # 64 and 2 places; 64 half metres across to either side
    tracks = (track(1, 2.0, 0.0, 0.5), track(2, 3.0, 0.5, 0.0), track(3, 6.0, 0.0, 0.5), track(4, 7.0, 0.5, 0.0))
    plan = Plan(3, tracks, (9,), (9, 8), "words", 2)
    assert _bits(plan, around) == "".join(
        [
            "10011",
            "1100",  # 8 + 4 tracks
            "10001" + "01000100" + "000100" + "0" + "000100" + "1" + "1",  # 64 + 4 across
            # The second from the first: 1 on; 2 half metres, the third of 0, 1, -1, 2, as 8 + 3.
            # Its ends lie as much farther across as it does.
            "010" + "1011" + "10" + "10" + "10" + "10" + "0",
            "010" + "010011" + "10" + "10" + "10" + "10" + "0",  # 6, the 11th, as 8 + 11
            "1" + "1000" + "10" + "10" + "10" + "10" + "0",  # as far on as two tracks before
            "1001" + "1001001",  # 8 + 1 range, 64 + 9
            "1010" + "1001001" + "1010",  # 1 less, the second of 0, 1, -1
            "10010",
        ]
    )
    assert _got(plan, around) == replace(plan, note="")


def test_a_contact_and_the_end() -> None:
    contact = Contact(1.0, 2.0, 1.5, 0.0, 3)
    assert _bits(contact) == "0000000000010" + "0000000000100" + "10011" + "0000000" + "100000011"
    assert _got(contact) == contact
    assert _bits(MissionOver("all is done")) == ""
    assert _got(MissionOver("all is done")) == MissionOver("")


# --- What holds for all.

numbers = st.integers(0, 300)
shares = st.floats(0, 1)
places_m = st.floats(0, 2500)
headings = st.floats(-7, 7)
moments = st.one_of(st.just(0), st.integers(SENT_MS - 600_000, SENT_MS + 50_000_000))
vertices = st.builds(Vertex, places_m, places_m)
tracks = st.builds(PlannedTrack, numbers, st.floats(-3500, 3500), places_m, places_m, places_m, places_m, st.booleans())
curves = st.lists(st.one_of(st.just(0.0), st.floats(0, 0.999)), max_size=60).map(np.array)
FITTING: dict[type[Any], st.SearchStrategy[Any]] = {
    AgentState: st.builds(
        AgentState, st.sampled_from(Mode), numbers, shares, moments, places_m, places_m, headings, numbers, numbers
    ),
    Plan: st.builds(
        Plan,
        numbers,
        st.lists(tracks, max_size=6).map(tuple),
        st.lists(numbers, max_size=4).map(tuple),
        st.lists(numbers, max_size=4).map(tuple),
        st.text(max_size=9),
        numbers,
    ),
    Curve: st.builds(Curve, numbers, st.sampled_from([0.05, 0.5, 0.83, 1.0, 2.0, 3.1, 20.0]), curves, numbers),
    Hotspot: st.builds(
        Hotspot,
        numbers,
        st.sampled_from(HotspotState),
        st.lists(vertices, max_size=8).map(tuple),
        shares,
        numbers,
        st.booleans(),
        numbers,
    ),
    Task: st.builds(
        Task, st.sampled_from(TaskAction), numbers, places_m, places_m, headings, st.floats(0, 3535), st.floats(0, 300)
    ),
    TaskStatus: st.builds(TaskStatus, numbers, st.sampled_from(TaskState), moments, st.text(max_size=9)),
    MissionOver: st.builds(MissionOver, st.text(max_size=9)),
    Contact: st.builds(Contact, places_m, places_m, st.floats(0, 40), shares, numbers),
}
HALF_STEPS = {"length_m": 0.5, "width_m": 0.5, "range_bin_m": 0.0} | dict.fromkeys(
    ["battery", "score", "mean_risk"], 0.5 / 127
)
NOT_CROSSING = {"tiles_told": 0, "hotspots_told": 0, "note": "", "reason": ""}


def _assert_got(got: Any, put: Any) -> None:
    """What was got is what was put, to the resolution that is declared, and the wire's own."""
    assert type(got) is type(put)
    for name in (one.name for one in fields(put)):
        one, other = getattr(got, name), getattr(put, name)
        if name in NOT_CROSSING:
            assert one == NOT_CROSSING[name]
        elif isinstance(put, Task) and _is_left_out(put, name):
            assert one == 0
        elif name.endswith("_ms"):
            assert (one == 0) == (other == 0)
            assert 0 <= one - other < 1000
        elif name == "heading_rad":
            assert 0 <= one < math.tau
            half_step = math.pi / (2**13 if isinstance(put, Task) else 2**6)
            assert abs(math.remainder(one - other, math.tau)) <= half_step + 2e-6
        elif name == "p_detect":
            _assert_drawn(one, np.rint(other * 10_000) / 10_000, max(1, int(5 / put.range_bin_m + 1e-9)))
        elif isinstance(other, float):
            assert abs(one - other) <= HALF_STEPS.get(name, 0.25) + 0.0101 * name.endswith("_m") + 1.01e-4
        elif isinstance(other, tuple) and other and is_dataclass(other[0]):
            for mine, yours in zip(one, other, strict=True):
                _assert_got(mine, yours)
        else:
            assert one == other


def _is_left_out(task: Task, name: str) -> bool:
    if name in ("start_x_m", "start_y_m"):
        return task.action not in (TaskAction.TAKE, TaskAction.TAKE_NEXT, TaskAction.STAND_ASIDE)
    takes = task.action in (TaskAction.TAKE, TaskAction.TAKE_NEXT)
    return name in ("heading_rad", "length_m", "width_m") and not takes


def _assert_drawn(got: Any, put: Any, every: int) -> None:
    assert got.shape == put.shape
    seen, still_seen = np.flatnonzero(put), np.flatnonzero(got)
    assert bool(seen.size) == bool(still_seen.size)
    if seen.size:
        assert (seen[0], seen[-1]) == (still_seen[0], still_seen[-1])
        for at in range(seen[0], seen[-1], every):
            assert abs(got[at] - put[at]) <= (1.0 if at == seen[0] else 0.5) * 0.999 / 63 + 1e-4


@by_type
@settings(max_examples=100)
@given(data=st.data())
def test_what_is_got_is_what_was_put_and_has_the_same_bits(message_type: type[Any], data: st.DataObject) -> None:
    message = data.draw(FITTING[message_type])
    got = _got(message)
    _assert_got(got, message)
    assert _bits(got) == _bits(message)
    assert_same(_got(got), got)


@by_type
@settings(max_examples=50)
@given(data=st.data())
def test_any_message_is_packed_or_refused_with_a_wire_error(message_type: type[Any], data: st.DataObject) -> None:
    message = data.draw(any_message(message_type))
    try:
        bits = _bits(message)
    except WireError:
        return
    assert _bits(_got(message)) == bits


def _is_got(packed: bytes, message_type: type[Any], around: Around = AROUND) -> bool:
    """Whether a message is in these bytes, which then are what it is packed as; if not, a WireError says so. Who reads
    on to its end comes as far, or is told as much."""
    reader, ahead = BitReader(packed), BitReader(packed)
    try:
        skip_message(ahead, message_type, around)
    except WireError:
        ahead.left = -1
    try:
        message = get_message(reader, message_type, around)
    except WireError:
        return False
    assert type(message) is message_type
    assert ahead.left == reader.left
    first = f"{int.from_bytes(packed, 'big'):0{8 * len(packed)}b}"[: 8 * len(packed) - reader.left]
    assert _bits(message, around) == first
    return True


@by_type
@settings(max_examples=200)
@given(packed=st.binary(max_size=60))
def test_any_bytes_are_a_message_or_refused_with_a_wire_error(message_type: type[Any], packed: bytes) -> None:
    assert _is_got(packed, message_type) or message_type is not MissionOver


@by_type
@settings(max_examples=100)
@given(data=st.data())
def test_bits_that_are_turned_over_give_a_message_or_a_wire_error(message_type: type[Any], data: st.DataObject) -> None:
    packed = _put(data.draw(FITTING[message_type])).to_bytes()
    changed = int.from_bytes(packed, "big")
    for _ in range(data.draw(st.integers(1, 3)) if packed else 0):
        changed ^= 1 << data.draw(st.integers(0, 8 * len(packed) - 1))
    _is_got(changed.to_bytes(len(packed), "big"), message_type)
    cut = packed[: data.draw(st.integers(0, len(packed)))]
    assert _is_got(cut, message_type) or len(cut) < len(packed)


@given(
    low=st.tuples(st.floats(-9e3, 9e3), st.floats(-9e3, 9e3)),
    sides=st.tuples(st.floats(0, 9e3), st.floats(0, 9e3)),
    share=st.tuples(shares, shares),
)
def test_a_place_in_any_box_is_got_to_half_a_metre(
    low: tuple[float, float], sides: tuple[float, float], share: tuple[float, float]
) -> None:
    around = Around(*low, low[0] + sides[0], low[1] + sides[1], 0)
    contact = Contact(low[0] + share[0] * sides[0], low[1] + share[1] * sides[1], 0.0, 0.0, 0)
    got = _got(contact, around)
    assert max(abs(got.x_m - contact.x_m), abs(got.y_m - contact.y_m)) <= 0.2601
    assert _bits(got, around) == _bits(contact, around)


# --- What does not cross.


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (replace(TAKE, start_x_m=2500.3), "start_x_m"),
        (replace(TAKE, start_y_m=-0.3), "start_y_m"),
        (replace(TAKE, length_m=3537.0), "length_m"),
        (replace(TAKE, width_m=-1.0), "width_m"),
        (replace(TAKE, start_x_m=math.nan), "start_x_m"),
        (replace(TAKE, strip=-1), "strip"),
        (AgentState(Mode.IDLE, 0, 1.0, SENT_MS - 601_000, 0.0, 0.0, 0.0), "expected_end_ms"),
        (AgentState(Mode.IDLE, 0, 1.0, LARGEST_MS, 0.0, 0.0, 0.0), "expected_end_ms"),
        (Curve(1, 0.0, np.array([0.1]), 0), "p_detect"),
        (Hotspot(1, HotspotState.ACTIVE, (Vertex(0, 0), Vertex(0, 3000)), 0.1, 1, False, 0), "outline"),
    ],
)
def test_what_does_not_fit_is_not_put(message: Any, field: str) -> None:
    with pytest.raises(WireError, match=rf"^{type(message).__name__}\.{field}: "):
        _put(message)


def test_a_place_that_was_never_put_is_refused() -> None:
    bits = _bits(replace(TAKE, action=TaskAction.STAND_ASIDE, start_x_m=2500.0))
    beyond = bits[:8] + f"{5001:013b}" + bits[21:]
    with pytest.raises(WireError, match=r"^Task\.start_x_m: 5001 steps are outside 0 to 5000$"):
        get_message(BitReader(int(beyond + "0" * 6, 2).to_bytes(5, "big")), Task, AROUND)


@pytest.mark.parametrize(
    ("message_type", "field"),
    [
        (CoverageTile, "sum_levels"),
        (Look, "origin_x_m"),
        (Nav, "x_m"),
        (StripStatus, "start_x_m"),
        (RunInfo, "scenario"),
    ],
)
def test_a_type_with_a_field_that_is_not_declared_does_not_cross(message_type: type[Any], field: str) -> None:
    with pytest.raises(TypeError, match=rf"^{message_type.__name__}\.{field}: nothing says how it crosses the water$"):
        get_message(BitReader(b""), message_type, AROUND)


@pytest.mark.parametrize("around", [(0, 0, -1, 1, 0), (0, 0, math.inf, 1, 0), (math.nan, 0, 1, 1, 0), (0, 0, 1, 1, -1)])
def test_what_is_no_box_or_no_time_is_refused(around: Sequence[Any]) -> None:
    with pytest.raises(ValueError, match="is no box or no time"):
        Around(*around)


# --- How large they are, in a box of 2,500 m by 2,500 m.


def test_a_state_takes_at_most_64_bits() -> None:
    state = AgentState(Mode.SURVEY, 31, 0.37, SENT_MS + 13_700_000, 1234.5, 987.6, 6.2)
    assert _put(state).bits == 64  # of a primary that has 3.8 h to go
    assert _put(replace(state, works_on=95, expected_end_ms=SENT_MS + 5_500_000)).bits == 64
    assert _put(replace(state, works_on=223, expected_end_ms=SENT_MS + 1_400_000)).bits == 64
    assert _put(replace(state, mode=Mode.IDLE, works_on=0, expected_end_ms=0)).bits == 60


def test_a_task_takes_at_most_81_bits_and_its_status_32() -> None:
    assert _put(replace(TAKE, strip=2031, length_m=2400.0, width_m=300.0)).bits == 81
    assert _put(replace(TAKE, strip=47)).bits == 69
    assert _put(TaskStatus(1007, TaskState.UNDER_WAY, SENT_MS + 5_500_000, "in words")).bits == 32


def test_a_hotspot_of_eight_corners_takes_at_most_26_bytes() -> None:
    # Cells of 5 m along a heading of 30 degrees, 200 m by 60 m with two notches.
    along_across = [(0, 0), (200, 0), (200, 40), (150, 40), (150, 60), (35, 60), (35, 25), (0, 25)]
    sin, cos = math.sin(math.pi / 6), math.cos(math.pi / 6)
    outline = tuple(Vertex(900 + v * sin + u * cos, 700 + v * cos - u * sin) for v, u in along_across)
    assert len(_put(Hotspot(3, HotspotState.ACTIVE, outline, 0.63, 420, True, 0)).to_bytes()) <= 26
    assert _put(Hotspot(4, HotspotState.WITHDRAWN, (), 0.0, 0, False, 12)).bits <= 40


def test_a_plan_of_eight_tracks_takes_at_most_64_bytes() -> None:
    # To and fro in pairs 80 m and 240 m apart, then closer, along a heading of 20 degrees, in an area whose ends are
    # not at right angles to that; all flown, each with another range.
    sin, cos = math.sin(math.radians(20)), math.cos(math.radians(20))
    across_m = [120, 200, 440, 520, 760, 840, 1052, 1124]
    planned = []
    for number, u in enumerate(across_m, 1):
        ends = [(300 + v * sin + u * cos, 600 + v * cos - u * sin) for v in (0.1 * u, 1800 - 0.2 * u)]
        (x0, y0), (x1, y1) = ends if number % 2 else reversed(ends)
        planned.append(PlannedTrack(number, float(u), x0, y0, x1, y1, flown=True))
    ranges = (130, 128, 131, 127, 124, 126, 118, 117)
    plan = Plan(9, tuple(planned), (120, 120, 120, 106), ranges, "r_eff 117 m after track 8", 0)
    assert len(_put(plan).to_bytes()) <= 64


@pytest.mark.parametrize("name", bundled.curve_names())
@given(factor=st.floats(0.3, 2.0), nearer_m=st.floats(-4.0, 4.0))
def test_a_curve_of_146_bins_takes_at_most_26_bytes_and_is_off_by_at_most_3_percent(
    name: str, factor: float, nearer_m: float
) -> None:
    points = bundled.curve(name)
    shifted = DetectionCurve(np.array(points["range_m"]) - nearer_m, np.array(points["p_detect"]) * factor)
    range_m = np.arange(146.0)
    curve = Curve(12, 1.0, shifted.at(range_m), 127)
    assert len(_put(curve).to_bytes()) <= 26
    got = _got(curve)
    assert np.abs(got.p_detect - curve.p_detect).max() <= 0.03
    seen, sent = (np.flatnonzero(one.p_detect > 0) for one in (got, curve))
    assert (seen[0], seen[-1]) == (sent[0], sent[-1])


def test_a_curve_that_sees_all_of_146_bins_takes_26_bytes() -> None:
    assert _put(Curve(47, 1.0, np.full(146, 0.5), 145)).bits == 26 * 8
