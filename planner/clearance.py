"""How many mines may be left: what a residual-risk map and the number of mines found say of those that were not.

Mines lie at random at an unknown density (a Poisson process), and a mine that lies in a cell is missed with the cell's
residual risk. Those found then tell of the density, and the density and the map of those left: with a gamma prior the
number left follows a negative binomial distribution. (Washburn, Search and Detection, and the chapter on mine
clearance in Washburn and Kress, Combat Modeling; the gamma-Poisson pair is that of any Bayesian textbook.)

A mine is found if it is on the list of mines. What was detected and is not listed, as it is more likely something else,
may be a mine all the same: each adds its chance to those left (the number of them follows a Poisson binomial
distribution), and all that was detected tells of the density.

That P(y) is known by few tracks alone makes the answer wider: all that looks have seen is taken for so much more or
less of it, by a log-normal distribution of mean 1, as the tracks differ from each other.
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
"""So many and more are told as one number."""
LOW, HIGH = 0.05, 0.95
DECIMALS = 9
"""Of a chance or a number of mines: last bits hang on the processor."""
NOTHING = np.zeros(0)


@dataclass(frozen=True)
class MinesLeft:
    """How many mines are left somewhere: the `mean`, the 90 % interval from `low` to `high`, and the chance that there
    is `none`. `clearance`: the share of all mines there that is expected to have been found, [0, 1]. `reached`: the
    chances of at most 0, 1, 2 and so on. `listed`: the chance to be a mine of each object that counts as found, there
    or elsewhere."""

    mean: float
    low: int
    high: int
    none: float
    clearance: float
    reached: FloatArray = field(compare=False, repr=False)
    listed: FloatArray = field(compare=False, repr=False)

    @property
    def found(self) -> float:
        """How many are expected to be mines of all that is listed as one."""
        return float(self.listed.sum())

    def chance_of_clearance(self, share: float) -> float:
        """With which chance at least so large a share, in (0, 1], of all mines is found: of those listed that are mines
        and of those left, which may be few or many each for themselves. Of no mine at all everything is found."""
        found = _poisson_binomial(self.listed)
        may_be_left = np.floor(np.round(np.arange(len(found)) * (1.0 / share - 1.0), DECIMALS))
        at = np.minimum(may_be_left, len(self.reached) - 1.0).astype(np.intp)
        return float((found * self.reached[at]).sum())

    def clearance_with(self, chance: float) -> float:
        """The largest share of which `chance_of_clearance` tells at least this chance, in (0, 1)."""
        found, left = _poisson_binomial(self.listed), np.diff(self.reached, prepend=0.0)
        some, others = np.flatnonzero(found > NEVER), np.flatnonzero(left > NEVER)
        all_there = np.maximum(some[:, np.newaxis] + others, 1)
        shares = np.where(others == 0, 1.0, some[:, np.newaxis] / all_there).ravel()
        order = np.argsort(-shares, kind="stable")
        chances = np.outer(found[some], left[others]).ravel()[order].cumsum()
        at = int(np.searchsorted(np.round(chances, DECIMALS), chance))
        return float(shares[order[min(at, len(order) - 1)]])


NEVER = 1e-12  # how likely it is that an unlikely number counts for nothing


def mines_left(
    risk: FloatArray,
    searched: BoolArray,
    place: BoolArray,
    cell_area_m2: float,
    listed: FloatArray,
    scatter: float,
    weights: FloatArray | float = 1.0,
    prior_mines: float = PRIOR_MINES,
    unlisted: FloatArray = NOTHING,
    there: FloatArray | float = 1.0,
) -> MinesLeft | None:
    """The mines left in the cells of `place`, given what was found in those that were `searched`; None where nothing
    was seen, and nothing can be said.

    `risk`: residual risk by cell, in [0, 1]. `listed`: the chance to be a mine, in [0, 1], of each object that counts
    as found, shape (objects,); `unlisted`: the same of each that was detected and does not; `there`: how much of each
    of these lies in the place, [0, 1]. `scatter`: relative standard deviation of what looks are taken to have seen, see
    `scatter_of`. `weights`: how much denser mines lie in some cells than in others. `prior_mines`: see PRIOR_MINES.

    Raises ValueError for a chance that is none, and for a scatter that is negative or not finite.
    """
    if not 0.0 <= scatter < math.inf:
        raise ValueError(f"scatter must be at least 0 and finite, not {scatter}")
    if not all(((one >= 0.0) & (one <= 1.0)).all() for one in (listed, unlisted)):  # a NaN is not, either
        raise ValueError("what is listed, or is not, must be a mine with a chance from 0 to 1")
    nodes, shares = np.polynomial.hermite_e.hermegauss(NODES)
    exponents = np.exp(scatter * nodes - scatter**2 / 2.0)
    chances, mean, cleared = np.zeros(1), 0.0, 0.0
    unlisted_there = unlisted * there
    shape, unlisted_left = float(listed.sum() + unlisted.sum()) + prior_mines, float(unlisted_there.sum())
    area = np.broadcast_to(np.asarray(weights, dtype=np.float64) * cell_area_m2, risk.shape)
    with np.errstate(divide="ignore"):
        logs = np.log(risk)
    for exponent, share in zip(exponents.tolist(), (shares / shares.sum()).tolist(), strict=True):
        missed_m2, seen_m2 = np.exp(exponent * logs) * area, -np.expm1(exponent * logs) * area
        searched_m2 = float(seen_m2[searched].sum())
        if searched_m2 <= 0.0:
            return None
        expected = shape * float(missed_m2[place].sum()) / searched_m2
        chances = _sum(chances, share * _negative_binomial(shape, expected))
        mean += share * expected
        detected = shape * float(seen_m2[place].sum()) / searched_m2
        all_there = detected + expected
        cleared += share * (max(0.0, detected - unlisted_left) / all_there if all_there > 0.0 else 1.0)
    reached = np.minimum(np.convolve(chances, _poisson_binomial(unlisted_there)).cumsum(), 1.0)
    return MinesLeft(
        mean=mean + unlisted_left,
        low=int(np.searchsorted(reached, LOW)),
        high=int(np.searchsorted(reached, HIGH)),
        none=float(reached[0]),
        clearance=cleared,
        reached=reached,
        listed=listed,
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
        *(risk, searched, in_place, map_.grid.cell_area_m2, mines[is_listed], scatter),
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
    """The chances of 0, 1, 2 and so on, of a mean, as far as they count; the last one is of so many and more."""
    if mean <= 0.0:
        return np.ones(1)
    miss = mean / (shape + mean)
    most = min(MOST_MINES, math.ceil(mean + 12.0 * math.sqrt(mean * (1.0 + mean / shape)) + 40.0))
    counts = np.arange(most)
    steps = np.log((shape + counts) / (counts + 1.0) * miss)
    chances = np.exp(shape * math.log1p(-miss) + np.concatenate([[0.0], steps.cumsum()]))
    chances[-1] += max(0.0, 1.0 - float(chances.sum()))
    return np.asarray(chances)


def _poisson_binomial(chances: FloatArray) -> FloatArray:
    """The chances that 0, 1, 2 and so on of some things are so, each with its own chance."""
    unsure = chances[(chances > 0.0) & (chances < 1.0)]
    most = min(len(unsure), math.ceil(unsure.sum() + 12.0 * math.sqrt((unsure * (1.0 - unsure)).sum()) + 40.0))
    numbers = np.zeros(1 + most)
    numbers[0] = 1.0
    for chance in unsure.tolist():
        more = numbers[:-1] * chance
        numbers *= 1.0 - chance
        numbers[1:] += more
    return np.concatenate([np.zeros(int((chances >= 1.0).sum())), numbers])


def _sum(one: FloatArray, other: FloatArray) -> FloatArray:
    """The sum of two rows of which the shorter one ends in zeros."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total
