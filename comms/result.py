"""What a bus reports of a run that has ended."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field


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
    digest: str | None
    rounds: int | None
    messages: dict[str, int]
    dropped: dict[str, int]
    latencies_ms: dict[str, list[float]] = field(default_factory=dict)
