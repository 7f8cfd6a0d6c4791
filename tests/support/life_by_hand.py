"""The strips of a fleet with nobody about who cuts, offers or says anything but what a test does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from by_hand import run_info
from coordinator_by_hand import PATIENCE, TWO_HELPERS
from one_node import received
from sectors_by_hand import sector

from comms.said.codec import Header
from comms.said.messages import AgentState, CoverageTile, Mode, StripState, StripStatus, Task, TaskState, TaskStatus
from coordinator.agenda import Agenda, Item
from coordinator.allocate.service import Service
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from coordinator.ledger import Ledger, StripRecord
from coordinator.outbox import Outbox
from coordinator.sectors import Sectors
from coordinator.strip_life import StripLife
from coordinator.vehicles import KnownVehicle
from planner.dubins import Pose
from planner.tiles import tiles
from planner.types import BoolArray

WEST, EAST = Window(0, 80, 0, 40), Window(0, 80, 40, 81)  # the sectors, of 400 m by 400 m in cells of 5 m
IN_THE_WEST, IN_THE_EAST = Window(10, 70, 20, 30), Window(10, 70, 60, 70)  # strips of a swath's width, 300 m long


class Lives:
    """Strips of two sectors, and what becomes of them. An answer is waited for 25 s, if not told otherwise."""

    def __init__(self, *, answer_within_ms: int = 25_000, looks_within_ms: int = 0) -> None:
        self.fleet = KnownFleet(run_info(400, 400, vehicles=TWO_HELPERS), PATIENCE, 0)
        self.agenda, self.outbox, self.ledger = Agenda(), Outbox(), Ledger()
        self.inside: BoolArray = np.ones(self.fleet.map.grid.shape, dtype=np.bool_)
        self.west, self.east = sector(self.fleet, WEST, 0), sector(self.fleet, EAST, 1)
        sectors = Sectors([self.west, self.east], self.fleet.map.grid, self.agenda)
        self.life = StripLife(
            self.ledger, self.fleet, self.inside, sectors, self.outbox, answer_within_ms, looks_within_ms
        )
        self._messages = 0
        for name, one in self.fleet.vehicles.items():
            one.hear_state(self.header(name), AgentState(Mode.TRANSIT, 0, 1, 0, 0, 0, 0), 0)

    def open(self, window: Window = IN_THE_WEST) -> StripRecord:
        """Opens a strip there, which counts 100 m2."""
        number = self.ledger.next_number
        self.life.open(Cut(window, 100.0, 90.0), 0, "")
        return self.strip(number)

    def offered(self, name: str, window: Window = IN_THE_WEST, *, at_ms: int = 0, as_next: bool = False) -> StripRecord:
        """A strip there, offered to a vehicle that is expected to have served it at 200 s."""
        record = self.open(window)
        self.life.offer(record.strip.number, name, Service(100, 200, Pose(0, 0, 0), 205), at_ms, as_next=as_next)
        self.forget()
        return record

    def given(self, name: str, window: Window = IN_THE_WEST, state: TaskState = TaskState.UNDER_WAY) -> StripRecord:
        """A strip there that a vehicle has said to be at."""
        record = self.offered(name, window)
        self.tell(name, record, state)
        self.forget()
        return record

    def next_of(self, name: str, window: Window = IN_THE_EAST) -> StripRecord:
        """A strip there that a vehicle has said to do next."""
        record = self.offered(name, window, as_next=True)
        self.tell(name, record, TaskState.NEXT)
        return record

    def strip(self, number: int) -> StripRecord:
        """The strip of that number."""
        found = self.ledger.get(number)
        assert found is not None
        return found

    def vehicle(self, name: str) -> KnownVehicle:
        """A vehicle of the fleet."""
        return self.fleet.vehicles[name]

    def header(self, name: str, now_ms: int = 0) -> Header:
        """Of the next message of a vehicle."""
        self._messages += 1
        return Header(name, 0, self._messages, now_ms)

    def tell(
        self,
        name: str,
        strip: StripRecord | int,
        state: TaskState,
        now_ms: int = 0,
        *,
        reason: str = "",
        header: Header | None = None,
    ) -> None:
        """A vehicle's word on a strip."""
        number = strip if isinstance(strip, int) else strip.strip.number
        status = TaskStatus(number, state, 0, reason)
        self.life.hear_status(self.vehicle(name), header or self.header(name, now_ms), status, now_ms)

    def state(self, name: str, mode: Mode, works_on: int = 0, now_ms: int = 0) -> None:
        """A vehicle's state."""
        vehicle, header, had_no_work = self.vehicle(name), self.header(name, now_ms), self.vehicle(name).has_no_work
        state = AgentState(mode, works_on, 1, 0, 0, 0, 0)
        assert vehicle.hear_state(header, state, now_ms)
        self.life.hear_state(vehicle, header, state, now_ms, had_no_work=had_no_work)

    def sees(self, name: str, rows: Sequence[int] | range, level: int = 9) -> None:
        """A vehicle's layer, whole: it has seen all of these rows as well as that, and nothing else."""
        levels = np.zeros(self.fleet.map.grid.shape, dtype=np.uint8)
        levels[list(rows)] = level
        self._messages += 1
        for tile in tiles(self.fleet.map.grid):
            part = levels[tile.window]
            settled = np.ones(part.shape, dtype=np.bool_)
            message = CoverageTile(self._messages, tile.first_row, tile.first_column, part, part, settled)
            self.fleet.hear_tile(received(f"agent/{name}/coverage/{tile.name}", message), message)

    def said(self) -> list[tuple[str, object, int]]:
        """What was said since, in order: tasks with who is told, strips with the reason."""
        found: list[tuple[str, object, int]] = []
        for one in self.outbox.empty():
            if isinstance(one.message, Task):
                found.append((one.key.split("/")[2], one.message.action, one.message.strip))
            elif isinstance(one.message, StripStatus):
                found.append((one.message.reason, one.message.state, int(one.key.split("/")[-1])))
        return found

    def due(self) -> list[tuple[Item, int, int]]:
        """What is on the agenda since: what, of which sector, when."""
        found = []
        for item in (Item.CUT, Item.ASSIGN):
            while (due_ms := self.agenda.deadline_ms(item)) is not None:
                found += [(item, number, due_ms) for number in self.agenda.strike(item, due_ms)]
        return found

    def forget(self) -> None:
        """What was said and is due so far is no matter."""
        self.said()
        self.due()

    def states(self) -> list[StripState]:
        """How the strips stand, by number."""
        return [one.state for one in self.ledger]
