"""The life of a strip: what moves it from open, through offered, or next of a vehicle that has one still, accepted and
under way, to done, failed or withdrawn.

A vehicle's word on a strip counts if it is newer than all that the vehicle has told of that strip. Whether a strip is
done the map decides, not the word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from comms.said.codec import Header
from comms.said.messages import AgentState, Mode, StripState, TaskAction, TaskState, TaskStatus
from comms.strip_books import LEFT
from coordinator.allocate.service import Service
from coordinator.config import ANSWER_WITHIN_MS
from coordinator.cut.strips import Cut
from coordinator.fleet import KnownFleet
from coordinator.ledger import TAKEN, Ledger, StripRecord
from coordinator.outbox import NO_STRIP, Outbox
from coordinator.sectors import Sectors
from coordinator.vehicles import KnownVehicle, Offer
from planner.risk import MOST_LEVELS
from planner.types import BoolArray, Strip

WORTH_SAYING = 0.05  # relative change of what a strip is worth from which it is published again
COVERED_SHARE = 0.5  # of a strip's cells, that must have been seen anew for the map to agree that it is done
LATE_SHARE = 0.5  # of the time that a service was expected to take, that it may take longer
LATE_MS = 60_000  # and so much more


class StripLife:
    """Writes the `ledger`, and says each change of it; nobody else does.

    `inside`: the area's cells, shape of the grid. `sectors`: where strips lie; what is expected there learns from those
    that are done. `answer_within_ms`: age of an offer from which no answer is expected any more. `looks_within_ms`: for
    so long the looks over a strip may come later than the word that it is done.
    """

    def __init__(
        self,
        ledger: Ledger,
        fleet: KnownFleet,
        inside: BoolArray,
        sectors: Sectors,
        outbox: Outbox,
        answer_within_ms: int,
        looks_within_ms: int,
    ) -> None:
        self.ledger = ledger
        self._fleet = fleet
        self._inside = inside
        self._sectors = sectors
        self._outbox = outbox
        self._answer_within_ms = answer_within_ms
        self._looks_within_ms = looks_within_ms
        self._looks_due_ms: dict[int, int] = {}  # of strips that are done by word alone
        self._next_back_ms: dict[str, int] = {}  # until when a vehicle has what it was to do next, asked for all it has
        self._late_ms = LATE_MS + answer_within_ms - ANSWER_WITHIN_MS  # words that wait for slots are no delay of work

    def open(self, cut: Cut, now_ms: int, why: str) -> None:
        """Opens a new strip where it is cut. `why`: what makes it worth a second look."""
        cut = replace(cut, why=why)
        strip = cut.strip(self._fleet.map.grid, self.ledger.next_number)
        self._outbox.add_strip(self.ledger.open(strip, cut, now_ms, why))

    def revise(self, record: StripRecord, cut: Cut, why: Callable[[Cut], str]) -> None:
        """Moves an open strip to where it is cut now, if that is news; who has refused it may be offered it again.
        `why`: tells what makes it worth a second look."""
        change_m2 = abs(cut.counts_m2 - record.cut.counts_m2)
        same = record.window == cut.window and record.cut.foreseen == cut.foreseen
        if same and change_m2 <= WORTH_SAYING * record.cut.counts_m2:
            return
        strip = cut.strip(self._fleet.map.grid, record.strip.number)
        self.ledger.revise(record, strip, replace(cut, why=why(cut)))
        for vehicle in self._fleet.vehicles.values():
            vehicle.refused.discard(record.strip.number)
        self._outbox.add_strip(record)

    def withdraw(self, record: StripRecord, now_ms: int) -> None:
        """Withdraws an open strip, where none is cut any more."""
        self._move(record, StripState.WITHDRAWN, now_ms, "no longer worth a second look, or part of another strip")

    def offer(self, number: int, name: str, expected: Service, now_ms: int, *, as_next: bool) -> None:
        """Offers an open strip to a vehicle. `expected`: how the service is expected to go. `as_next`: it is to serve
        it when it is done with the strip that it has."""
        record, vehicle = self.ledger.get(number), self._fleet.vehicles[name]
        assert record is not None
        self._outbox.add_task(TaskAction.TAKE_NEXT if as_next else TaskAction.TAKE, name, record.strip)
        vehicle.asked_back = 0
        ends_ms = round(expected.ends_s * 1000)
        due_ms = ends_ms + round(LATE_SHARE * (ends_ms - now_ms)) + self._late_ms
        levels = self._fleet.levels(name, record.window)
        offer = Offer(record.strip, record.cut, expected, due_ms, levels, now_ms)
        vehicle.note_offer(offer, self._answer_within_ms)
        if as_next:
            vehicle.agreed_next = 0
            self._move(record, StripState.NEXT, now_ms, f"offered to {name} as its next", name)
        else:
            self._move(record, StripState.OFFERED, now_ms, f"offered to {name}", name)

    def ask_back(self, strip: Strip, vehicle: KnownVehicle, now_ms: int) -> None:
        """Tells a vehicle to give a strip back, and with it what it was to do next: that is open again once it has, as
        until it is told so it may be done with the one and go on with the other; or where its answer is late."""
        name = vehicle.entry.vehicle
        vehicle.asked_back, vehicle.asked_back_ms = strip.number, now_ms
        self._outbox.add_task(TaskAction.GIVE_BACK, name, strip)
        following = self.ledger.next_of(name)
        if following is None:
            return
        if self._outbox.unsay_offer(name, following.strip.number) or following.strip.number == strip.number:
            self._open_next(vehicle, now_ms)
        else:
            self._next_back_ms.setdefault(name, now_ms + self._answer_within_ms)

    def _open_next(self, vehicle: KnownVehicle, now_ms: int) -> None:
        """Opens again what a vehicle was to do next."""
        name = vehicle.entry.vehicle
        following = self.ledger.next_of(name)
        if following is not None:
            self._move(following, StripState.OPEN, now_ms, f"{name} is told to give strip {vehicle.asked_back} back")
            self._sectors.assign_by(now_ms, following.window)

    def _ask_back_again(self, strip: Strip, vehicle: KnownVehicle, now_ms: int) -> None:
        """The same, unless it was told so as lately as its answer may take."""
        if vehicle.asked_back != strip.number or now_ms - vehicle.asked_back_ms >= self._answer_within_ms:
            self.ask_back(strip, vehicle, now_ms)

    def hear_state(
        self, vehicle: KnownVehicle, header: Header, state: AgentState, now_ms: int, *, had_no_work: bool
    ) -> None:
        """A vehicle's newest state tells of its work, too: an answer, or its last word on a strip, may be lost.

        `had_no_work`: whether it had none by the state before.
        """
        if vehicle.is_at_a_strip:
            if vehicle.hear_word_of(state.works_on, header):
                self._hear_at_work(state.works_on, vehicle, header, now_ms, under_way=state.mode is Mode.REVISIT)
        elif (had_no_work and vehicle.has_no_work) or state.mode.is_out_of_work:
            self._hear_no_work(vehicle, header, now_ms)

    def hear_status(self, vehicle: KnownVehicle, header: Header, status: TaskStatus, now_ms: int) -> None:
        """A vehicle tells how it stands with a strip."""
        if not vehicle.hear_word_of(status.strip, header):
            return
        vehicle.unanswered = 0
        if status.state in (TaskState.ACCEPTED, TaskState.UNDER_WAY):
            under_way = status.state is TaskState.UNDER_WAY
            self._hear_at_work(status.strip, vehicle, header, now_ms, under_way=under_way)
            return
        if status.state is TaskState.NEXT:
            self._hear_next(status.strip, vehicle, now_ms)
            return
        record, name = self.ledger.get(status.strip), vehicle.entry.vehicle
        if status.state is TaskState.GIVEN_BACK and vehicle.asked_back == status.strip:
            self._open_next(vehicle, now_ms)
        if record is None or record.vehicle != name or record.state not in TAKEN:
            if status.state is TaskState.DONE:  # by one that counted as lost: the map tells what is left
                if record is not None and self._was_served(record, vehicle):
                    self._await_looks(record, name, now_ms, f"{name} had served it, its looks are to come")
                self._sectors.cut_by(now_ms, None if record is None else [record.window])
            elif status.state is not TaskState.REFUSED and record is not None and record.vehicle == name:
                self._await_no_more(record, now_ms)
            return
        if status.state is TaskState.REFUSED:
            if vehicle.answer_older(status.strip):
                return  # what it says to the newest offer is to come
            self._sectors.assign_by(now_ms, record.window)
        else:
            self._sectors.cut_by(now_ms, [record.window])
        match status.state:
            case TaskState.REFUSED:
                vehicle.note_refusal(status.strip)
                self._move(record, StripState.OPEN, now_ms, f"{name} refused: {status.reason}")
            case TaskState.GIVEN_BACK:
                vehicle.refused.add(status.strip)
                if vehicle.asked_back != status.strip:
                    vehicle.note_failure()
                self._move(record, StripState.OPEN, now_ms, f"given back by {name}")
            case TaskState.FAILED:
                vehicle.note_failure(record.window)
                self._move(record, StripState.FAILED, now_ms, f"{name} failed: {status.reason}", name)
            case TaskState.DONE:
                self._hear_done(record, vehicle, now_ms)

    def find_overdue(self, lost: Iterable[str], now_ms: int) -> None:
        """Opens again what vehicles had that are `lost` now, have not answered, or are late; and finds whose looks over
        a strip that they say is done have come, or are late."""
        for record in self.awaited:
            if self._seen_share(record) >= COVERED_SHARE:
                del self._looks_due_ms[record.strip.number]
                self._learn(record)
            elif now_ms >= self._looks_due_ms[record.strip.number]:
                self._await_no_more(record, now_ms)
        for name in lost:
            for record in self.ledger.in_state(*TAKEN):
                if record.vehicle == name:
                    self._move(record, StripState.OPEN, now_ms, f"{name} is lost: nothing heard of it")
                    self._sectors.cut_by(now_ms, [record.window])
        for name, due_ms in [*self._next_back_ms.items()]:
            if now_ms >= due_ms:
                self._open_next(self._fleet.vehicles[name], now_ms)
        for record in self._unanswered():
            if now_ms - record.since_ms >= self._answer_within_ms:
                self._fleet.vehicles[record.vehicle].note_silence()
                self._move(record, StripState.OPEN, now_ms, f"no answer from {record.vehicle}")
                self._sectors.assign_by(now_ms, record.window)
        for record in self._answered():
            if record.state not in TAKEN:
                continue  # it was to come after one that was late
            vehicle, offer = self._of(record)
            if now_ms >= offer.due_ms:
                late = f"{record.vehicle} has not served it, which was expected by {offer.service.ends_s:.0f} s"
                self.ask_back(record.strip, vehicle, now_ms)
                self._open_next(vehicle, now_ms)
                vehicle.note_failure(record.window)
                if record.state in TAKEN:  # else it was its next, and is open again
                    self._move(record, StripState.OPEN, now_ms, late)
                self._sectors.cut_by(now_ms, [record.window])

    def deadlines_ms(self) -> Iterator[int]:
        """When an answer, or a service, is overdue."""
        yield from (one.since_ms + self._answer_within_ms for one in self._unanswered())
        yield from (self._of(one)[1].due_ms for one in self._answered())
        yield from self._looks_due_ms.values()
        yield from self._next_back_ms.values()

    def _unanswered(self) -> list[StripRecord]:
        offered = self.ledger.in_state(StripState.OFFERED, StripState.NEXT)
        return [one for one in offered if not self._is_agreed(one)]

    def _answered(self) -> list[StripRecord]:
        taken = self.ledger.in_state(StripState.NEXT, StripState.ACCEPTED, StripState.UNDER_WAY)
        return [one for one in taken if one.state is not StripState.NEXT or self._is_agreed(one)]

    def _is_agreed(self, record: StripRecord) -> bool:
        """Whether its vehicle has said that it does it next."""
        is_next = record.state is StripState.NEXT
        return is_next and self._fleet.vehicles[record.vehicle].agreed_next == record.strip.number

    @property
    def awaited(self) -> list[StripRecord]:
        """The strips that are done by their vehicles' word, while the looks that tell so may still come: their ground
        counts as seen."""
        return [record for number in self._looks_due_ms if (record := self.ledger.get(number)) is not None]

    @property
    def unended(self) -> list[StripRecord]:
        """The strips that are open or taken."""
        return self.ledger.in_state(StripState.OPEN, *TAKEN)

    def leave_all(self, now_ms: int) -> None:
        """Leaves what has not ended open for good: the mission is over."""
        for record in self.unended:
            who = f"{record.vehicle} has not ended it" if record.vehicle else "nobody has served it"
            self.ledger.leave(record, now_ms, f"{LEFT}: {who}")
            self._outbox.add_strip(record)

    def _hear_at_work(
        self, number: int, vehicle: KnownVehicle, header: Header, now_ms: int, *, under_way: bool
    ) -> None:
        """A vehicle says that it is at a strip.

        Where the strip is not with it, because it counted as lost or answered late, it gets the strip back, as it was,
        if nobody else has it. Else the vehicle is to give it back, so that no two are at one place: also where it was
        asked to before, and where the strip is of a coordinator that is no more.
        """
        record, name = self.ledger.get(number), vehicle.entry.vehicle
        if record is None:
            if number > 0:
                self._ask_back_again(replace(NO_STRIP, number=number), vehicle, now_ms)
            return
        offer = vehicle.offers.get(number)
        is_next = record.state is StripState.NEXT and record.vehicle == name
        if is_next and not self._leaves_its_other(vehicle, number, header, now_ms):
            return
        if record.state is StripState.OPEN and offer is not None and vehicle.asked_back != number:
            if not self._leaves_its_other(vehicle, number, header, now_ms):
                return
            if record.strip != offer.strip:
                self.ledger.revise(record, offer.strip, offer.cut)
                self._outbox.add_strip(record)
                self._sectors.cut_by(now_ms, [record.window])
            vehicle.offers[number] = replace(offer, due_ms=max(offer.due_ms, now_ms + self._late_ms))
            self._move(record, StripState.OFFERED, now_ms, f"{name} is at it after all", name)
        if record.vehicle != name or record.state not in TAKEN:
            self._ask_back_again(record.strip, vehicle, now_ms)
            return
        vehicle.unanswered = 0
        if under_way and record.state is not StripState.UNDER_WAY:
            self._move(record, StripState.UNDER_WAY, now_ms, "under way", name)
        elif record.state in (StripState.OFFERED, StripState.NEXT):
            self._move(record, StripState.ACCEPTED, now_ms, "accepted", name)

    def _hear_next(self, number: int, vehicle: KnownVehicle, now_ms: int) -> None:
        """A vehicle says that it does a strip next; one that is not its next any more it is to give back."""
        record, name, offer = self.ledger.get(number), vehicle.entry.vehicle, vehicle.offers.get(number)
        is_open = record is not None and record.state is StripState.OPEN
        may = vehicle.asked_back != number and self.ledger.next_of(name) is None
        if record is not None and is_open and may and offer is not None and record.strip == offer.strip:
            self._move(record, StripState.NEXT, now_ms, f"{name} does it next after all", name)  # it has answered late
        if record is None or record.state is not StripState.NEXT or record.vehicle != name:
            strip = replace(NO_STRIP, number=number) if record is None else record.strip
            if number > 0:
                self._ask_back_again(strip, vehicle, now_ms)
            return
        vehicle.unanswered, vehicle.agreed_next = 0, number

    def _leaves_its_other(self, vehicle: KnownVehicle, number: int, header: Header, now_ms: int) -> bool:
        """Opens again what a vehicle has beside the strip that it says it is at, as it can be at one alone; where it
        has seen that, it is done.

        Returns False, and opens nothing, where it has since said that it is at the other: what it says now is old.
        """
        name = vehicle.entry.vehicle
        other = self.ledger.strip_of(name)
        if other is not None:
            if other.state is not StripState.OFFERED and vehicle.has_told_since(header, other.strip.number):
                return False
            if other.state is not StripState.OFFERED and self._seen_share(other) >= COVERED_SHARE:
                self._move(other, StripState.DONE, now_ms, f"seen by {name}, which is at strip {number}", name)
                self._sectors.cut_by(now_ms, [other.window])
            elif self._may_be_done(other, vehicle, now_ms):
                self._await_looks(
                    other, name, now_ms, f"left by {name}, which is at strip {number}; its looks are to come"
                )
                self._sectors.cut_by(now_ms, [other.window])
            else:
                self._move(other, StripState.OPEN, now_ms, f"{name} is at strip {number}")
                self._sectors.assign_by(now_ms, other.window)
        return True

    def _hear_no_work(self, vehicle: KnownVehicle, header: Header, now_ms: int) -> None:
        """A vehicle says once more that it has no work: its last word on a strip that it still has here was lost, or
        what it had agreed to do next is forgotten."""
        name = vehicle.entry.vehicle
        if name in self._next_back_ms:
            self._open_next(vehicle, now_ms)
        for record in self._answered():
            if record.vehicle == name and vehicle.hear_word_of(record.strip.number, header):
                if self._seen_share(record) >= COVERED_SHARE:
                    vehicle.failures = 0
                    self._move(record, StripState.DONE, now_ms, f"seen by {name}, whose word on it was lost", name)
                elif self._may_be_done(record, vehicle, now_ms):
                    self._await_looks(record, name, now_ms, f"left by {name}, which has no work; its looks are to come")
                else:
                    vehicle.note_failure()
                    self._move(record, StripState.OPEN, now_ms, f"{name} has no work, its word on it was lost")
                self._sectors.cut_by(now_ms, [record.window])

    def _hear_done(self, record: StripRecord, vehicle: KnownVehicle, now_ms: int) -> None:
        """What is left of a strip that its vehicle says is done is cut anew."""
        name, share = vehicle.entry.vehicle, self._seen_share(record)
        if share >= COVERED_SHARE:
            self._learn(record)
            self._move(record, StripState.DONE, now_ms, f"{share:.0%} of it seen by {name}", name)
        elif self._looks_within_ms:
            self._await_looks(record, name, now_ms, f"{name} says so, its looks are to come")
        else:
            vehicle.note_failure(record.window)
            self._move(record, StripState.FAILED, now_ms, f"{name} says done, but saw {share:.0%} of it", name)

    def _learn(self, record: StripRecord) -> None:
        """The vehicle of a strip has seen it."""
        vehicle, offer = self._of(record)
        vehicle.failures = 0
        self._sectors.learn(record.window, record.vehicle, offer.levels_before, vehicle.entry.p_detect)

    def _may_be_done(self, record: StripRecord, vehicle: KnownVehicle, now_ms: int) -> bool:
        """Whether a vehicle that has left a strip may have said that it is done, and its looks be on their way."""
        offer = vehicle.offers.get(record.strip.number)
        is_late = record.state is StripState.ACCEPTED and offer is not None and offer.service.ends_s * 1000 <= now_ms
        is_at_it = (record.state is StripState.UNDER_WAY or is_late) and vehicle.asked_back != record.strip.number
        return self._looks_within_ms > 0 and is_at_it

    def _was_served(self, record: StripRecord, vehicle: KnownVehicle) -> bool:
        """Whether a strip that is open again is done by the late word of a vehicle that had it, as its looks may come
        later still: it had said before that it was at another, or it counted as lost."""
        offer = vehicle.offers.get(record.strip.number)
        is_open = record.state is StripState.OPEN
        return self._looks_within_ms > 0 and is_open and offer is not None and offer.strip == record.strip

    def _await_looks(self, record: StripRecord, name: str, now_ms: int, reason: str) -> None:
        self._looks_due_ms[record.strip.number] = now_ms + self._looks_within_ms
        self._move(record, StripState.DONE, now_ms, reason, name)

    def _await_no_more(self, record: StripRecord, now_ms: int) -> None:
        """What a vehicle was taken to have seen of a strip it has not: that is cut anew."""
        if self._looks_due_ms.pop(record.strip.number, None) is not None:
            self._fleet.vehicles[record.vehicle].note_failure(record.window)
            self._sectors.cut_by(now_ms, [record.window])

    def _seen_share(self, record: StripRecord) -> float:
        """Share of a strip's cells that its vehicle has seen since it was offered the strip."""
        cells = self._inside[record.window.cells]
        if not cells.any():
            return 1.0
        levels, before = self._fleet.levels(record.vehicle, record.window), self._of(record)[1].levels_before
        return float(((levels > before) | (levels == MOST_LEVELS))[cells].mean())

    def _of(self, record: StripRecord) -> tuple[KnownVehicle, Offer]:
        """The vehicle that has a strip, and as what it was offered it."""
        vehicle = self._fleet.vehicles[record.vehicle]
        return vehicle, vehicle.offers[record.strip.number]

    def _move(self, record: StripRecord, state: StripState, now_ms: int, reason: str, vehicle: str = "") -> None:
        if record.state is StripState.NEXT:
            self._next_back_ms.pop(record.vehicle, None)
        self.ledger.move(record, state, now_ms, reason, vehicle)
        self._outbox.add_strip(record)
