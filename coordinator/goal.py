"""Whether what the mission is flown for is reached, by the fleet's map, P(y) and contacts as the coordinator has heard
them, and whether it soon will be."""

from __future__ import annotations

import math

import numpy as np

from coordinator.agenda import Agenda, Item
from coordinator.cut.window import Window
from coordinator.expect.contacts import KnownContacts
from coordinator.fleet import KnownFleet
from planner.clearance import CAUTIOUS_MINES, mines_left_by, scatter_of_all
from planner.goal import Goal
from planner.region import Region
from planner.types import BoolArray, FloatArray

LOOK_EVERY_MS = 30_000  # the map changes slowly, and to find the contacts' objects takes its time
NEAR = 0.8  # share of what the risk is expected to fall by until the deadline within which a goal is near


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
        self._lacking: float | None = None
        """By how many nats what is left must still fall, when it was last looked; None while nothing was seen."""
        self._risk = 1.0
        """The mean residual risk then."""
        self._expected = dict[int, tuple[float, float]]()
        """By sector, see `hear_expected`."""
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
        if left is not None:
            self._lacking, self._risk = goal.nats_lacking(left), 1.0 - left.clearance
        return f"{goal.words}; {goal.words_now(left)}" if goal.is_reached(left) else ""

    def area_m2(self, window: Window, cell_area_m2: float) -> FloatArray | None:
        """How much of each cell of a window counts of what is left; None without a goal."""
        if self._goal is None:
            return None
        there: FloatArray = self._inside.astype(np.float64) if self._place is None else self._place
        return there[window.cells] * cell_area_m2

    def hear_expected(self, sector: int, left_m2: float, area_m2: float) -> None:
        """What helpers are expected to leave in a sector by the deadline (residual risk times m2), of so many square
        metres that count."""
        self._expected[sector] = left_m2, area_m2

    @property
    def is_near(self) -> bool:
        """Whether the goal is expected to be reached well before the deadline: what is left must fall by clearly less
        than the risk is expected to. While nothing was seen it is taken to be near, as it costs least to be wrong
        then."""
        if self._goal is None or self._lacking is None:
            return self._goal is not None
        left_m2, area_m2 = (sum(one) for one in zip((0.0, 0.0), *self._expected.values(), strict=True))
        risk_m2 = self._risk * area_m2
        return 0.0 < left_m2 < risk_m2 and self._lacking <= NEAR * math.log(risk_m2 / left_m2)
