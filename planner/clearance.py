"""How many mines may be left: what a residual-risk map and the number of mines found say of those that were not.

Mines lie at random at an unknown density (a Poisson process), and a mine that lies in a cell is missed with the cell's
residual risk. Those found then tell of the density, and the density and the map of those left: with a gamma prior the
number left follows a negative binomial distribution. (Washburn, Search and Detection, and the chapter on mine
clearance in Washburn and Kress, Combat Modeling; the gamma-Poisson pair is that of any Bayesian textbook.)

A mine is found if it is on the list of mines. What was detected and is not listed, as it is more likely something else,
may be a mine all the same: each adds its chance to those left (the number of them follows a Poisson binomial
distribution), and all that was detected tells of the density. How many of it are mines is not sure, which makes the
answer wider: the gamma distribution is the one with the variance that the number left has with that.

That P(y) is known by few tracks alone makes it wider, too: all that looks have seen is taken for so much more or less
of it, by a log-normal distribution of mean 1, as the tracks differ from each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.contacts import ObjectsOnMap, SeenObjects, are_listed
from planner.types import EVERYWHERE, BoolArray, DetectionCurve, FloatArray, GridSpec

PRIOR_MINES = 0.5
"""The gamma prior's shape, at a rate of 0: Jeffreys' prior of a Poisson process, half a mine found at any density."""
CAUTIOUS_MINES = 1.0
"""The same where a decision rests on it that few are left: one mine more than was found gives the upper limit of a
Poisson process' mean that holds at any density (F. Garwood, Biometrika 28, 1936)."""
UNKNOWN_SCATTER = 0.3
"""Taken for the spread of P(y) between tracks where fewer than two are known."""
NODES = np.linspace(-6.0, 6.0, 31)
"""Of a standard normal distribution, near enough to each other that sums over them are integrals."""
SHARES = np.exp(-(NODES**2) / 2.0) / np.exp(-(NODES**2) / 2.0).sum()
MOST_SCATTER = 1.0
"""That of tracks of which all but one saw next to nothing."""
MOST_MINES = 100_000
"""So many and more are told as one number."""
LOW, HIGH = 0.05, 0.95
DECIMALS = 9
"""Of a chance or a number of mines: last bits hang on the processor."""


@dataclass(frozen=True)
class Detected:
    """What was detected, as it counts: with which chance each object is a mine, in [0, 1], whether it is listed as one,
    and how much of it lies in the place that is asked for, [0, 1]; shape (objects,). Raises ValueError for a chance
    that is none."""

    mines: FloatArray
    is_listed: BoolArray
    there: FloatArray | float = 1.0

    def __post_init__(self) -> None:
        if not ((self.mines >= 0.0) & (self.mines <= 1.0)).all():  # a NaN is not, either
            raise ValueError("an object must be a mine with a chance from 0 to 1")


@dataclass(frozen=True)
class MinesLeft:
    """How many mines are left somewhere: the `mean`, the 90 % interval from `low` to `high`, and the chance that there
    is `none`. `clearance`: the chance that a mine which lies there has been found, [0, 1]; it tells of the search, not
    of what happened to be found there. `reached`: the chances of at most 0, 1, 2 and so on. `listed`: with which chance
    each object that counts as found is a mine and lies there."""

    mean: float
    low: int
    high: int
    none: float
    clearance: float
    reached: FloatArray = field(compare=False, repr=False)
    listed: FloatArray = field(compare=False, repr=False)

    @property
    def found(self) -> float:
        """How many mines there are expected to be listed."""
        return float(self.listed.sum())

    def chance_of_clearance(self, share: float) -> float:
        """With which chance at least so large a share of all mines there is found: of those listed that are mines and
        of those left, each taken to be few or many by itself. Of no mine at all everything is found. Raises ValueError
        for a share that is not in (0, 1]."""
        if not 0.0 < share <= 1.0:
            raise ValueError(f"a share must be above 0 and at most 1, not {share}")
        return self._chance(share, _poisson_binomial(self.listed))

    def clearance_with(self, chance: float) -> float:
        """The largest share of which `chance_of_clearance` tells at least this chance, in (0, 1); to 9 decimals, and 0
        where it tells it of none."""
        found = _poisson_binomial(self.listed)

        def is_told(share: float) -> bool:
            return share <= 1.0 and round(self._chance(share, found), DECIMALS) >= chance

        low, high = 0.0, 1.0 + 2.0**-30
        while high - low > 2.0**-31:  # of `low` it is told, of `high` it is not
            share = (low + high) / 2.0
            low, high = (share, high) if is_told(share) else (low, share)
        share = round(low, DECIMALS)
        return share if share == 0.0 or is_told(share) else round(share - 10.0**-DECIMALS, DECIMALS)

    def _chance(self, share: float, found: FloatArray) -> float:
        may_be_left = np.floor(np.round(np.arange(len(found)) * (1.0 / share - 1.0), DECIMALS))
        at = np.minimum(may_be_left, len(self.reached) - 1.0).astype(np.intp)
        return min(1.0, float((found * self.reached[at]).sum()))


def mines_left(
    risk: FloatArray,
    searched: BoolArray,
    place: BoolArray,
    cell_area_m2: float,
    detected: Detected,
    scatter: float,
    weights: FloatArray | float = 1.0,
    prior_mines: float = PRIOR_MINES,
) -> MinesLeft | None:
    """The mines left in the cells of `place`, given what was `detected` in those that were `searched`; None where
    nothing was seen, and nothing can be said.

    `risk`: residual risk by cell, in [0, 1]. `scatter`: relative standard deviation of what looks are taken to have
    seen, see `scatter_of`, 0 to MOST_SCATTER. `weights`: how much denser mines lie in some cells than in others.
    `prior_mines`: see PRIOR_MINES.

    Raises ValueError for a scatter or a risk out of range.
    """
    if not 0.0 <= scatter <= MOST_SCATTER:
        raise ValueError(f"scatter must be from 0 to {MOST_SCATTER:g}, not {scatter}")
    if not ((risk >= 0.0) & (risk <= 1.0)).all():
        raise ValueError("risk must be from 0 to 1")
    mines, listed, there = detected.mines, detected.is_listed, np.broadcast_to(detected.there, detected.mines.shape)
    unlisted_there = (mines * there)[~listed]
    expected_mines = float(mines.sum()) + prior_mines
    unsure, unsure_left = float((mines * (1.0 - mines)).sum()), float((mines * (1.0 - mines) * there)[~listed].sum())
    area = np.broadcast_to(np.asarray(weights, dtype=np.float64) * cell_area_m2, risk.shape)
    with np.errstate(divide="ignore"):
        logs = np.log(risk)
    chances, mean, detects = np.zeros(1), 0.0, 0.0
    exponents = np.exp(scatter * NODES - scatter**2 / 2.0) if scatter > 0.0 else np.ones(1)
    shares = SHARES if scatter > 0.0 else np.ones(1)
    for exponent, share in zip(exponents.tolist(), shares.tolist(), strict=True):
        missed_m2, seen_m2 = np.exp(exponent * logs) * area, -np.expm1(exponent * logs) * area
        searched_m2 = float(seen_m2[searched].sum())
        if searched_m2 <= 0.0:
            return None
        missed_there_m2, seen_there_m2 = float(missed_m2[place].sum()), float(seen_m2[place].sum())
        by_one = missed_there_m2 / searched_m2  # so many are left for each that was detected
        # How many were detected is not sure, and each that is unlisted is left as well as those that it tells of.
        spread = expected_mines + unsure + (2.0 * unsure_left / by_one if by_one > 0.0 else 0.0)
        chances = _sum(chances, share * _negative_binomial(expected_mines**2 / spread, by_one * expected_mines))
        mean += share * by_one * expected_mines
        there_m2 = seen_there_m2 + missed_there_m2
        detects += share * (seen_there_m2 / there_m2 if there_m2 > 0.0 else 1.0)
    reached = np.minimum(np.convolve(chances, _poisson_binomial(unlisted_there)).cumsum(), 1.0)
    lists = (float(mines[listed].sum()) + prior_mines) / expected_mines
    return MinesLeft(
        mean=mean + float(unlisted_there.sum()),
        low=int(np.searchsorted(reached, LOW)),
        high=int(np.searchsorted(reached, HIGH)),
        none=float(reached[0]),
        clearance=min(1.0, detects) * lists,
        reached=reached,
        listed=(mines * there)[listed],
    )


def mines_left_by(
    objects: ObjectsOnMap,
    inside: BoolArray,
    scatter: float,
    place: FloatArray | None = None,
    prior_mines: float = PRIOR_MINES,
) -> MinesLeft | None:
    """The same by what a fleet has detected and by its map, of the area's cells, `inside`, or of a `place`, so much of
    each cell, 0 or more; from the number of cells that have each level, as there are few levels and many cells. Objects
    count that lie in the area as far as one can tell; in a place each by as much as its cell does. None where there is
    no map yet."""
    map_ = objects.map
    if map_ is None:
        return None
    seen, chances = objects.known()
    within = _lie_within(seen, inside, map_.grid)
    mines, there = chances[within, 0], np.ones(int(within.sum()))
    if place is not None:
        rows, columns = map_.grid.cells_of(seen.x_m[within], seen.y_m[within])
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
    detected = Detected(mines, are_listed(mines), there)
    return mines_left(risk, searched, in_place, map_.grid.cell_area_m2, detected, scatter, weights, prior_mines)


def _lie_within(seen: SeenObjects, inside: BoolArray, grid: GridSpec) -> BoolArray:
    """Which objects lie in the area, or no farther from it than one may be mistaken; shape (objects,)."""
    rows, columns = grid.cells_of(seen.x_m, seen.y_m)
    reach = np.ceil(seen.gate_m / grid.cell_m).astype(np.intp)
    found = []
    for row, column, by in zip(rows.tolist(), columns.tolist(), reach.tolist(), strict=True):
        low, high, west, east = (max(0, at) for at in (row - by, row + by + 1, column - by, column + by + 1))
        found.append(bool(inside[low:high, west:east].any()))
    return np.array(found, dtype=np.bool_)


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
    return min(MOST_SCATTER, float(seen.std(ddof=1) / seen.mean() / math.sqrt(len(seen))))


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
    rows = [np.array([1.0 - one, one]) for one in unsure.tolist()] or [np.ones(1)]
    while len(rows) > 1:  # by pairs, and pairs of these: many small sums are dear
        rows = [np.convolve(*pair) for pair in zip(rows[::2], rows[1::2], strict=False)] + rows[len(rows) // 2 * 2 :]
    return np.concatenate([np.zeros(int((chances >= 1.0).sum())), rows[0]])


def _sum(one: FloatArray, other: FloatArray) -> FloatArray:
    """The sum of two rows of which the shorter one ends in zeros."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total
