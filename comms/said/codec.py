"""A message's payload: header and body as one positional MessagePack array behind the schema version."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import msgpack

from comms.said.messages import Message
from comms.said.wire import IDENTIFIER, LARGEST_MS, WireError, record_of

pack: Callable[[Any], bytes] = msgpack.Packer().pack  # making one takes as long as packing a message


def unpack(packed: bytes) -> Any:
    """What was packed; raises WireError, and nothing else, where this is no MessagePack."""
    try:
        return msgpack.unpackb(packed)
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        raise WireError(f"not MessagePack: {error}") from None


SCHEMA_VERSION = 1
HEADER_FIELDS = 6
LARGEST_INCARNATION = 2**16 - 1
LARGEST_SEQUENCE = 2**32 - 1
CLOCK = "clock"  # the clock's id as a sender


class Header(NamedTuple):
    """Who sent a message, which of its messages it is, and when (simulated milliseconds).

    `incarnation` tells a node's starts apart: 0 for the first, larger for each later one. `sequence` counts the
    messages of this incarnation from 0.
    """

    sender: str
    incarnation: int
    sequence: int
    sent_ms: int

    @property
    def order(self) -> tuple[int, bool, str, int, int]:
        """The order in which messages are handled: by send time, then the clock's first, then sender and sequence."""
        return self.sent_ms, self.sender != CLOCK, self.sender, self.incarnation, self.sequence


def encode(header: Header, message: Message) -> bytes:
    """The payload of a message; raises WireError where a field does not fit."""
    return packed(header, body_of(message))


def decode(payload: bytes, message_type: type[Message]) -> tuple[Header, Message]:
    """Header and message of a payload; raises WireError, and nothing else, where it is not one of `message_type`."""
    header, body = _fields(payload)
    return header, message_of(body, message_type)


def body_of(message: Message) -> list[Any]:
    """What MessagePack is to pack of a message; raises WireError where a field does not fit."""
    return record_of(type(message)).encode(message)


def message_of(body: Any, message_type: type[Message]) -> Message:
    """The message of such a body, unpacked or not packed yet; raises WireError where it is not one of that type."""
    message: Message = record_of(message_type).decode(body)
    return message


def packed(header: Header, body: list[Any]) -> bytes:
    """The payload of a header and a body; raises WireError where the header does not fit."""
    _check(*header)
    return pack([SCHEMA_VERSION, *header, body])


def header_of(payload: bytes) -> Header:
    """The header alone, whatever the message; raises WireError, and nothing else, where there is none."""
    return _fields(payload)[0]


def _fields(payload: bytes) -> tuple[Header, Any]:
    fields = unpack(payload)
    if type(fields) is not list or len(fields) != HEADER_FIELDS:
        raise WireError(f"not a list of {HEADER_FIELDS} parts")
    version, sender, incarnation, sequence, sent_ms, body = fields
    if type(version) is not int or version != SCHEMA_VERSION:
        raise WireError(f"of another schema version than {SCHEMA_VERSION}")
    _check(sender, incarnation, sequence, sent_ms)
    return Header(sender, incarnation, sequence, sent_ms), body


def _check(sender: Any, incarnation: Any, sequence: Any, sent_ms: Any) -> None:
    if type(sender) is not str or not IDENTIFIER.fullmatch(sender):
        raise WireError("the sender is not an identifier")
    if type(incarnation) is not int or not 0 <= incarnation <= LARGEST_INCARNATION:
        raise WireError(f"the incarnation is not a whole number from 0 to {LARGEST_INCARNATION}")
    if type(sequence) is not int or not 0 <= sequence <= LARGEST_SEQUENCE:
        raise WireError(f"the sequence is not a whole number from 0 to {LARGEST_SEQUENCE}")
    if type(sent_ms) is not int or not 0 <= sent_ms <= LARGEST_MS:
        raise WireError(f"the send time is not a whole number from 0 to {LARGEST_MS}")
