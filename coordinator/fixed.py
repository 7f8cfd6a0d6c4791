"""Second looks that do not react to what is seen: lanes mown from the first second, lanes across the tracks, and routes
planned once for what is expected at the start. What coordination has to beat."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from comms.said.announcement import RosterVehicle
from comms.said.messages import StripState
from coordinator.allocate.routes import BEAM, plan_routes
from coordinator.allocate.situation import Situation
from coordinator.briefing import Briefing
from coordinator.cut.room import Room
from coordinator.cut.strips import Cut, cells_wide
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from coordinator.sectors import Sector
from coordinator.strip_cutting import StripCutting
from coordinator.strip_life import StripLife
from planner.footprints import footprint_of
from planner.types import BoolArray


@dataclass
class FixedRoutes:
    """An `Allocator`: each helper flies its own strips in turn. `routes`: their numbers, by vehicle."""

    routes: dict[str, list[int]] = field(default_factory=dict)

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """See `coordinator.allocate.situation.Allocator`."""
        there = {one.strip.number for one in situation.strips}
        offers = {}
        for helper in situation.free:
            numbers = (one for one in self.routes.get(helper.vehicle, ()) if one in there and one not in helper.refused)
            number = next(numbers, None)
            if number is not None:
                offers[helper.vehicle] = number
        return offers


class Lanes:
    """Shares the area among helpers, each a block of lanes as wide as its swath, side by side; who has flown all of its
    lanes flies them again, back. `inside`: the area's cells, shape of the grid; `across`: the lanes run across the
    tracks."""

    def __init__(self, inside: BoolArray, fleet: KnownFleet, strips: StripLife, *, across: bool) -> None:
        self.routes = FixedRoutes()
        self._across = across
        self._inside = inside
        self._fleet = fleet
        self._strips = strips
        self._lanes: dict[str, list[Window]] = {}

    def cut(self, now_ms: int) -> None:
        """Opens the lanes of helpers that are there and have none left."""
        if not self._lanes:
            if any(one.state is None for one in self._fleet.helpers):
                return
            self._lanes = self._shared()
        ledger = self._strips.ledger
        for name, lanes in self._lanes.items():
            route = self.routes.routes.setdefault(name, [])
            records = [ledger.get(number) for number in route]
            if all(one is not None and one.state in (StripState.DONE, StripState.FAILED) for one in records):
                first = ledger.next_number
                for lane in lanes:
                    cut = Cut(lane, counts_m2=0.0, removable_m2=self._removable_m2(lane), foreseen=True)
                    self._strips.open(cut, now_ms, "a lane")
                self.routes.routes[name] = list(range(first, ledger.next_number))
                self._lanes[name] = lanes[::-1]

    def _removable_m2(self, lane: Window) -> float:
        """What a look along a lane removes of ground of which nothing is known."""
        least = min(one.entry.p_detect for one in self._fleet.helpers)
        return least * float(self._inside[lane.cells].sum()) * self._fleet.map.grid.cell_area_m2

    def _shared(self) -> dict[str, list[Window]]:
        """By helper its lanes in the order of flying. Helpers have blocks of lanes in the order in which they lie
        across them, as wide as they are fast."""
        grid, entries = self._fleet.map.grid, {}
        for one in self._fleet.helpers:
            assert one.state is not None
            place_m = grid.frame.to_sweep(one.state.x_m, one.state.y_m)[1 if self._across else 0]
            entries[one.entry.vehicle] = place_m, one.entry
        names = sorted(entries, key=lambda name: (entries[name][0], name))
        shares = np.cumsum([0.0, *(_sweeps_m2ps(entries[name][1]) for name in names)])
        inside = self._inside.T if self._across else self._inside
        edges = np.rint(shares / shares[-1] * inside.shape[1]).astype(int).tolist()
        found = {}
        for place, name in enumerate(names):
            at_m, entry = entries[name]
            width = min(inside.shape[1], cells_wide(grid, footprint_of(entry.sonar).reach.strip_width_m))
            lanes = _lanes(inside, edges[place], edges[place + 1], width)
            nearer_end = at_m > (edges[place] + edges[place + 1]) / 2 * grid.cell_m
            found[name] = [self._window(lane) for lane in (lanes[::-1] if nearer_end else lanes)]
            if self._fleet.keep_out:
                found[name] = Room(grid, entry, self._fleet.keep_out, grid.cell_m).flyable(1, found[name])
        return found

    def _window(self, lane: Window) -> Window:
        return lane.turned if self._across else lane


def _sweeps_m2ps(entry: RosterVehicle) -> float:
    return footprint_of(entry.sonar).reach.strip_width_m * entry.speed_mps


def _lanes(inside: BoolArray, first: int, end: int, width: int) -> list[Window]:
    """Windows of `width` columns side by side over columns [first, end), the last one pulled in; each as long as the
    area is there."""
    found = []
    for begin in range(first, end, width):
        column = max(0, min(begin, inside.shape[1] - width))
        rows = np.flatnonzero(inside[:, column : column + width].any(axis=1))
        if rows.size:
            found.append(Window(int(rows[0]), int(rows[-1]) + 1, column, column + width))
    return found


class Beforehand:
    """Plans routes of the whole area, one `sector`, once, to the deadline and for what is expected when every primary
    has said its first plan, and keeps to them."""

    def __init__(
        self, cutting: StripCutting, sector: Sector, briefing: Briefing, fleet: KnownFleet, strips: StripLife
    ) -> None:
        self.routes = FixedRoutes()
        self._cutting = cutting
        self._sector = sector
        self._briefing = briefing
        self._fleet = fleet
        self._strips = strips

    def cut(self, now_ms: int) -> None:
        """Opens the strips of the routes, as soon as these can be planned."""
        waits = any(one.plan is None for one in self._fleet.primaries.values())
        waits |= any(one.state is None for one in self._fleet.helpers)
        if self.routes.routes or waits or not math.isfinite(self._briefing.expected_deadline_s()):
            return
        self._cutting.cut(now_ms, again=True)
        situation = self._briefing.situation(now_ms, self._sector)
        routes = plan_routes(situation.strips, situation.helpers, situation.deadline_s, BEAM)
        self.routes.routes = {name: list(numbers) for name, numbers in routes.strips.items()}
        planned = {number for numbers in routes.strips.values() for number in numbers}
        for record in self._strips.ledger.in_state(StripState.OPEN):
            if record.strip.number not in planned:
                self._strips.withdraw(record, now_ms)
