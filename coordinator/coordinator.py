"""The coordinator: joins the layers, cuts strips from the hotspots, offers them to helpers, follows each to its end,
and says when the mission is over."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Iterator
from itertools import chain

from comms.node import Received, Step
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import AgentState, Contact, CoverageTile, Curve, Hotspot, Mode, Plan, TaskState, TaskStatus
from coordinator.agenda import Agenda, Item
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig, weights_over
from coordinator.cut.window import Window
from coordinator.dispatch import Dispatch
from coordinator.expect.contacts import KnownContacts
from coordinator.expect.expectation import ExpectedMap
from coordinator.fixed import Beforehand, Lanes
from coordinator.fleet import KnownFleet
from coordinator.goal import GoalWatch
from coordinator.ledger import NUMBERS_A_SECOND, Ledger
from coordinator.mission_end import MissionEnd
from coordinator.outbox import Outbox
from coordinator.sectors import LEAST_SWATHS, Sector, Sectors, laid_out
from coordinator.strip_cutting import StripCutting
from coordinator.strip_life import StripLife
from coordinator.vehicles import KnownVehicle
from planner.flyable import reachable_cells
from planner.footprints import footprint_of
from planner.region import Region
from planner.types import BoolArray

log = logging.getLogger("secondlook.coordinator")

# News is cut by at once where a helper is free, or none is at a strip; where one on its way may be turned round,
# within the first of these times the sectors, which share the coordinator's time; else within the second.
TURN_WITHIN_MS, CUT_WITHIN_MS = 10_000, 120_000
TELLS_OF_GROUND = (CoverageTile, Hotspot, Contact)
"""No deadline of a vehicle or a strip hangs on these messages."""


class Coordinator:
    """See the module. All it knows of the fleet it has from the run's announcement and from the agents.

    `has_begun`: whether that announcement has come; from then on there are `fleet` and `ledger`.
    """

    _first_number: int  # of strips, since it was started
    fleet: KnownFleet  # this and what follows: since the run's announcement
    _sectors: Sectors
    _strips: StripLife
    _dispatch: Dispatch
    _end: MissionEnd
    _contacts: KnownContacts
    _briefing: Briefing  # where there are helpers

    def __init__(self, config: CoordinatorConfig) -> None:
        self.config = config
        self._agenda = Agenda()
        self._outbox = Outbox()
        self.has_begun = False
        self._cutting: list[StripCutting] = []  # by sector, where there are helpers
        self._fixed: Beforehand | Lanes | None = None  # where second looks do not react to what is seen
        self._first_other_ms: list[int] | None = None  # see _others_ms; None where it may have changed

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
        if not isinstance(received.message, TELLS_OF_GROUND):
            self._first_other_ms = None
        if self.has_begun:
            self._hear(received, now_ms)
        elif isinstance(received.message, RunInfo):
            self._begin(received.message, now_ms)
        return self._step(now_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Finds who is lost and what is late, does what is due, and finds whether the mission is over."""
        self._first_other_ms = None
        if self.has_begun and self._end.over is None:
            self._strips.find_overdue(self.fleet.find_lost(now_ms), now_ms)
            if now_ms < self._end.may_end_ms():  # what is offered then would be left in the same breath
                self._do_what_is_due(now_ms)
            self._end.find(now_ms)
        elif self._agenda.strike(Item.SAY_OVER, now_ms):
            self._end.say_again(now_ms)
        return self._step(now_ms)

    def _do_what_is_due(self, now_ms: int) -> None:
        """One sector at a time: a wake-up of a large fleet's coordinator takes no longer than of a small one's."""
        for number in self._agenda.strike(Item.CUT, now_ms, most=1):
            self._cut(number, now_ms)
        for number in self._agenda.strike(Item.ASSIGN, now_ms, most=1):
            self._assign(self._sectors.all[number], now_ms)
        if self._agenda.strike(Item.KEEP_APART, now_ms):
            self._dispatch.keep_apart(now_ms)

    def _begin(self, run: RunInfo, now_ms: int) -> None:
        config, agenda, outbox = self.config, self._agenda, self._outbox
        region = Region(run.outline, run.hole_outlines, run.keep_out_outlines)
        inside = region.inside(run.grid.spec)
        self.fleet = fleet = KnownFleet(run, config.patience, now_ms, config.flows)
        helpers = [one.entry for one in fleet.helpers]
        # Where none of them comes to from its home no second look goes.
        homes = [(one.home_x_m, one.home_y_m) for one in helpers]
        in_reach = reachable_cells(homes, region, run.grid.spec, fleet.keep_out)
        narrowest = min(helpers, key=lambda one: footprint_of(one.sonar).reach.strip_width_m, default=None)
        p_detect = 0.0 if narrowest is None else narrowest.p_detect
        self._sectors = sectors = Sectors(_sectors(config, fleet, in_reach, p_detect), run.grid.spec, agenda)
        ledger = Ledger(self._first_number, sectors.number_of)
        self._strips = strips = StripLife(
            ledger, fleet, inside, sectors, outbox, config.answer_within_ms, config.looks_within_ms
        )
        self._contacts = contacts = KnownContacts(fleet, inside)
        goal = GoalWatch(config.goal, fleet, contacts, region, inside, agenda, now_ms)
        self._end = MissionEnd(config, fleet, strips, sectors, goal, agenda, outbox)
        if narrowest is not None:
            self._briefing = briefing = Briefing(config, ledger, fleet, goal, p_detect)
            weights = weights_over(run.grid.spec, inside, config.priorities)
            self._cutting = [
                StripCutting(narrowest, config, weights, one, len(sectors.all), briefing, goal, fleet, contacts, strips)
                for one in sectors.all
            ]
            if config.strips == "beforehand":
                self._fixed = Beforehand(self._cutting[0], sectors.all[0], briefing, fleet, strips)
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
                self._sectors.cut_by(now_ms + CUT_WITHIN_MS, [_tile(message)])
        elif isinstance(message, Hotspot):
            sectors = self._hear_hotspot(received, message)
            if not is_over:
                self._cut_soon(sectors, now_ms)
        elif isinstance(message, Contact):
            if self.config.goal is not None or self.config.contacts:
                strip = self.ledger.strip_of(received.vehicle)
                self._contacts.hear(received, message, across=strip is not None and strip.window.across)
        elif is_over:
            if isinstance(message, AgentState) and vehicle is not None:
                vehicle.hear_state(header, message, now_ms)
        elif isinstance(message, AgentState) and vehicle is not None:
            self._hear_state(vehicle, header, message, now_ms)
        elif isinstance(message, TaskStatus) and vehicle is not None:
            self._strips.hear_status(vehicle, header, message, now_ms)
            if message.state is TaskState.REFUSED:  # its state stays as it was, but it does not go where it was sent
                self._dispatch.note_state(vehicle.entry.vehicle, now_ms, does_another=True)
        elif isinstance(message, Plan | Curve) and vehicle is not None:
            before = self._sectors.surveyed_by(vehicle)
            if vehicle.hear_survey(header, message):
                self._cut_soon({*before, *self._sectors.surveyed_by(vehicle)}, now_ms)

    def _hear_hotspot(self, received: Received, hotspot: Hotspot) -> list[Sector]:
        """Hears a hotspot's newest word; returns where there is something to cut by it."""
        vehicle = self.fleet.vehicles.get(received.vehicle)
        if vehicle is not None:
            vehicle.arrivals.note_hotspot(received.header.incarnation, received.key, hotspot.revision)
        return self._sectors.hear_hotspot(received, hotspot) if self._cutting else []

    def _cut_soon(self, sectors: Iterable[Sector], now_ms: int) -> None:
        """There is news of the survey: the sooner cut by, the sooner a helper can be sent by it."""
        for sector in sectors:
            team = [self.fleet.vehicles[name] for name in sector.team]
            if any(one.is_idle for one in team) or not any(one.is_at_a_strip and not one.lost for one in team):
                within_ms = 0
            else:
                turn_within_ms = min(TURN_WITHIN_MS * len(self._sectors.all), CUT_WITHIN_MS)
                within_ms = turn_within_ms if any(one.is_on_its_way for one in team) else CUT_WITHIN_MS
            self._agenda.add(Item.CUT, now_ms + within_ms, sector.number)

    def _hear_state(self, vehicle: KnownVehicle, header: Header, state: AgentState, now_ms: int) -> None:
        was_idle, was_finished, was_lost, before = vehicle.is_idle, vehicle.is_finished, vehicle.lost, vehicle.state
        had_no_work = vehicle.has_no_work
        if not vehicle.hear_state(header, state, now_ms):
            return
        name = vehicle.entry.vehicle
        if was_lost:
            log.info("%s is heard again", name)
        comes_home = before is not None and before.mode is Mode.RETURNING and state.mode.has_ended
        if before is None or (vehicle.is_finished and not was_finished) or comes_home:
            for sector in self._sectors.about(vehicle):
                self._agenda.add(Item.CUT, now_ms, sector.number)
        if vehicle.is_idle and not was_idle:
            for sector in self._sectors.about(vehicle):
                self._agenda.add(Item.ASSIGN, now_ms, sector.number)
        same = before is not None and (before.mode, before.works_on) == (state.mode, state.works_on)
        self._dispatch.note_state(name, now_ms, does_another=not same)
        self._strips.hear_state(vehicle, header, state, now_ms, had_no_work=had_no_work)
        self._end.note_state(vehicle, now_ms)
        ahead_ms = self.config.ahead_ms
        if ahead_ms and vehicle.is_at_a_strip and state.expected_end_ms > 0 and self.ledger.next_of(name) is None:
            for sector in self._sectors.about(vehicle):  # it is to have its next by then
                self._agenda.add(Item.CUT, max(now_ms, state.expected_end_ms - ahead_ms), sector.number)

    def _cut(self, number: int, now_ms: int) -> None:
        if self._fixed is not None:
            self._fixed.cut(now_ms)
        elif self._cutting:
            self._cutting[number].cut(now_ms)
        self._agenda.add(Item.ASSIGN, now_ms, number)

    def _assign(self, sector: Sector, now_ms: int) -> None:
        if not self._cutting:
            return
        situation = self._briefing.situation(now_ms, sector)
        for helper in situation.free if len(self._sectors.all) > 1 else ():
            better = self._sectors.better_for(helper, situation.now_s, situation.deadline_s)
            if better is not None:
                self._sectors.join(helper.vehicle, better, now_ms)
                log.info("%s joins the team of sector %d", helper.vehicle, better.number + 1)
                return  # both are cut anew, and then offered
        self._dispatch.assign(situation, sector.number, now_ms)

    def _step(self, now_ms: int) -> Step:
        return Step(self._outbox.empty(), self._next_wake_ms(now_ms))

    def _next_wake_ms(self, now_ms: int) -> int | None:
        if not self.has_begun:
            return None
        if self._end.over is not None:
            return self._agenda.deadline_ms(Item.SAY_OVER)
        return self._agenda.next_wake_ms(now_ms, self._others_ms())

    def _others_ms(self) -> Iterator[int]:
        """The earliest deadline that is not on the agenda, if there is one; only who asks has it worked out."""
        if self._first_other_ms is None:
            others_ms = chain(self.fleet.deadlines_ms(), self._strips.deadlines_ms(), self._end.deadlines_ms())
            self._first_other_ms = sorted(others_ms)[:1]
        yield from self._first_other_ms


def _sectors(config: CoordinatorConfig, fleet: KnownFleet, in_reach: BoolArray, p_detect: float) -> list[Sector]:
    """The sectors of the area, as many as the fleet has teams of helpers. What does not react is planned as one."""
    grid, homes = fleet.map.grid, {}
    for one in fleet.helpers:
        across_m, along_m = grid.frame.to_sweep(one.entry.home_x_m, one.entry.home_y_m)
        homes[one.entry.vehicle] = (along_m / grid.cell_m, across_m / grid.cell_m)
    swath_m = min((footprint_of(one.entry.sonar).reach.strip_width_m for one in fleet.helpers), default=0.0)
    team = config.helpers_a_team if config.strips == "reacting" else max(1, len(homes))
    return [
        Sector(number, window, set(names), ExpectedMap(fleet, window, in_reach[window.cells], p_detect))
        for number, (window, names) in enumerate(
            laid_out(in_reach, homes, team, math.ceil(LEAST_SWATHS * swath_m / grid.cell_m))
        )
    ]


def _tile(tile: CoverageTile) -> Window:
    rows, columns = tile.sum_levels.shape
    return Window(tile.first_row, tile.first_row + rows, tile.first_column, tile.first_column + columns)
