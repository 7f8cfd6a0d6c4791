"""An upper bound on the risk that any schedule of second looks could have removed.

The model. Helpers fly straight legs along the grid, every cell's width, from any row to any other, in any number and
order, and see what lies in their swath; a look at a cell counts once the cell is released. What is relaxed:

- A leg is cut into crossings of single rows, each of which may be flown at a time of its own, from the release of the
  first cell in its swath on; all of its swath then counts.
- Between two legs flown in opposite directions a vehicle turns by half a circle at least and moves sideways by what
  lies between them: that takes at least `(pi - 2) r` more than the way sideways, and a run-in. One such turn is counted
  for each length of the area that is swept, less one a helper. The way to the first leg is free.
- Of the way sideways only that from the first leg to the farthest one is counted, and only for one helper.
- A third look at a place counts as one, however many came before.
- Helpers of one fleet are taken together; where they differ each counts as the best of them in everything.

The constraints that remain say that what is released after t is swept between t and the deadline, for a t every minute.
Priced by one multiplier each (a Lagrangian relaxation), they leave a packing of crossings in each row, which dynamic
programming solves exactly. For any multipliers the value is an upper bound; the least of these is sought by cutting
planes, with OR-tools' GLOP for the master problem.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from ortools.linear_solver import pywraplp

from bench.removable import Removable
from bench.row_packing import LOOKS, RowPacking
from bench.swath import Swath
from planner.types import FloatArray

STEP_S = 60.0
IN_OUT = 0.6  # how near to the best multipliers so far the next are tried
LEAST_PRICE = 1e-9
ENOUGH = 1e-4  # relative distance of the bound from the relaxation's optimum


@dataclass(frozen=True, eq=False)
class Bound:
    """`removed_m2`: no schedule removes more. `optimum_m2`: what the relaxation's own optimum is at least, so that more
    time would not bring the bound below. `price_m2ps`: what a second of a helper brings at the bound."""

    removed_m2: float
    optimum_m2: float
    price_m2ps: float
    iterations: int


@dataclass(frozen=True, eq=False)
class BestKind:
    """Each helper taken for the best of them in speed, turn, swath and P_d. `crossing_s`: a row's share of all that
    takes time; `turn_s`: the part of it that a turn takes beyond the way sideways."""

    count: int
    speed_mps: float
    swath: Swath
    p_detect: FloatArray
    crossing_s: float
    turn_s: float


def best_kind(mission: Removable) -> BestKind:
    """The fleet as helpers of one kind."""
    helpers, grid = mission.helpers, mission.grid
    speed_mps = max(one.speed_mps for one in helpers)
    turn_m = min((math.pi - 2) * one.turn_radius_m + one.run_in_m for one in helpers)
    return BestKind(
        count=len(helpers),
        speed_mps=speed_mps,
        swath=Swath(max(one.sensor.swath.width for one in helpers)),
        p_detect=np.max([one.sensor.best for one in helpers], axis=0),
        crossing_s=grid.cell_m / speed_mps * (1 + turn_m / (grid.rows * grid.cell_m)),
        turn_s=turn_m / speed_mps,
    )


def upper_bound(mission: Removable, seconds: float) -> Bound:
    """The bound. The search for the best multipliers takes at most about so many seconds of wall time, and ends when
    they are found."""
    return Relaxation(mission).minimise(time.monotonic() + seconds)


class Relaxation:
    """The priced problem. Constraint k is about what is released from `from_s[k]` on."""

    def __init__(self, mission: Removable) -> None:
        self.mission = mission
        self.kind = kind = best_kind(mission)
        released_s = np.where(mission.inside, mission.released_s, np.inf)
        self.worth = np.where(released_s < mission.ends_s, mission.risk, 0.0) * mission.grid.cell_area_m2
        p = kind.p_detect
        self.packing = RowPacking([self.worth * p * (1 - p) ** look for look in range(LOOKS)], kind.swath)
        crossing_from_s = _least_within(released_s, kind.swath)
        self.flyable = crossing_from_s < mission.ends_s
        self.column_from_s = crossing_from_s.min(axis=0)
        first_s = float(crossing_from_s.min())
        later_s = np.arange(math.floor(first_s / STEP_S) + 1, mission.ends_s / STEP_S) * STEP_S
        self.from_s = np.append(first_s, later_s)
        # A crossing counts in the constraint of this number and in all before.
        self.constraint: NDArray[np.intp] = np.searchsorted(self.from_s, crossing_from_s, side="right") - 1
        budget_s = kind.count * (mission.ends_s - self.from_s + kind.turn_s)
        lost_s = np.array([self._lost_s(from_s) for from_s in self.from_s])
        self.free_s = budget_s[:, np.newaxis] - lost_s  # by constraint and farthest column

    def minimise(self, until_s: float) -> Bound:
        """Cutting planes with in-out separation, until that time of `time.monotonic`."""
        solver = pywraplp.Solver.CreateSolver("GLOP")
        # At this price of the first constraint nothing is worth a crossing.
        dearest = float(self.packing.alone.max()) / self.kind.crossing_s
        prices = [solver.NumVar(LEAST_PRICE, dearest, "") for _ in self.from_s]
        value = solver.NumVar(-solver.infinity(), solver.infinity(), "")
        solver.Minimize(value)
        tried = np.full(self.from_s.size, LEAST_PRICE)
        tried[0] = dearest / 2
        best_prices, best, optimum, iterations = tried, math.inf, 0.0, 0
        while not iterations or (time.monotonic() < until_s and best - optimum > ENOUGH * best):
            iterations += 1
            bound, slope = self.evaluate(tried)
            if bound < best:
                best, best_prices = bound, tried
            cut = solver.Constraint(bound - float(slope @ tried), solver.infinity())
            cut.SetCoefficient(value, 1.0)
            for price, by in zip(prices, slope.tolist(), strict=True):
                cut.SetCoefficient(price, -by)
            if solver.Solve() != pywraplp.Solver.OPTIMAL:
                break
            optimum = max(optimum, value.solution_value())
            at_master = np.array([price.solution_value() for price in prices])
            tried = IN_OUT * best_prices + (1 - IN_OUT) * at_master
        everything = float(self.worth.sum())
        return Bound(min(best, everything), min(optimum, everything), float(best_prices.sum()), iterations)

    def evaluate(self, prices: FloatArray) -> tuple[float, FloatArray]:
        """The value at these prices, above 0, and its slope there."""
        price = np.where(self.flyable, self.kind.crossing_s * np.cumsum(prices)[self.constraint], np.inf)
        packed = self.packing.solve(price)
        value = packed.best_to.sum(axis=1) + prices @ self.free_s
        far = int(np.where(self.flyable.any(axis=0), value, -np.inf).argmax())
        used_s = np.zeros(self.from_s.size)
        for row in range(self.packing.rows):
            np.add.at(used_s, self.constraint[row, packed.crossings(row, far)], self.kind.crossing_s)
        return float(value[far]), self.free_s[:, far] - np.cumsum(used_s[::-1])[::-1]

    def _lost_s(self, from_s: float) -> FloatArray:
        """By farthest column: the least time from `from_s` on that is spent waiting and on the way sideways."""
        lost = np.zeros(self.column_from_s.size)
        sideways_s = self.mission.grid.cell_m / self.kind.speed_mps
        earliest = np.maximum(self.column_from_s, from_s)
        for far in np.flatnonzero((self.column_from_s >= from_s) & (self.column_from_s < self.mission.ends_s)).tolist():
            waiting_s = np.minimum.accumulate(earliest[far::-1]) - from_s  # by the first leg's distance
            lost[far] = float((waiting_s + np.arange(far + 1) * sideways_s).min())
        return lost


def _least_within(values: FloatArray, swath: Swath) -> FloatArray:
    """The least value in the swath of a leg at each column."""
    padded = np.pad(values, ((0, 0), (swath.left, swath.right)), constant_values=np.inf)
    least: FloatArray = np.lib.stride_tricks.sliding_window_view(padded, swath.width, axis=1).min(axis=2)
    return least
