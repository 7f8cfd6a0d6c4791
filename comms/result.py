"""What a bus reports of a run that has ended, summed up from the last words of its processes."""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from comms.node import Received
from comms.runner import Outgoing, SenderDigest
from comms.said.messages import StripState, StripStatus, Task, TaskAction, TaskState, TaskStatus
from comms.said.topics import number_of

STRIP_TO_TASK = "strip_to_task"


class Ending(enum.Enum):
    """Why a run has ended."""

    OVER = "over"
    IDLE = "idle"
    TIME_LIMIT = "time_limit"


@dataclass(frozen=True)
class BusResult:
    """`mission_ms`: simulated time of the mission's end. `messages`: count per topic. `dropped`: count per reason.
    `latencies_ms`: wall-clock latencies measured by the bus, by name; empty on the local bus. A run by the wall clock
    has no digest and no rounds."""

    ending: Ending
    mission_ms: int
    digest: str | None = None
    rounds: int | None = None
    messages: dict[str, int] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    latencies_ms: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LastWord:
    """What a process tells at the end: what its nodes have said, in lockstep by sender with its digest, by the wall
    clock as a count per topic; what was dropped there; what was measured."""

    digests: list[SenderDigest] = field(default_factory=list)
    messages: dict[str, int] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    latencies_ms: dict[str, list[float]] = field(default_factory=dict)


def summed_up(last_words: Iterable[LastWord]) -> LastWord:
    """All last words in one."""
    digests: list[SenderDigest] = []
    messages, dropped = Counter[str](), Counter[str]()
    latencies: dict[str, list[float]] = {}
    for one in last_words:
        digests += one.digests
        messages.update(one.messages)
        dropped.update(one.dropped)
        for name, milliseconds in one.latencies_ms.items():
            latencies.setdefault(name, []).extend(milliseconds)
    return LastWord(digests, dict(messages), dict(dropped), latencies)


class StripLatency:
    """Wall-clock latency from a strip's publication to its acceptance, of each strip that is published and offered at
    once, that is while an eligible helper is free. Stamped where the coordinator's process sends, and where it handles
    what has come, outside payload and digest."""

    def __init__(self) -> None:
        self.milliseconds: list[float] = []
        self._published_s: dict[int, float] = {}

    def sending(self, outgoing: list[Outgoing], wall_s: float) -> None:
        """The coordinator's publications of one round, about to be sent."""
        new = {
            number_of(one.key)
            for one in outgoing
            if isinstance(one.message, StripStatus) and one.message.state is StripState.OPEN
        }
        for one in outgoing:
            task = one.message
            if isinstance(task, Task) and task.action is TaskAction.TAKE and task.strip in new:
                self._published_s.setdefault(task.strip, wall_s)

    def arrived(self, received: Received, wall_s: float) -> None:
        """A message that the coordinator's process handles, which in its own it does at the clock's next word."""
        status = received.message
        if isinstance(status, TaskStatus) and status.state is TaskState.ACCEPTED:
            published_s = self._published_s.pop(status.strip, None)
            if published_s is not None:
                self.milliseconds.append((wall_s - published_s) * 1000)
