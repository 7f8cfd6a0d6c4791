"""What an allocator is told: the helpers, the strips and the time left, from all that the coordinator knows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from comms.said.messages import StripState
from coordinator.allocate.situation import Helper, OpenStrip, Situation
from coordinator.config import CoordinatorConfig
from coordinator.cut.cutter import Cutter
from coordinator.cut.strips import Cut
from coordinator.fleet import KnownFleet
from coordinator.ledger import WITH_A_VEHICLE, Ledger, StripRecord
from coordinator.vehicles import KnownVehicle
from planner.dubins import Pose
from planner.footprints import footprint_of

SWEEPING_SHARE = 0.7  # of a helper's time, that it spends on strips and not on the way


class Briefing:
    """Reads ledger, vehicles and cutter as they are when it is asked; changes none of them."""

    def __init__(self, config: CoordinatorConfig, ledger: Ledger, fleet: KnownFleet, cutter: Cutter) -> None:
        self._config = config
        self._grid = fleet.map.grid
        self._ledger = ledger
        self._vehicles = fleet.vehicles
        self._primaries = fleet.primaries.values()
        self._cutter = cutter

    def situation(self, now_ms: int, coming: Sequence[Cut]) -> Situation:
        """What is decided on now. `coming`: what will be a strip when it has settled."""
        helpers = self.helpers(now_ms)
        deadline_s = self.expected_deadline_s()
        under_way = (one.track_under_way for one in self._primaries)
        ends_s = [one.ends_s for one in under_way if one is not None]
        return Situation(
            now_s=now_ms / 1000,
            deadline_s=deadline_s,
            strips=tuple(self.open_strip(record) for record in self._ledger.in_state(StripState.OPEN)),
            helpers=helpers,
            coming=tuple(self.coming_strip(cut) for cut in coming),
            switch_margin=self._config.switch_margin,
            later_m2ps=self._worth_later_m2ps(helpers, deadline_s, coming),
            later_s=min(ends_s, default=math.inf),
        )

    def helpers(self, now_ms: int) -> tuple[Helper, ...]:
        """Those that can be given something, by name."""
        found = (self._helper(vehicle, now_ms) for _, vehicle in sorted(self._vehicles.items()))
        return tuple(helper for helper in found if helper is not None)

    def expected_deadline_s(self) -> float:
        """When the mission is expected to be over; infinite while nobody can tell."""
        ends_ms = [one.expected_end_ms for one in self._primaries]
        known_ms = [end_ms for end_ms in ends_ms if end_ms is not None]
        if not known_ms or len(known_ms) < len(ends_ms):
            return math.inf
        return max(known_ms) * self._config.deadline_factor / 1000

    def coming_strip(self, cut: Cut) -> OpenStrip:
        """What will be a strip, as an allocator sees it."""
        strip = cut.strip(self._grid, 0)
        return OpenStrip(strip, self._risk_m2(cut), cut.settles_s)

    def open_strip(self, record: StripRecord) -> OpenStrip:
        """A strip as an allocator sees it."""
        return OpenStrip(record.strip, self._risk_m2(record.cut), record.cut.settles_s)

    def sweeps_m2(self, now_ms: int) -> float:
        """What helpers have time to sweep until the mission ends; infinite while nobody can tell."""
        deadline_s = self.expected_deadline_s()
        if math.isinf(deadline_s):
            return math.inf
        helpers = self.helpers(now_ms)
        return SWEEPING_SHARE * sum(max(0.0, deadline_s - one.free_s) * one.speed_mps * one.swath_m for one in helpers)

    def _worth_later_m2ps(self, helpers: Sequence[Helper], deadline_s: float, coming: Sequence[Cut]) -> float:
        """Of what is open, and of what is to come if the rest of the area is like what has settled."""
        if not helpers or math.isinf(deadline_s):
            return 0.0
        speed_mps = sum(one.speed_mps for one in helpers) / len(helpers)
        cell_m, overhead_m, to_come = self._grid.cell_m, self._cutter.rules.overhead_m, self._cutter.more_to_come

        def supply(cut: Cut, count: float) -> Supply:
            length_m = cut.window.rows * cell_m
            return Supply(cut.counts_m2, (length_m + overhead_m) / speed_mps, count)

        supplies = [supply(cut, 1.0 + to_come) for cut in coming]
        for record in self._ledger:
            if record.state is not StripState.WITHDRAWN:
                there = 1.0 if record.state is StripState.OPEN else 0.0
                supplies.append(supply(record.cut, there + to_come))
        return worth_later_m2ps(supplies, sum(max(0.0, deadline_s - one.free_s) for one in helpers))

    def _helper(self, vehicle: KnownVehicle, now_ms: int) -> Helper | None:
        """A helper as an allocator sees it; None where it is lost or can be given nothing."""
        state, entry = vehicle.state, vehicle.entry
        stays_away = vehicle.is_finished and not vehicle.is_idle
        if not entry.role.revisits or vehicle.lost or state is None or stays_away or not vehicle.is_trusted:
            return None
        records = [one for one in self._ledger.in_state(*WITH_A_VEHICLE) if one.vehicle == entry.vehicle]
        if not records and not vehicle.is_idle:
            return None
        pose = Pose(state.x_m, state.y_m, state.heading_rad)
        free_at, free_ms = pose, now_ms
        if records:
            expected = vehicle.offers[records[0].strip.number].service
            ends_ms = round(expected.free_s * 1000)
            if state.works_on == records[0].strip.number and state.expected_end_ms > 0:
                ends_ms = state.expected_end_ms
            free_at, free_ms = expected.free_at, max(now_ms, ends_ms)
        open_strips = self._ledger.in_state(StripState.OPEN)
        sees = footprint_of(entry.sonar)
        return Helper(
            vehicle=entry.vehicle,
            pose=pose,
            free_at=free_at,
            free_s=free_ms / 1000,
            task=self.open_strip(records[0]) if records else None,
            speed_mps=entry.speed_mps,
            turn_radius_m=entry.turn_radius_m,
            run_in_m=entry.run_in_m,
            swath_m=sees.reach.strip_width_m,
            lead_m=sees.lead_m,
            p_detect=entry.p_detect,
            lasts_until_s=(vehicle.heard_ms + state.battery * entry.endurance_ms) / 1000,
            sweeping=bool(records) and records[0].state is StripState.UNDER_WAY,
            refused=frozenset(one.strip.number for one in open_strips if vehicle.is_not_for_it(one)),
        )

    def _risk_m2(self, cut: Cut) -> float:
        return cut.counts_m2 / self._cutter.rules.p_detect


@dataclass(frozen=True)
class Supply:
    """Strips of a kind: what one look removes at each (residual risk times m2), the seconds it takes, and how many."""

    removed_m2: float
    service_s: float
    count: float


def worth_later_m2ps(supplies: Iterable[Supply], helpers_s: float) -> float:
    """The rate of the last strip served if `helpers_s` seconds go to the strips of the best rates first; 0 where the
    time suffices for all of them."""
    left_s = helpers_s
    for supply in sorted(supplies, key=lambda one: -one.removed_m2 / one.service_s):
        left_s -= supply.service_s * supply.count
        if left_s < 0:
            return supply.removed_m2 / supply.service_s
    return 0.0
