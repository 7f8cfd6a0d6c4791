"""What a second look at contacts is worth: how much surer it makes how many mines there are, in the same currency as a
look at ground.

Of ground a look lowers the mines that may be left unseen, and with them the variance of their number, by the residual
risk that it removes, times its area, times how dense mines lie. Of an object that was seen it lowers the variance of
whether that is a mine. Over the density of mines this, too, is square metres of residual risk.
"""

from __future__ import annotations

import math

import numpy as np

from comms.node import Received
from comms.said.messages import Contact
from coordinator.cut.window import Window
from coordinator.fleet import KnownFleet
from planner.clearance import PRIOR_MINES
from planner.contacts import ObjectsOnMap, Sighting, surer_by
from planner.rounding import rounded
from planner.types import BoolArray, FloatArray

DOUBTFUL = 0.45  # by so much at most does the chance to be a mine differ from a half
MOST_SPREAD = 4  # cells to a side over which what an object is worth is spread, as it may lie in any of them


class KnownContacts:
    """All contacts that were heard, as objects. `inside`: the area's cells, shape of the fleet's map."""

    def __init__(self, fleet: KnownFleet, inside: BoolArray) -> None:
        self._fleet = fleet
        self._inside = inside
        self.objects = ObjectsOnMap(fleet.map)

    def hear(self, received: Received, contact: Contact, *, across: bool) -> None:
        """Joins a contact. `across`: it was seen from a strip across the tracks."""
        number = received.vehicle, received.header.incarnation, received.number
        place = contact.x_m, contact.y_m, contact.sigma_m
        self.objects.hear(Sighting(received.vehicle, *place, contact.score, across), number)

    def doubtful(self, window: Window) -> int:
        """How many objects lie in a window of the map of which nobody can tell whether they are mines."""
        seen, chances = self.objects.known()
        rows, columns = self._fleet.map.grid.cells_of(seen.x_m, seen.y_m)
        there = (rows >= window.first_row) & (rows < window.end_row)
        there &= (columns >= window.first_column) & (columns < window.end_column)
        return int((there & (rounded(np.abs(chances[:, 0] - 0.5)) < DOUBTFUL)).sum())

    def worth(self, window: Window, look: FloatArray, weights: FloatArray) -> FloatArray | None:
        """What a further look counts at the cells of a window of the map for the objects there, seen from along the
        tracks and from across: shape (2, rows, columns), residual risk times m2. None where that is nothing.

        `look`: the share of a mine's chance to be missed that a look takes, and `weights`: what a cell's risk counts,
        as a multiple of their mean; both of the window's shape. Looks from an aspect from which the object was seen
        before count less, as far as the map takes looks for alike (rho).
        """
        grid, map_ = self._fleet.map.grid, self._fleet.map
        seen, chances = self.objects.known()
        rows, columns = grid.cells_of(seen.x_m, seen.y_m)
        rows, columns = rows - window.first_row, columns - window.first_column
        shape = look.shape
        here = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
        if not here.any():
            return None
        seen_m2 = float((1.0 - map_.risk)[self._inside].sum()) * grid.cell_area_m2
        if seen_m2 <= 0.0:
            return None
        density_m2 = (self.objects.mines + PRIOR_MINES) / seen_m2
        rows, columns, of_those = rows[here], columns[here], np.flatnonzero(here)
        nats = -np.log1p(-np.minimum(look[rows, columns], 1.0 - 1e-9))
        counts = rounded(surer_by(chances[here], nats) / density_m2)
        worth = np.zeros((2, *shape))
        for row, column, place, count in zip(
            rows.tolist(), columns.tolist(), of_those.tolist(), counts.tolist(), strict=True
        ):
            side = min(MOST_SPREAD, max(1, math.ceil(float(seen.sigma_m[place]) / grid.cell_m)))
            about = (
                slice(max(0, row - side), min(shape[0], row + side + 1)),
                slice(max(0, column - side), min(shape[1], column + side + 1)),
            )
            each = count / look[about].size
            for aspect, was_seen in enumerate((seen.along[place], seen.across[place])):
                worth[aspect, *about] += each * (1.0 - map_.rho if was_seen else 1.0)
        worth *= weights * (look > 0.0)
        return worth
