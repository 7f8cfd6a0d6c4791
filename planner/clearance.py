"""How many mines may be left: what a residual-risk map and the number of mines found say of those that were not.

Mines lie at random at an unknown density (a Poisson process), and a mine that lies in a cell is missed with the cell's
residual risk. Those found then tell of the density, and the density and the map of those left: with a gamma prior the
number left follows a negative binomial distribution. (Washburn, Search and Detection, and the chapter on mine
clearance in Washburn and Kress, Combat Modeling; the gamma-Poisson pair is that of any Bayesian textbook.)

A mine is found if it is on the list of mines. What was detected and is not listed, as it is more likely something else,
may be a mine all the same: each adds its chance to those left (the number of them follows a Poisson binomial
distribution), and all that was detected tells of the density.

That P(y) is known by few tracks alone makes the answer wider: all that looks have seen is taken for so much more or
less of it as the tracks differ from each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.contacts import ObjectsOnMap, are_listed
from planner.fleet_map import EVERYWHERE
from planner.types import BoolArray, DetectionCurve, FloatArray

PRIOR_MINES = 0.5
"""The gamma prior's shape, at a rate of 0: Jeffreys' prior of a Poisson process, half a mine found at any density."""
CAUTIOUS_MINES = 1.0
"""The same where a decision rests on it that few are left: one mine more than was found gives the upper limit of a
Poisson process' mean that holds at any density (F. Garwood, Biometrika 28, 1936)."""
UNKNOWN_SCATTER = 0.3
"""Taken for the spread of P(y) between tracks where fewer than two are known."""
NODES = 9
MOST_MINES = 100_000
LOW, HIGH = 0.05, 0.95
NOTHING = np.zeros(0)


@dataclass(frozen=True)
class MinesLeft:
    """How many mines are left somewhere: the `mean`, the 90 % interval from `low` to `high`, and the chance that there
    is `none`. `found`: how many are expected to be mines of all that is listed as one, there or elsewhere; `clearance`:
    the share of all mines there that is expected to have been found, [0, 1]. `reached`: the chances of at most 0, 1, 2
    and so on."""

    found: float
    mean: float
    low: int
    high: int
    none: float
    clearance: float
    reached: FloatArray = field(compare=False, repr=False)

    def chance_of_at_most(self, number: float) -> float:
        """With which chance no more than so many are left; of less than none 0."""
        return float(self.reached[min(math.floor(number), len(self.reached) - 1)]) if number >= 0 else 0.0

    def at_most_with(self, chance: float) -> int:
        """The least number of which no more are left with a chance in [0, 1]."""
        return min(int(np.searchsorted(self.reached, chance)), len(self.reached) - 1)


def mines_left(
    risk: FloatArray,
    searched: BoolArray,
    place: BoolArray,
    cell_area_m2: float,
    found: float,
    scatter: float,
    weights: FloatArray | float = 1.0,
    prior_mines: float = PRIOR_MINES,
    unlisted: FloatArray = NOTHING,
    there: FloatArray | float = 1.0,
) -> MinesLeft | None:
    """The mines left in the cells of `place`, given how many were `found` in those that were `searched`; None where
    nothing was seen, and nothing can be said.

    `risk`: residual risk by cell, in [0, 1]. `scatter`: relative standard deviation of what looks are taken to have
    seen, see `scatter_of`. `weights`: how much denser mines lie in some cells than in others. `prior_mines`: see
    PRIOR_MINES. `unlisted`: the chance to be a mine, in [0, 1], of each object that was detected and does not count as
    found, shape (objects,); `there`: how much of each lies in the place, [0, 1].

    Raises ValueError for a number found, or a scatter, that is negative or not finite.
    """
    if not (0.0 <= found < math.inf and 0.0 <= scatter < math.inf):
        raise ValueError(f"found and scatter must be at least 0 and finite, not {found} and {scatter}")
    nodes, shares = np.polynomial.hermite_e.hermegauss(NODES)
    chances, means, cleared, kept = np.zeros(1), 0.0, 0.0, 0.0
    shares = shares / shares.sum()
    shape, unlisted_there = found + float(unlisted.sum()) + prior_mines, unlisted * there
    area = np.broadcast_to(np.asarray(weights, dtype=np.float64) * cell_area_m2, risk.shape)
    for node, share in zip(nodes.tolist(), shares.tolist(), strict=True):
        missed = risk ** max(0.0, 1.0 + scatter * node)
        seen_m2 = float(((1.0 - missed) * area)[searched].sum())
        left_m2 = float((missed * area)[place].sum())
        if seen_m2 <= 0.0:
            if scatter == 0.0 or node == 0.0:
                return None
            continue
        kept += share
        expected = shape * left_m2 / seen_m2
        chances = _sum(chances, share * _negative_binomial(shape, expected))
        means += share * expected
        detected = shape * float(((1.0 - missed) * area)[place].sum()) / seen_m2
        all_there = detected + expected
        cleared += share * (max(0.0, detected - float(unlisted_there.sum())) / all_there if all_there > 0.0 else 1.0)
    for chance in unlisted_there.tolist():
        chances = np.append(chances * (1.0 - chance), 0.0) + np.append(0.0, chances * chance)
    total = float(chances.sum())
    reached = chances.cumsum() / total
    return MinesLeft(
        found=found,
        mean=means / kept + float(unlisted_there.sum()),
        low=int(np.searchsorted(reached, LOW)),
        high=int(np.searchsorted(reached, HIGH)),
        none=float(chances[0]) / total,
        clearance=cleared / kept,
        reached=reached,
    )


def mines_left_by(
    objects: ObjectsOnMap,
    inside: BoolArray,
    scatter: float,
    place: FloatArray | None = None,
    prior_mines: float = PRIOR_MINES,
) -> MinesLeft | None:
    """The same by what a fleet has detected and by its map, of the area's cells, `inside`, or of a `place`, so much of
    each cell, 0 or more; from the number of cells that have each level, as there are few levels and many cells. An
    object lies in a place by as much as its cell does. None where there is no map yet."""
    map_ = objects.map
    if map_ is None:
        return None
    seen, chances = objects.known()
    mines, there = chances[:, 0], np.ones(seen.x_m.shape)
    is_listed = are_listed(mines)
    if place is not None:
        rows, columns = map_.grid.cells_of(seen.x_m, seen.y_m)
        there = place[np.clip(rows, 0, map_.grid.rows - 1), np.clip(columns, 0, map_.grid.columns - 1)]
        there = np.minimum(there, 1.0)
    levels, risk = map_.levels_within(EVERYWHERE, map_.layers)
    weights = np.bincount(levels[inside], minlength=risk.size).astype(np.float64)
    searched = in_place = np.ones(risk.size, dtype=np.bool_)
    if place is not None:
        some = place > 0.0
        weights = np.concatenate([weights, np.bincount(levels[some], place[some], minlength=risk.size)])
        risk, searched = np.tile(risk, 2), np.repeat([True, False], risk.size)
        in_place = ~searched
    return mines_left(
        *(risk, searched, in_place, map_.grid.cell_area_m2, float(mines[is_listed].sum()), scatter),
        *(weights, prior_mines, mines[~is_listed], there[~is_listed]),
    )


def scatter_of_all(vehicles: Iterable[Sequence[DetectionCurve]]) -> float:
    """The largest of what several vehicles' tracks tell, see `scatter_of`; with no vehicle `UNKNOWN_SCATTER`."""
    return max((scatter_of(curves) for curves in vehicles), default=UNKNOWN_SCATTER)


def scatter_of(curves: Sequence[DetectionCurve]) -> float:
    """The relative standard error of what looks have seen, by P(y) as several tracks have measured it: of the mean over
    tracks of -ln(1 - P(y)), integrated over range. With fewer than two `UNKNOWN_SCATTER`."""
    seen = np.array([np.trapezoid(-np.log1p(-one.p_detect), one.range_m) for one in curves])
    seen = seen[seen > 0.0]
    if len(seen) < 2:
        return UNKNOWN_SCATTER
    return float(seen.std(ddof=1) / seen.mean() / math.sqrt(len(seen)))


def _negative_binomial(shape: float, mean: float) -> FloatArray:
    """The chances of 0, 1, 2 and so on, of a mean, as far as they count."""
    if mean <= 0.0:
        return np.ones(1)
    miss = mean / (shape + mean)
    most = min(MOST_MINES, math.ceil(mean + 12.0 * math.sqrt(mean * (1.0 + mean / shape)) + 40.0))
    counts = np.arange(most)
    steps = np.log((shape + counts) / (counts + 1.0) * miss)
    logs = shape * math.log1p(-miss) + np.concatenate([[0.0], steps.cumsum()])
    return np.asarray(np.exp(logs))


def _sum(one: FloatArray, other: FloatArray) -> FloatArray:
    """The sum of two rows of which the shorter one ends in zeros."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total
