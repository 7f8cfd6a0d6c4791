"""How a node's messages go out in a lockstep run over Zenoh: each to those that act, in parcels to those that only
listen, as a parcel costs its way as much as a message."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator

import zenoh

from comms.keys import RunKeys
from comms.runner import Outgoing
from comms.said.codec import pack, unpack
from comms.said.wire import WireError
from comms.session import put

MOST_BYTES = 7900  # of a parcel, unless a single message has more: so it fits into one packet with its own key
HEAD_BYTES = 8  # that MessagePack puts before key and payload, at the most, and before all


def parcels(outgoing: Iterable[Outgoing]) -> Iterator[tuple[tuple[str, ...], bytes]]:
    """Parcels of the messages, in order, and the listeners that each is for."""
    held: dict[tuple[str, ...], list[str | bytes]] = {}
    sizes: dict[tuple[str, ...], int] = {}
    for one in outgoing:
        watchers = one.route.watchers
        if not watchers:
            continue
        size = len(one.key) + one.size + HEAD_BYTES
        if watchers in held and sizes[watchers] + size > MOST_BYTES:
            yield watchers, pack(held.pop(watchers))
        if watchers not in held:
            held[watchers], sizes[watchers] = [], HEAD_BYTES
        held[watchers] += (one.key, one.payload)
        sizes[watchers] += size
    for watchers, messages in held.items():
        yield watchers, pack(messages)


def unpacked(parcel: bytes) -> Iterator[tuple[str, bytes]]:
    """Key below the run id and payload of each message; raises WireError, and nothing else, where this is no parcel."""
    pairs = unpack(parcel)
    if type(pairs) is not list or len(pairs) % 2:
        raise WireError("not a list of keys and payloads")
    keys, payloads = pairs[::2], pairs[1::2]
    if not ({str}.issuperset(map(type, keys)) and {bytes}.issuperset(map(type, payloads))):
        raise WireError("not a list of keys and payloads")
    return zip(keys, payloads, strict=True)


def publish(session: zenoh.Session, keys: RunKeys, outgoing: Iterable[Outgoing], here: Container[str] = ()) -> None:
    """Sends messages of one node to the acting nodes that are not `here`; they go out with the next word at the
    latest."""
    for one in outgoing:
        if any(reader not in here for reader in one.route.readers):
            put(session, keys.topic(one.key), one.payload, at_once=False, away_only=True)


def publish_parcels(session: zenoh.Session, keys: RunKeys, sender: str, outgoing: Iterable[Outgoing]) -> None:
    """Sends messages of one node to those that only listen; likewise."""
    for watchers, parcel in parcels(outgoing):
        put(session, keys.parcel(watchers, sender), parcel, at_once=False)
