"""When the mission is over, and saying so again to those who may not have heard it."""

from __future__ import annotations

import math

from comms.said.messages import MissionOver
from coordinator.agenda import Agenda, Item
from coordinator.config import CoordinatorConfig
from coordinator.fleet import KnownFleet
from coordinator.outbox import Outbox
from coordinator.strip_life import StripLife

SAY_AGAIN_AFTER_MS = (*range(10, 100, 10), *range(1000, 10_000, 1000))


class MissionEnd:
    """The mission is over when every primary has finished and no strip is left, at the latest at the deadline, by the
    last primary's end or by the clock. `over`: what was said of that, None until then."""

    def __init__(
        self, config: CoordinatorConfig, fleet: KnownFleet, strips: StripLife, agenda: Agenda, outbox: Outbox
    ) -> None:
        self.over: MissionOver | None = None
        self._over_ms = 0
        self._config = config
        self._fleet = fleet
        self._strips = strips
        self._agenda = agenda
        self._outbox = outbox

    def find(self, now_ms: int) -> None:
        """Finds whether the mission is over, and says so."""
        left, surveying = self._strips.unended, self._fleet.surveying
        if not left and not surveying:
            reason = "every primary has finished and no strip is left"
        elif now_ms >= self._deadline_ms():
            by_the_clock = math.isfinite(self._config.deadline_s)
            end = "the deadline" if by_the_clock else f"{self._config.deadline_factor:g} times the last primary's end"
            cut_short = ", the survey is not finished" if surveying else ""
            reason = f"{end} is reached{cut_short}, {len(left)} strips are left"
        else:
            return
        self._strips.leave_all(now_ms)
        self.over, self._over_ms = MissionOver(reason), now_ms
        self._outbox.add_over(self.over)
        self._agenda.add(Item.SAY_OVER, now_ms + SAY_AGAIN_AFTER_MS[0])

    def say_again(self, now_ms: int) -> None:
        """Says again that the mission is over, where a vehicle has not answered, or some of its tiles were lost: the
        answer to that are its tiles, too."""
        vehicles = self._fleet.vehicles.values()
        unheard = any(one.heard_ms <= self._over_ms or not one.is_finished for one in vehicles)
        if self.over is not None and (unheard or any(one.has_missed_tiles for one in vehicles)):
            self._outbox.add_over(self.over)
            to_come = (self._over_ms + after_ms for after_ms in SAY_AGAIN_AFTER_MS)
            again_ms = next((again_ms for again_ms in to_come if again_ms > now_ms), None)
            if again_ms is not None:
                self._agenda.add(Item.SAY_OVER, again_ms)

    def deadlines_ms(self) -> list[int]:
        """When the mission is over at the latest, if that is known already."""
        deadline_ms = self._deadline_ms()
        return [] if deadline_ms == math.inf else [int(deadline_ms)]

    def _deadline_ms(self) -> float:
        if math.isfinite(self._config.deadline_s):
            return math.ceil(self._config.deadline_s * 1000)
        if self._fleet.surveying:
            return math.inf
        ends_ms = [one.finished_ms or 0 for one in self._fleet.primaries.values()]
        return math.ceil(max(ends_ms, default=0) * self._config.deadline_factor)
