"""Helpers that do not do what they say, one way each; a scenario names them as the agent of a vehicle."""

from __future__ import annotations

from comms.said.messages import Task, TaskAction, TaskState, TaskStatus
from comms.said.topics import TASK_STATUS
from planner.types import Track
from vehicle_agent.revisit import RevisitAgent


class RefusesAll(RevisitAgent):
    """Takes nothing."""

    answers = 0

    def on_task(self, task: Task, now_ms: int) -> None:
        """Refuses."""
        self.answer(task, TaskState.REFUSED, "no")

    def answer(self, task: Task, state: TaskState, reason: str = "") -> None:
        """Says how a task stands."""
        self.answers += 1
        key = TASK_STATUS.key(vehicle=self.vehicle, number=self.answers)
        self.publish(key, TaskStatus(task.strip, state, 0, reason))


class NeverMoves(RevisitAgent):
    """Takes what it is offered, says that it is on its way, and stays where it is."""

    def follow(self, track: Track, run_in_m: float) -> None:
        """Commands nothing."""


class NeverGivesBack(NeverMoves):
    """And keeps it, whatever it is asked."""

    def on_task(self, task: Task, now_ms: int) -> None:
        """Hears offers alone."""
        if task.action is TaskAction.TAKE:
            super().on_task(task, now_ms)


class SaysDone(RefusesAll):
    """Says at once that all is done."""

    def on_task(self, task: Task, now_ms: int) -> None:
        """Lies."""
        self.answer(task, TaskState.DONE)
