"""Words between clock and processes when the wall clock drives the nodes.

Host to clock: `hello`, again and again, `failed`, `done`. Clock to host: `welcome`, `refused`, `finish`, `goodbye`.
Clock to all: the time signal. Node to all: its beat, with the tallies of what it keeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from comms.errors import WordsError
from comms.result import BusResult, Ending
from comms.words import are_counts, pack


@dataclass(frozen=True, slots=True)
class Hello:
    """A host says that it is there.

    `instance`: made up by the process, so that two of one name are told apart. `now_ms`: the mission time it goes by,
    None as long as it knows none. `welcomed`: whether it has heard the clock.
    """

    instance: str
    schema: int
    scenario_sha256: str
    welcomed: bool
    now_ms: int | None


@dataclass(frozen=True, slots=True)
class Beat:
    """`tallies`: see `comms.wall.journal`."""

    incarnation: int
    tallies: dict[str, int]


def pack_hello(hello: Hello) -> bytes:
    """A host's `hello`."""
    return pack(
        "hello", hello.instance, hello.schema, hello.scenario_sha256, hello.welcomed, hello.now_ms,
    )  # fmt: skip


def unpack_hello(words: list[Any]) -> Hello:
    """The `hello` of a host; raises WordsError."""
    match words:
        case ["hello", str(instance), int(schema), str(sha), bool(welcomed), None | int() as now_ms]:
            return Hello(instance, schema, sha, welcomed, now_ms)
    raise WordsError("a hello that is none")


def pack_time(now_ms: int | None, factor: float, *, taken_up: bool) -> bytes:
    """The time signal: mission time, None before the start, its factor, and whether the clock has taken it up from
    others, as one that was started anew."""
    return pack("time", now_ms, factor, taken_up)


def unpack_time(words: list[Any]) -> tuple[int | None, float, bool]:
    """The three words of a time signal; raises WordsError."""
    match words:
        case ["time", None | int() as now_ms, float(factor), bool(taken_up)] if factor > 0:
            return now_ms, factor, taken_up
    raise WordsError("a time signal that is none")


def pack_beat(beat: Beat) -> bytes:
    """A node's `beat`."""
    return pack("beat", beat.incarnation, beat.tallies)


def unpack_beat(words: list[Any]) -> Beat:
    """The `beat` of a node; raises WordsError."""
    match words:
        case ["beat", int(incarnation), dict(tallies)] if are_counts(tallies):
            return Beat(incarnation, tallies)
    raise WordsError("a beat that is none")


def pack_finish(result: BusResult) -> bytes:
    """The clock's `finish`: how the run has ended, as far as is known yet."""
    return pack(
        "finish", result.ending.value, result.mission_ms, result.messages, result.dropped, result.latencies_ms,
    )  # fmt: skip


def unpack_finish(words: list[Any]) -> BusResult:
    """The result in a `finish`; raises WordsError."""
    match words:
        case ["finish", str(ending), int(mission_ms), dict(messages), dict(dropped), dict(latencies_ms)]:
            if ending in [one.value for one in Ending]:
                return BusResult(Ending(ending), mission_ms, None, None, messages, dropped, latencies_ms)
    raise WordsError("an end that is none")
