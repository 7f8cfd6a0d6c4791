"""Words between clock and processes when the wall clock drives the nodes.

Host to clock: `hello`, again and again, `failed`, `done`. Clock to host: `welcome`, `refused`, `finish`, `goodbye`.
Clock to all: the time signal. Node to all: its beat, with the tallies of what it keeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from comms.errors import WordsError
from comms.result import BusResult, Ending
from comms.said.codec import LARGEST_INCARNATION
from comms.said.routing import Routing
from comms.words import are_counts, are_latencies, pack

LONGEST_ID = 64  # characters, of what a hello is told apart by
LARGEST_FACTOR = 1000.0  # by which mission time runs faster than the wall clock
LATEST_MS = 2**35  # of a mission, whose time limit is at most 10 million seconds


@dataclass(frozen=True, slots=True)
class Hello:
    """A host says that it is there.

    `instance`: made up by the process, so that two of one name are told apart. `now_ms`: the mission time it goes by,
    None as long as it knows none; of one that is not welcomed yet until when it remembers the mission, None where it
    does not. `welcomed`: whether it has heard the clock. `late_ms`: see `Pace.hear`.
    """

    instance: str
    schema: int
    scenario_sha256: str
    welcomed: bool
    now_ms: int | None
    late_ms: int = 0


@dataclass(frozen=True, slots=True)
class TimeSignal:
    """Mission time, None before the start, and by how much it runs faster than the wall. `taken_up`: the clock has it
    from others, as one that was started anew. `held`: it stands still until the next signal."""

    now_ms: int | None
    factor: float
    taken_up: bool = False
    held: bool = False


@dataclass(frozen=True, slots=True)
class Beat:
    """`tallies`: see `comms.journal`."""

    incarnation: int
    tallies: dict[str, int]


def pack_hello(hello: Hello) -> bytes:
    """A host's `hello`."""
    return pack(
        "hello", hello.instance, hello.schema, hello.scenario_sha256, hello.welcomed, hello.now_ms, hello.late_ms,
    )  # fmt: skip


def unpack_hello(words: list[Any]) -> Hello:
    """The `hello` of a host; raises WordsError."""
    match words:
        case ["hello", str(instance), int(schema), str(sha), bool(welcomed), None | int() as now_ms, int(late_ms)]:
            if max(len(instance), len(sha)) <= LONGEST_ID and _is_time(now_ms) and _is_time(late_ms):
                return Hello(instance, schema, sha, welcomed, now_ms, late_ms)
    raise WordsError("a hello that is none")


def pack_time(told: TimeSignal) -> bytes:
    """The clock's time signal."""
    return pack("time", told.now_ms, told.factor, told.taken_up, told.held)


def unpack_time(words: list[Any]) -> TimeSignal:
    """What a time signal tells; raises WordsError."""
    match words:
        case ["time", None | int() as now_ms, float(factor), bool(taken_up), bool(held)]:
            if _is_time(now_ms) and 0 < factor <= LARGEST_FACTOR:
                return TimeSignal(now_ms, factor, taken_up=taken_up, held=held)
    raise WordsError("a time signal that is none")


def pack_beat(beat: Beat) -> bytes:
    """A node's `beat`."""
    return pack("beat", beat.incarnation, beat.tallies)


def unpack_beat(words: list[Any], node_id: str, routing: Routing) -> Beat:
    """The `beat` of a node; raises WordsError, also where it tells of what that node does not keep: a tally's key goes
    into a query to its sender, and its number is bounded by what there is to keep."""
    match words:
        case ["beat", int(incarnation), dict(tallies)]:
            if node_id not in routing.nodes:
                raise WordsError("a beat of nobody in the fleet")
            if not tallies.keys() <= routing.kept_by(node_id):
                raise WordsError("a beat with a tally of what its sender does not keep")
            if are_counts(tallies) and 0 <= incarnation <= LARGEST_INCARNATION:
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
            counted = are_counts(messages) and are_counts(dropped) and are_latencies(latencies_ms)
            if counted and _is_time(mission_ms) and ending in [one.value for one in Ending]:
                return BusResult(Ending(ending), mission_ms, None, None, messages, dropped, latencies_ms)
    raise WordsError("an end that is none")


def _is_time(now_ms: int | None) -> bool:
    return now_ms is None or 0 <= now_ms <= LATEST_MS
