"""Where a second look is worth flying to, and what is still to come: from the hotspots, the fleet's map, what helpers
have found, and what the primaries are about to settle. Cut anew is only where something has changed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from comms.said.messages import Hotspot
from coordinator.cut.ground import BadlySeen, ExpectedLooks, Growth, Place, Revision, TrackUnderWay
from coordinator.cut.strips import Cut, CuttingRules, cut_strips, stretches
from coordinator.cut.window import Window
from planner.fleet_map import FleetMap
from planner.risk import NATS_PER_LEVEL
from planner.types import BoolArray, FloatArray, GridSpec

RISK_STEP = 0.05
"""Worth is told in steps, so that it does not change with every look."""


def worth_risk(risk: FloatArray, cells: float, least_weight: float = 1.0) -> float:
    """Residual risk from which a cell is worth a second look, if helpers have time for so many: rounded down to a step,
    at least one, of what counts least. `risk`: as it counts, of the cells that may be worth one."""
    count = int(cells)
    least_step = RISK_STEP * least_weight
    if count >= risk.size:
        return least_step
    least = float(np.partition(risk, risk.size - 1 - count)[risk.size - 1 - count])
    return max(least_step, int(least / RISK_STEP + 1e-9) * RISK_STEP)


@dataclass
class LastCut:
    """Remembers one cut at a time; before the first one all has changed."""

    grid: GridSpec
    _arrays: tuple[FloatArray | BoolArray, ...] = ()
    _rules: CuttingRules | None = None
    _claimed: frozenset[Window] = frozenset()

    def changed_columns(
        self,
        risk: FloatArray,
        open_cells: BoolArray,
        growth: Growth,
        rules: CuttingRules,
        claimed: Iterable[Window],
    ) -> BoolArray:
        """Columns, shape (columns,), with a cell whose risk, settling or strip is another than at the last cut, and
        those two swaths beside; all of them where the rules are others.

        `claimed`: the windows that are a strip's, or will be; where one has gone its cells have changed. Remembers
        the arrays and the rules.
        """
        arrays = (risk, open_cells, growth.risk, growth.settles_s, growth.descending)
        if rules != self._rules:
            self._arrays, self._rules = arrays, rules
            return np.ones(self.grid.columns, dtype=np.bool_)
        changed = np.zeros(self.grid.shape, dtype=np.bool_)
        for now, before in zip(arrays, self._arrays, strict=True):
            changed |= now != before
        found = np.zeros(self.grid.columns, dtype=np.bool_)
        found |= changed.any(axis=0)
        for window in self._claimed.difference(claimed):
            found[window.columns] = True
        self._arrays = arrays
        reach = 2 * rules.columns(self.grid)
        columns = np.zeros_like(found)
        for stretch in stretches(found):
            columns[max(0, stretch.start - reach) : stretch.stop + reach] = True
        return columns

    def remember(self, claimed: Iterable[Window]) -> None:
        """Remembers the windows that are a strip's, or will be, after the cut."""
        self._claimed = frozenset(claimed)


@dataclass(frozen=True, eq=False)
class Ground:
    """The area as it was at one time. `columns`: those to be cut anew; for the other arrays see `cut_strips`."""

    columns: BoolArray
    risk: FloatArray
    open_cells: BoolArray
    growth: Growth


class Cutter:
    """Cuts the area again and again, each time only where something has changed.

    `inside`: the area's cells, shape of the map's grid. `rules`: their `worth_risk` is the most that it may become; it
    falls where helpers have time for more than is badly seen. `weights`: how many times a cell's risk counts
    when strips are compared.
    """

    def __init__(self, fleet: FleetMap, inside: BoolArray, rules: CuttingRules, weights: FloatArray) -> None:
        self.rules = rules
        self._weights = weights
        self._least_weight = min(1.0, float(weights[weights > 0].min(initial=1.0)))
        self.more_to_come = 0.0
        """Area that is still to settle, as a multiple of what has."""
        self._most_worth_risk = rules.worth_risk
        self._fleet = fleet
        self._inside = inside
        self._inside_cells = int(inside.sum())
        self._badly_seen = BadlySeen(fleet.grid, inside)
        self._expected_looks = ExpectedLooks(fleet.grid)
        self._last_cut = LastCut(fleet.grid)

    def hear_hotspot(self, place: Place, revision: Revision, message: Hotspot) -> bool:
        """Hears a hotspot's newest word; returns whether it was news."""
        return self._badly_seen.hear(place, revision, message)

    def learn(self, window: Window, helper: str, typical: float) -> None:
        """Learns what second looks find, from what a helper that has swept a window has told of it.

        `typical`: its P_d as the run tells it.
        """
        layer = self._fleet.layers.get(helper)
        if layer is not None:
            p_detect = -np.expm1(-NATS_PER_LEVEL * layer.largest_levels[window.cells].astype(np.float64))
            self._expected_looks.learn(window, p_detect, typical)

    def assess(
        self, primaries: Mapping[str, TrackUnderWay | None], sweeps_m2: float, claimed: Sequence[Window]
    ) -> Ground:
        """Assesses the area as it is now: what is badly seen, what still grows, and what a look must bring.

        `primaries`: the track that each flies. `sweeps_m2`: what helpers have time for until the mission ends, infinite
        while nobody can tell. `claimed`: the windows that are a strip's, or will be.
        """
        fleet, inside = self._fleet, self._inside
        settled = fleet.settled_by(primaries)
        risk = self._badly_seen.risk(fleet, settled)
        risk = risk * self._expected_looks.factor(risk)
        open_cells = self._badly_seen.still_open(fleet.told_by(primaries), settled)
        growth = Growth.none(fleet.grid)
        for name, under_way in primaries.items():
            if under_way is not None and name in fleet.layers:
                growth.add(fleet.grid, inside, risk, fleet.layers[name], under_way)
        ahead = int((inside & ~settled & (growth.settles_s == 0)).sum())
        self.more_to_come = ahead / max(1, self._inside_cells - ahead)
        if math.isfinite(sweeps_m2):
            cells = sweeps_m2 / fleet.grid.cell_area_m2 / (1.0 + self.more_to_come)
            counts = risk * self._weights
            marginal = worth_risk(counts[counts > 0], cells, self._least_weight)
            worth = min(self._most_worth_risk, marginal)
            self.rules = replace(self.rules, worth_risk=worth, marginal_risk=marginal)
        columns = self._last_cut.changed_columns(risk, open_cells, growth, self.rules, claimed)
        return Ground(columns, risk, open_cells, growth)

    def cut(self, ground: Ground, claimed: Sequence[Window]) -> list[Cut]:
        """The strips in the columns to be cut anew, best first; `claimed`: windows that are a strip's already."""
        return cut_strips(
            self._fleet.grid,
            ground.risk,
            ground.open_cells,
            self.rules,
            claimed,
            ground.growth,
            ground.columns,
            self._weights,
        )

    def remember(self, claimed: Sequence[Window]) -> None:
        """Remembers the windows that are a strip's, or will be, after the cut."""
        self._last_cut.remember(claimed)
