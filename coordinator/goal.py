"""Whether what the mission is flown for is reached, by the fleet's map, P(y) and contacts as the coordinator has heard
them."""

from __future__ import annotations

from coordinator.agenda import Agenda, Item
from coordinator.expect.contacts import KnownContacts
from coordinator.fleet import KnownFleet
from planner.clearance import CAUTIOUS_MINES, mines_left_by, scatter_of_all
from planner.goal import Goal
from planner.region import Region
from planner.types import BoolArray

LOOK_EVERY_MS = 30_000  # the map changes slowly, and to find the contacts' objects takes its time


class GoalWatch:
    """Looks every LOOK_EVERY_MS. `goal`: None where the mission has none. `inside`: the cells of the `area`, shape of
    the grid."""

    def __init__(
        self,
        goal: Goal | None,
        fleet: KnownFleet,
        contacts: KnownContacts,
        area: Region,
        inside: BoolArray,
        agenda: Agenda,
        now_ms: int,
    ) -> None:
        self._goal = goal
        self._fleet = fleet
        self._inside = inside
        self._place = None if goal is None else goal.place(area, fleet.map.grid)
        self._agenda = agenda
        self._contacts = contacts
        if goal is not None:
            agenda.add(Item.GOAL, now_ms + LOOK_EVERY_MS)

    def find(self, now_ms: int) -> str:
        """What is told where the goal is found to be reached now; empty where it is not, or it is not time to look."""
        goal = self._goal
        if goal is None or not self._agenda.strike(Item.GOAL, now_ms):
            return ""
        self._agenda.add(Item.GOAL, now_ms + LOOK_EVERY_MS)
        curves = [[curve for track, curve in one.curves.items() if track > 0] for one in self._fleet.vehicles.values()]
        scatter = scatter_of_all(one for one in curves if one)
        left = mines_left_by(self._contacts.objects, self._inside, scatter, self._place, CAUTIOUS_MINES)
        return f"{goal.words}; {goal.words_now(left)}" if goal.is_reached(left) else ""
