"""What the coordinator says: how strips stand, tasks for helpers, and that the mission is over."""

from __future__ import annotations

from comms.node import Publication
from comms.said.messages import MissionOver, StripStatus, Task, TaskAction
from comms.said.topics import MISSION_OVER, STRIP, TASK
from comms.said.wire import shortened
from coordinator.ledger import StripRecord
from planner.types import Strip

NO_STRIP = Strip(0, (0.0, 0.0), 0.0, 0.0, 0.0)


class Outbox:
    """Keeps what is to be published until the node's step, in order. Tasks are numbered from 1."""

    def __init__(self) -> None:
        self._waiting: list[Publication] = []
        self._tasks = 0

    def add_strip(self, record: StripRecord) -> None:
        """Says how a strip stands."""
        strip = record.strip
        message = StripStatus(
            revision=record.revision,
            state=record.state,
            start_x_m=strip.start[0],
            start_y_m=strip.start[1],
            heading_rad=strip.heading_rad,
            length_m=strip.length_m,
            width_m=strip.width_m,
            removable_m2=record.cut.removable_m2,
            vehicle=record.vehicle,
            reason=shortened(record.reason),
            why=shortened(record.cut.why),
            foreseen=record.cut.foreseen,
        )
        self._waiting.append(Publication(STRIP.key(number=strip.number), message))

    def add_task(self, action: TaskAction, vehicle: str, strip: Strip = NO_STRIP) -> None:
        """Tells a vehicle to do something with a strip, or at its start, or by itself."""
        self._tasks += 1
        task = Task(action, strip.number, *strip.start, strip.heading_rad, strip.length_m, strip.width_m)
        self._waiting.append(Publication(TASK.key(vehicle=vehicle, number=self._tasks), task))

    def unsay_offer(self, vehicle: str, number: int) -> bool:
        """A strip is not offered to a vehicle after all, where that has not gone out yet; returns whether it was so."""

        def offers_it(one: Publication) -> bool:
            task = one.message
            if not isinstance(task, Task) or not task.action.is_offer:
                return False
            return task.strip == number and TASK.vehicle_of(one.key) == vehicle

        before = len(self._waiting)
        self._waiting = [one for one in self._waiting if not offers_it(one)]
        return len(self._waiting) < before

    def add_over(self, over: MissionOver) -> None:
        """Says that the mission is over."""
        self._waiting.append(Publication(MISSION_OVER.key(), over))

    def empty(self) -> tuple[Publication, ...]:
        """All that is to be published; it is then no longer here."""
        waiting = tuple(self._waiting)
        self._waiting.clear()
        return waiting
