"""Messages for those that only listen, in parcels and out of them."""

from __future__ import annotations

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comms.keys import RunKeys
from comms.lockstep.parcels import MOST_BYTES, parcels, unpacked
from comms.runner import Outgoing
from comms.said.codec import Header
from comms.said.messages import TruthPose
from comms.said.routing import Route
from comms.said.topics import TRUTH_POSE
from comms.said.wire import WireError
from comms.session import PACKET_BYTES

AUDIENCES = [("recorder", "observer"), ("observer",), ()]


def said(number: int, watchers: tuple[str, ...], size: int) -> Outgoing:
    route = Route(TRUTH_POSE, "alpha", "world", (), watchers)
    payload = number.to_bytes(4) * (size // 4)
    return Outgoing(
        f"key/{number}", route, TruthPose(0, 0, 0), payload, len(payload), Header("world", 0, number, 0), []
    )


@given(st.lists(st.tuples(st.sampled_from(AUDIENCES), st.integers(1, 2000).map(lambda words: 4 * words)), max_size=40))
def test_each_audience_gets_its_messages_once_and_in_order_and_no_parcel_is_large(
    all_said: list[tuple[tuple[str, ...], int]],
) -> None:
    outgoing = [said(number, watchers, size) for number, (watchers, size) in enumerate(all_said)]
    got: dict[tuple[str, ...], list[tuple[str, bytes]]] = {}
    for watchers, parcel in parcels(outgoing):
        messages = list(unpacked(parcel))
        assert len(messages) == 1 or len(parcel) <= MOST_BYTES
        got.setdefault(watchers, []).extend(messages)
    for watchers in AUDIENCES:
        theirs = [(one.key, one.payload) for one in outgoing if watchers and one.route.watchers == watchers]
        assert got.get(watchers, []) == theirs


def test_a_full_parcel_fits_into_a_packet_with_its_key() -> None:
    key = RunKeys("a" * 60).parcel(("recorder", "observer"), "b" * 40)
    assert MOST_BYTES + len(key) + 30 <= PACKET_BYTES  # Zenoh's own words about it take less than 30 bytes


def test_messages_share_a_parcel_until_it_is_full() -> None:
    three = [said(number, AUDIENCES[0], MOST_BYTES // 2 - 40) for number in range(3)]
    assert [len(list(unpacked(parcel))) for _, parcel in parcels(three)] == [2, 1]


@pytest.mark.parametrize(
    "parcel",
    [b"", b"\xc1", msgpack.packb(1), msgpack.packb({"a": b"b"}), msgpack.packb(["a"]), msgpack.packb(["a", "b"]),
     msgpack.packb([b"a", b"b"]), msgpack.packb(["a", b"b", 1, b"b"]), b"\x91" * 5000],
)  # fmt: skip
def test_what_is_no_parcel_is_refused(parcel: bytes) -> None:
    with pytest.raises(WireError):
        unpacked(parcel)


@given(st.binary(max_size=200))
def test_no_bytes_break_it(parcel: bytes) -> None:
    try:
        messages = list(unpacked(parcel))
    except WireError:
        return
    assert all(type(key) is str and type(payload) is bytes for key, payload in messages)
