"""The ledger of strips: each has one state at a time and at most one vehicle, each vehicle at most one strip and one
that is its next, and each change a reason. Nothing is ever removed. What would break that is refused with an error: it
is a mistake of ours."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from comms.said.messages import StripState
from coordinator.cut.strips import Cut
from coordinator.cut.window import Window
from planner.types import Strip

NUMBERS_A_SECOND = 1000  # of the mission: whoever is started anew gives numbers that were never given
WITH_A_VEHICLE = frozenset({StripState.OFFERED, StripState.ACCEPTED, StripState.UNDER_WAY})
TAKEN = frozenset(state for state in StripState if state.is_taken)
"""With a vehicle, or to be with it next."""
ALLOWED: dict[StripState, frozenset[StripState]] = {
    StripState.OPEN: frozenset({StripState.OFFERED, StripState.NEXT, StripState.DONE, StripState.WITHDRAWN}),
    StripState.NEXT: frozenset(
        {StripState.ACCEPTED, StripState.UNDER_WAY, StripState.OPEN, StripState.DONE, StripState.FAILED}
    ),
    StripState.OFFERED: frozenset(
        {StripState.ACCEPTED, StripState.UNDER_WAY, StripState.OPEN, StripState.DONE, StripState.FAILED}
    ),
    StripState.ACCEPTED: frozenset({StripState.UNDER_WAY, StripState.OPEN, StripState.DONE, StripState.FAILED}),
    StripState.UNDER_WAY: frozenset({StripState.OPEN, StripState.DONE, StripState.FAILED}),
    StripState.DONE: frozenset(),
    StripState.FAILED: frozenset(),
    StripState.WITHDRAWN: frozenset(),
}


@dataclass
class StripRecord:
    """One strip: where it is, what it was cut from and is worth, how it stands, with whom, since when and why."""

    strip: Strip
    cut: Cut
    state: StripState
    revision: int
    vehicle: str
    since_ms: int
    reason: str

    @property
    def window(self) -> Window:
        """The cells that it was cut from."""
        return self.cut.window


class Ledger:
    """All strips by number, counted from `first_number`, 1 or more. `sector_of`: the number of the sector in which a
    window lies; there is one alone where nothing is said."""

    def __init__(self, first_number: int = 1, sector_of: Callable[[Window], int] | None = None) -> None:
        self._first_number = first_number
        self._sector_of = sector_of
        self._open_in = defaultdict[int, set[int]](set)
        self._records: dict[int, StripRecord] = {}
        self._by_state: dict[StripState, set[int]] = {state: set() for state in StripState}
        self._with: dict[str, int] = {}  # the strip of each vehicle that has one
        self._next: dict[str, int] = {}

    def __iter__(self) -> Iterator[StripRecord]:
        return iter(self._records.values())

    def get(self, number: int) -> StripRecord | None:
        """A strip's record, None for a number that was never given."""
        return self._records.get(number)

    def strip_of(self, vehicle: str) -> StripRecord | None:
        """The strip that is with a vehicle; None where it has none."""
        number = self._with.get(vehicle)
        return None if number is None else self._records[number]

    def next_of(self, vehicle: str) -> StripRecord | None:
        """The strip that a vehicle is to serve next; None where there is none."""
        number = self._next.get(vehicle)
        return None if number is None else self._records[number]

    @property
    def next_number(self) -> int:
        """The number of the next new strip."""
        return self._first_number + len(self._records)

    def open(self, strip: Strip, cut: Cut, now_ms: int, reason: str) -> StripRecord:
        """Enters a new strip, which has the next number."""
        if strip.number != self.next_number:
            raise ValueError(f"strip {strip.number} cannot be opened: the next number is {self.next_number}")
        record = StripRecord(strip, cut, StripState.OPEN, 1, "", now_ms, reason)
        self._records[strip.number] = record
        self._by_state[record.state].add(strip.number)
        self._open_beside(record).add(strip.number)
        return record

    def revise(self, record: StripRecord, strip: Strip, cut: Cut) -> None:
        """Changes where an open strip is and what it is worth."""
        if record.state is not StripState.OPEN:
            raise ValueError(f"strip {record.strip.number} is {record.state.value}: only an open one can be revised")
        if strip.number != record.strip.number:
            raise ValueError(f"strip {record.strip.number} cannot be revised as strip {strip.number}")
        self._open_beside(record).discard(strip.number)
        record.strip, record.cut = strip, cut
        self._open_beside(record).add(strip.number)
        record.revision += 1

    def move(self, record: StripRecord, state: StripState, now_ms: int, reason: str, vehicle: str = "") -> None:
        """Moves a strip to a state. `vehicle`: who it is then with, or who has ended it.

        Raises ValueError, and changes nothing, where its present state does not lead there, where it would be with
        nobody or with two, and where its vehicle has another strip, or another next one.
        """
        self._check(record, state, vehicle)
        number = record.strip.number
        self._by_state[record.state].discard(number)
        self._by_state[state].add(number)
        if StripState.OPEN in (state, record.state):
            numbers = self._open_beside(record)
            numbers.add(number) if state is StripState.OPEN else numbers.discard(number)
        if record.state in TAKEN:
            del self._taken(record.state)[record.vehicle]
        if state in TAKEN:
            self._taken(state)[vehicle] = number
        record.state, record.since_ms, record.reason = state, now_ms, reason
        record.vehicle = vehicle if state in TAKEN or state.has_ended else ""
        record.revision += 1

    def _check(self, record: StripRecord, state: StripState, vehicle: str) -> None:
        what = f"strip {record.strip.number} cannot become {state.value}"
        if state not in ALLOWED[record.state]:
            raise ValueError(f"{what}: it is {record.state.value}")
        if state in TAKEN and not vehicle:
            raise ValueError(f"{what} with nobody")
        if record.state in TAKEN and vehicle and vehicle != record.vehicle:
            raise ValueError(f"{what} by {vehicle}: it is with {record.vehicle}")
        if state in TAKEN and self._taken(state).get(vehicle, record.strip.number) != record.strip.number:
            raise ValueError(f"{what} with {vehicle}, which has strip {self._taken(state)[vehicle]}")

    def _taken(self, state: StripState) -> dict[str, int]:
        return self._next if state is StripState.NEXT else self._with

    def leave(self, record: StripRecord, now_ms: int, reason: str) -> None:
        """Leaves a strip that has not ended open for good, with nobody."""
        if record.state is not StripState.OPEN:
            self.move(record, StripState.OPEN, now_ms, reason)
        else:
            record.since_ms, record.reason = now_ms, reason
            record.revision += 1

    def in_state(self, *states: StripState) -> list[StripRecord]:
        """Records in one of these states, by number."""
        numbers = [number for state in states for number in self._by_state[state]]
        numbers.sort()
        return [self._records[number] for number in numbers]

    def open_in(self, sector: int) -> list[StripRecord]:
        """The open strips in a sector, by number."""
        return [self._records[number] for number in sorted(self._open_in[sector])]

    def _open_beside(self, record: StripRecord) -> set[int]:
        """The numbers of the open strips in the sector in which a strip lies."""
        return self._open_in[0 if self._sector_of is None else self._sector_of(record.window)]
