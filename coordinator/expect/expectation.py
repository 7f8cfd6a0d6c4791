"""The expected map: for every cell the residual risk that is expected to be left at the mission's end by what the fleet
does anyway, and what a helper's look would remove of it.

Looks multiply, so their order does not matter: what is known is the looks so far and the tracks that primaries still
mean to fly. Where cells have settled, or a hotspot was told, that is what was seen; elsewhere it is what P(y) lets
expect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coordinator.cut.window import Window
from coordinator.expect.hotspots import Hotspots
from coordinator.expect.seabed import Seabed
from coordinator.expect.tracks import ExpectedTracks
from coordinator.fleet import KnownFleet
from planner.risk import HIGHEST_P_DETECT, MOST_LEVELS, NATS_PER_LEVEL, LevelArray
from planner.rounding import rounded
from planner.types import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Expectation:
    """The expected map at one time; arrays of grid shape. `risk`: the residual risk expected to be left, 0 where no
    second look goes; `look`: the share of it that a helper's look there is expected to remove; `is_seen`: where that
    rests on what was seen and not on what is expected of tracks to come."""

    risk: FloatArray
    look: FloatArray
    is_seen: BoolArray


class ExpectedMap:
    """Made anew from what the fleet has said whenever it is asked. `place`: of which part of the fleet's map it is, for
    which `grid` and all arrays are; `inside`: the area's cells there; `p_detect`: what a helper's look is told to
    have."""

    def __init__(self, fleet: KnownFleet, place: Window, inside: BoolArray, p_detect: float) -> None:
        self.grid = fleet.map.grid.part(place.first_row, place.end_row, place.first_column, place.end_column)
        self.hotspots = Hotspots(self.grid, inside)
        self._fleet = fleet
        self._place = place
        self._inside = inside
        self._p_detect = p_detect
        self._seabed = Seabed(self.grid)
        self._tracks = ExpectedTracks(self.grid)

    def learn(self, window: Window, helper: str, before: LevelArray, typical: float) -> None:
        """Learns what second looks find from a pass over a window of the fleet's map that lies in this part of it.
        `before`: what the helper's layer told there before it, the sum over its looks; `typical`: its P_d as the run
        tells it."""
        gained = self._fleet.levels(helper, window).astype(np.float64) - before
        layer = self._fleet.map.layers.get(helper)
        if layer is not None:  # where the sum is full the best look is all that is known
            full = layer.sum_levels[window.cells] == MOST_LEVELS
            gained = np.where(full, np.maximum(gained, layer.largest_levels[window.cells]), gained)
        self._seabed.learn(window.within(self._place), -np.expm1(-NATS_PER_LEVEL * np.maximum(gained, 0.0)), typical)

    def now(self) -> Expectation:
        """What is expected by all that was heard. Ground ahead of the survey is told of once every primary that
        surveys has said its plan."""
        fleet, rho, cells = self._fleet, self._fleet.map.rho, self._place.cells
        tracks = self._tracks.of(fleet.primaries)
        told = self._told(surveys=True)
        share, helpers_share = self._seabed.shares(told, tracks.flown)
        told += self._told(surveys=False)
        nats = np.multiply(share, tracks.ahead)
        nats += told
        look = np.minimum(self._p_detect * helpers_share, HIGHEST_P_DETECT)
        if rho > 0:  # the largest single look counts for more, and of another what it adds to that
            largest = np.maximum(NATS_PER_LEVEL * fleet.map.largest(cells), share * tracks.largest_ahead)
            nats = largest * rho + nats * (1 - rho)
            look_nats = -np.log1p(-look)
            look = -np.expm1(-np.maximum(look_nats - largest, 0.0) * rho - look_nats * (1 - rho))
        settled = fleet.map.settled_by(fleet.primaries, cells)
        hot, told_risk = self.hotspots.drawn()
        risk = rounded(np.exp(np.negative(nats, out=nats), out=nats))
        np.copyto(risk, told_risk, where=hot & ~(settled | (told > 0)))
        is_seen = settled | hot
        plans_are_known = all(one.plan is not None for one in fleet.primaries.values())
        risk *= self._inside if plans_are_known else self._inside & is_seen
        return Expectation(risk=risk, look=rounded(look), is_seen=is_seen)

    def _told(self, *, surveys: bool) -> FloatArray:
        """-ln(1 - P_d) of all looks so far, summed over those of primaries, or of who does not survey."""
        map_, primaries = self._fleet.map, self._fleet.primaries
        vehicles = [name for name in map_.layers if (name in primaries) == surveys]
        nats: FloatArray = map_.sums(self._place.cells, vehicles) * np.float64(NATS_PER_LEVEL)
        return nats
