"""Coordinators that give strips which are none; a scenario names them as its coordinator's node."""

from __future__ import annotations

import math
from typing import ClassVar

from comms.node import Publication, Received, Step
from comms.said.messages import MissionOver, Task, TaskAction
from comms.said.topics import MISSION_OVER, TASK

END_MS = 60_000
Place = tuple[float, float, float, float, float]


class GivesStrips:
    """Offers these strips to the helper, one every 5 s, as start, heading, length and width, and ends the mission."""

    strips: ClassVar[list[Place]] = [
        (100, 20, 0, 0, 10),
        (100, 20, 0, 50, 0),
        (100, 20, 0, -50, 10),
        (400, 20, 0, 50, 10),
        (-9e6, 20, 0, 50, 10),
        (100, -40, math.pi, 50, 10),
        (100, 20, 0, 50, 10),
    ]

    def __init__(self, config: object) -> None:
        self._given = 0

    def start(self, now_ms: int) -> Step:
        """Begins in 5 s."""
        return Step(wake_ms=now_ms + 5000)

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Hears nobody."""
        return Step(wake_ms=(now_ms // 5000 + 1) * 5000)

    def on_wake(self, now_ms: int) -> Step:
        """Gives the next strip."""
        if now_ms >= END_MS:
            return Step((Publication(MISSION_OVER.key(), MissionOver("enough")),))
        said: tuple[Publication, ...] = ()
        if self._given < len(self.strips):
            x_m, y_m, heading_rad, length_m, width_m = self.strips[self._given]
            self._given += 1
            task = Task(TaskAction.TAKE, self._given, x_m, y_m, heading_rad, length_m, width_m)
            said = (Publication(TASK.key(vehicle="helper", number=self._given), task),)
        return Step(said, (now_ms // 5000 + 1) * 5000)


class GivesNan(GivesStrips):
    """Gives a strip of no length that can be told."""

    strips: ClassVar[list[Place]] = [(100, 20, 0, math.nan, 10)]
