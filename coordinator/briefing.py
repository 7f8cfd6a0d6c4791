"""What an allocator is told: the helpers, the strips and the time left, from all that the coordinator knows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from comms.said.messages import StripState
from coordinator.allocate.service import can_fly
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from coordinator.config import CoordinatorConfig
from coordinator.cut.strips import Counted
from coordinator.fleet import KnownFleet
from coordinator.goal import GoalWatch
from coordinator.ledger import Ledger, StripRecord
from coordinator.sectors import Sector
from coordinator.vehicles import KnownVehicle, pose_of, way_home_of
from planner.footprints import footprint_of
from planner.types import Strip
from planner.way_home import MARGIN_S

AT_WORK = (StripState.ACCEPTED, StripState.UNDER_WAY)
STAYS_MS = 10_000
"""So long who was sent to a strip is not turned round: two might else be sent and called back in turns, without end."""


class Briefing:
    """Reads ledger and vehicles as they are when it is asked; changes none of them. `p_detect`: what a look along a
    strip was expected to have when it was cut."""

    def __init__(
        self, config: CoordinatorConfig, ledger: Ledger, fleet: KnownFleet, goal: GoalWatch, p_detect: float
    ) -> None:
        self._config = config
        self._goal = goal
        self._p_detect = p_detect
        self._ledger = ledger
        self._vehicles = fleet.vehicles
        self._primaries = fleet.primaries

    def situation(self, now_ms: int, sector: Sector) -> Situation:
        """What is decided on now in a sector: of its open strips, and for who is in its team, by name."""
        records = self._ledger.open_in(sector.number)
        found = (self._helper(self._vehicles[name], records, now_ms) for name in sorted(sector.team))
        deadline_s = self.expected_deadline_s()
        return Situation(
            now_s=now_ms / 1000,
            deadline_s=deadline_s,
            strips=tuple(self.open_strip(record) for record in records),
            helpers=tuple(helper for helper in found if helper is not None),
            switch_margin=self._config.switch_margin,
            price=sector.price / self._p_detect,
            soonest=math.isfinite(deadline_s) and self._goal.is_near,
        )

    def expected_deadline_s(self) -> float:
        """When the mission is expected to be over at the latest; infinite while nobody can tell."""
        ends_ms = [one.expected_end_ms for one in self._primaries.values()]
        known_ms = [end_ms for end_ms in ends_ms if end_ms is not None]
        if not known_ms or len(known_ms) < len(ends_ms):
            return self._config.deadline_s
        return min(self._config.deadline_s, max(known_ms) * self._config.deadline_factor / 1000)

    def open_strip(self, record: StripRecord) -> OpenStrip:
        """A strip as an allocator sees it."""
        return self.as_open(record.strip, record.cut)

    def as_open(self, strip: Strip, cut: Counted) -> OpenStrip:
        """The same of one that is not open yet."""
        return OpenStrip(strip, cut.counts_m2 / self._p_detect)

    def time_m(self, situation: Situation, sector: Sector) -> float:
        """The metres that its helpers have time, and battery, to fly in a sector until the mission ends; infinite while
        nobody can tell of either."""
        deadline_s, helpers = situation.deadline_s, situation.helpers
        if not helpers:  # some may still come
            left_s = max(0.0, deadline_s - situation.now_s)
            return sum(left_s * self._vehicles[name].entry.speed_mps for name in sorted(sector.team))
        return sum(max(0.0, min(deadline_s, one.lasts_until_s) - one.free_s) * one.speed_mps for one in helpers)

    def _helper(self, vehicle: KnownVehicle, open_strips: Sequence[StripRecord], now_ms: int) -> Helper | None:
        """A helper as an allocator sees it; None where it is lost or can be given nothing. `open_strips`: those that it
        may be offered."""
        state, entry = vehicle.state, vehicle.entry
        stays_away = vehicle.is_finished and not vehicle.is_idle  # or on its way home
        if not entry.role.revisits or vehicle.lost or state is None or stays_away or not vehicle.is_trusted:
            return None
        following = self._ledger.next_of(entry.vehicle)
        record = following or self._ledger.strip_of(entry.vehicle)
        if record is None and not vehicle.is_idle:
            return None
        pose = pose_of(state)
        free_at, free_ms = pose, now_ms
        if record is not None:
            expected = vehicle.offers[record.strip.number].service
            ends_ms = round(expected.free_s * 1000)
            if state.works_on == record.strip.number and state.expected_end_ms > 0:
                ends_ms = state.expected_end_ms
            free_at, free_ms = expected.free_at, max(now_ms, ends_ms)
            is_soon = 0 < self._config.ahead_ms >= free_ms - now_ms and not vehicle.silent
            is_kept = record.state in AT_WORK and vehicle.asked_back != record.strip.number
            if is_soon and following is None and is_kept:
                record, pose = None, free_at  # it is given its next now
        sees = footprint_of(entry.sonar)
        helper = Helper(
            vehicle=entry.vehicle,
            pose=pose,
            free_at=free_at,
            free_s=free_ms / 1000,
            task=None if record is None else self.open_strip(record),
            speed_mps=entry.speed_mps,
            turn_radius_m=entry.turn_radius_m,
            run_in_m=entry.run_in_m,
            swath_m=sees.reach.strip_width_m,
            beside_m=sees.reach.beside_m,
            lead_m=sees.lead_m,
            way_home=way_home_of(entry, vehicle.keep_out, vehicle.flows),
            p_detect=entry.p_detect,
            lasts_until_s=(vehicle.heard_ms + state.battery * entry.endurance_ms - entry.reserve_ms) / 1000 - MARGIN_S,
            sweeping=record is not None
            and (
                vehicle.silent
                or record is following
                or record.state is StripState.UNDER_WAY
                or now_ms - vehicle.offers[record.strip.number].offered_ms < STAYS_MS
            ),
            refused=frozenset(one.strip.number for one in open_strips if vehicle.is_not_for_it(one)),
            keep_out=vehicle.keep_out,
            heard_s=vehicle.heard_ms / 1000,
        )
        cannot = frozenset(one.strip.number for one in open_strips if not can_fly(one.strip, helper))
        return replace(helper, refused=helper.refused | cannot) if cannot else helper
