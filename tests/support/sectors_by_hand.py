"""Sectors by hand."""

from __future__ import annotations

import numpy as np

from coordinator.cut.window import Window
from coordinator.expect.expectation import ExpectedMap
from coordinator.fleet import KnownFleet
from coordinator.sectors import Sector


def sector(fleet: KnownFleet, window: Window, number: int = 0, *team: str) -> Sector:
    """One that lies inside the area whole."""
    inside = np.ones((window.rows, window.columns_wide), dtype=np.bool_)
    return Sector(number, window, set(team), ExpectedMap(fleet, window, inside, 0.7))


def whole(fleet: KnownFleet) -> Sector:
    """All of the area, and all of its helpers."""
    grid = fleet.map.grid
    return sector(fleet, Window(0, grid.rows, 0, grid.columns), 0, *(one.entry.vehicle for one in fleet.helpers))
