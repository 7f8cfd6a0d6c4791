"""The coordinator: joins the layers, cuts strips from the hotspots, offers them to helpers, follows each to its end,
and says when the mission is over."""

from __future__ import annotations

import logging
from itertools import chain

from comms.node import Received, Step
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import AgentState, CoverageTile, Curve, Hotspot, Mode, Plan, TaskState, TaskStatus
from coordinator.agenda import Agenda, Item
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig
from coordinator.dispatch import Dispatch
from coordinator.expect.expectation import ExpectedMap
from coordinator.fixed import Beforehand, Lanes
from coordinator.fleet import KnownFleet
from coordinator.ledger import NUMBERS_A_SECOND, Ledger
from coordinator.mission_end import MissionEnd
from coordinator.outbox import Outbox
from coordinator.strip_cutting import StripCutting
from coordinator.strip_life import StripLife
from coordinator.vehicles import KnownVehicle
from planner.flyable import reachable_cells
from planner.footprints import footprint_of
from planner.region import Region

log = logging.getLogger("secondlook.coordinator")

# News is cut by at once where a helper is free, or none is at a strip; else within the first of these where one that is
# on its way may be turned round, and within the second where none is.
TURN_WITHIN_MS, CUT_WITHIN_MS = 10_000, 120_000


class Coordinator:
    """See the module. All it knows of the fleet it has from the run's announcement and from the agents.

    `has_begun`: whether that announcement has come; from then on there are `fleet` and `ledger`.
    """

    fleet: KnownFleet  # this and what follows: since the run's announcement
    _strips: StripLife
    _dispatch: Dispatch
    _end: MissionEnd
    _briefing: Briefing  # where there are helpers

    def __init__(self, config: CoordinatorConfig) -> None:
        self.config = config
        self._first_number = 1
        self._agenda = Agenda()
        self._outbox = Outbox()
        self.has_begun = False
        self._cutting: StripCutting | None = None  # where there are helpers
        self._fixed: Beforehand | Lanes | None = None  # where second looks do not react to what is seen

    @property
    def ledger(self) -> Ledger:
        """The strips; to be read."""
        return self._strips.ledger

    def start(self, now_ms: int) -> Step:
        """Waits for the run's announcement."""
        self._first_number = 1 + NUMBERS_A_SECOND * (now_ms // 1000)
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Hears what the agents say; what follows from it is decided at a wake-up of its own, 1 ms later."""
        if self.has_begun:
            self._hear(received, now_ms)
        elif isinstance(received.message, RunInfo):
            self._begin(received.message, now_ms)
        return self._step(now_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Finds who is lost and what is late, does what is due, and finds whether the mission is over."""
        if self.has_begun and self._end.over is None:
            self._strips.find_overdue(self.fleet.find_lost(now_ms), now_ms)
            if self._agenda.strike(Item.CUT, now_ms):
                self._cut(now_ms)
            if self._agenda.strike(Item.ASSIGN, now_ms):
                self._assign(now_ms)
            if self._agenda.strike(Item.KEEP_APART, now_ms):
                self._dispatch.keep_apart(now_ms)
            self._end.find(now_ms)
        elif self._agenda.strike(Item.SAY_OVER, now_ms):
            self._end.say_again(now_ms)
        return self._step(now_ms)

    def _begin(self, run: RunInfo, now_ms: int) -> None:
        config, agenda, outbox = self.config, self._agenda, self._outbox
        region = Region(run.outline, run.hole_outlines, run.keep_out_outlines)
        inside = region.inside(run.grid.spec)
        self.fleet = fleet = KnownFleet(run, config.lost_after_ms, now_ms, config.flows)
        ledger = Ledger(self._first_number)
        helpers = [one.entry for one in fleet.helpers]
        # Where none of them comes to from its home no second look goes.
        homes = [(one.home_x_m, one.home_y_m) for one in helpers]
        in_reach = reachable_cells(homes, region, run.grid.spec, fleet.keep_out)
        narrowest = min(helpers, key=lambda one: footprint_of(one.sonar).reach.strip_width_m, default=None)
        p_detect = 0.0 if narrowest is None else narrowest.p_detect
        expected = ExpectedMap(fleet, in_reach, p_detect)
        self._strips = strips = StripLife(ledger, fleet, inside, expected, agenda, outbox)
        self._end = MissionEnd(config, fleet, strips, agenda, outbox)
        if narrowest is not None:
            self._briefing = Briefing(config, ledger, fleet, p_detect)
            self._cutting = StripCutting(narrowest, config, inside, expected, self._briefing, fleet, strips)
            if config.strips == "beforehand":
                self._fixed = Beforehand(self._cutting, self._briefing, fleet, strips)
            elif config.strips != "reacting":
                self._fixed = Lanes(in_reach, fleet, strips, across=config.strips == "lanes_across")
        allocator = config.allocator if self._fixed is None else self._fixed.routes
        self._dispatch = Dispatch(config, allocator, fleet, inside, strips, agenda, outbox)
        self.has_begun = True

    def _hear(self, received: Received, now_ms: int) -> None:
        message, header, vehicle = received.message, received.header, self.fleet.vehicles.get(received.vehicle)
        is_over = self._end.over is not None  # then what is asked for is still taken in, and nothing is done by it
        if isinstance(message, CoverageTile):
            if self.fleet.hear_tile(received, message) and not is_over:
                self._agenda.add(Item.CUT, now_ms + CUT_WITHIN_MS)
        elif isinstance(message, Hotspot):
            if self._hear_hotspot(received, message) and not is_over:
                self._cut_soon(now_ms)
        elif is_over:
            if isinstance(message, AgentState) and vehicle is not None:
                vehicle.hear_state(header, message, now_ms)
        elif isinstance(message, AgentState) and vehicle is not None:
            self._hear_state(vehicle, header, message, now_ms)
        elif isinstance(message, TaskStatus) and vehicle is not None:
            self._strips.hear_status(vehicle, header, message, now_ms)
            if message.state is TaskState.REFUSED:  # its state stays as it was, but it does not go where it was sent
                self._dispatch.note_state(vehicle.entry.vehicle, now_ms, does_another=True)
        elif isinstance(message, Plan | Curve) and vehicle is not None and vehicle.hear_survey(header, message):
            self._cut_soon(now_ms)

    def _hear_hotspot(self, received: Received, hotspot: Hotspot) -> bool:
        """Hears a hotspot's newest word; returns whether there is something to cut by it."""
        vehicle = self.fleet.vehicles.get(received.vehicle)
        if vehicle is not None:
            vehicle.arrivals.note_hotspot(received.header.incarnation, received.key, hotspot.revision)
        return self._cutting is not None and self._cutting.hear_hotspot(received, hotspot)

    def _cut_soon(self, now_ms: int) -> None:
        """There is news of the survey: the sooner cut by, the sooner a helper can be sent by it."""
        helpers = self.fleet.helpers
        if any(one.is_idle for one in helpers) or not any(one.is_at_a_strip and not one.lost for one in helpers):
            within_ms = 0
        else:
            within_ms = TURN_WITHIN_MS if any(one.is_on_its_way for one in helpers) else CUT_WITHIN_MS
        self._agenda.add(Item.CUT, now_ms + within_ms)

    def _hear_state(self, vehicle: KnownVehicle, header: Header, state: AgentState, now_ms: int) -> None:
        was_idle, was_finished, was_lost, before = vehicle.is_idle, vehicle.is_finished, vehicle.lost, vehicle.state
        if not vehicle.hear_state(header, state, now_ms):
            return
        name = vehicle.entry.vehicle
        if was_lost:
            log.info("%s is heard again", name)
        comes_home = before is not None and before.mode is Mode.RETURNING and state.mode.has_ended
        if before is None or (vehicle.is_finished and not was_finished) or comes_home:
            self._agenda.add(Item.CUT, now_ms)
        if vehicle.is_idle and not was_idle:
            self._agenda.add(Item.ASSIGN, now_ms)
        same = before is not None and (before.mode, before.works_on) == (state.mode, state.works_on)
        self._dispatch.note_state(name, now_ms, does_another=not same)
        self._strips.hear_state(vehicle, header, state, now_ms, was_idle=was_idle)

    def _cut(self, now_ms: int) -> None:
        if self._fixed is not None:
            self._fixed.cut(now_ms)
        elif self._cutting is not None:
            self._cutting.cut(now_ms)
        self._agenda.add(Item.ASSIGN, now_ms)

    def _assign(self, now_ms: int) -> None:
        if self._cutting is not None:
            self._dispatch.assign(self._briefing.situation(now_ms), now_ms)

    def _step(self, now_ms: int) -> Step:
        return Step(self._outbox.empty(), self._next_wake_ms(now_ms))

    def _next_wake_ms(self, now_ms: int) -> int | None:
        if not self.has_begun:
            return None
        if self._end.over is not None:
            return self._agenda.deadline_ms(Item.SAY_OVER)
        others_ms = chain(self.fleet.deadlines_ms(), self._strips.deadlines_ms(), self._end.deadlines_ms())
        return self._agenda.next_wake_ms(now_ms, others_ms)
