"""What messages.mpk consists of: numbered records with a checksum each, so that what lies before and behind a damaged
stretch is read, and what is missing is known.

A record is a MessagePack array of four: checksum, number, key, payload. The checksum is the CRC-32 (as of zlib) of all
bytes behind it, and always a uint 32, so that each record begins with the same two bytes: by these the next one is
looked for behind what cannot be read. Record 0 is the file's head, with versions as its payload; message N of the
mission is record N.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgpack

from comms.said.codec import SCHEMA_VERSION, header_of, pack

FILE_FORMAT = "secondlook-messages"
FILE_VERSION = 2
PARTS = 4
_BEGIN = bytes((0x90 + PARTS, 0xCE))  # an array of so many parts, a uint 32
_CHECKED = len(_BEGIN) + 4  # from there on


def record(number: int, key: str, payload: bytes) -> bytes:
    """A message as it stands in the file."""
    rest = pack([number, key, payload])[1:]  # without the head of an array of its own
    return _BEGIN + zlib.crc32(rest).to_bytes(4) + rest


VERSIONS = pack([FILE_VERSION, SCHEMA_VERSION])
HEAD = record(0, FILE_FORMAT, VERSIONS)
BEGIN_OF_VERSION_1 = b"\x92" + pack(FILE_FORMAT)  # whose messages had neither numbers nor checksums


class Record(NamedTuple):
    """A message that was found in a file, and from where to where it stands there."""

    start: int
    end: int
    number: int
    key: str
    payload: bytes

    @property
    def sent_s(self) -> float:
        """When it was sent; raises WireError where the payload is no message."""
        return header_of(self.payload).sent_ms / 1000


class Missing(NamedTuple):
    """So many messages in a row that are not in the file, between the times of those before and behind, in seconds."""

    messages: int
    after_s: float
    before_s: float


@dataclass(frozen=True)
class Damage:
    """What cannot be read of a messages.mpk.

    `unreadable`: stretches of it, offset and length in bytes, in order. `missing`: what is known to be missing by the
    numbers of the messages. `read_until_s`: where the last of these stretches reaches to the file's end, as that was
    cut off or is damaged, the time of the last message before it; 0 of an empty file, which has no such stretch; else
    None.
    """

    unreadable: tuple[tuple[int, int], ...]
    missing: tuple[Missing, ...]
    read_until_s: float | None

    def __str__(self) -> str:
        if self.read_until_s is not None and (not self.unreadable or self.unreadable[-1][0] == 0):
            return "was cut off before its first message"
        inner = self.unreadable if self.read_until_s is None else self.unreadable[:-1]
        damaged = [_unreadable_told(inner)] if inner else []
        damaged += [_missing_told(self.missing)] if inner or self.missing else []
        told = [f"is damaged: {', '.join(damaged)}"] if damaged else []
        if self.read_until_s is not None:
            offset, length = self.unreadable[-1]
            lost = f"its last {length} bytes, from offset {offset} on, and what came after {self.read_until_s:.3f} s"
            told.append(f"was cut off or is damaged at its end: {lost}, are lost")
        return "; it ".join(told)


def _unreadable_told(stretches: tuple[tuple[int, int], ...]) -> str:
    where = f"at offset {stretches[0][0]}"
    if len(stretches) > 1:
        where = f"in {len(stretches)} places from offset {stretches[0][0]} to {sum(stretches[-1])}"
    return f"{sum(length for _, length in stretches)} bytes {where} cannot be read"


def _missing_told(missing: tuple[Missing, ...]) -> str:
    if not missing:
        return "no message is missing"
    many = sum(one.messages for one in missing)
    where = f", in {len(missing)} places" if len(missing) > 1 else ""
    between = f"between {missing[0].after_s:.3f} s and {missing[-1].before_s:.3f} s"
    return f"{many} {'message is' if many == 1 else 'messages are'} missing {between}{where}"


def records_in(content: bytes) -> Iterator[Record]:
    """Every whole record, in the order of the file."""
    start = content.find(_BEGIN)
    while start >= 0:
        end = start + 1
        for one in _in_a_row(content, start):
            yield one
            end = one.end
        start = content.find(_BEGIN, end)


def _in_a_row(content: bytes, start: int) -> Iterator[Record]:
    """The records from there on, one behind the other, up to what is none."""
    file, bytes_of = io.BytesIO(content), memoryview(content)
    file.seek(start)
    # Limits, as what is damaged may claim any length.
    stream = msgpack.Unpacker(file, max_array_len=PARTS, max_map_len=0, max_ext_len=0)
    first = start
    try:
        for parts in stream:
            end = first + stream.tell()
            if not _fits(parts, bytes_of[start + _CHECKED : end]):
                return
            yield Record(start, end, *parts[1:])
            start = end
    except (ValueError, msgpack.UnpackException):
        return


def _fits(parts: Any, checked: memoryview) -> bool:
    if type(parts) is not list or [type(one) for one in parts] != [int, int, str, bytes]:
        return False
    return bool(parts[0] == zlib.crc32(checked))


def damage_of(found: list[Record], messages: list[Record], size: int) -> Damage | None:
    """What cannot be read of a file of so many bytes. `found`: all records as they lie in it; `messages`: each once, in
    the order of their numbers, without the head. Raises WireError where a payload is no message."""
    unreadable, end = [], 0
    for one in found:
        if one.start > end:
            unreadable.append((end, one.start - end))
        end = one.end
    if end < size:
        unreadable.append((end, size - end))
    missing, before = [], None
    for one in messages:
        last = 0 if before is None else before.number
        if one.number > last + 1:
            missing.append(Missing(one.number - last - 1, 0.0 if before is None else before.sent_s, one.sent_s))
        before = one
    until_s = None if found and end == size else 0.0 if before is None else before.sent_s
    if not unreadable and not missing and until_s is None:
        return None
    return Damage(tuple(unreadable), tuple(missing), until_s)
