"""What a second look is worth, cell by cell, by what is to be brought down: the mean residual risk, that of the worst
30 % of the area, both, or the targets expected to be missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coordinator.cut.search import Counts, fly_each
from coordinator.cut.window import Window
from planner.compiled import compiled
from planner.types import BoolArray, FloatArray

WORST = 0.3  # share of the area


@dataclass(frozen=True)
class Objective:
    """What counts: `mean` times the mean residual risk and `worst` times that of the worst 30 % of the area."""

    mean: float
    worst: float


OBJECTIVES = {"mean": Objective(1.0, 0.0), "worst30": Objective(0.0, 1.0), "both": Objective(0.7, 0.3)}
# A cell's risk is the chance that a target there is missed, and weights say how thick targets lie: the share that is
# expected to be missed is the weighted mean.
OBJECTIVES["targets"] = OBJECTIVES["mean"]


@dataclass(frozen=True, eq=False)
class Ground:
    """The expected map as it is cut; arrays of grid shape.

    `risk`: residual risk expected to be left, 0 where no second look goes; `look`: the share of it that a look takes;
    `weights`: what a cell's risk counts, its area in m2 included; `is_seen`: where the risk rests on what was seen, and
    not on what is expected of tracks to come. `threshold`: residual risk above which a cell is expected to be of the
    worst 30 % in the end: what is above it, summed, is least for the right threshold and is then what the worst 30 %
    have beyond it (the conditional value at risk as Rockafellar and Uryasev write it, 2000).
    `contacts`, shape (2, rows, columns): what a look at the objects in a cell counts beside that (residual risk times
    m2), from a strip along the tracks and from one across; None where contacts count for nothing. Looked at once they
    count no more: what was found then tells anew. `goal_m2`: how much of each cell counts of what the mission's goal
    asks for; None where there is none.
    """

    risk: FloatArray
    look: FloatArray
    weights: FloatArray
    is_seen: BoolArray
    objective: Objective
    threshold: float
    contacts: FloatArray | None = None
    goal_m2: FloatArray | None = None

    def copy(self) -> Ground:
        """One that may be flown."""
        contacts = None if self.contacts is None else self.contacts.copy()
        return replace(self, risk=self.risk.copy(), contacts=contacts)

    @property
    def turned(self) -> Ground:
        """The same with rows and columns exchanged, so that what lies across the tracks runs up the rows. Flying the
        one flies the other."""
        return replace(
            self,
            risk=self.risk.T,
            look=self.look.T,
            weights=self.weights.T,
            is_seen=self.is_seen.T,
            contacts=None if self.contacts is None else self.contacts[::-1].transpose(0, 2, 1),
            goal_m2=None if self.goal_m2 is None else self.goal_m2.T,
        )

    def in_blocks(self, block: int) -> Ground:
        """The same by blocks of so many cells a side, of which the last may have fewer: what a look removes of a block,
        flown whole, is what it removes of its cells."""
        risk, look, weights, is_seen = _in_blocks(self.risk, self.look, self.weights, self.is_seen, block)
        return replace(
            self,
            risk=risk,
            look=look,
            weights=weights,
            is_seen=is_seen,
            contacts=None if self.contacts is None else np.stack([_sums(one, block) for one in self.contacts]),
            goal_m2=None if self.goal_m2 is None else _sums(np.where(self.risk > 0, self.goal_m2, 0.0), block),
        )

    def fly(self, window: Window, share: float = 1.0) -> None:
        """A look along a window is flown, or counts as if it were; `share`: as far as that, taken alike over all of
        it."""
        cells = window.cells
        risk = self.risk[cells]
        risk *= 1.0 - (self.look[cells] if share == 1.0 else share * self.look[cells])
        if self.contacts is not None:
            self.contacts[:, *cells] *= 1.0 - share

    def fly_each(
        self, windows: Sequence[Window], shares: Sequence[float] | float = 1.0, least_m2: Sequence[float] | float = -1.0
    ) -> FloatArray:
        """The same along windows, one after the other, but none that counts no more than its least, and what each of
        them brings: see `coordinator.cut.search.fly_each`."""
        bounds = np.array([one.bounds for one in windows], dtype=np.int64).reshape(-1, 4)
        its_shares = np.full(len(windows), shares, dtype=np.float64)
        its_least_m2 = np.full(len(windows), least_m2, dtype=np.float64)
        contacts = np.empty((0, *self.risk.shape)) if self.contacts is None else self.contacts
        return fly_each(
            self.risk, self.look, self.weights, self.is_seen, contacts, self.counts, bounds, its_shares, its_least_m2
        )

    def left_m2(self) -> float:
        """What is left of the objective (residual risk times m2): the worst 30 % as they are now, not by the
        threshold."""
        there = self.risk > 0
        risk, weights = self.risk[there], self.weights[there]
        left_m2 = self.objective.mean * float((weights * risk).sum())
        if self.objective.worst and risk.size:
            worst_from = _worst_from(risk)
            above_m2 = float((weights * np.maximum(risk - worst_from, 0.0)).sum())
            left_m2 += self.objective.worst * (worst_from * float(weights.sum()) + above_m2 / WORST)
        if self.contacts is not None:
            left_m2 += float(self.contacts.max(axis=0).sum())
        return left_m2

    def left_of_goal_m2(self) -> tuple[float, float]:
        """What is left where the mission's goal is (residual risk times m2), and how much of that is looked at, m2."""
        if self.goal_m2 is None:
            return 0.0, 0.0
        there = self.risk > 0
        return float((self.goal_m2 * self.risk).sum()), float(self.goal_m2[there].sum())

    def worst_from(self) -> float:
        """The residual risk from which on cells are of the worst of those that are looked at, as it is now."""
        risk = self.risk[self.risk > 0]
        return _worst_from(risk) if risk.size else 0.0

    @property
    def counts(self) -> Counts:
        """What a look counts in the objective."""
        return Counts(self.objective.mean, self.objective.worst / WORST, self.threshold)


def _worst_from(risk: FloatArray) -> float:
    """From which on these are of the worst, at least one: `numpy.quantile` tells the same, with more ado."""
    place = (risk.size - 1) * (1.0 - WORST)
    share, (low, high) = place - int(place), _in_order(risk, int(place))
    return low + (high - low) * share if share < 0.5 else high - (high - low) * (1 - share)


@compiled
def _in_blocks(
    risk: FloatArray, look: FloatArray, weights: FloatArray, is_seen: BoolArray, block: int
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """See `Ground.in_blocks`. Sums over a block are sums of those over its rows."""
    (rows, columns), size = risk.shape, (-(-risk.shape[0] // block), -(-risk.shape[1] // block))
    of_risk, of_look, of_weights = np.zeros(size), np.zeros(size), np.zeros(size)
    of_seen = np.empty(size, np.bool_)
    for at in np.ndindex(size):
        weight = at_risk = removed = seen = 0.0
        for row in range(at[0] * block, min((at[0] + 1) * block, rows)):
            its_weight = its_risk = its_removed = its_seen = 0.0
            for column in range(at[1] * block, min((at[1] + 1) * block, columns)):
                if risk[row, column] > 0:
                    counts = weights[row, column]
                    its_weight += counts
                    its_risk += counts * risk[row, column]
                    its_removed += counts * risk[row, column] * look[row, column]
                    its_seen += counts if is_seen[row, column] else 0.0
            weight, at_risk, removed, seen = (
                weight + its_weight,
                at_risk + its_risk,
                removed + its_removed,
                seen + its_seen,
            )
        of_weights[at], of_seen[at] = weight, seen > weight / 2
        if weight > 0:
            of_risk[at] = at_risk / weight
        if at_risk > 0:
            of_look[at] = removed / at_risk
    return of_risk, of_look, of_weights, of_seen


_in_blocks.called_with(lambda: (*np.ones((3, 1, 1)), np.ones((1, 1), dtype=np.bool_), 1))


def _sums(values: FloatArray, block: int) -> FloatArray:
    """Sums over blocks of cells."""
    rows, columns = (-(-size // block) for size in values.shape)
    padded = np.zeros((rows * block, columns * block))
    padded[: values.shape[0], : values.shape[1]] = values
    sums: FloatArray = np.zeros((rows, columns))
    for row in range(block):  # far faster than a sum over two axes of four
        of_row = padded[row::block, ::block].copy()
        for column in range(1, block):
            of_row += padded[row::block, column::block]
        sums += of_row
    return sums


BINS = 1024


@compiled
def _in_order(values: FloatArray, place: int) -> tuple[float, float]:
    """The value at a place, if they were put in order, and the next one, where there is one, else the same. Values are
    counted by bins, and then those of the bin in which it lies by finer ones, until all in it are alike: to order them
    takes two to four times as long."""
    before, following, counts, left = 0, np.inf, np.empty(BINS + 1, np.int64), values
    low, high = left.min(), left.max()
    while low < high and BINS / (high - low) < np.inf:  # of less apart there are none in a map
        bins_a_unit = BINS / (high - low)
        counts[:] = 0
        for value in left:
            counts[int((value - low) * bins_a_unit)] += 1
        number = 0
        while before + counts[number] <= place:
            before += counts[number]
            number += 1
        there, count = np.empty(counts[number]), 0
        for value in left:
            its_number = int((value - low) * bins_a_unit)
            if its_number == number:
                there[count] = value
                count += 1
            elif its_number > number:
                following = min(following, value)
        left, low, high = there, there.min(), there.max()
    return low, low if place + 1 < before + left.size or following == np.inf else following


_in_order.called_with(lambda: (np.zeros(1), 0))
