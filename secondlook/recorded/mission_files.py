"""The files that hold a mission's messages: messages.mpk for programs, events.jsonl for people."""

from __future__ import annotations

import enum
import json
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from comms.node import Received
from comms.said.codec import unpack
from comms.said.topics import COVERAGE, HEARD, LOOK, NAV
from comms.said.wire import WireError
from secondlook.errors import UserError
from secondlook.files import GrowingFile
from secondlook.recorded.message_records import (
    BEGIN_OF_VERSION_1,
    HEAD,
    VERSIONS,
    Damage,
    Record,
    damage_of,
    record,
    records_in,
)

NOT_FOR_PEOPLE = (LOOK, COVERAGE, NAV, HEARD)  # arrays, positions, which are better drawn, and what was said elsewhere


class MissionFiles:
    """Writes both files as the messages come; what was written stays readable if the run is cut off. Raises
    CannotWriteError.

    `messages.mpk` is a stream of records as in `message_records`. `events.jsonl` has one JSON object a line: time, key
    and fields. Either may be left out.
    """

    def __init__(self, folder: Path, *, with_messages: bool, with_events: bool = True) -> None:
        self._events = GrowingFile(folder / "events.jsonl") if with_events else None
        self._messages = GrowingFile(folder / "messages.mpk") if with_messages else None
        self._number = 0
        self._json = json.JSONEncoder(separators=(", ", ": "), check_circular=False, default=_plain).encode
        if self._messages is not None:
            self._messages.write(HEAD)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, received: Received) -> None:
        """Writes one message."""
        if self._messages is not None:
            self._number += 1
            self._messages.write(record(self._number, received.key, received.payload))
        if self._events is not None and received.topic not in NOT_FOR_PEOPLE:
            event = {"t_s": received.t_s, "key": received.key, **_plain(received.message)}
            self._events.write(f"{self._json(event)}\n".encode())

    def close(self) -> None:
        """Ends both files, also where one of them cannot be written."""
        try:
            if self._events is not None:
                self._events.close()
        finally:
            if self._messages is not None:
                self._messages.close()


class Recording(NamedTuple):
    """Key (below the run id) and payload of each message of a messages.mpk, in the order of sending, and what cannot be
    read of it; None where that is nothing."""

    messages: list[tuple[str, bytes]]
    damage: Damage | None


def read_recording(path: Path) -> Recording:
    """All that can be read of a messages.mpk, also of one that was cut off or is damaged.

    Raises UserError, in one sentence, for what is not such a file or is one of another version.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; must be the messages.mpk of a recorded run") from error
    found = list(records_in(content))
    if not found and not HEAD.startswith(content):
        old = content.startswith(BEGIN_OF_VERSION_1)
        what = "is of an older secondlook, which wrote no checksums; must be read by that, or flown again"
        raise UserError(f"{path}: {what if old else 'is not a file of messages'}")
    by_number: dict[int, Record] = {}
    for one in found:  # what stands there twice counts once
        by_number.setdefault(one.number, one)
    head = by_number.pop(0, None)
    if head is not None and head.payload != VERSIONS:
        raise UserError(f"{path}: is of {_in_words(head.payload)}; must be of {_in_words(VERSIONS)}")
    messages = [one for _, one in sorted(by_number.items())]
    try:
        damage = damage_of(found, messages, len(content))
    except WireError as error:
        raise UserError(f"{path}: holds what is no message: {error}") from error
    return Recording([(one.key, one.payload) for one in messages], damage)


def _in_words(versions: bytes) -> str:
    file, schema = unpack(versions)
    return f"file version {file} with messages of schema version {schema}"


def read_messages(path: Path) -> list[tuple[str, bytes]]:
    """Key and payload of each message alone; see `read_recording`."""
    return read_recording(path).messages


@cache
def _field_names(kind: Any) -> tuple[str, ...] | None:
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else None


def _plain(value: Any) -> Any:
    """What JSON has no word for: a message or a part of one, an enumeration's member, bytes, an array."""
    kind: Any = type(value)
    names = _field_names(kind)
    if names is not None:
        return {name: getattr(value, name) for name in names}
    if isinstance(value, bytes):
        return value.hex()
    return value.value if isinstance(value, enum.Enum) else value.tolist()
