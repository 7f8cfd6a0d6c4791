"""Words between clock and processes, beside the topics: a name and what belongs to it, packed.

Each drive has words of its own (`comms.lockstep.words`, `comms.wall.words`); the last word of a process is the same.
"""

from __future__ import annotations

import math
from typing import Any

from comms.errors import WordsError
from comms.result import LastWord
from comms.runner import SenderDigest
from comms.said import codec
from comms.said.wire import WireError

LARGEST_COUNT = 2**53  # so that the sum of any number of processes' counts can be packed again
LONGEST_NAME = 100  # characters, of what is counted


def pack(*words: Any) -> bytes:
    """A name and its words."""
    return codec.pack(words)


def unpack(payload: bytes) -> list[Any]:
    """Name and words; raises WordsError where there are none."""
    try:
        words = codec.unpack(payload)
    except WireError:
        words = None
    if type(words) is not list or not words or type(words[0]) is not str:
        raise WordsError(f"{payload[:20]!r}")
    return words


def pack_last_word(last: LastWord) -> bytes:
    """A host's `done`."""
    senders = [[one.sender, one.incarnation, one.count, one.sha256] for one in last.digests]
    return pack("done", senders, last.messages, last.dropped, last.latencies_ms)


def unpack_last_word(words: list[Any]) -> LastWord:
    """The `done` of a host; raises WordsError."""
    match words:
        case ["done", list(senders), dict(messages), dict(dropped), dict(latencies_ms)]:
            if (
                all(types_of(one) == [str, int, int, str] for one in senders)
                and are_counts(messages)
                and are_counts(dropped)
                and are_latencies(latencies_ms)
            ):
                return LastWord([SenderDigest(*one) for one in senders], messages, dropped, latencies_ms)
    raise WordsError("a last word that is none")


def types_of(values: Any) -> list[type]:
    """Of the members of a list or tuple; of anything else what no pattern of types is like."""
    return [type(one) for one in values] if isinstance(values, list | tuple) else [type(None)]


def are_counts(table: dict[Any, Any]) -> bool:
    """Whether a table holds whole numbers, from 0 to 2**53, by name."""
    return all(_is_name(name) and type(count) is int and 0 <= count <= LARGEST_COUNT for name, count in table.items())


def are_latencies(table: dict[Any, Any]) -> bool:
    """Whether a table holds lists of milliseconds by name."""
    return all(
        _is_name(name) and {float}.issuperset(types_of(times)) and all(map(math.isfinite, times))
        for name, times in table.items()
    )


def _is_name(name: Any) -> bool:
    return type(name) is str and len(name) <= LONGEST_NAME
