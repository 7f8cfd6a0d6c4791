"""What the recorder is told; apart from it, so that whoever starts it need not import rerun."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from planner.types import PriorityGround


@dataclass(frozen=True)
class RecorderConfig:
    """`path`: the file to write.

    `recording_id`: recordings of one id open as one; the name of the file's folder, the run's, if not given.
    `live_pipe`: the named pipe of a LiveServer, to show the mission while it runs; None: the file alone.
    `draw_every_s`: the risk map is drawn at most once in so much simulated time, a very large one once a minute.
    `piece_s`: positions and statistics are held back for so much simulated time, and four seconds of the wall clock at
    least, and written together; a live view does not wait for that.
    `thresholds`: each survey vehicle's P_d from which data is admissible, drawn with its P(y) where it is told.
    `priorities`: drawn on the map.
    """

    path: Path
    recording_id: str | None = None
    live_pipe: Path | None = None
    draw_every_s: float = 10.0
    piece_s: float = 60.0
    thresholds: Mapping[str, float] = field(default_factory=dict)
    priorities: tuple[PriorityGround, ...] = ()
