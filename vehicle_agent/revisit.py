"""The revisit agent: takes strips from the coordinator, sweeps them with the sonar on, reports what came of it."""

from __future__ import annotations

from comms.said.messages import Look, ManeuverStatus, Mode, RunInfo, Task
from vehicle_agent.agent import Agent
from vehicle_agent.config import RevisitConfig
from vehicle_agent.second_looks import SecondLooks


class RevisitAgent(Agent):
    """A helper: see the module."""

    def __init__(self, config: RevisitConfig) -> None:
        super().__init__(config.vehicle, config.endurance_ms)
        self.config = config
        self._looks = SecondLooks(self, config, rest=Mode.IDLE)

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """Reports for duty."""
        self.report_state(now_ms)

    def on_task(self, task: Task, now_ms: int) -> None:
        """Answers an offer, or gives a strip back."""
        self._looks.on_task(task, now_ms)

    def on_look(self, look: Look, now_ms: int) -> None:
        """Counts what has been swept of the present leg."""
        self._looks.on_look(look)

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Goes from leg to leg."""
        self._looks.on_maneuver(status, now_ms)

    def on_over(self, now_ms: int) -> None:
        """Stops where it is."""
        self._looks.on_over(now_ms)
        self.mode = Mode.FINISHED
        self.hold()

    def report(self, now_ms: int) -> None:
        """Adds the progress of a strip under way to the report."""
        super().report(now_ms)
        self._looks.tell_progress()
