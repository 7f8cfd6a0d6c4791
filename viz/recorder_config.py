"""What the recorder is told; apart from it, so that whoever starts it need not import rerun."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from comms.node import Received
from planner.types import PriorityGround

LogLine = tuple[int, str, str, bool]
"""When, in simulated milliseconds, and by whom, in what words, and whether something did not go as planned."""


class Storyteller(Protocol):
    """Tells a mission in plain words, for the log."""

    @property
    def telling(self) -> tuple[type, ...]:
        """The messages that may be worth a line."""

    def tell(self, received: Received) -> Iterable[LogLine]:
        """The lines that are ready now that this message has come."""

    def rest(self, *, before_ms: int | None = None) -> Iterable[LogLine]:
        """The lines still held back: all, or those of another time than this."""


LinkPoint = tuple[int, str, float]
"""When, in simulated milliseconds, of which series, and what: `age/VEHICLE`, what the coordinator knows of it, and
`age_of_coordinator/VEHICLE`, what that has heard, in seconds; `bytes_per_s`, `bytes_per_s_for/SUBJECT`; `frames_lost`
and `slots_full` as shares."""


class LinkTeller(Protocol):
    """Tells how the link goes, as series over time. `subjects`: what bytes are for, each with words for people."""

    @property
    def subjects(self) -> Mapping[str, str]:
        """See above."""

    @property
    def telling(self) -> tuple[type, ...]:
        """The messages that it makes use of."""

    def tell(self, received: Received) -> Iterable[LinkPoint]:
        """The points that are known now that this message has come."""

    def rest(self, now_ms: int) -> Iterable[LinkPoint]:
        """Those that are left at the end."""


@dataclass(frozen=True)
class RecorderConfig:
    """`path`: the file to write. `story`: makes who tells of the mission in its log.

    `live_pipe`: the named pipe of a LiveServer, to show the mission while it runs; None: the file alone.
    `draw_every_s`: the risk map is drawn at most once in so much simulated time, a very large one once a minute.
    `thresholds`: each survey vehicle's P_d from which data is admissible, drawn with its P(y) where it is told.
    `priorities`: drawn on the map. `link`: makes who tells how the link goes; None where everybody hears everybody.
    """

    path: Path
    story: Callable[[], Storyteller]
    live_pipe: Path | None = None
    draw_every_s: float = 10.0
    thresholds: Mapping[str, float] = field(default_factory=dict)
    priorities: tuple[PriorityGround, ...] = ()
    link: Callable[[], LinkTeller] | None = None
