"""Sectors: the area of a large fleet is shared among teams of helpers. What is cut, expected and offered in one sector
rests on what lies in it and on its own team, so that news of one corner of the map costs no more in a large fleet than
in a small one.

Sectors stay where they are laid before the mission; helpers change teams. What a metre flown is worth, the price at
which a sector's strips are cut, tells where there are too few: a helper that is free joins the team in whose sector the
time it has left brings clearly more, its way there counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from comms.node import Received
from comms.said.messages import Hotspot
from coordinator.agenda import Agenda, Item
from coordinator.allocate.situation import HORIZON_S, Helper
from coordinator.cut.window import Window
from coordinator.expect.expectation import ExpectedMap
from coordinator.vehicles import KnownVehicle
from planner.risk import LevelArray
from planner.types import BoolArray, FloatArray, GridSpec, Point

LEAST_SWATHS = 4.0  # that a sector is wide and long, and many more where there is room
JOINS_FOR = 1.5  # times as much a helper's time must bring elsewhere for it to join another team
STAYS_S = 600.0  # in a team that it has joined: until then prices tell that it is there
MOST_LONG = 4.0  # times as long as it is wide is a sector left that could be halved: long strips need fewer turns
EMPTY_COUNTS = 3.0  # times its price a metre is worth where nobody of the team is there


@dataclass(eq=False)
class Sector:
    """A rectangle of the map, `window`, and the names of the helpers that serve it. `is_worth`: whether anything is
    open in it; `price`: what a metre flown in it is worth, residual risk times m2 a metre."""

    number: int
    window: Window
    team: set[str]
    expected: ExpectedMap
    price: float = 0.0
    is_worth: bool = False
    present: int = 0
    """How many of the team could be given something when it was last asked."""

    def holds(self, window: Window) -> bool:
        """Whether the middle of a window lies in it."""
        row, column = (window.first_row + window.end_row) // 2, (window.first_column + window.end_column) // 2
        return self.window.holds(row, column)


class Sectors:
    """All sectors, by number. Each cell of the map lies in one."""

    def __init__(self, sectors: Sequence[Sector], grid: GridSpec, agenda: Agenda) -> None:
        self.all = list(sectors)
        self._grid = grid
        self._agenda = agenda
        self._stays_until_s: dict[str, float] = {}
        self._hot: dict[tuple[str, int], set[int]] = {}
        """Of each hotspot that touches some, their numbers."""
        self._by_helper = {name: one for one in self.all for name in one.team}

    def of(self, window: Window) -> Sector:
        """The one in whose window the middle of another lies."""
        return next(one for one in self.all if one.holds(window))

    def number_of(self, window: Window) -> int:
        """The number of the sector in whose window the middle of another lies."""
        return self.of(window).number

    def touched(self, window: Window) -> list[Sector]:
        """Those that share cells with a window."""
        return [one for one in self.all if one.window.shared(window)]

    def surveyed_by(self, primary: KnownVehicle) -> list[Sector]:
        """Those that a primary's plan touches; all, where it has told of none."""
        tracks = primary.plan.tracks if primary.plan is not None else ()
        if not tracks or len(self.all) == 1:
            return self.all
        x_m = np.array([place for one in tracks for place in (one.start_x_m, one.end_x_m)])
        y_m = np.array([place for one in tracks for place in (one.start_y_m, one.end_y_m)])
        return self.touched(self._window_about(x_m, y_m, primary.entry.far_m))

    def about(self, vehicle: KnownVehicle) -> list[Sector]:
        """Where it matters what a vehicle does: where it surveys, and that of its team."""
        found = self.surveyed_by(vehicle) if vehicle.entry.role.surveys else []
        own = self._by_helper.get(vehicle.entry.vehicle)
        return found if own is None or own in found else [*found, own]

    def hear_hotspot(self, received: Received, message: Hotspot) -> list[Sector]:
        """Hears a hotspot's newest word; returns where it was news."""
        place, revision = (received.vehicle, received.number), (received.header.incarnation, message.revision)
        lies_in = self._hot.get(place, set())
        if len(self.all) > 1 and message.outline:
            corners = np.array([(corner.x_m, corner.y_m) for corner in message.outline])
            touched = self.touched(self._window_about(corners[:, 0], corners[:, 1], 0.0))
            lies_in = self._hot[place] = lies_in | {one.number for one in touched}
        sectors = self.all if len(self.all) == 1 else [self.all[number] for number in sorted(lies_in)]
        return [one for one in sectors if one.expected.hotspots.hear(place, revision, message)]

    def _window_about(self, x_m: FloatArray, y_m: FloatArray, beside_m: float) -> Window:
        """The cells, and those that far beside them, among which places of the mission frame lie."""
        across_m, along_m = self._grid.frame.to_sweep(x_m, y_m)
        first_row, end_row, first_column, end_column = (
            math.floor(one / self._grid.cell_m)
            for one in (
                along_m.min() - beside_m,
                along_m.max() + beside_m + self._grid.cell_m,
                across_m.min() - beside_m,
                across_m.max() + beside_m + 2 * self._grid.cell_m,
            )
        )
        return Window(first_row, end_row, first_column, end_column)

    def cut_by(self, deadline_ms: int, windows: Sequence[Window] | None = None) -> None:
        """Strips are to be cut anew by a time, in the sectors that these windows touch; in all, where none are
        named."""
        for one in self.all:
            if windows is None or any(one.window.shared(window) for window in windows):
                self._agenda.add(Item.CUT, deadline_ms, one.number)

    def assign_by(self, deadline_ms: int, window: Window) -> None:
        """Open strips are to be offered by a time, in the sector in which a window lies."""
        self._agenda.add(Item.ASSIGN, deadline_ms, self.of(window).number)

    def learn(self, window: Window, helper: str, before: LevelArray, typical: float) -> None:
        """See `ExpectedMap.learn`."""
        self.of(window).expected.learn(window, helper, before, typical)

    def better_for(self, helper: Helper, now_s: float, deadline_s: float) -> Sector | None:
        """Where the time that a free helper has left brings so much more that it joins the team there; None where it
        stays."""
        own = self._by_helper[helper.vehicle]
        if (own.present <= 1 and own.is_worth) or now_s < self._stays_until_s.get(helper.vehicle, -math.inf):
            return None
        left_s = min(deadline_s, now_s + HORIZON_S, helper.lasts_until_s) - now_s
        brings = {one.number: self._brings(one, helper, left_s) for one in self.all}
        best = max(self.all, key=lambda one: (brings[one.number], -one.number))
        return best if brings[best.number] > JOINS_FOR * brings[own.number] else None

    def join(self, name: str, sector: Sector, now_ms: int) -> None:
        """A helper joins another team; both sectors are cut anew for who is there now."""
        own = self._by_helper[name]
        own.team.discard(name)
        own.present -= 1
        sector.team.add(name)
        sector.present += 1
        self._by_helper[name] = sector
        self._stays_until_s[name] = now_ms / 1000 + STAYS_S
        for one in (own, sector):
            self._agenda.add(Item.CUT, now_ms, one.number)

    def _brings(self, sector: Sector, helper: Helper, left_s: float) -> float:
        """What a helper's time left is worth in a sector."""
        if not sector.is_worth:
            return 0.0
        price = sector.price * (1.0 if sector.present else EMPTY_COUNTS)
        return price * max(0.0, left_s * helper.speed_mps - self._way_m(sector.window, helper.free_at[:2]))

    def _way_m(self, window: Window, place: Point) -> float:
        """How far a place, in the mission frame, lies from a window."""
        across_m, along_m = (one / self._grid.cell_m for one in self._grid.frame.to_sweep(*place))
        beside = max(window.first_column - across_m, across_m - window.end_column, 0.0)
        beyond = max(window.first_row - along_m, along_m - window.end_row, 0.0)
        return self._grid.cell_m * math.hypot(beside, beyond)


def laid_out(
    inside: BoolArray, homes: Mapping[str, Point], helpers_a_team: int, least_cells: int
) -> list[tuple[Window, list[str]]]:
    """Sectors for helpers, as many as there are teams of that many, each with its share of the cells inside, and who
    lies nearest to it in its team: halved again and again, the halves side by side across the tracks, so that strips
    stay long, or one behind the other where it is too long or too narrow for that.

    `homes`: of each helper, as (row, column) of the map, which may lie beyond it. No side is shorter than
    `least_cells`.
    """
    whole = Window(0, inside.shape[0], 0, inside.shape[1])
    return _halved(inside, whole, dict(homes), helpers_a_team, least_cells)


def _halved(
    inside: BoolArray, window: Window, homes: dict[str, Point], helpers_a_team: int, least_cells: int
) -> list[tuple[Window, list[str]]]:
    teams = len(homes) // helpers_a_team
    sides = (window.first_row, window.end_row), (window.first_column, window.end_column)
    axes = (0, 1) if window.rows > MOST_LONG * window.columns_wide else (1, 0)
    axis = next((one for one in axes if sides[one][1] - sides[one][0] >= 2 * least_cells), None)
    if teams < 2 or axis is None:
        return [(window, sorted(homes))]
    first, end = sides[axis]
    share = (teams // 2) / teams
    before = inside[window.cells].sum(axis=1 - axis).cumsum()
    at = first + int(np.searchsorted(before, share * before[-1])) + 1
    at = min(max(at, first + least_cells), end - least_cells)
    names = sorted(homes, key=lambda name: (homes[name][axis], name))
    count = round(share * len(names))
    found = []
    for (begin, until), some in (((first, at), names[:count]), ((at, end), names[count:])):
        part = (
            Window(begin, until, window.first_column, window.end_column)
            if axis == 0
            else Window(window.first_row, window.end_row, begin, until)
        )
        found += _halved(inside, part, {name: homes[name] for name in some}, helpers_a_team, least_cells)
    return found
