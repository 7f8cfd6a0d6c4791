"""The coordinator: joins the layers, cuts strips from the hotspots, offers them to helpers, follows each to its end,
and says when the mission is over."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np

from comms.node import Publication, Received, Step
from comms.said.codec import Header
from comms.said.messages import (
    AgentState,
    CoverageTile,
    Hotspot,
    MissionOver,
    Mode,
    Plan,
    RunInfo,
    StripState,
    StripStatus,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import MISSION_OVER, STRIP, TASK
from coordinator.allocate.allocators import checked_offers, offers_let_through
from coordinator.allocate.service import service
from coordinator.allocate.situation import Helper, Situation
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig, weights_over
from coordinator.cut.cutter import Cutter
from coordinator.cut.strips import Cut, CuttingRules, Window
from coordinator.keep_apart.right_of_way import Order, RightOfWay, Underway
from coordinator.ledger import WITH_A_VEHICLE, Ledger, StripRecord
from coordinator.vehicles import KnownVehicle, Offer
from planner.fleet_map import FleetMap
from planner.region import Region
from planner.risk import NATS_PER_LEVEL, LevelArray
from planner.types import BoolArray, Point, Strip

log = logging.getLogger("secondlook.coordinator")

SAME_STRIP = 0.25  # shared area, as a share of both together, from which a newly cut strip is an open one revised
WORTH_SAYING = 0.05  # relative change of what a strip is worth from which it is published again
ANSWER_WITHIN_MS = 10_000
GIVEN_UP_AFTER = 10  # times as long as for a lost vehicle must a primary be silent before the mission ends without it
CUT_WITHIN_MS = 60_000  # of tiles that come without a hotspot
COVERED_SHARE = 0.5  # of a strip's cells, that must have been seen anew for the map to agree that it is done
LATE_SHARE = 0.5  # of the time that a service was expected to take, that it may take longer
LATE_MS = 60_000  # and so much more
NUMBERS_A_SECOND = 1000  # of the mission: whoever is started anew gives numbers that were never given
SAY_AGAIN_AFTER_MS = (*range(10, 100, 10), *range(1000, 10_000, 1000))  # that the mission is over
FULL_LEVEL = 255  # a cell that has it cannot show another look


class Coordinator:
    """See the module. All it knows of the fleet it has from the run's announcement and from the agents."""

    def __init__(self, config: CoordinatorConfig) -> None:
        self.config = config
        self.ledger = Ledger()
        self.vehicles: dict[str, KnownVehicle] = {}
        self.map: FleetMap | None = None
        self._primaries: dict[str, KnownVehicle] = {}
        self._inside: BoolArray
        self._cutter: Cutter | None = None  # where there are helpers
        self._briefing: Briefing  # there, too
        self._tasks = 0
        self._outbox: list[Publication] = []
        self._to_cut = False
        self._cut_by_ms: int | None = None
        self._to_assign = False
        self._coming: list[Cut] = []
        self._ripe_ms: int | None = None
        self._over: MissionOver | None = None
        self._over_ms = 0
        self._say_again_ms: int | None = None
        self._complained_of: set[str] = set()
        self._right_of_way: RightOfWay | None = None
        self._gave_way: dict[str, set[int]] = {}  # strips that helpers gave back to give way: they may be offered again
        self._to_look = False
        self._clear_ms: int | None = None  # when to try again with offers that had to wait

    def start(self, now_ms: int) -> Step:
        """Waits for the run's announcement."""
        self.ledger = Ledger(1 + NUMBERS_A_SECOND * (now_ms // 1000))
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Takes in what the agents say; what follows from it is decided at a wake-up of its own, 1 ms later."""
        message = received.message
        if isinstance(message, RunInfo) and self.map is None:
            self._begin(message, now_ms)
        elif self.map is not None and self._over is None:
            vehicle = self.vehicles.get(received.vehicle)
            if isinstance(message, CoverageTile):
                self._take_tile(received, message, now_ms)
            elif isinstance(message, Hotspot):
                self._take_hotspot(received, message)
            elif isinstance(message, AgentState) and vehicle is not None:
                self._take_state(vehicle, received.header, message, now_ms)
            elif isinstance(message, TaskStatus) and vehicle is not None:
                self._take_status(vehicle, received.header, message, now_ms)
            elif isinstance(message, Plan) and vehicle is not None:
                vehicle.take_plan(received.header, message)
        elif self._over is not None:
            vehicle = self.vehicles.get(received.vehicle)
            if isinstance(message, AgentState) and vehicle is not None:
                vehicle.take_state(received.header, message, now_ms)
        return self._step(now_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Cuts, assigns and looks whether anyone is lost and whether the mission is over."""
        if self.map is not None and self._over is None:
            self._find_lost(now_ms)
            self._find_late(now_ms)
            if self._to_cut or (self._cut_by_ms is not None and self._cut_by_ms <= now_ms):
                self._to_cut = False
                self._cut_by_ms = None
                self._cut(now_ms)
                self._to_assign = True
            due_ms = [one for one in (self._ripe_ms, self._clear_ms) if one is not None]
            if self._to_assign or min(due_ms, default=now_ms + 1) <= now_ms:
                self._to_assign = False
                self._assign(now_ms)
            if self._to_look:
                self._to_look = False
                self._keep_apart(now_ms)
            self._find_end(now_ms)
        elif self._over is not None:
            self._say_over_again(self._over, now_ms)
        return self._step(now_ms)

    def _begin(self, run: RunInfo, now_ms: int) -> None:
        spec = run.grid.spec
        self.map = FleetMap(spec, run.rho)
        self._inside = Region(run.outline, run.hole_outlines).inside(spec)
        if self.config.separation_m > 0:
            self._right_of_way = RightOfWay(self.config.separation_m, self._is_inside)
        self.vehicles = {entry.vehicle: KnownVehicle(entry, heard_ms=now_ms) for entry in run.vehicles}
        self._primaries = {name: one for name, one in self.vehicles.items() if one.entry.role.surveys}
        helpers = [entry for entry in run.vehicles if entry.role.revisits]
        if helpers:
            narrowest = min(helpers, key=lambda entry: entry.strip_width_m)
            rules = CuttingRules(
                swath_m=narrowest.strip_width_m,
                p_detect=narrowest.p_detect,
                worth_risk=self.config.worth_risk,
                overhead_m=math.pi * narrowest.turn_radius_m + 2 * narrowest.swath_m + 2 * narrowest.run_in_m,
                min_strip_m=self.config.min_strip_m,
                max_strip_m=self.config.max_strip_m,
            )
            self._cutter = Cutter(
                self.map, self._inside, rules, weights_over(spec, self._inside, self.config.priorities)
            )
            self._briefing = Briefing(self.config, spec, self.ledger, self.vehicles, self._cutter)

    def _take_tile(self, received: Received, tile: CoverageTile, now_ms: int) -> None:
        assert self.map is not None
        try:
            news = self.map.join(received.vehicle, received.header.incarnation, tile)
        except ValueError as error:
            self._drop(received.vehicle, error)
            return
        if received.vehicle in self.vehicles:
            self.vehicles[received.vehicle].note_tile(received.header.incarnation, tile.version)
        if news and self._cut_by_ms is None:
            self._cut_by_ms = now_ms + CUT_WITHIN_MS

    def _drop(self, vehicle: str, why: object) -> None:
        if vehicle not in self._complained_of:
            self._complained_of.add(vehicle)
            log.warning("dropped a message from %s: %s (said once)", vehicle, why)

    def _take_hotspot(self, received: Received, message: Hotspot) -> None:
        if self._cutter is not None:
            place = (received.vehicle, received.number)
            self._to_cut |= self._cutter.take_hotspot(place, (received.header.incarnation, message.revision), message)

    def _take_state(self, vehicle: KnownVehicle, header: Header, state: AgentState, now_ms: int) -> None:
        was_idle, was_finished, was_lost = vehicle.is_idle, vehicle.is_finished, vehicle.lost
        did = (vehicle.state.mode, vehicle.state.works_on) if vehicle.state is not None else None
        if not vehicle.take_state(header, state, now_ms):
            return
        if was_lost:
            log.info("%s is heard again", vehicle.entry.vehicle)
        if self._right_of_way is not None:
            if did != (state.mode, state.works_on):
                self._right_of_way.changed(vehicle.entry.vehicle)
            self._to_look |= now_ms >= self._right_of_way.look_s * 1000
        self._to_cut |= vehicle.is_finished and not was_finished
        self._to_assign |= vehicle.is_idle and not was_idle
        if vehicle.is_at_a_strip:
            # Its state tells too that it is at a strip: the answer may be lost.
            if vehicle.tells_news_of(state.works_on, header):
                self._take_at_work(state.works_on, vehicle, now_ms, under_way=state.mode is Mode.REVISIT)
        elif was_idle and vehicle.is_idle:
            self._take_idle(vehicle, header, now_ms)

    def _take_idle(self, vehicle: KnownVehicle, header: Header, now_ms: int) -> None:
        """A vehicle says once more that it has no work: its last word on a strip that it still has here was lost."""
        name = vehicle.entry.vehicle
        for record in self.ledger.in_state(StripState.ACCEPTED, StripState.UNDER_WAY):
            if record.vehicle == name and vehicle.tells_news_of(record.strip.number, header):
                if self._seen_share(record, vehicle) >= COVERED_SHARE:
                    vehicle.failures = 0
                    self._move(record, StripState.DONE, now_ms, f"seen by {name}, whose word on it was lost", name)
                else:
                    self._note_failure(vehicle)
                    self._move(record, StripState.OPEN, now_ms, f"{name} has no work, its word on it was lost")
                self._to_cut = True

    def _take_status(self, vehicle: KnownVehicle, header: Header, status: TaskStatus, now_ms: int) -> None:
        if not vehicle.tells_news_of(status.strip, header):
            return
        vehicle.unanswered = 0
        if status.state in (TaskState.ACCEPTED, TaskState.UNDER_WAY):
            self._take_at_work(status.strip, vehicle, now_ms, under_way=status.state is TaskState.UNDER_WAY)
            return
        record, name = self.ledger.get(status.strip), vehicle.entry.vehicle
        if record is None or record.vehicle != name or record.state not in WITH_A_VEHICLE:
            self._to_cut |= status.state is TaskState.DONE  # by one that was taken for lost: the map tells what is left
            return
        match status.state:
            case TaskState.REFUSED:
                vehicle.refused.add(status.strip)
                self._move(record, StripState.OPEN, now_ms, f"{name} refused: {status.reason}")
                self._to_assign = True
            case TaskState.GIVEN_BACK:
                vehicle.refused.add(status.strip)
                if vehicle.asked_back != status.strip:
                    self._note_failure(vehicle)
                self._move(record, StripState.OPEN, now_ms, f"given back by {name}")
                self._to_cut = True
            case TaskState.FAILED:
                self._note_failure(vehicle, record)
                self._move(record, StripState.FAILED, now_ms, f"{name} failed: {status.reason}", name)
                self._to_cut = True
            case TaskState.DONE:
                self._take_done(record, vehicle, now_ms)

    def _take_at_work(self, number: int, vehicle: KnownVehicle, now_ms: int, *, under_way: bool) -> None:
        """A vehicle says that it is at a strip.

        Where the strip is not with it, because it was taken for lost, it gets the strip back, as it was, if nobody else
        has it. Else the vehicle is to give it back, so that no two are at one place: also where it was asked to before,
        and where the strip is of a coordinator that is no more.
        """
        record, name = self.ledger.get(number), vehicle.entry.vehicle
        if record is None:
            if number > 0:
                self._say(TaskAction.GIVE_BACK, Strip(number, (0.0, 0.0), 0.0, 0.0, 0.0), name)
            return
        offer = vehicle.offers.get(number)
        if record.state is StripState.OPEN and offer is not None and vehicle.asked_back != number:
            if record.strip != offer.strip:
                self.ledger.revise(record, offer.strip, offer.cut)
                self._publish_strip(record)
                self._to_cut = True
            vehicle.offers[number] = replace(offer, due_ms=max(offer.due_ms, now_ms + LATE_MS))
            self._move(record, StripState.OFFERED, now_ms, f"{name} is at it after all", name)
        if record.vehicle == name and record.state in WITH_A_VEHICLE:
            vehicle.unanswered = 0
            if under_way:
                self._move(record, StripState.UNDER_WAY, now_ms, "under way", name)
            else:
                self._move(record, StripState.ACCEPTED, now_ms, "accepted", name)
        else:
            self._ask_back(record.strip, vehicle)

    def _ask_back(self, strip: Strip, vehicle: KnownVehicle) -> None:
        vehicle.asked_back = strip.number
        self._say(TaskAction.GIVE_BACK, strip, vehicle.entry.vehicle)

    def _take_done(self, record: StripRecord, vehicle: KnownVehicle, now_ms: int) -> None:
        """The map decides whether a strip is done, not the word; what is left is cut anew."""
        name = vehicle.entry.vehicle
        share = self._seen_share(record, vehicle)
        if share >= COVERED_SHARE:
            vehicle.failures = 0
            self._learn(record, vehicle)
            self._move(record, StripState.DONE, now_ms, f"{share:.0%} of it seen by {name}", name)
        else:
            self._note_failure(vehicle, record)
            self._move(record, StripState.FAILED, now_ms, f"{name} says done, but saw {share:.0%} of it", name)
        self._to_cut = True

    def _learn(self, record: StripRecord, vehicle: KnownVehicle) -> None:
        """Learns from a strip that a vehicle has swept what second looks find."""
        assert self.map is not None
        layer = self.map.layers.get(vehicle.entry.vehicle)
        if layer is not None and self._cutter is not None:
            levels = layer.largest_levels[record.window.cells].astype(np.float64)
            p_detect = -np.expm1(-NATS_PER_LEVEL * levels)
            self._cutter.learn(record.window, p_detect, vehicle.entry.p_detect)

    def _note_failure(self, vehicle: KnownVehicle, record: StripRecord | None = None) -> None:
        """It has not served what it accepted; where `record` is given, it is not to be sent there again."""
        if record is not None:
            vehicle.failed_at.append(record.window)
        was_trusted = vehicle.is_trusted
        vehicle.failures += 1
        self._tell_if_given_up(vehicle, was_trusted, f"it has not served {vehicle.failures} strips in a row")

    def _tell_if_given_up(self, vehicle: KnownVehicle, was_trusted: bool, why: str) -> None:
        if was_trusted and not vehicle.is_trusted:
            log.warning("%s is offered nothing more: %s", vehicle.entry.vehicle, why)

    def _seen_share(self, record: StripRecord, vehicle: KnownVehicle) -> float:
        """Share of a strip's cells that the vehicle has seen since it was offered the strip."""
        cells = self._inside[record.window.cells]
        if not cells.any():
            return 1.0
        levels, before = self._levels(vehicle, record.window), vehicle.offers[record.strip.number].levels_before
        return float(((levels > before) | (levels == FULL_LEVEL))[cells].mean())

    def _levels(self, vehicle: KnownVehicle, window: Window) -> LevelArray:
        """What a vehicle's own layer tells of a window's cells: the sum over its looks."""
        assert self.map is not None
        layer = self.map.layers.get(vehicle.entry.vehicle)
        if layer is None:
            return np.zeros(self._inside[window.cells].shape, dtype=np.uint8)
        return layer.sum_levels[window.cells].copy()

    def _find_late(self, now_ms: int) -> None:
        """Takes back what a vehicle has not served well after it was expected to have."""
        for record in self.ledger.in_state(StripState.ACCEPTED, StripState.UNDER_WAY):
            vehicle, number = self.vehicles[record.vehicle], record.strip.number
            offer = vehicle.offers[number]
            if now_ms < offer.due_ms:
                continue
            late = f"{record.vehicle} has not served it, which was expected by {offer.service.ends_s:.0f} s"
            self._ask_back(record.strip, vehicle)
            self._note_failure(vehicle, record)
            self._move(record, StripState.OPEN, now_ms, late)
            self._to_cut = True

    def _find_lost(self, now_ms: int) -> None:
        for name, vehicle in self.vehicles.items():
            if vehicle.lost or now_ms - vehicle.heard_ms < self.config.lost_after_ms:
                continue
            vehicle.lost = True
            log.info("%s is lost: nothing heard of it since %.0f s", name, vehicle.heard_ms / 1000)
            for record in self.ledger.in_state(*WITH_A_VEHICLE):
                if record.vehicle == name:
                    self._move(record, StripState.OPEN, now_ms, f"{name} is lost: nothing heard of it")
                    self._to_cut = True
        for vehicle in self._primaries.values():
            if vehicle.finished_ms is None and now_ms - vehicle.heard_ms >= self._given_up_after_ms:
                vehicle.finished_ms = now_ms
        for record in self.ledger.in_state(StripState.OFFERED):
            if now_ms - record.since_ms >= ANSWER_WITHIN_MS:
                vehicle = self.vehicles[record.vehicle]
                was_trusted = vehicle.is_trusted
                vehicle.unanswered += 1
                self._tell_if_given_up(vehicle, was_trusted, f"{vehicle.unanswered} offers in a row are not answered")
                self._move(record, StripState.OPEN, now_ms, f"no answer from {record.vehicle}")
                self._to_assign = True

    def _cut(self, now_ms: int) -> None:
        cutter = self._cutter
        if cutter is None:
            return
        under_way = {name: one.track_under_way for name, one in self._primaries.items()}
        ground = cutter.look(under_way, self._briefing.sweeps_m2(now_ms), self._looked_at())
        columns = ground.columns
        unmatched = [record for record in self.ledger.in_state(StripState.OPEN) if columns[record.window.columns].any()]
        self._coming = [cut for cut in self._coming if not columns[cut.window.columns].any()]
        to_cut = {record.window for record in unmatched}
        for cut in cutter.cut(ground, [window for window in self._looked_at() if window not in to_cut]):
            same = max(unmatched, key=lambda record: record.window.overlap(cut.window), default=None)
            if same is not None and same.window.overlap(cut.window) >= SAME_STRIP:
                unmatched.remove(same)
                self._revise(same, cut)
            elif cut.settles_s > 0:
                self._coming.append(cut)
            else:
                self._open(cut, now_ms)
        for record in unmatched:
            self._move(record, StripState.WITHDRAWN, now_ms, "no longer worth a second look, or part of another strip")
        cutter.remember(self._looked_at())

    def _looked_at(self) -> list[Window]:
        """What is a strip's that is open or with a vehicle, or will be one's."""
        records = self.ledger.in_state(StripState.OPEN, *WITH_A_VEHICLE)
        return [*(record.window for record in records), *(cut.window for cut in self._coming)]

    def _open(self, cut: Cut, now_ms: int) -> StripRecord:
        number = self.ledger.next_number
        record = self.ledger.open(self._briefing.strip_of(cut, number), cut, now_ms, "badly seen")
        self._publish_strip(record)
        return record

    def _open_what_is_ripe(self, now_ms: int) -> None:
        """Opens a strip that is still settling when a free helper that sets out now will not overtake the survey."""
        self._ripe_ms = None
        free = [helper for helper in self._briefing.helpers(now_ms) if helper.task is None] if self._coming else []
        if not free:
            return
        for cut in [*self._coming]:
            one = self._briefing.coming_strip(cut)
            leaves_ms = min(math.floor(service(one, helper).leaves_s * 1000) for helper in free)
            if leaves_ms <= now_ms:
                self._coming.remove(cut)
                self._open(cut, now_ms)
            else:
                self._ripe_ms = leaves_ms if self._ripe_ms is None else min(leaves_ms, self._ripe_ms)

    @property
    def _given_up_after_ms(self) -> int:
        return GIVEN_UP_AFTER * self.config.lost_after_ms

    def _revise(self, record: StripRecord, cut: Cut) -> None:
        change_m2 = abs(cut.counts_m2 - record.cut.counts_m2)
        if record.window == cut.window and change_m2 <= WORTH_SAYING * record.cut.counts_m2:
            return
        self.ledger.revise(record, self._briefing.strip_of(cut, record.strip.number), cut)
        for vehicle in self.vehicles.values():
            vehicle.refused.discard(record.strip.number)
        self._publish_strip(record)

    def _assign(self, now_ms: int) -> None:
        if self._cutter is None:
            return
        self._open_what_is_ripe(now_ms)
        self._clear_ms = None
        for name, numbers in self._gave_way.items():
            self.vehicles[name].refused -= numbers
        situation = self._briefing.situation(now_ms, self._coming)
        if not situation.strips or not situation.helpers:
            return
        right, allocator = self._right_of_way, self.config.allocator
        if right is None:
            self._offer(checked_offers(allocator.assign(situation), situation), situation, now_ms)
            return
        departures = right.departures(self._under_way(), now_ms / 1000)
        offers, again_s = offers_let_through(allocator, situation, departures)
        for name, number in offers:
            right.offered(name, number, departures)
        self._offer(offers, situation, now_ms)
        self._clear_ms = now_ms + round(again_s * 1000) if math.isfinite(again_s) else None
        for order in right.make_room(departures, self._under_way()):
            self._tell(order)

    def _offer(self, offers: list[tuple[str, int]], situation: Situation, now_ms: int) -> None:
        helpers = {helper.vehicle: helper for helper in situation.helpers}
        for name, number in offers:
            record, helper, vehicle = self.ledger.get(number), helpers[name], self.vehicles[name]
            assert record is not None
            if helper.task is not None:
                self._ask_back(helper.task.strip, vehicle)
                continue
            self._say(TaskAction.TAKE, record.strip, name)
            vehicle.asked_back = 0
            vehicle.offers[number] = self._offer_of(record, helper, vehicle, now_ms)
            self._move(record, StripState.OFFERED, now_ms, f"offered to {name}", name)

    def _offer_of(self, record: StripRecord, helper: Helper, vehicle: KnownVehicle, now_ms: int) -> Offer:
        expected = service(self._briefing.open_strip(record), helper)
        ends_ms = round(expected.ends_s * 1000)
        due_ms = ends_ms + round(LATE_SHARE * (ends_ms - now_ms)) + LATE_MS
        return Offer(record.strip, record.cut, expected, due_ms, self._levels(vehicle, record.window))

    def _under_way(self) -> list[Underway]:
        records = {record.vehicle: record for record in self.ledger.in_state(*WITH_A_VEHICLE)}
        return [Underway(one, records[name].strip if name in records else None) for name, one in self.vehicles.items()]

    def _keep_apart(self, now_ms: int) -> None:
        """Tells helpers to give way to whom they would come too close."""
        assert self._right_of_way is not None
        for order in self._right_of_way.look(self._under_way(), now_ms / 1000):
            self._tell(order)

    def _tell(self, order: Order) -> None:
        if order.gives_back is not None:
            self._gave_way.setdefault(order.name, set()).add(order.gives_back.number)
            self._ask_back(order.gives_back, self.vehicles[order.name])
        if order.place is not None:
            self._say(TaskAction.STAND_ASIDE, Strip(0, order.place, 0.0, 0.0, 0.0), order.name)

    def _is_inside(self, place: Point) -> bool:
        assert self.map is not None
        grid = self.map.grid
        across_m, along_m = (float(one) for one in grid.frame.to_sweep(*place))
        column, row = round(across_m / grid.cell_m), math.floor(along_m / grid.cell_m)
        return 0 <= column < grid.columns and 0 <= row < grid.rows and bool(self._inside[row, column])

    def _say(self, action: TaskAction, strip: Strip, vehicle: str) -> None:
        self._tasks += 1
        task = Task(action, strip.number, *strip.start, strip.heading_rad, strip.length_m, strip.width_m)
        self._outbox.append(Publication(TASK.key(vehicle=vehicle, number=self._tasks), task))

    def _find_end(self, now_ms: int) -> None:
        ends = [one.finished_ms for one in self._primaries.values()]
        if any(end is None for end in ends):
            return
        left = self.ledger.in_state(StripState.OPEN, *WITH_A_VEHICLE)
        if not left:
            reason = "every primary has finished and no strip is left"
        elif now_ms >= self._deadline_ms():
            end = f"{self.config.deadline_factor:g} times the last primary's end"
            reason = f"{end} is reached, {len(left)} strips are left"
        else:
            return
        for record in left:
            who = f"{record.vehicle} has not ended it" if record.vehicle else "nobody has served it"
            self.ledger.leave(record, now_ms, f"left when the mission was over: {who}")
            self._publish_strip(record)
        self._over, self._over_ms = MissionOver(reason), now_ms
        self._outbox.append(Publication(MISSION_OVER.key(), self._over))
        self._say_again_ms = now_ms + SAY_AGAIN_AFTER_MS[0]

    def _say_over_again(self, over: MissionOver, now_ms: int) -> None:
        """Says again that the mission is over, where a vehicle has not answered, or some of its tiles were lost: the
        answer to that are its tiles, too."""
        unheard = any(one.heard_ms <= self._over_ms or not one.is_finished for one in self.vehicles.values())
        if unheard or any(one.has_missed_tiles for one in self.vehicles.values()):
            self._outbox.append(Publication(MISSION_OVER.key(), over))
            to_come = (self._over_ms + after_ms for after_ms in SAY_AGAIN_AFTER_MS)
            self._say_again_ms = next((again_ms for again_ms in to_come if again_ms > now_ms), None)
        else:
            self._say_again_ms = None

    def _deadline_ms(self) -> int:
        ends = [one.finished_ms or 0 for one in self._primaries.values()]
        return math.ceil(max(ends, default=0) * self.config.deadline_factor)

    def _move(self, record: StripRecord, state: StripState, now_ms: int, reason: str, vehicle: str = "") -> None:
        if self.ledger.move(record, state, now_ms, reason, vehicle):
            self._publish_strip(record)

    def _publish_strip(self, record: StripRecord) -> None:
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
            reason=record.reason[:200],
        )
        self._outbox.append(Publication(STRIP.key(number=strip.number), message))

    def _step(self, now_ms: int) -> Step:
        published = tuple(self._outbox)
        self._outbox.clear()
        return Step(published, self._next_wake_ms(now_ms))

    def _next_wake_ms(self, now_ms: int) -> int | None:
        if self._over is not None:
            return self._say_again_ms
        if self.map is None:
            return None
        if self._to_cut or self._to_assign or self._to_look:
            return now_ms + 1
        times = [one.heard_ms + self.config.lost_after_ms for one in self.vehicles.values() if not one.lost]
        times += [record.since_ms + ANSWER_WITHIN_MS for record in self.ledger.in_state(StripState.OFFERED)]
        at_work = self.ledger.in_state(StripState.ACCEPTED, StripState.UNDER_WAY)
        times += [self.vehicles[one.vehicle].offers[one.strip.number].due_ms for one in at_work]
        times += [one for one in (self._cut_by_ms, self._ripe_ms, self._clear_ms) if one is not None]
        surveying = [one for one in self._primaries.values() if one.finished_ms is None]
        times += [one.heard_ms + self._given_up_after_ms for one in surveying]
        if not surveying:
            times.append(self._deadline_ms())
        return min((max(time_ms, now_ms + 1) for time_ms in times), default=None)
