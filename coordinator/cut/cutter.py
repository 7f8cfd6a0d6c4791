"""Cuts as many strips as helpers have time for: the price of a metre flown is found at which they are just so many."""

from __future__ import annotations

from collections.abc import Sequence

from coordinator.cut.ground import Ground
from coordinator.cut.strips import Cut, CuttingRules, cut_windows
from coordinator.cut.window import Window
from planner.types import GridSpec

SPARE_STRIPS = 4  # so many more than helpers have time for, so that there is a choice to the end
STEP = 1.2  # by which the price is changed until they are so many
MOST_STEPS = 48  # more than from the least price to the highest there is
STAYS_FOR = 0.01  # share by which strips cut anew must be better than those that are open


class Cutter:
    """Remembers the price, which hardly changes from one cut to the next. `least_worth`: what a cell has to count for a
    look to be worth flying there whatever time there is, as a mean over a swath (residual risk times m2)."""

    def __init__(self, grid: GridSpec, rules: CuttingRules, least_worth: float) -> None:
        self.rules = rules
        self._grid = grid
        self._least_price = least_worth * rules.swath_m / grid.cell_area_m2
        self._price = self._least_price
        self.threshold = 0.0
        """Residual risk from which on a cell will be of the worst, see `Ground`."""

    def cut(self, ground: Ground, time_m: float, claimed: Sequence[Window], opened: Sequence[Window]) -> list[Cut]:
        """The strips worth flying, where helpers can fly `time_m` until the mission ends, infinite while nobody can
        tell.

        `claimed`: windows that are with a vehicle. `opened`: those of the open strips, which stay where they are if
        what is cut anew is hardly better.
        """
        left = ground.copy()
        for window in claimed:
            left.fly(window)
        if time_m <= 0:  # nobody can be sent any more: what is open is left as it is
            self._expect_worst(left, time_m, ())
            return _cuts(left, opened, self._grid.cell_area_m2)
        anew = _cuts(left, self._windows(left, time_m), self._grid.cell_area_m2)
        as_open = _cuts(left, opened, self._grid.cell_area_m2)
        suffices = self._metres(opened) >= min(
            self._enough_m(time_m, opened), self._metres([one.window for one in anew])
        )
        stays = suffices and self._profit(as_open) >= (1.0 - STAYS_FOR) * self._profit(anew)
        cuts = as_open if stays else anew
        self._expect_worst(left, time_m, cuts)
        return cuts

    def _expect_worst(self, left: Ground, time_m: float, cuts: Sequence[Cut]) -> None:
        """Finds from which residual risk on a cell will be of the worst, if helpers fly the best of the strips."""
        for cut in self._best_first(cuts):
            time_m -= self._metres([cut.window])
            if time_m < 0:
                break
            left.fly(cut.window)
        self.threshold = left.worst_from()

    def _windows(self, ground: Ground, time_m: float) -> list[Window]:
        """As many windows as there is time for, at the highest price at which they are, and behind them some to
        spare."""
        found = self._at(ground, self._price)
        for _ in range(MOST_STEPS):
            if self._metres(found) < time_m:
                if self._price <= self._least_price:
                    break
                self._price = max(self._least_price, self._price / STEP)
                found = self._at(ground, self._price)
            else:
                dearer = self._at(ground, self._price * STEP)
                if self._metres(dearer) < time_m:
                    break
                self._price, found = self._price * STEP, dearer
        price, left = self._price, ground.copy()
        for window in found:
            left.fly(window)
        while self._metres(found) < self._enough_m(time_m, found) and price > self._least_price:
            price = max(self._least_price, price / STEP**2)
            new = [one for one in self._at(left, price) if not one.is_at_one_of(found)]
            for window in new:
                left.fly(window)
            found = [*found, *new]
        return found

    def _enough_m(self, time_m: float, found: Sequence[Window]) -> float:
        return time_m + SPARE_STRIPS * self._metres(found) / max(1, len(found))

    def _at(self, ground: Ground, price: float) -> list[Window]:
        return cut_windows(self._grid, ground, self.rules, price)

    def _metres(self, windows: Sequence[Window]) -> float:
        return sum(one.cells_long * self._grid.cell_m + self.rules.overhead_m for one in windows)

    def _profit(self, cuts: Sequence[Cut]) -> float:
        return sum(one.counts_m2 for one in cuts) - self._price * self._metres([one.window for one in cuts])

    def _best_first(self, cuts: Sequence[Cut]) -> list[Cut]:
        return sorted(cuts, key=lambda one: -one.counts_m2 / self._metres([one.window]))


def _cuts(ground: Ground, windows: Sequence[Window], cell_area_m2: float) -> list[Cut]:
    """What windows bring if they are flown one after the other."""
    left, found = ground.copy(), list[Cut]()
    for window in windows:
        cells = window.cells
        worth = left.worth(cells)
        counts_m2 = float(worth.sum())
        removed_m2 = float((left.risk[cells] * left.look[cells]).sum()) * cell_area_m2
        foreseen = float(worth[left.is_seen[cells]].sum()) < counts_m2 / 2
        found.append(Cut(window, removed_m2, counts_m2, foreseen))
        left.fly(window)
    return found
