"""A message's payload: header and body as one positional MessagePack array behind schema version and checksum.

The array's parts: schema version, checksum, sender, incarnation, sequence number, send time, body. The checksum is the
CRC-32 (as of zlib) of all bytes behind it, always as a MessagePack uint 32: so it lies at one place, and what is
checked is what was received, before anything else is read. A CRC-32 notices every change of up to 32 bits in a row, in
less time than other sums take; it is against damage, not against forgery.
"""

from __future__ import annotations

import struct
import zlib
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


SCHEMA_VERSION = 3
PARTS = 7
_START = (0x90 + PARTS, SCHEMA_VERSION, 0xCE)  # an array of so many parts, a small number, a uint 32
_HEAD = struct.Struct(">3BI")
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

    @property
    def newness(self) -> tuple[int, int]:
        """Of two messages of one sender the newer has more."""
        return self.incarnation, self.sequence


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
    """The message of such a body; raises WireError where it is not one of that type."""
    message: Message = record_of(message_type).decode(body)
    return message


def message_again(body: list[Any], message_type: type[Message]) -> Message:
    """The message of a body that `body_of` has just made, as its readers get it."""
    message: Message = record_of(message_type).again(body)
    return message


def packed(header: Header, body: list[Any]) -> bytes:
    """The payload of a header and a body; raises WireError where the header does not fit."""
    _check(*header)
    return sealed([*header, body])


def sealed(parts: list[Any]) -> bytes:
    """The payload of the parts behind version and checksum, whatever they are."""
    rest = pack(parts)[1:]  # without the head of an array of its own
    return _HEAD.pack(*_START, zlib.crc32(rest)) + rest


def header_of(payload: bytes) -> Header:
    """The header alone, whatever the message; raises WireError, and nothing else, where there is none."""
    return _fields(payload)[0]


def _fields(payload: bytes) -> tuple[Header, Any]:
    head = _HEAD.unpack_from(payload) if len(payload) >= _HEAD.size else ()
    if head[:3] != _START:
        raise WireError(f"not a list of {PARTS} parts of schema version {SCHEMA_VERSION} with a checksum")
    if zlib.crc32(payload[_HEAD.size :]) != head[3]:
        raise WireError("the checksum does not fit")
    _, _, sender, incarnation, sequence, sent_ms, body = unpack(payload)
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
