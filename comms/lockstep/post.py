"""How a node's messages go out in a lockstep run over Zenoh: each to those that act, in parcels to the others."""

from __future__ import annotations

from collections.abc import Sequence

import zenoh

from comms.control import RunKeys
from comms.lockstep.parcels import parcels
from comms.runner import Outgoing
from comms.session import put


def publish(session: zenoh.Session, keys: RunKeys, sender: str, outgoing: Sequence[Outgoing]) -> None:
    """Sends messages of one node; they go out with the next word at the latest."""
    for one in outgoing:
        if one.route.readers:
            put(session, keys.topic(one.key), one.payload, at_once=False)
    for watchers, parcel in parcels(outgoing):
        put(session, keys.parcel(watchers, sender), parcel, at_once=False)
