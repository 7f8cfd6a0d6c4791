"""Wall-clock latency from a strip's publication to its acceptance, stamped where the coordinator's process sends and
where it takes up what has come, outside payload and digest."""

from __future__ import annotations

from comms.node import Received
from comms.runner import Outgoing
from comms.said.messages import StripState, StripStatus, Task, TaskAction, TaskState, TaskStatus
from comms.said.topics import number_of

STRIP_TO_TASK = "strip_to_task"


class StripLatency:
    """Times each strip that is published and offered at once, that is while an eligible helper is free."""

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
        """A message that the coordinator's process takes up, which in its own it does at the clock's next word."""
        status = received.message
        if isinstance(status, TaskStatus) and status.state is TaskState.ACCEPTED:
            published_s = self._published_s.pop(status.strip, None)
            if published_s is not None:
                self.milliseconds.append((wall_s - published_s) * 1000)
