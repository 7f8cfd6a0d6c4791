"""What the clock and the processes say to each other when the wall clock drives the nodes: keys and packed words.

Host to clock: `hello`, again and again, `failed`, `done`. Clock to host: `welcome`, `refused`, `finish`, `goodbye`.
Clock to all: the time signal. Node to all: its beat, with the tallies of what it keeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from comms.control import ControlError, RunKeys, pack
from comms.result import BusResult, Ending


@dataclass(frozen=True)
class WallKeys(RunKeys):
    """Full Zenoh keys of a run by the wall clock."""

    @property
    def time(self) -> str:
        """The clock's time signal."""
        return f"{self.root}clock/time"

    def life(self, host: str, instance: str) -> str:
        """The liveliness token of one process of a host's name; both may be `*`."""
        return f"{self.alive(host)}/{instance}"

    def beat(self, node: str) -> str:
        """A node's beat."""
        return f"{self.root}clock/beat/{node}"


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
class LastWord:
    """What a host's nodes have said in all, what was dropped there, what was measured."""

    messages: dict[str, int]
    dropped: dict[str, int]
    latencies_ms: dict[str, list[float]]


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
    """The `hello` of a host; raises ControlError."""
    match words:
        case ["hello", str(instance), int(schema), str(sha), bool(welcomed), None | int() as now_ms]:
            return Hello(instance, schema, sha, welcomed, now_ms)
    raise ControlError("a hello that is none")


def pack_time(now_ms: int | None, factor: float, *, taken_up: bool) -> bytes:
    """The time signal: mission time, None before the start, its factor, and whether the clock has taken it up from
    others, as one that was started anew."""
    return pack("time", now_ms, factor, taken_up)


def unpack_time(words: list[Any]) -> tuple[int | None, float, bool]:
    """The three words of a time signal; raises ControlError."""
    match words:
        case ["time", None | int() as now_ms, float(factor), bool(taken_up)] if factor > 0:
            return now_ms, factor, taken_up
    raise ControlError("a time signal that is none")


def pack_beat(beat: Beat) -> bytes:
    """A node's `beat`."""
    return pack("beat", beat.incarnation, beat.tallies)


def unpack_beat(words: list[Any]) -> Beat:
    """The `beat` of a node; raises ControlError."""
    match words:
        case ["beat", int(incarnation), dict(tallies)] if _counts(tallies):
            return Beat(incarnation, tallies)
    raise ControlError("a beat that is none")


def pack_last_word(last: LastWord) -> bytes:
    """A host's `done`."""
    return pack("done", last.messages, last.dropped, last.latencies_ms)


def unpack_last_word(words: list[Any]) -> LastWord:
    """The `done` of a host; raises ControlError."""
    match words:
        case ["done", dict(messages), dict(dropped), dict(latencies_ms)]:
            if _counts(messages) and _counts(dropped) and _lists_of_floats(latencies_ms):
                return LastWord(messages, dropped, latencies_ms)
    raise ControlError("a last word that is none")


def pack_finish(result: BusResult) -> bytes:
    """The clock's `finish`: how the run has ended, as far as is known yet."""
    return pack(
        "finish", result.ending.value, result.mission_ms, result.messages, result.dropped, result.latencies_ms,
    )  # fmt: skip


def unpack_finish(words: list[Any]) -> BusResult:
    """The result in a `finish`; raises ControlError."""
    match words:
        case ["finish", str(ending), int(mission_ms), dict(messages), dict(dropped), dict(latencies_ms)]:
            if ending in [one.value for one in Ending]:
                return BusResult(Ending(ending), mission_ms, None, None, messages, dropped, latencies_ms)
    raise ControlError("an end that is none")


def _counts(table: dict[Any, Any]) -> bool:
    return all(type(name) is str and type(count) is int for name, count in table.items())


def _lists_of_floats(table: dict[Any, Any]) -> bool:
    return all(
        type(name) is str and type(values) is list and all(type(one) is float for one in values)
        for name, values in table.items()
    )
