"""When the mission is over, and saying so again to those who may not have heard it; asking for what has not arrived,
without which it may not be over."""

from __future__ import annotations

import math

from comms.said.messages import MissionOver, TaskAction
from coordinator.agenda import Agenda, Item
from coordinator.config import CoordinatorConfig
from coordinator.fleet import KnownFleet
from coordinator.goal import GoalWatch
from coordinator.outbox import Outbox
from coordinator.sectors import Sectors
from coordinator.strip_life import StripLife
from coordinator.vehicles import KnownVehicle

# Who lacks something is asked for it after the first of these times, as what is under way may take longer than the
# state that tells of it; again after the second, or while primaries survey, which have much else to say, the third.
ASK_AFTER_MS, ASK_EVERY_MS, ASK_WHILE_SURVEYING_MS = 1000, 10_000, 60_000
SAY_AGAIN_AFTER_MS = (*range(10, 100, 10), *range(1000, 10_000, 1000))

GOAL_REACHED = "the goal is reached"
"""What the reason begins with where it is that."""


class MissionEnd:
    """The mission is over when every primary has finished, all of which states tell has arrived and was cut by, no
    strip is left and nobody is on its way home; at once where its goal is reached; at the latest at the deadline, by
    the last primary's end or by the clock. Who ends its survey early, as its battery is low, has finished when it is
    home. `over`: what was said of that, None until then."""

    def __init__(
        self,
        config: CoordinatorConfig,
        fleet: KnownFleet,
        strips: StripLife,
        sectors: Sectors,
        goal: GoalWatch,
        agenda: Agenda,
        outbox: Outbox,
    ) -> None:
        self.over: MissionOver | None = None
        self._over_ms = 0
        self._lacks_since_ms: dict[str, int] = {}  # of whom something has not arrived
        self._asked_ms: dict[str, int] = {}  # when each was last asked to tell again
        self._config = config
        self._fleet = fleet
        self._strips = strips
        self._sectors = sectors
        self._goal = goal
        self._agenda = agenda
        self._outbox = outbox

    def find(self, now_ms: int) -> None:
        """Finds whether the mission is over, and says so; asks for what has not arrived."""
        left, surveying = self._strips.unended, self._fleet.surveying
        lacking = self._fleet.lacking(now_ms)
        self._ask(lacking, now_ms)
        returning = any(one.is_returning for one in self._fleet.vehicles.values())
        given_up = ", ".join(name for name, one in self._fleet.primaries.items() if one.is_given_up)
        given_up = f"; given up before the end of its survey: {given_up}" if given_up else ""
        is_busy = bool(left or self._strips.awaited or surveying or lacking or returning)
        if not is_busy and not self._cut_is_left(now_ms):
            early = ", ".join(name for name, one in self._fleet.primaries.items() if one.ended_early)
            cut_short = f"; the survey of {early} has ended early, as the battery lasted for no more" if early else ""
            have_finished = "" if given_up else "every primary has finished and "
            reason = f"{have_finished}no strip is left{cut_short}{given_up}"
        elif goal := self._goal.find(now_ms):
            reason = f"{GOAL_REACHED}: {goal}, {len(left)} strips are left"
        elif now_ms >= self.deadline_ms():
            by_the_clock = math.isfinite(self._config.deadline_s)
            end = "the deadline" if by_the_clock else f"{self._config.deadline_factor:g} times the last primary's end"
            cut_short = ", the survey is not finished" if surveying else ""
            reason = f"{end} is reached{cut_short}, {len(left)} strips are left{given_up}"
        else:
            return
        self._strips.leave_all(now_ms)
        self.over, self._over_ms = MissionOver(reason), now_ms
        self._outbox.add_over(self.over)
        self._agenda.add(Item.SAY_OVER, now_ms + SAY_AGAIN_AFTER_MS[0])

    def note_state(self, vehicle: KnownVehicle, now_ms: int) -> None:
        """A vehicle's newest state may tell of something that has not arrived: it is asked for that in time."""
        if vehicle.lacks:
            self._lacks_since_ms.setdefault(vehicle.entry.vehicle, now_ms)
            self._agenda.add(Item.ASK_AGAIN, self._ask_ms(vehicle))

    def _ask(self, lacking: list[KnownVehicle], now_ms: int) -> None:
        """Asks those of whom something has not arrived to tell it again, until all has; then it is cut by, at once
        where every primary has finished."""
        if self._lacks_since_ms and not lacking and not self._fleet.surveying:
            self._sectors.cut_by(now_ms)
        names = [one.entry.vehicle for one in lacking]
        self._lacks_since_ms = {name: self._lacks_since_ms.get(name, now_ms) for name in names}
        self._agenda.strike(Item.ASK_AGAIN, now_ms)
        for one in lacking:
            if self._ask_ms(one) <= now_ms:
                self._asked_ms[one.entry.vehicle] = now_ms
                if not one.lost:
                    self._outbox.add_task(TaskAction.TELL_AGAIN, one.entry.vehicle)
            self._agenda.add(Item.ASK_AGAIN, self._ask_ms(one))

    def _ask_ms(self, vehicle: KnownVehicle) -> int:
        """When a vehicle of which something has not arrived is to be asked for it."""
        name, every_ms = vehicle.entry.vehicle, ASK_WHILE_SURVEYING_MS if self._fleet.surveying else ASK_EVERY_MS
        return max(self._lacks_since_ms[name] + ASK_AFTER_MS, self._asked_ms.get(name, -every_ms) + every_ms)

    def _cut_is_left(self, now_ms: int) -> bool:
        """Whether there is news that was not cut by; if so that is done at once."""
        left = self._agenda.sectors(Item.CUT)
        for sector in left:
            self._agenda.add(Item.CUT, now_ms, sector)
        return bool(left)

    def say_again(self, now_ms: int) -> None:
        """Says again that the mission is over, where a vehicle has not answered, or something of it has not arrived:
        the answer to that are its tiles and hotspots, too."""
        vehicles = self._fleet.vehicles.values()
        unheard = any(one.heard_ms <= self._over_ms or not one.is_finished for one in vehicles)
        if self.over is not None and (unheard or any(one.lacks for one in vehicles)):
            self._outbox.add_over(self.over)
            to_come = (self._over_ms + after_ms for after_ms in SAY_AGAIN_AFTER_MS)
            again_ms = next((again_ms for again_ms in to_come if again_ms > now_ms), None)
            if again_ms is not None:
                self._agenda.add(Item.SAY_OVER, again_ms)

    def may_end_ms(self) -> float:
        """When the mission is over at the latest, or before that may be, as its goal is looked at."""
        look_ms = self._agenda.deadline_ms(Item.GOAL)
        return self.deadline_ms() if look_ms is None else min(look_ms, self.deadline_ms())

    def deadlines_ms(self) -> list[int]:
        """When the mission is over at the latest, if that is known already."""
        deadline_ms = self.deadline_ms()
        return [] if deadline_ms == math.inf else [int(deadline_ms)]

    def deadline_ms(self) -> float:
        """When the mission is over at the latest; infinite where that is not known yet."""
        if math.isfinite(self._config.deadline_s):
            return math.ceil(self._config.deadline_s * 1000)
        if self._fleet.surveying:
            return math.inf
        ends_ms = [one.finished_ms or 0 for one in self._fleet.primaries.values()]
        return math.ceil(max(ends_ms, default=0) * self._config.deadline_factor)
