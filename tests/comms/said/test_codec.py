"""Payloads: every message comes back as it was sent, and whatever else arrives is refused with a WireError alone."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass, replace
from typing import Any, get_type_hints

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from largest_message import MESSAGE_TYPES, headers, largest_message
from same_message import assert_same

from comms.said.announcement import RosterVehicle, RunInfo
from comms.said.codec import LARGEST_INCARNATION, LARGEST_SEQUENCE, SCHEMA_VERSION, Header, decode, encode, sealed
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Curve,
    Look,
    ManeuverState,
    ManeuverStatus,
    Mode,
    Nav,
    StripState,
    StripStatus,
    Task,
)
from comms.said.topics import TASK, TOPICS, Topic
from comms.said.wire import LARGEST_MS, MISFITS, Scaled, WireError, record_of
from comms.session import LARGEST_MESSAGE_BYTES
from planner.tiles import TILE_CELLS
from secondlook.testing.checks.any_mail import any_message, kind_of

HEADER = Header("alpha", 0, 3, 4500)
NAV = Nav(1.0, -2.5, 0.5, 1.5, 15.0, 0.0, -0.25)
by_type = pytest.mark.parametrize("message_type", MESSAGE_TYPES, ids=lambda one: one.__name__)

# What MessagePack can say: also deep nesting, extension types, huge and special numbers, text that is no UTF-8.
plain = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(),
    st.text(max_size=8),
    st.binary(max_size=8),
    st.builds(msgpack.ExtType, st.integers(0, 127), st.binary(max_size=12)),
    st.sampled_from([msgpack.Timestamp(0, 1), 7_000_001, "x" * 300, b"y" * 300, -1]),
)
values = st.recursive(
    plain,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.text(max_size=3), inner, max_size=3),
        st.tuples(inner, st.integers(1, 100)).map(lambda one: _nested(*one)),
    ),
    max_leaves=6,
)


def _nested(value: Any, depth: int) -> Any:
    for _ in range(depth):
        value = [value]
    return value


def _decodes_or_is_refused(payload: bytes, message_type: type[Any]) -> bool:
    try:
        header, message = decode(payload, message_type)
    except WireError as error:
        refusal = str(error)
    else:
        refusal = ""
    if refusal:
        assert len(refusal) < 400
        return False
    # What is let in is a message that could have been sent.
    assert type(message) is message_type
    assert decode(encode(header, message), message_type)[0] == header
    return True


@by_type
@settings(max_examples=25)
@given(data=st.data(), header=headers)
def test_what_is_sent_comes_back_quantised_once(message_type: type[Any], data: st.DataObject, header: Header) -> None:
    message = data.draw(any_message(message_type))
    payload = encode(header, message)
    got_header, got = decode(payload, message_type)
    assert got_header == header
    assert encode(got_header, got) == payload
    _assert_close(got, message, message_type)


def _assert_close(got: Any, sent: Any, message_type: type[Any]) -> None:
    hints = get_type_hints(message_type, include_extras=True)
    for field in fields(message_type):
        one, other = getattr(got, field.name), getattr(sent, field.name)
        kind = kind_of(hints[field.name])
        if isinstance(kind, Scaled):
            assert abs(one - other) <= 0.5001 / kind.steps_per_unit
        elif isinstance(other, np.ndarray):
            assert one.shape == other.shape
            assert np.allclose(one, other, rtol=0.0, atol=0.5001e-4)
        elif isinstance(other, tuple):
            assert len(one) == len(other)
            for mine, yours in zip(one, other, strict=True):
                if is_dataclass(yours):
                    _assert_close(mine, yours, type(yours))
                else:
                    assert mine == yours
        elif is_dataclass(other):
            _assert_close(one, other, type(other))
        else:
            assert one == other


@by_type
@settings(max_examples=25)
@given(data=st.data())
def test_a_record_is_converted_as_its_fields_kinds_say(message_type: type[Any], data: st.DataObject) -> None:
    record, message = record_of(message_type), data.draw(any_message(message_type))
    every = [encode(getattr(message, name)) for name, encode, _ in record.fields]
    written = record.encode(message)
    assert written == every[: len(written)]
    assert record.encode(record.decode(every)) == written
    if len(written) < len(every):
        assert message_type is RunInfo
        assert every[len(written) :] == [[], 0]
    wire = [data.draw(st.one_of(st.just(encode(getattr(message, name))), values)) for name, encode, _ in record.fields]
    try:
        by_field = [decode(one) for (_, _, decode), one in zip(record.fields, wire, strict=True)]
    except MISFITS:
        with pytest.raises(WireError):
            record.decode(wire)
    else:
        assert_same(record.decode(wire), message_type(*by_field))


WITH_DEFAULTS = [
    (record, field.name, [one.name for one in fields(record)].index(field.name))
    for record in (*MESSAGE_TYPES, RosterVehicle)
    for field in fields(record)
    if field.default is not MISSING
]


@pytest.mark.parametrize(("record", "field", "place"), WITH_DEFAULTS, ids=lambda one: getattr(one, "__name__", one))
@settings(max_examples=10)
@given(data=st.data())
def test_one_written_before_there_were_its_last_fields_has_their_defaults(
    record: type[Any], field: str, place: int, data: st.DataObject
) -> None:
    codec, message = record_of(record), data.draw(any_message(record))
    earlier = codec.decode(codec.encode(message)[:place])
    later = [one for one in fields(record)[place:] if one.default is not MISSING]
    assert field in [one.name for one in later]
    assert_same(earlier, replace(codec.decode(codec.encode(message)), **{one.name: one.default for one in later}))


@by_type
def test_one_that_lacks_a_field_without_a_default_or_has_one_too_many_is_refused(message_type: type[Any]) -> None:
    codec = record_of(message_type)
    needed = sum(one.default is MISSING for one in fields(message_type))
    wire = codec.encode(largest_message(message_type, tile_cells=1))
    for wrong in (wire[: needed - 1], [*wire, 0]):
        with pytest.raises(WireError, match=f"^{message_type.__name__} needs a list of {len(wire)} fields$"):
            codec.decode(wrong)


@pytest.mark.parametrize("wrong", [b"no", None, 7])
def test_a_field_that_does_not_fit_is_named_also_where_the_last_are_missing(wrong: object) -> None:
    codec = record_of(StripStatus)
    wire = codec.encode(largest_message(StripStatus, tile_cells=1))[:10]
    with pytest.raises(WireError, match=r"^StripStatus\.reason: "):
        codec.decode([*wire[:9], wrong])


def test_a_payload_is_a_positional_array_behind_schema_version_and_checksum() -> None:
    payload = encode(HEADER, NAV)
    assert msgpack.unpackb(payload) == [
        SCHEMA_VERSION, zlib.crc32(payload[7:]), "alpha", 0, 3, 4500, [100, -250, 500_000, 1500, 1500, 0, -250_000],
    ]  # fmt: skip
    assert payload[7:] == msgpack.packb(["alpha", 0, 3, 4500, [100, -250, 500_000, 1500, 1500, 0, -250_000]])[1:]


@by_type
@settings(max_examples=25)
@given(data=st.data())
def test_a_payload_of_which_some_bytes_in_a_row_are_changed_is_refused(
    message_type: type[Any], data: st.DataObject
) -> None:
    sent = encode(HEADER, data.draw(any_message(message_type)))
    where = data.draw(st.integers(0, len(sent) - 1))
    damage = data.draw(st.binary(min_size=1, max_size=4).filter(any))
    changed = bytes(one ^ damage[at - where] if 0 <= at - where < len(damage) else one for at, one in enumerate(sent))
    if changed == sent:  # all that is not 0 would have struck behind the end
        return
    with pytest.raises(WireError):
        decode(changed, message_type)


def test_a_payload_with_any_one_byte_changed_inside_an_array_is_refused() -> None:
    sent = encode(HEADER, CURVE)
    array = sent.index((1000).to_bytes(2, "little"))
    for at in range(array, array + 4):
        for value in set(range(256)) - {sent[at]}:
            with pytest.raises(WireError, match=r"^the checksum does not fit$"):
                decode(sent[:at] + bytes([value]) + sent[at + 1 :], Curve)


@by_type
@settings(max_examples=25)
@given(payload=st.binary(max_size=60))
def test_any_bytes_are_refused_with_a_wire_error_alone(message_type: type[Any], payload: bytes) -> None:
    assert not _decodes_or_is_refused(payload, message_type)


@by_type
@settings(max_examples=25)
@given(data=st.data())
def test_a_payload_with_bytes_changed_is_refused_or_is_a_message_and_one_cut_off_is_refused(
    message_type: type[Any], data: st.DataObject
) -> None:
    sent = encode(HEADER, data.draw(any_message(message_type)))
    changed = bytearray(sent)
    for _ in range(data.draw(st.integers(1, 3))):
        changed[data.draw(st.integers(0, len(sent) - 1))] = data.draw(st.integers(0, 255))
    _decodes_or_is_refused(bytes(changed), message_type)
    assert not _decodes_or_is_refused(sent[: data.draw(st.integers(0, len(sent) - 1))], message_type)


@by_type
@settings(max_examples=30)
@given(data=st.data())
def test_a_payload_with_a_part_replaced_is_refused_or_is_a_message(
    message_type: type[Any], data: st.DataObject
) -> None:
    parts = msgpack.unpackb(encode(HEADER, data.draw(any_message(message_type))))
    sealed_parts = parts[2:]
    _replace_one(sealed_parts, data)
    _decodes_or_is_refused(sealed(sealed_parts), message_type)
    _replace_one(parts, data)
    _decodes_or_is_refused(msgpack.packb(parts), message_type)


def _replace_one(parts: list[Any], data: st.DataObject) -> None:
    where = data.draw(st.integers(0, len(parts) - 1))
    if isinstance(parts[where], list) and parts[where] and data.draw(st.booleans()):
        _replace_one(parts[where], data)
    elif data.draw(st.integers(0, 9)):
        parts[where] = data.draw(values)
    else:
        del parts[where]


def _sealed_bytes(rest: bytes) -> bytes:
    """What looks like a payload as far as the checksum, which fits."""
    return encode(HEADER, NAV)[:3] + zlib.crc32(rest).to_bytes(4, "big") + rest


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xdd\xff\xff\xff\xff",  # an array that claims 4 billion entries
        b"\xc6\xff\xff\xff\xff",  # bytes that claim 4 GiB
        b"\x91" * 200_000 + b"\xc0",  # nested 200,000 deep
        _sealed_bytes(msgpack.packb(["alpha", 0, 3, 4500, None])[1:-1] + b"\x91" * 900 + b"\xc0"),
        b"\x97" + b"\x91" * 900 + b"\xc0" * 7,
        _sealed_bytes(msgpack.packb(["alpha", 0, 3, 4500])[1:] + b"\xdd\xff\xff\xff\xff"),
        _sealed_bytes(encode(HEADER, NAV)[7:] + b"\x00"),
        _sealed_bytes(b""),
        encode(HEADER, NAV)[:7],
    ],
    ids=[
        "empty",
        "huge array",
        "huge bytes",
        "too deep",
        "deep body",
        "deep version",
        "huge body",
        "trailing byte",
        "nothing sealed",
        "nothing behind the checksum",
    ],
)
def test_payloads_made_to_hurt_are_refused(payload: bytes) -> None:
    for message_type in MESSAGE_TYPES:
        assert not _decodes_or_is_refused(payload, message_type)


@pytest.mark.parametrize("version", [0, 2, 4, True, 1.0, "1", None])
def test_another_schema_version_is_refused(version: object) -> None:
    parts = msgpack.unpackb(encode(HEADER, NAV))
    with pytest.raises(WireError, match="schema version"):
        decode(msgpack.packb([version, *parts[1:]]), Nav)


HEADERS_THAT_DO_NOT_FIT = [
    Header("", 0, 0, 0),
    Header("Alpha", 0, 0, 0),
    Header("alpha/beta", 0, 0, 0),
    Header("alpha\n", 0, 0, 0),
    Header("a" * 41, 0, 0, 0),
    Header("alpha", -1, 0, 0),
    Header("alpha", LARGEST_INCARNATION + 1, 0, 0),
    Header("alpha", 0, LARGEST_SEQUENCE + 1, 0),
    Header("alpha", 0, 0, -1),
    Header("alpha", 0, 0, LARGEST_MS + 1),
    Header("alpha", 0, True, 0),
    Header("alpha", 0, 0, 1.0),  # type: ignore[arg-type]
]


@pytest.mark.parametrize("header", HEADERS_THAT_DO_NOT_FIT, ids=repr)
def test_a_header_that_does_not_fit_is_neither_sent_nor_taken(header: Header) -> None:
    with pytest.raises(WireError):
        encode(header, NAV)
    body = msgpack.unpackb(encode(HEADER, NAV))[-1]
    with pytest.raises(WireError):
        decode(
            sealed([header.sender, header.incarnation, header.sequence, header.sent_ms, body]),
            Nav,
        )


SCALED_FIELDS = [
    (message_type, field.name)
    for message_type in MESSAGE_TYPES
    for field in fields(message_type)
    if isinstance(kind_of(get_type_hints(message_type, include_extras=True)[field.name]), Scaled)
]


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1e300, None, "3", 1 + 2j])
@pytest.mark.parametrize(("message_type", "field"), SCALED_FIELDS, ids=lambda one: getattr(one, "__name__", one))
def test_a_number_that_is_none_or_out_of_range_is_not_sent(message_type: type[Any], field: str, wrong: object) -> None:
    message = replace(largest_message(message_type, tile_cells=4), **{field: wrong})
    with pytest.raises(WireError, match=rf"^{message_type.__name__}\.{field}: "):
        encode(HEADER, message)


TILE = CoverageTile(1, 0, 0, np.zeros((2, 2), np.uint8), np.zeros((2, 2), np.uint8), np.zeros((2, 2), np.bool_))
LOOK = Look(1, 1, 0.0, 0.0, 0.0, 0.0, 5.0, 1.0, np.zeros((2, 1, 2)), 15.0, 0.0, True, ())
CURVE = Curve(1, 1.0, np.array([0.1, 0.2]), 2)
STATUS = ManeuverStatus(1, ManeuverState.DONE, 0, "")
STATE = AgentState(Mode.IDLE, 0, 1.0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("message", "field", "wrong"),
    [
        (CURVE, "p_detect", np.array([0.1, math.nan])),
        (CURVE, "p_detect", np.array([0.9991])),
        (CURVE, "p_detect", np.array([-0.001])),
        (CURVE, "p_detect", np.array([[0.1]])),
        (CURVE, "p_detect", np.zeros(4097)),
        (CURVE, "p_detect", np.array(["a"])),
        (CURVE, "r_eff_m", 2.5),
        (CURVE, "r_eff_m", -1),
        (CURVE, "r_eff_m", 2**31),
        (TILE, "sum_levels", np.full((2, 2), 256)),
        (TILE, "sum_levels", np.full((2, 2), 1.5)),
        (TILE, "sum_levels", np.full((2, 2), -1, np.int8)),
        (TILE, "settled", np.zeros((33, 33), np.bool_)),
        (STATE, "mode", StripState.OPEN),
        (STATE, "mode", "idle"),
        (STATUS, "reason", "x" * 201),
        (STATUS, "reason", "\u00fc" * 101),  # 202 bytes in UTF-8
        (STATUS, "reason", "\ud800"),  # half a surrogate pair
        (STATUS, "reason", b"no"),
    ],
)
def test_what_does_not_fit_its_field_is_not_sent(message: Any, field: str, wrong: object) -> None:
    with pytest.raises(WireError, match=rf"^{type(message).__name__}\.{field}: "):
        encode(HEADER, replace(message, **{field: wrong}))


@pytest.mark.parametrize("count", [7, np.int64(7), np.uint8(7), True])
def test_a_count_travels_as_a_plain_whole_number(count: int) -> None:
    got = decode(encode(HEADER, replace(CURVE, r_eff_m=count)), Curve)[1]
    assert isinstance(got, Curve)
    assert (got.r_eff_m, type(got.r_eff_m)) == (int(count), int)


def test_a_message_is_not_shared_by_its_arrays() -> None:
    tile = decode(encode(HEADER, TILE), CoverageTile)[1]
    curve = decode(encode(HEADER, CURVE), Curve)[1]
    assert isinstance(tile, CoverageTile)
    assert isinstance(curve, Curve)
    for array in (tile.sum_levels, tile.largest_levels, tile.settled, curve.p_detect):
        with pytest.raises(ValueError, match="read-only"):
            array[:1] = 0


@pytest.mark.parametrize("lies", [np.asfortranarray, lambda a: np.repeat(a, 2, axis=-1)[..., ::2]])
def test_an_array_travels_alike_however_it_lies_in_memory(lies: Callable[[Any], Any]) -> None:
    levels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    look = replace(LOOK, p_detect=np.stack([levels / 100, levels / 50]))
    assert encode(HEADER, replace(look, p_detect=lies(look.p_detect))) == encode(HEADER, look)
    tile = replace(TILE, sum_levels=levels, settled=levels > 2)
    assert encode(HEADER, replace(tile, sum_levels=lies(levels), settled=lies(levels > 2))) == encode(HEADER, tile)


# Vehicles' ids have up to 40 characters, the coordinator's is its own.
LONGEST_HEADER = Header("a" * 40, LARGEST_INCARNATION, LARGEST_SEQUENCE, LARGEST_MS)


@pytest.mark.parametrize("topic", [topic for topic in TOPICS if topic is not TASK], ids=lambda topic: topic.name)
def test_the_largest_message_is_within_its_topics_limit(topic: Topic) -> None:
    payload = encode(LONGEST_HEADER, largest_message(topic.message, tile_cells=TILE_CELLS))
    assert len(payload) <= topic.max_bytes <= LARGEST_MESSAGE_BYTES // 2


@given(data=st.data(), header=headers)
def test_a_task_of_the_first_49_days_never_takes_more_than_64_bytes(data: st.DataObject, header: Header) -> None:
    message = data.draw(st.one_of(st.just(largest_message(Task, tile_cells=0)), any_message(Task)))
    header = header._replace(sender="coordinator", sent_ms=header.sent_ms % 2**32)
    assert len(encode(header, message)) <= 64


def test_the_largest_task_and_a_full_tile_over_water_have_the_size_worked_out_by_hand() -> None:
    # Array and version 3, checksum 5, sender 1 + 11, incarnation 3, sequence 5, send time 9; array 1, action 1, six
    # numbers 30.
    task = largest_message(Task, tile_cells=0)
    assert len(encode(LONGEST_HEADER._replace(sender="coordinator"), task)) == 68
    # Levels of 400 bytes each with 1 + 1 + 1 + 3 before them, the mask of 50 with 1 + 1 + 1 + 2, three numbers, header.
    tile = largest_message(CoverageTile, tile_cells=20)
    assert len(encode(LONGEST_HEADER, tile)) == 2 * 406 + 55 + 1 + 15 + 2 + 5 + 42 + 3 + 5 + 9
