"""Who is sent where: the allocator's offers as far as they may be made now, and who is told to give way."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from comms.said.messages import TaskAction
from coordinator.agenda import Agenda, Item
from coordinator.allocate.allocators import checked_offers, offers_let_through
from coordinator.allocate.service import expected_service
from coordinator.allocate.situation import Allocator, Situation
from coordinator.config import CoordinatorConfig
from coordinator.fleet import KnownFleet
from coordinator.keep_apart.right_of_way import Instruction, RightOfWay, Underway
from coordinator.ledger import WITH_A_VEHICLE
from coordinator.outbox import NO_STRIP, Outbox
from coordinator.strip_life import StripLife
from planner.types import BoolArray, GridSpec, Point

WAITS_MS = 120_000
"""Who has waited for so long for others at work to be out of its way does not wait any more: where a vehicle stays in
the way one wait follows the other."""
GAP_MS = 60_000
"""What it was told so long before is not the same wait: meanwhile it was lost, or there was nothing to wait for."""


class Dispatch:
    """Beside every allocator alike vehicles are kept apart, where the configuration wants that. `inside`: the area's
    cells, shape of the grid."""

    def __init__(
        self,
        config: CoordinatorConfig,
        allocator: Allocator,
        fleet: KnownFleet,
        inside: BoolArray,
        strips: StripLife,
        agenda: Agenda,
        outbox: Outbox,
    ) -> None:
        self._allocator = allocator
        self._fleet = fleet
        self._strips = strips
        self._agenda = agenda
        self._outbox = outbox
        lies_inside = partial(_lies_inside, fleet.map.grid, inside)
        self._waits_ms: dict[str, tuple[int, int]] = {}
        """From when to when helpers that are free have been waiting for others at work."""
        self._right_of_way = None
        if config.separation_m > 0:
            self._right_of_way = RightOfWay(config.separation_m, lies_inside, fleet.keep_out)

    def note_state(self, name: str, now_ms: int, *, does_another: bool) -> None:
        """A vehicle was heard. `does_another`: what it does is another than it was."""
        if self._right_of_way is not None:
            if does_another:
                self._right_of_way.changed(name)
            if now_ms >= self._right_of_way.check_s * 1000:
                self._agenda.add(Item.KEEP_APART, now_ms)

    def assign(self, situation: Situation, sector: int, now_ms: int) -> None:
        """Makes the allocator's offers in a sector; those that must wait it is asked for again."""
        if not situation.strips or not situation.helpers:
            return
        right = self._right_of_way
        if right is None:
            self._offer(checked_offers(self._allocator.assign(situation), situation), situation, now_ms)
            return
        departures = right.departures(self._under_way(), now_ms / 1000)
        self._waits_ms = {name: wait for name, wait in self._waits_ms.items() if now_ms - wait[1] < GAP_MS}
        impatient = [name for name, (since_ms, _) in self._waits_ms.items() if now_ms - since_ms >= WAITS_MS]
        through = offers_let_through(self._allocator, situation, departures, impatient)
        free = {helper.vehicle for helper in situation.free}
        for name, number in through.offers:
            if name in free:
                right.offered(name, number, departures)
        waiting = through.waiting & free
        for helper in situation.helpers:
            since_ms, _ = self._waits_ms.pop(helper.vehicle, (now_ms, now_ms))
            if helper.vehicle in waiting and helper.free_s <= situation.now_s:
                self._waits_ms[helper.vehicle] = since_ms, now_ms
        self._offer(through.offers, situation, now_ms)
        if math.isfinite(through.again_s):
            self._agenda.add(Item.ASSIGN, now_ms + round(through.again_s * 1000), sector)
        self._instruct(right.make_room(departures, self._under_way()), now_ms)

    def keep_apart(self, now_ms: int) -> None:
        """Tells helpers to give way to whom they would come too close."""
        if self._right_of_way is not None:
            self._instruct(self._right_of_way.check(self._under_way(), now_ms / 1000), now_ms)

    def _offer(self, offers: Iterable[tuple[str, int]], situation: Situation, now_ms: int) -> None:
        """Offers strips; a helper that has one is first to give that back."""
        helpers = {helper.vehicle: helper for helper in situation.helpers}
        open_strips = {one.strip.number: one for one in situation.strips}
        for name, number in offers:
            helper = helpers[name]
            if helper.task is not None:
                self._strips.ask_back(helper.task.strip, self._fleet.vehicles[name], now_ms)
            else:
                expected = expected_service(open_strips[number], helper)
                as_next = self._strips.ledger.strip_of(name) is not None
                self._strips.offer(number, name, expected, now_ms, as_next=as_next)

    def _instruct(self, instructions: Iterable[Instruction], now_ms: int) -> None:
        for one in instructions:
            if one.gives_back is not None:
                vehicle = self._fleet.vehicles[one.name]
                vehicle.gave_way.add(one.gives_back.number)
                self._strips.ask_back(one.gives_back, vehicle, now_ms)
            if one.place is not None:
                self._outbox.add_task(TaskAction.STAND_ASIDE, one.name, replace(NO_STRIP, start=one.place))

    def _under_way(self) -> list[Underway]:
        strips = {record.vehicle: record.strip for record in self._strips.ledger.in_state(*WITH_A_VEHICLE)}
        return [Underway(one, strips.get(name)) for name, one in self._fleet.vehicles.items()]


def _lies_inside(grid: GridSpec, inside: BoolArray, place: Point) -> bool:
    """Whether a place, in the mission frame, lies in one of the area's cells."""
    across_m, along_m = grid.frame.to_sweep(*place)
    column, row = round(across_m / grid.cell_m), math.floor(along_m / grid.cell_m)
    return 0 <= column < grid.columns and 0 <= row < grid.rows and bool(inside[row, column])
