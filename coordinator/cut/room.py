"""What of windows can be flown where there is ground to keep out of."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

from comms.said.announcement import RosterVehicle
from coordinator.cut.strips import strip_of
from coordinator.cut.window import Window
from planner.flyable import flyable_pieces
from planner.footprints import footprint_of
from planner.keep_out import KeepOut
from planner.sweep import legs_over_strip, sweeps_by
from planner.types import GridSpec, Strip

WHOLE_BLOCKS = 1e-6


@dataclass(frozen=True)
class Room:
    """`grid`: the map's; `helper`: who is to fly them; `min_strip_m`: what is shorter is no strip."""

    grid: GridSpec
    helper: RosterVehicle
    keep_out: KeepOut
    min_strip_m: float

    def flyable(self, block: int, windows: Iterable[Window]) -> list[Window]:
        """What of each window, of blocks of so many cells a side, can be flown, with run-in and run-out and room to
        turn; in order."""
        return [piece for window in windows for piece in self._pieces(block, window)]

    @lru_cache(maxsize=10_000)  # noqa: B019 - there is one of it in a mission, which lives as long
    def _pieces(self, block: int, window: Window) -> list[Window]:
        if self._can_fly(block, window):
            return [window]
        reach = footprint_of(self.helper.sonar).reach
        sides_m = (reach.beside_m, -reach.beside_m) if reach.beside_m else (0.0,)
        found = [self._beside(block, window, side_m) for side_m in sides_m]
        return max(found, key=lambda some: sum(one.cells_long for one in some))

    def _beside(self, block: int, window: Window, side_m: float) -> list[Window]:
        """The same where its leg lies on one side of it."""
        entry, sees, block_m = self.helper, footprint_of(self.helper.sonar), block * self.grid.cell_m
        legs = legs_over_strip(self._strip(block, window), sees.reach.strip_width_m, side_m)
        if len(legs) > 1:
            return []
        found = []
        for leg in flyable_pieces(legs, self.keep_out, entry.turn_radius_m, entry.run_in_m, sees.lead_m):
            from_m, to_m = (math.dist(legs[0].start, end) for end in (leg.start, leg.end))
            first, end = math.ceil(from_m / block_m - WHOLE_BLOCKS), math.floor(to_m / block_m + WHOLE_BLOCKS)
            if (end - first) * block_m >= self.min_strip_m:
                piece = _part(window, first, end)
                if self._can_fly(block, piece):
                    found.append(piece)
        return found

    def _can_fly(self, block: int, window: Window) -> bool:
        entry, strip = self.helper, self._strip(block, window)
        sees = footprint_of(entry.sonar)
        return bool(sweeps_by(sees, strip, entry.turn_radius_m, entry.run_in_m, self.keep_out))

    def _strip(self, block: int, window: Window) -> Strip:
        return strip_of(self.grid, window.in_cells(block, self.grid.shape), 0)


def _part(window: Window, first: int, end: int) -> Window:
    """From one cell along a window's strip to another."""
    if window.across:
        column = window.first_column
        return replace(window, first_column=column + first, end_column=column + end)
    return replace(window, first_row=window.first_row + first, end_row=window.first_row + end)
