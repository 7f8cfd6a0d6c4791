"""MessagePack as the bus speaks it: one packer for all, and what comes from others unpacked or refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgpack

from comms.said.wire import WireError

pack: Callable[[Any], bytes] = msgpack.Packer().pack  # making one takes as long as packing a message


def unpack(packed: bytes) -> Any:
    """What was packed; raises WireError, and nothing else, where this is no MessagePack."""
    try:
        return msgpack.unpackb(packed)
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        raise WireError(f"not MessagePack: {error}") from None
