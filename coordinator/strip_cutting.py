"""From what is expected to strips: which are new, which an open strip as it lies now."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from comms.said.announcement import RosterVehicle
from coordinator.allocate.routes import plan_each
from coordinator.allocate.situation import HORIZON_S, Helper, Situation
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig
from coordinator.cut.cutter import Cutter, Flown, FlownRoutes
from coordinator.cut.ground import OBJECTIVES, Ground
from coordinator.cut.legs import Flier
from coordinator.cut.room import Room
from coordinator.cut.strips import Counted, Cut, CuttingRules
from coordinator.expect.contacts import KnownContacts
from coordinator.fleet import KnownFleet
from coordinator.goal import GoalWatch
from coordinator.ledger import TAKEN
from coordinator.reasons import ACROSS, Reasons
from coordinator.sectors import Sector
from coordinator.strip_life import StripLife
from planner.footprints import footprint_of
from planner.types import FloatArray

COMPARED_BEAM = 6  # of the routes by which strips are compared: half as wide as that of those to be flown
LEAST_WORTH = 1e-3  # of a cell in m2 for its area: what is worth less is worth nothing
MOST_BETWEEN = 4
SAME_STRIP = 0.25  # shared area, as a share of both together, from which a newly cut strip is an open one revised


class StripCutting:
    """Cuts a sector when that is on the agenda, strips that suit the `narrowest` of the fleet's helpers. `weights`:
    what a cell's risk counts, shape of the map's grid. `sectors`: how many there are; of so many cuts, at most
    MOST_BETWEEN, one tries the other heading, as all share the coordinator's time.

    What is cut has windows of the sector; what is in the ledger has those of the fleet's map.
    """

    def __init__(
        self,
        narrowest: RosterVehicle,
        config: CoordinatorConfig,
        weights: FloatArray,
        sector: Sector,
        sectors: int,
        briefing: Briefing,
        goal: GoalWatch,
        fleet: KnownFleet,
        contacts: KnownContacts,
        strips: StripLife,
    ) -> None:
        swath_m = footprint_of(narrowest.sonar).reach.strip_width_m
        rules = CuttingRules(
            swath_m=swath_m,
            overhead_m=math.pi * narrowest.turn_radius_m + swath_m + 2 * narrowest.run_in_m,
            min_strip_m=config.min_strip_m,
            max_strip_m=config.max_strip_m,
        )
        self._lays = config.strips == "reacting" and getattr(config.allocator, "lays_strips", False) is True
        self._objective = OBJECTIVES[config.objective]
        grid = sector.expected.grid
        area_m2 = grid.cell_area_m2
        least_worth = self._objective.mean * config.worth_risk * narrowest.p_detect * area_m2
        least_worth = max(least_worth, LEAST_WORTH * area_m2)
        room = Room(grid, narrowest, fleet.keep_out, config.min_strip_m) if fleet.keep_out else None
        self._cutter = Cutter(
            grid, rules, least_worth, across=config.across, room=room, turns_each=min(sectors, MOST_BETWEEN)
        )
        self._cell_weights = weights[sector.window.cells]
        self._weights = self._cell_weights * area_m2
        self._contacts = contacts if config.contacts else None
        self._sector = sector
        self._grid = grid
        self._briefing = briefing
        self._goal = goal
        self._goal_m2 = goal.area_m2(sector.window, area_m2)
        self._fleet = fleet
        self._strips = strips

    def _flown(self, situation: Situation) -> Flown:
        """What helpers fly of strips by the best routes to the deadline; all of it where nobody is there yet."""
        helpers, grid = situation.helpers, self._grid
        deadline_s = min(situation.deadline_s, situation.now_s + HORIZON_S)

        def flown(choices: Sequence[Sequence[Counted]]) -> Sequence[FlownRoutes]:
            if not helpers:
                return [FlownRoutes(dict.fromkeys(range(len(cuts)), 1.0), ()) for cuts in choices]
            as_open = self._briefing.as_open
            strips = [[as_open(cut.strip(grid, place), cut) for place, cut in enumerate(cuts)] for cuts in choices]
            found = plan_each([(some, helpers) for some in strips], deadline_s, COMPARED_BEAM)
            return [FlownRoutes(its.shares, [its.strips[one.vehicle] for one in helpers]) for its in found]

        return flown

    def _fliers(self, situation: Situation) -> list[Flier]:
        """By whose routes strips are laid before one is offered: none while nobody is to be sent to one, or nobody can
        tell when the mission ends, nor where that is not all that routes hang on."""
        frame, deadline_s = self._grid.frame, situation.deadline_s
        if not (self._lays and situation.free and math.isfinite(deadline_s)) or situation.soonest:
            return []
        if not all(self._is_plain(one, deadline_s) for one in situation.helpers):
            return []
        return [
            Flier(
                *frame.to_sweep(one.free_at.x_m, one.free_at.y_m),
                one.free_at.heading_rad - frame.heading_rad,
                one.free_s,
                deadline_s,
                one.speed_mps,
                one.turn_radius_m,
                one.run_in_m,
                one.lead_m,
            )
            for one in situation.helpers
        ]

    def _is_plain(self, helper: Helper, deadline_s: float) -> bool:
        """Whether a helper flies Dubins's ways, in still water, with nothing to keep out of and to the middle of
        strips, and its battery lasts to the mission's end and home from any corner."""
        if helper.keep_out or helper.beside_m or not helper.sailing.is_in_still_water:
            return False
        rows, columns = self._grid.shape
        across_m, along_m = columns * self._grid.cell_m, rows * self._grid.cell_m
        corners = [self._grid.frame.to_mission(x_m, y_m) for x_m in (0.0, across_m) for y_m in (0.0, along_m)]
        poses = np.array([(x_m, y_m, 0.0) for x_m, y_m in corners])
        return deadline_s + float(helper.home_s(poses).max()) <= helper.lasts_until_s

    def cut(self, now_ms: int, *, again: bool = False) -> None:
        """Cuts anew, and opens, revises and withdraws strips by that; `again`: also a second one on a place that is
        worth two looks, else that is cut when the first is under way."""
        sector, ledger = self._sector, self._strips.ledger
        expected, place = sector.expected.now(), sector.window
        reasons = Reasons(self._grid, self._fleet.primaries, expected.risk)

        def why(cut: Cut) -> str:
            told = [reasons.why(replace(cut, window=cut.window.within(place)))]
            count = 0 if self._contacts is None else self._contacts.doubtful(cut.window)
            if count:
                told.append("1 contact that may be a mine" if count == 1 else f"{count} contacts that may be mines")
            if cut.window.across:
                told.append(ACROSS)
            return "; ".join(told)

        contacts = None
        if self._contacts is not None:
            look = np.where(expected.risk > 0.0, expected.look, 0.0)  # none where no second look goes
            contacts = self._contacts.worth(place, look, self._cell_weights)
        ground = Ground(
            risk=expected.risk,
            look=expected.look,
            weights=self._weights,
            is_seen=expected.is_seen,
            objective=self._objective,
            threshold=self._cutter.threshold,
            contacts=None if contacts is None else self._objective.mean * contacts,
            goal_m2=self._goal_m2,
        )
        flown_anyway = [*ledger.in_state(*TAKEN), *self._strips.awaited]
        claimed = [one.window.within(place) for one in flown_anyway if one.window.shared(place)]
        unmatched = ledger.open_in(sector.number)
        opened = [record.window.within(place) for record in unmatched]
        situation = self._briefing.situation(now_ms, sector)
        time_m, flown = self._briefing.time_m(situation, sector), self._flown(situation)
        cuts = self._cutter.cut(ground, time_m, claimed, opened, flown, self._fliers(situation), again=again)
        sector.price, sector.is_worth, sector.present = self._cutter.price, bool(cuts), len(situation.helpers)
        self._goal.hear_expected(sector.number, *self._cutter.leaves_m2)
        for found in cuts:
            cut = replace(found, window=found.window.moved(place.first_row, place.first_column))
            same = next((record for record in unmatched if record.window == cut.window), None)  # as most are
            if same is None:
                alike = (record for record in unmatched if record.window.across == cut.window.across)
                same = max(alike, key=lambda record: record.window.overlap(cut.window), default=None)
            if same is not None and same.window.overlap(cut.window) >= SAME_STRIP:
                unmatched.remove(same)
                self._strips.revise(same, cut, why)
            else:
                self._strips.open(cut, now_ms, why(cut))
        for record in unmatched:
            self._strips.withdraw(record, now_ms)
