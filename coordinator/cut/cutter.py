"""Cuts as many strips as helpers have time for: the price of a metre flown is found at which they are just so many.

They are cut along the tracks, where bands lie that were seen badly, and, where they may be, again across them, where
there is often room for longer ones and fewer turns. Those are chosen that leave less when helpers have flown the best
of them. Before one is offered, those that helpers have routes over are laid for these routes, see
`coordinator.cut.laying`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from coordinator.cut.ground import Ground
from coordinator.cut.laying import Laying
from coordinator.cut.legs import Flier
from coordinator.cut.room import Room
from coordinator.cut.strips import Counted, Cut, Cutting, CuttingRules, cells_wide
from coordinator.cut.window import Window
from planner.types import GridSpec

STAYS_FOR = 0.005  # share of what strips remove by which those cut anew must be better than those that are open
TURNS_FOR = 0.02  # and by which those of the other heading must, as what is expected changes from one cut to the next
LAID_FOR = 0.01  # and by which those must that are laid anew, of what the routes over them remove
BLOCKS_A_SWATH = 5  # cells are taken together in blocks, of which at least so many make a swath


class FlownRoutes(NamedTuple):
    """What helpers fly of a choice of strips: by a strip's place in its choice the share that they fly of it in time,
    and of each helper the places of those that it serves, in order."""

    shares: Mapping[int, float]
    routes: Sequence[Sequence[int]]


Flown = Callable[[Sequence[Sequence[Counted]]], Sequence[FlownRoutes]]
"""Tells what helpers fly of each of several choices of strips."""


class _Outcome(NamedTuple):
    """What comes of what is `flown`. `after`: the ground as helpers leave it; `left_m2`: what is left of the objective,
    with what the metres flown cost at least."""

    flown: FlownRoutes
    after: Ground
    left_m2: float


class Cutter:
    """Remembers prices and heading, which hardly change from one cut to the next. `least_worth`: what a cell has to
    count for a look to be worth flying there whatever time there is, as a mean over a swath (residual risk times
    m2). `across`: whether strips may run across the tracks, too. `room`: cuts them so
    that they can be flown where there is ground to keep out of. `turns_each`: of so many cuts one tries the other
    heading."""

    def __init__(
        self,
        grid: GridSpec,
        rules: CuttingRules,
        least_worth: float,
        *,
        across: bool = False,
        room: Room | None = None,
        turns_each: int = 1,
    ) -> None:
        self._room = room
        self._cell_area_m2, self._shape = grid.cell_area_m2, grid.shape
        self._block = _block(cells_wide(grid, rules.swath_m))
        least_price = least_worth * rules.swath_m / grid.cell_area_m2
        blocks = replace(grid, cell_m=grid.cell_m * self._block)
        self._laying = Laying(blocks, grid.cell_m / 2, rules)
        headings = (False, True) if across else (False,)
        self._ways = [OneHeading(blocks, rules, least_price, across=way) for way in headings]
        self._kept = self._ways[0]
        self._turns_each = turns_each
        self._searches = 0
        self.threshold = 0.0
        """Residual risk from which on a cell will be of the worst, see `Ground`."""
        self.leaves_m2 = 0.0, 0.0
        """What helpers are expected to leave where the goal is, see `Ground.left_of_goal_m2`."""

    @property
    def price(self) -> float:
        """Of a metre flown, at which strips were cut last."""
        return self._kept.price

    def cut(
        self,
        ground: Ground,
        time_m: float,
        claimed: Sequence[Window],
        opened: Sequence[Window],
        flown: Flown,
        fliers: Sequence[Flier] = (),
        *,
        again: bool = False,
    ) -> list[Cut]:
        """The strips worth flying, where helpers can fly `time_m` until the mission ends, infinite while nobody can
        tell.

        `claimed`: windows that are with a vehicle. `opened`: those of the open strips, which stay where they are if
        what is cut anew is hardly better. `fliers`: the helpers by whose routes strips are laid, in the order in which
        `flown` tells these; none where strips stay as they are cut. Where there is time for it places are worth several
        looks; of strips that lie on one another by three quarters only the first is told, as its place is cut again
        once that is under way, or all are with `again`.
        """
        in_cells, left = ground.copy(), ground.in_blocks(self._block)
        for window in claimed:
            in_cells.fly(window)
            left.fly(window.in_blocks(self._block))
        best, after = [window.in_blocks(self._block) for window in opened], left
        if time_m > 0:  # else nobody can be sent any more, and what is open is left as it is
            best, after = self._best(left, time_m, best, flown, fliers)
        self.threshold, self.leaves_m2 = after.worst_from(), after.left_of_goal_m2()
        told = list[Window]()
        for window in best:
            if again or not window.is_at_one_of(told):
                told.append(window)
        return self._cuts(in_cells, [one.in_cells(self._block, self._shape) for one in told])

    def _best(
        self, left: Ground, time_m: float, opened: Sequence[Window], flown: Flown, fliers: Sequence[Flier]
    ) -> tuple[list[Window], Ground]:
        """The windows by which helpers leave least, those of the open strips or some cut anew, and the ground as they
        leave it."""
        stay, kept = _counted(left, opened, self._kept.least_m2), self._kept
        turns = not stay or self._searches % self._turns_each == 0
        self._searches += 1
        ways = self._ways if turns else [kept]
        cuts_anew = [self._anew(left, way.windows(left, time_m)) for way in ways]
        before_m2, outcomes = left.left_m2(), self._flown(left, [stay, *cuts_anew], flown)
        best, most_m2 = stay, (before_m2 - outcomes[stay].left_m2) * (1.0 + TURNS_FOR) * (1.0 + STAYS_FOR)
        for way, anew in zip(ways, cuts_anew, strict=True):
            gained_m2 = (before_m2 - outcomes[anew].left_m2) * (1.0 + TURNS_FOR if way is kept else 1.0)
            if gained_m2 > most_m2 or not best:
                most_m2, best, self._kept = gained_m2, anew, way
        windows, after = [one.window for one in best], outcomes[best].after
        if best and fliers:
            others = dict.fromkeys([*windows, *(one.window for anew in cuts_anew for one in anew)])
            return self._laid(left, windows, outcomes[best], [*others], fliers)
        return windows, after

    def _laid(
        self, left: Ground, best: list[Window], outcome: _Outcome, others: Sequence[Window], fliers: Sequence[Flier]
    ) -> tuple[list[Window], Ground]:
        """The same as they are laid for the routes over them, and behind them those over which none goes, if that is
        better by enough. `others`: what may be among them."""
        routes = [[best[place] for place in route] for route in outcome.flown.routes]
        ground = replace(left, threshold=outcome.after.worst_from())
        laid = self._laying.laid(ground, routes, others, fliers, self._searches)
        if laid.better <= LAID_FOR:
            return best, outcome.after
        after = left.copy()
        after.fly_each(laid.parts)
        spare = [window for place, window in enumerate(best) if place not in outcome.flown.shares]
        return [one.window for one in _counted(left, [*laid.windows, *spare], self._kept.least_m2)], after

    def _anew(self, ground: Ground, windows: Sequence[Window]) -> tuple[Counted, ...]:
        """What windows that are cut anew count, as far as they can be flown."""
        return _counted(ground, windows if self._room is None else self._room.flyable(self._block, windows))

    def _flown(
        self, ground: Ground, choices: Iterable[tuple[Counted, ...]], flown: Flown
    ) -> dict[tuple[Counted, ...], _Outcome]:
        """What comes of it if helpers fly each of some choices of windows by the best routes."""
        outcomes = dict[tuple[Counted, ...], _Outcome]()
        differ = list(dict.fromkeys(choices))
        in_cells = [
            [Counted(one.window.in_cells(self._block, self._shape), one.counts_m2) for one in choice]
            for choice in differ
        ]
        for choice, its in zip(differ, flown(in_cells), strict=True):
            after, windows, least_m2 = ground.copy(), [choice[place].window for place in its.shares], 0.0
            after.fly_each(windows, list(its.shares.values()))
            for window, share in zip(windows, its.shares.values(), strict=True):
                least_m2 += share * self._kept.least_m2(window)
            outcomes[choice] = _Outcome(its, after, after.left_m2() + least_m2)
        return outcomes

    def _cuts(self, ground: Ground, windows: Sequence[Window]) -> list[Cut]:
        """What windows of cells bring if they are flown one after the other."""
        return [
            Cut(window, counts_m2, removed * self._cell_area_m2, foreseen=seen_m2 < counts_m2 / 2)
            for window, (counts_m2, seen_m2, removed) in zip(windows, ground.fly_each(windows).tolist(), strict=True)
        ]


def _counted(
    ground: Ground, windows: Sequence[Window], least_m2: Callable[[Window], float] | None = None
) -> tuple[Counted, ...]:
    """What windows count if they are flown one after the other; one that counts no more than `least_m2` says is left
    out, and not flown."""
    least = [-1.0 if least_m2 is None else least_m2(one) for one in windows]
    told = ground.copy().fly_each(windows, 1.0, least)[:, 0].tolist()
    each = zip(windows, told, least, strict=True)
    return tuple(Counted(window, counts_m2) for window, counts_m2, its_least_m2 in each if counts_m2 > its_least_m2)


class OneHeading:
    """Cuts windows that all lie `across` the tracks, or all along them. `price`: of a metre flown."""

    def __init__(self, grid: GridSpec, rules: CuttingRules, least_price: float, *, across: bool) -> None:
        self.price = least_price
        self._least_price = least_price
        self._across = across
        self._grid = grid
        self._rules = rules

    def windows(self, ground: Ground, time_m: float) -> list[Window]:
        """As many windows as there is time for, at the highest price at which they are, and behind them some to
        spare; none without time."""
        if time_m <= 0:
            return []
        cutting = Cutting(self._grid, ground, self._rules, across=self._across)
        found, self.price = cutting.cut(self.price, self._least_price, time_m)
        return found

    def least_m2(self, window: Window) -> float:
        """What a strip there has to count to be worth flying whatever time there is."""
        return self._least_price * self._rules.metres_flown(window.cells_long * self._grid.cell_m)


def _block(width: int) -> int:
    """So many cells a side are taken together: as many as divide a swath and leave it enough blocks."""
    sizes = (size for size in range(1, width // BLOCKS_A_SWATH + 1) if width % size == 0)
    return max(sizes, default=1)
