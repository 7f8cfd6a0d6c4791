"""From cuts to strips: which are new, which an open strip as it lies now, and which must settle before they are one."""

from __future__ import annotations

import math

from comms.node import Received
from comms.said.announcement import RunInfo
from comms.said.messages import Hotspot, StripState
from coordinator.agenda import Agenda, Item
from coordinator.allocate.service import expected_service
from coordinator.briefing import Briefing
from coordinator.config import CoordinatorConfig, weights_over
from coordinator.cut.cutter import Cutter
from coordinator.cut.strips import Cut, CuttingRules
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from coordinator.strip_life import StripLife
from planner.fleet_map import FleetMap
from planner.footprints import footprint_of
from planner.types import BoolArray

SAME_STRIP = 0.25  # shared area, as a share of both together, from which a newly cut strip is an open one revised


def cutter_for(run: RunInfo, config: CoordinatorConfig, fleet_map: FleetMap, inside: BoolArray) -> Cutter | None:
    """What cuts strips that suit the narrowest helper of a run; None where there is no helper. `inside`: the area's
    cells, shape of the map's grid."""
    helpers = [entry for entry in run.vehicles if entry.role.revisits]
    if not helpers:
        return None
    reaches = {entry: footprint_of(entry.sonar).reach for entry in helpers}
    narrowest, reach = min(reaches.items(), key=lambda item: item[1].strip_width_m)
    rules = CuttingRules(
        swath_m=reach.strip_width_m,
        p_detect=narrowest.p_detect,
        worth_risk=config.worth_risk,
        overhead_m=math.pi * narrowest.turn_radius_m + 2 * reach.far_m + 2 * narrowest.run_in_m,
        min_strip_m=config.min_strip_m,
        max_strip_m=config.max_strip_m,
    )
    return Cutter(fleet_map, inside, rules, weights_over(fleet_map.grid, inside, config.priorities))


class StripCutting:
    """Cuts when that is on the agenda. `coming`: what will be a strip when it has settled."""

    def __init__(
        self, cutter: Cutter, briefing: Briefing, fleet: KnownFleet, strips: StripLife, agenda: Agenda
    ) -> None:
        self.coming: list[Cut] = []
        self._cutter = cutter
        self._briefing = briefing
        self._fleet = fleet
        self._strips = strips
        self._agenda = agenda

    def hear_hotspot(self, received: Received, message: Hotspot, now_ms: int) -> None:
        """A hotspot is cut at once."""
        revision = received.header.incarnation, message.revision
        if self._cutter.hear_hotspot((received.vehicle, received.number), revision, message):
            self._agenda.add(Item.CUT, now_ms)

    def cut(self, now_ms: int) -> None:
        """Cuts anew where something has changed, and opens, revises and withdraws strips by that."""
        cutter, ledger = self._cutter, self._strips.ledger
        under_way = {name: one.track_under_way for name, one in self._fleet.primaries.items()}
        ground = cutter.assess(under_way, self._briefing.sweeps_m2(now_ms), self._claimed())
        columns = ground.columns
        unmatched = [record for record in ledger.in_state(StripState.OPEN) if columns[record.window.columns].any()]
        self.coming = [cut for cut in self.coming if not columns[cut.window.columns].any()]
        to_cut = {record.window for record in unmatched}
        for cut in cutter.cut(ground, [window for window in self._claimed() if window not in to_cut]):
            same = max(unmatched, key=lambda record: record.window.overlap(cut.window), default=None)
            if same is not None and same.window.overlap(cut.window) >= SAME_STRIP:
                unmatched.remove(same)
                self._strips.revise(same, cut)
            elif cut.settles_s > 0:
                self.coming.append(cut)
            else:
                self._strips.open(cut, now_ms)
        for record in unmatched:
            self._strips.withdraw(record, now_ms)
        cutter.remember(self._claimed())

    def open_what_is_ripe(self, now_ms: int) -> None:
        """Opens a strip that is still settling when a free helper that sets out now will not overtake the survey."""
        free = [helper for helper in self._briefing.helpers(now_ms) if helper.task is None] if self.coming else []
        for cut in [*self.coming] if free else []:
            one = self._briefing.coming_strip(cut)
            leaves_ms = min(math.floor(expected_service(one, helper).leaves_s * 1000) for helper in free)
            if leaves_ms <= now_ms:
                self.coming.remove(cut)
                self._strips.open(cut, now_ms)
            else:
                self._agenda.add(Item.ASSIGN, leaves_ms)

    def _claimed(self) -> list[Window]:
        """What is a strip's that is open or with a vehicle, or will be one's."""
        return [*(record.window for record in self._strips.unended), *(cut.window for cut in self.coming)]
