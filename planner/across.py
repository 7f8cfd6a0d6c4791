"""Residual risk across the tracks of one part of the area, and how to move tracks so that its worst 30 % is least.

Looked at is a line across the tracks, in bins of a metre. Risk is judged at as many places of it as the map has cells,
as the map judges it at its cells' centres; whether ground is seen at all, in each bin. Along the tracks all is taken as
alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from planner.types import DetectionCurve, FloatArray

MOST_BINS = 5000
"""Of a metre each, or of as many whole metres as it takes."""
WORST_SHARE = 0.3
"""Of the width: what a plan is judged by, as `planner.risk.RiskStatistics.worst30_mean` judges a survey."""
MEAN_WEIGHT = 0.01
"""Of the mean beside the worst 30 %, so that of plans alike in that the one that leaves less is taken."""
SHIFTS = np.array([shift for step in (1, 2, 4, 8, 16, 32) for shift in (-step, step)])
"""By how many bins tracks are moved at a time."""
MOST_ROUNDS = 40
"""Through all ways to move tracks. Up to seven are needed for the paper's area, two or three as a rule."""
MOST_MOVED = 10
"""Of the tracks to come so many are moved, those that are flown first; there is a next time for the others."""
COARSE = 8
"""Bins between the places tried for a track more."""
LEAST_GAIN = 1e-6
"""Of residual risk: what is better by less is taken as no better."""

LevelArray = NDArray[np.uint8]


class Measured(NamedTuple):
    """A track: its offset, its P(y), and the r_eff of that."""

    across_m: float
    curve: DetectionCurve
    r_eff_m: float


@dataclass(frozen=True)
class HelperLooks:
    """What helpers are expected to look at while one track is flown: `width_m` of the ground across the tracks, >= 0,
    over the length of a track, with `p_detect` in [0, 1)."""

    width_m: float = 0.0
    p_detect: float = 0.0


NOBODY = HelperLooks()


class Looked(NamedTuple):
    """What some tracks make of the width. `left`, `least`: of each cell the product of what their looks leave as far as
    these are independent, and the least of what they leave as far as they are not; the product of both is its risk
    (`planner.risk.residual_risk`). `seen`: the level of each bin. `tracks`: how many."""

    left: FloatArray
    least: FloatArray
    seen: LevelArray
    tracks: int


@dataclass(frozen=True, order=True)
class Worth:
    """How good tracks are, less is better: `lost_m`, the width that they see worse than asked, counts before `risk`,
    the mean of the worst 30 % with a little of the mean of all."""

    lost_m: float
    risk: float

    def is_better(self, than: Worth) -> bool:
        """By enough to tell."""
        return (self.lost_m, self.risk + LEAST_GAIN) < (than.lost_m, than.risk)


class Across:
    """A width with the tracks flown over it, and what tracks to come would make of it.

    `width_m`: > 0. `flown`: each track counts by its own P(y). `curve`, `r_eff_m`: P(y) of the tracks to come, and its
    r_eff; a place within it is seen better than one beyond. `cell_m`: of the map. `rho`: as for
    `planner.risk.residual_risk`. `helpers`: what they look at during each track. Tracks to come lie on whole bins:
    `bins` are their offsets in `step_m`, the width of a bin.
    """

    def __init__(
        self,
        width_m: float,
        flown: Sequence[Measured],
        curve: DetectionCurve,
        r_eff_m: float,
        cell_m: float,
        rho: float = 0.0,
        helpers: HelperLooks = NOBODY,
    ) -> None:
        self.step_m = max(1, math.ceil(width_m / MOST_BINS))
        self._bins = max(1, math.ceil(width_m / self.step_m))
        self._width_m, self._rho, self._helpers = width_m, rho, helpers
        # What a track leaves and sees, by how far to its right the first bin lies: rows are views of one table each.
        self._farthest = self._bins + math.ceil(float(curve.range_m[-1]) / self.step_m) + 1
        begin_m = np.arange(-self._farthest, self._farthest + self._bins, dtype=np.float64) * self.step_m
        cell = max(1, round(cell_m / self.step_m))
        missed = _missed(curve, begin_m)
        self._left, self._least = (
            sliding_window_view(missed**power, self._bins)[:, ::cell] for power in (1.0 - rho, rho)
        )
        self._levels = sliding_window_view(_levels(curve, begin_m, self.step_m, r_eff_m), self._bins)
        self._begin_m = np.arange(self._bins, dtype=np.float64) * self.step_m
        columns = [_missed(own, self._begin_m[::cell] - across_m) for across_m, own, _ in flown]
        all_left = np.ones(self._left.shape[1])
        self._flown = Looked(
            np.multiply.reduce([all_left, *columns]) ** (1.0 - rho),
            np.minimum.reduce([all_left, *columns]) ** rho,
            self._levels_of(flown),
            len(flown),
        )
        self._asked = self._flown.seen
        self._first, self._last = 0, math.floor(width_m / self.step_m)  # bins between which tracks may be moved

    def ask_for(self, tracks: Sequence[Measured]) -> None:
        """Whatever these tracks see is asked of every plan, whose tracks lie within the width or no farther outside
        than these do."""
        self._asked = self._levels_of(tracks)
        outermost_m = [0.0, self._width_m, *(one.across_m for one in tracks)]
        self._first = math.ceil(min(outermost_m) / self.step_m)
        self._last = math.floor(max(outermost_m) / self.step_m)

    def lost_m(self, tracks: Sequence[Measured]) -> float:
        """How much of what is asked is missed by the tracks flown and these."""
        seen = np.maximum(self._flown.seen, self._levels_of(tracks))
        return float(np.count_nonzero(seen < self._asked)) * self.step_m

    def _levels_of(self, tracks: Sequence[Measured]) -> LevelArray:
        seen: LevelArray = np.zeros(self._bins, dtype=np.uint8)
        for across_m, own, r_eff_m in tracks:
            seen = np.maximum(seen, _levels(own, self._begin_m - across_m, self.step_m, r_eff_m))
        return seen

    def worth(self, bins: Sequence[int]) -> Worth:
        """Of the tracks flown and these."""
        alone = np.zeros((1, 0), dtype=np.intp)
        looked = self._after(self._flown, bins)
        return Worth(float(self._lost_m(looked, alone)[0]), float(self._risk(looked, alone)[0]))

    def worst30(self, bins: Sequence[int]) -> float:
        """The mean residual risk over the worst 30 % of the width after the tracks flown and these, and what helpers
        are expected to look at."""
        left, least, _, tracks = self._after(self._flown, bins)
        return float(self._worst_and_mean((left * least)[np.newaxis], tracks)[0][0])

    def refined(self, bins: Sequence[int]) -> list[int]:
        """The tracks moved, one by one and several together, as long as that is better."""
        found = sorted(np.clip(np.array(bins, dtype=np.intp), self._first, self._last).tolist())
        worth = self.worth(found)
        movable = min(len(found), MOST_MOVED)
        moves, fixed = _moves(movable), self._after(self._flown, found[movable:])
        tried = in_vain = 0
        while in_vain < len(moves) and tried < MOST_ROUNDS * len(moves):
            group, shifts = moves[tried % len(moves)]
            others = self._after(fixed, [found[index] for index in range(movable) if index not in group])
            moved = np.clip(np.array([found[index] for index in group]) + shifts, self._first, self._last)
            best, its_worth = self._best(others, moved, worth)
            tried, in_vain = tried + 1, in_vain + 1
            if its_worth.is_better(worth):
                worth, in_vain = its_worth, 0
                for index, place in zip(group, moved[best].tolist(), strict=True):
                    found[index] = place
        return sorted(found)

    def with_one_more(self, bins: Sequence[int]) -> list[int]:
        """These and the track beside them that is worth most."""
        places = np.arange(self._first, self._last + 1, COARSE)[:, np.newaxis]
        best, _ = self._best(self._after(self._flown, bins), places, Worth(math.inf, math.inf))
        return sorted([*bins, int(places[best, 0])])

    def with_one_less(self, bins: Sequence[int]) -> list[int]:
        """All of these but the one that is worth least."""
        fewer = [[*bins[:place], *bins[place + 1 :]] for place in range(len(bins))]
        worths = [self.worth(one) for one in fewer]
        return fewer[min(range(len(fewer)), key=lambda place: (worths[place].lost_m, worths[place].risk))]

    def _best(self, others: Looked, tried: NDArray[np.intp], than: Worth) -> tuple[int, Worth]:
        """Which row of tracks tried, shape (rows, tracks), is worth most together with the others, and how much; of
        those alone that may be better than so much."""
        risk = self._risk(others, tried)
        rows = np.arange(len(tried)) if than.lost_m else np.flatnonzero(risk + LEAST_GAIN < than.risk)
        if not rows.size:
            return 0, than
        lost_m = self._lost_m(others, tried[rows])
        best = int(np.lexsort((risk[rows], lost_m))[0])
        return int(rows[best]), Worth(float(lost_m[best]), float(risk[rows[best]]))

    def _after(self, looked: Looked, bins: Sequence[int]) -> Looked:
        """What these tracks make of it."""
        places = self._places(np.array(bins, dtype=np.intp))
        least = np.minimum(looked.least, self._least[places].min(axis=0, initial=1.0)) if self._rho else looked.least
        return Looked(
            looked.left * self._left[places].prod(axis=0),
            least,
            np.maximum(looked.seen, self._levels[places].max(axis=0, initial=0)),
            looked.tracks + len(bins),
        )

    def _risk(self, others: Looked, tried: NDArray[np.intp]) -> FloatArray:
        """`Worth.risk` of the others together with each row of tracks tried, shape (rows,)."""
        places = self._places(tried)
        risk = self._left[places].prod(axis=1) * others.left
        if self._rho:
            risk *= np.minimum(self._least[places].min(axis=1, initial=1.0), others.least)
        worst, mean = self._worst_and_mean(risk, others.tracks + tried.shape[1])
        together: FloatArray = worst + MEAN_WEIGHT * mean
        return together

    def _lost_m(self, others: Looked, tried: NDArray[np.intp]) -> FloatArray:
        """`Worth.lost_m` of the others together with each row of tracks tried, shape (rows,)."""
        seen = np.maximum(self._levels[self._places(tried)].max(axis=1, initial=0), others.seen)
        lost_m: FloatArray = np.count_nonzero(seen < self._asked, axis=1).astype(np.float64) * self.step_m
        return lost_m

    def _places(self, bins: NDArray[np.intp]) -> NDArray[np.intp]:
        """The rows of the tables for tracks at these bins; who lies farther out sees nothing."""
        return np.minimum(np.maximum(self._farthest - bins, 0), 2 * self._farthest)

    def _worst_and_mean(self, risk: FloatArray, tracks: int) -> tuple[FloatArray, FloatArray]:
        """Of each row, whose order is lost, with what helpers look at while so many tracks are flown: where most is
        left."""
        bins = risk.shape[1]
        if self._helpers.width_m > 0.0:
            times, rest = divmod(self._helpers.width_m * tracks / (self._bins * self.step_m), 1.0)
            left = (1.0 - self._helpers.p_detect) ** (1.0 - self._rho)
            risk *= left**times
            helped = round(rest * bins)
            if 0 < helped < bins:
                risk.partition(bins - helped, axis=1)
            risk[:, bins - helped :] *= left
        worst = max(1, round(WORST_SHARE * bins))
        risk.partition(bins - worst, axis=1)
        return risk[:, bins - worst :].sum(axis=1) / worst, risk.sum(axis=1) / bins


@lru_cache(maxsize=MOST_MOVED + 1)
def _moves(count: int) -> list[tuple[tuple[int, ...], NDArray[np.intp]]]:
    """Ways to move so many tracks: which, and by how many bins each, shape (tries, tracks)."""
    each = np.arange(count)
    patterns = {tuple((each == place).astype(float)) for place in range(count)}
    patterns |= {tuple(((each == place) | (each == place + 1)).astype(float)) for place in range(count)}
    patterns |= {tuple((each >= place).astype(float)) for place in range(count)}
    patterns |= {tuple(np.maximum(0.0, (each - place + 1) / (count - place))) for place in range(count)}
    patterns |= {tuple(((each >= place) & ((each - place) % 2 == 0)).astype(float)) for place in range(count)}
    moves = []
    for pattern in sorted(patterns, reverse=True):
        group = tuple(index for index in range(count) if pattern[index])
        shifts = np.rint(np.outer(SHIFTS, [pattern[index] for index in group])).astype(np.intp)
        moves.append((group, shifts))
    return moves


def _missed(curve: DetectionCurve, beside_m: FloatArray) -> FloatArray:
    """1 - P_d at these distances from a track, less than 0 to its left."""
    return 1.0 - curve.at(np.abs(beside_m))


def _levels(curve: DetectionCurve, begin_m: FloatArray, step_m: float, r_eff_m: float) -> LevelArray:
    """How a track sees bins that begin so far beside it: 2 all of a bin within r_eff, 1 all of it, 0 not all."""
    ends = np.abs(begin_m), np.abs(begin_m + step_m)
    seen = (curve.at(ends[0]) > 0) & (curve.at(ends[1]) > 0)
    within = seen & (np.maximum(*ends) <= r_eff_m)
    return seen.astype(np.uint8) + within.astype(np.uint8)
