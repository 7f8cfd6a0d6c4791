"""An upper bound on the risk that any schedule of second looks could have removed.

The model. Helpers fly straight legs along the grid or across it, from anywhere to anywhere, in any number and order,
and see what lies in their swath; a look counts whenever it happens. Time allows a helper so many looks at cells:

- Within one bout a helper turns by less than a quarter from one leg to the next. It then never goes back, so that a
  bout's legs are together no longer than the longer side of the grid.
- A bout begins with a run-in, and between two bouts lies a quarter turn at least. All other ways are free.
- What a helper has swept when the deadline comes may be half a cell longer than it has flown: cells count whose middle
  is passed.

What is relaxed: those looks may fall on any cells at all, as if each were flown to by itself. At one price for a look,
each cell takes as many looks as are worth the price (a Lagrangian relaxation); for any price the value is an upper
bound, and the least of these is where as many looks are taken as there are. Where helpers differ, each look has the P_d
of the best of them at that cell, from its best place in the swath.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bench.removable import LegHelper, Removable
from planner.types import FloatArray

HALVINGS = 60


@dataclass(frozen=True)
class Bound:
    """`removed_m2`: no schedule removes more. `price_m2`: what one look at a cell brings at the bound."""

    removed_m2: float
    price_m2: float


def upper_bound(mission: Removable) -> Bound:
    """The least bound over all prices of a look."""
    looks = sum(most_looks(mission, helper) for helper in mission.helpers)
    worth_m2 = mission.risk * mission.grid.cell_area_m2
    p_detect = np.max([helper.best_p_detect for helper in mission.helpers], axis=0)
    there = (worth_m2 > 0) & (p_detect > 0)
    worth_m2, p_detect = worth_m2[there], p_detect[there]
    if not worth_m2.size:
        return Bound(0.0, 0.0)
    dearest, cheapest = float((worth_m2 * p_detect).max()), 0.0
    removed_m2 = float(worth_m2.sum())
    price = dearest
    for _ in range(HALVINGS):
        taken = _worth_taking(worth_m2, p_detect, price)
        gained_m2 = worth_m2 * (1 - (1 - p_detect) ** taken) - price * taken
        removed_m2 = min(removed_m2, price * looks + float(gained_m2.sum()))
        if taken.sum() > looks:
            cheapest = price
        else:
            dearest = price
        price = (cheapest + dearest) / 2
    return Bound(removed_m2, price)


def most_looks(mission: Removable, helper: LegHelper) -> float:
    """At how many cells a helper can look until the deadline, one that it looks at again counted again."""
    grid = mission.grid
    quarter_m = math.pi / 2 * helper.turn_radius_m
    longest_m = max(grid.shape) * grid.cell_m
    flown_m = helper.speed_mps * mission.ends_s + grid.cell_m / 2 + quarter_m
    swept_m = flown_m / (1 + (helper.run_in_m + quarter_m) / longest_m)
    return swept_m / grid.cell_m * max(sensor.swath.width for sensor in helper.sensors)


def _worth_taking(worth_m2: FloatArray, p_detect: FloatArray, price_m2: float) -> FloatArray:
    """How many looks at each cell bring more than the price: the next after n brings `worth p (1 - p)^n`."""
    first_m2 = worth_m2 * p_detect
    taken = np.ceil(np.log(price_m2 / first_m2) / np.log1p(-p_detect))
    return np.where(first_m2 > price_m2, np.maximum(taken, 0.0), 0.0)
