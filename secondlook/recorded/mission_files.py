"""The files that hold a mission's messages: messages.mpk for programs, events.jsonl for people."""

from __future__ import annotations

import enum
import json
import logging
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgpack

from comms.node import Received
from comms.said.codec import SCHEMA_VERSION
from comms.said.topics import COVERAGE, LOOK, NAV
from secondlook.errors import UserError
from secondlook.files import GrowingFile

log = logging.getLogger("secondlook.recorded")

FILE_FORMAT = "secondlook-messages"
_HEAD: bytes = msgpack.packb([FILE_FORMAT, SCHEMA_VERSION])
NOT_FOR_PEOPLE = (LOOK, COVERAGE, NAV)  # looks and tiles are arrays, positions are better drawn


class MissionFiles:
    """Writes both files as the messages come; what was written stays readable if the run is cut off. Raises
    CannotWriteError.

    `messages.mpk` is a stream of MessagePack values: first `[format, schema version]`, then `[key, payload]` for each
    message. `events.jsonl` has one JSON object a line: time, key and fields.
    """

    def __init__(self, folder: Path, *, with_messages: bool) -> None:
        self._events = GrowingFile(folder / "events.jsonl")
        self._messages = GrowingFile(folder / "messages.mpk") if with_messages else None
        self._pack = msgpack.Packer().pack
        self._json = json.JSONEncoder(separators=(", ", ": "), check_circular=False, default=_plain).encode
        if self._messages is not None:
            self._messages.write(_HEAD)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, received: Received) -> None:
        """Writes one message."""
        if self._messages is not None:
            self._messages.write(self._pack([received.key, received.payload]))
        if received.topic not in NOT_FOR_PEOPLE:
            event = {"t_s": received.t_s, "key": received.key, **_plain(received.message)}
            self._events.write(f"{self._json(event)}\n".encode())

    def close(self) -> None:
        """Ends both files, also where one of them cannot be written."""
        try:
            self._events.close()
        finally:
            if self._messages is not None:
                self._messages.close()


def read_messages(path: Path) -> list[tuple[str, bytes]]:
    """Key (below the run id) and payload of every message in a messages.mpk, in the order of sending.

    A file that was cut off in the middle of a message is read up to there, and the log says so. Raises
    UserError, in one sentence, for what is not such a file or is one of another version.
    """
    found: list[tuple[str, bytes]] = []
    try:
        with path.open("rb") as file:
            stream = msgpack.Unpacker(file)
            head = next(stream, None)
            if head is None and _HEAD.startswith(path.read_bytes()):
                log.warning("%s: was cut off before its first message", path)
                return found
            if type(head) is not list or len(head) != 2 or head[0] != FILE_FORMAT:
                raise UserError(f"{path}: is not a file of messages")
            if head[1] != SCHEMA_VERSION:
                raise UserError(f"{path}: holds messages of schema version {head[1]}; must be version {SCHEMA_VERSION}")
            for entry in stream:
                if type(entry) is not list or [type(one) for one in entry] != [str, bytes]:
                    raise UserError(f"{path}: message {len(found) + 1} is not a key and a payload")
                found.append((entry[0], entry[1]))
            if stream.tell() < path.stat().st_size:
                log.warning("%s: was cut off in the middle of message %d; read up to there", path, len(found) + 1)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; must be the messages.mpk of a recorded run") from error
    except (ValueError, msgpack.UnpackException) as error:
        raise UserError(f"{path}: cannot be read behind message {len(found)}: {error}") from error
    return found


@cache
def _field_names(kind: type[Any]) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def _plain(value: Any) -> Any:
    """What JSON has no word for: a message or a part of one, an enumeration's member, an array."""
    kind: type[Any] = type(value)
    if is_dataclass(kind):
        return {name: getattr(value, name) for name in _field_names(kind)}
    return value.value if isinstance(value, enum.Enum) else value.tolist()
