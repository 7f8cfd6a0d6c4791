"""Lays strips for the routes by which helpers are to serve them.

Strips are cut one by one, each where it brings most for the metres that it takes. What lies between them, how long a
turn from one to the next is, and what the deadline cuts off, is known only of routes. So strips over which helpers
have routes are laid anew: moved aside, made longer or shorter, turned, taken out, given to another helper or exchanged
for one that was not chosen, a thousand times at random. What brings more is kept, and at first now and then what brings
a little less (simulated annealing): a change that pays may need another one before.

What is tried, and by which chance what brings less is kept, are random numbers of a seed: the same map and routes are
always laid alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coordinator.cut.ground import Ground
from coordinator.cut.legs import (
    ACROSS,
    LEG,
    MOST_LOOKS,
    UP,
    Flier,
    Routes,
    Site,
    counts_of_looks_m2,
    exchange,
    look_at_what_differs,
    take,
    turn_for_shortest,
)
from coordinator.cut.strips import CuttingRules
from coordinator.cut.window import Window
from planner.compiled import compiled
from planner.types import FloatArray, GridSpec, IntArray

STEPS = 1000
HOTTEST, COLDEST = 1e-4, 1e-5
"""Temperatures at which a search begins and ends, as shares of what is gained."""
MOST_ASIDE, MOST_LONGER, MOST_LATER = 3, 6, 10
"""A leg is moved aside by so many blocks at most, made longer or shorter by so many at either end, and where one turns
from a leg to the next comes so many later or earlier."""
INSERT, TAKE_OUT, EXCHANGE, ASIDE, ALL_ASIDE, LONGER, LATER, TURN = 0.14, 0.22, 0.3, 0.42, 0.58, 0.72, 0.85, 0.92
"""Up to which share of the steps each change is tried; the rest gives a leg to another helper, or flies it sooner or
later."""
DRAWS = 8
"""Random numbers of a step."""


class Laid(NamedTuple):
    """`windows`: as strips are laid; `parts`: what of each is flown by the deadline; `better`: by what share more that
    brings than what was given, infinite if that brought nothing."""

    windows: list[Window]
    parts: list[Window]
    better: float


class Laying:
    """Lays strips on a grid of blocks. `edge_m`: how far before the frame's origin the grid's first column begins."""

    def __init__(self, blocks: GridSpec, edge_m: float, rules: CuttingRules) -> None:
        self._block_m, self._edge_m = float(blocks.cell_m), float(edge_m)
        self._shortest, self._longest = rules.cells_long(blocks)

    def laid(
        self,
        ground: Ground,
        routes: Sequence[Sequence[Window]],
        others: Sequence[Window],
        fliers: Sequence[Flier],
        seed: int,
    ) -> Laid:
        """What helpers are to fly, in order, helper by helper.

        Args:
            ground: as it is before.
            routes: of each helper the windows that it is to fly, in order.
            others: windows that may be put in.
            fliers: the helpers, at least one.
            seed: of what is tried.
        """
        contacts = np.zeros(ground.risk.shape)
        if ground.contacts is not None:  # those of either heading: a look does not know from where it is
            contacts = ground.contacts.min(axis=0)
        counts_m2 = counts_of_looks_m2(ground.risk, ground.look, ground.weights, contacts, ground.counts)
        site = Site(counts_m2, self._block_m, self._edge_m, self._shortest, self._longest)
        most = max(map(len, routes)) + len(others)
        legs, count = np.zeros((len(routes), most, LEG), dtype=np.int64), np.array([len(one) for one in routes])
        for helper, route in enumerate(routes):
            legs[helper, : len(route), :UP] = _legs(route)
        flown, draws = np.zeros((len(routes), most, ACROSS), dtype=np.int64), np.random.default_rng(seed)
        before_m2, after_m2 = _lay(
            site, np.array(fliers), legs, count, flown, _legs(others), draws.random((STEPS, DRAWS))
        )
        is_there = np.arange(most) < count[:, np.newaxis]
        windows = [Window(a, b, c, d, across=bool(across)) for a, b, c, d, across, _ in legs[is_there].tolist()]
        bounds = zip(flown[is_there].tolist(), windows, strict=True)
        parts = [Window(a, b, c, d, across=window.across) for (a, b, c, d), window in bounds]
        return Laid(windows, parts, after_m2 / before_m2 - 1.0 if before_m2 > 0 else math.inf)


def _legs(windows: Sequence[Window]) -> IntArray:
    """Of windows, as long as nobody knows in which direction they are flown."""
    return np.array([(*one.bounds, one.across) for one in windows], dtype=np.int64).reshape(-1, UP)


@compiled
def _lay(
    site: Site,
    fliers: FloatArray,
    legs: IntArray,
    count: IntArray,
    flown: IntArray,
    others: IntArray,
    draws: FloatArray,
) -> tuple[float, float]:
    """Lays legs anew, in place, and tells what of them is `flown` in time; returns what they brought, and what they
    bring now. `draws`: of each step random numbers in [0, 1)."""
    helpers, most = legs.shape[:2]
    now = Routes(
        legs.copy(),
        count.copy(),
        np.zeros((helpers, most)),
        np.zeros((helpers, most, ACROSS), np.int64),
        np.zeros(site.counts_m2.shape[1:], np.uint8),
    )
    trial = Routes(now.legs.copy(), now.number.copy(), now.way_m.copy(), now.flown.copy(), now.looks)
    now_m2 = 0.0
    for one in range(helpers):
        turn_for_shortest(site, fliers[one], now.legs[one], now.number[one])
        take(now, trial, one)
        now.number[one] = 0
        now_m2 += exchange(site, fliers, now, trial, one)
        take(trial, now, one)
    legs[:], count[:], flown[:] = now.legs, now.number, now.flown
    before_m2 = best_m2 = now_m2
    for step in range(len(draws)):
        one, other = _change(site, now, trial, others, draws[step])
        gained_m2 = exchange(site, fliers, now, trial, one)
        if other != one:
            gained_m2 += exchange(site, fliers, now, trial, other)
        hot = max(best_m2, 1.0) * HOTTEST * (COLDEST / HOTTEST) ** (step / len(draws))
        if gained_m2 >= 0.0 or draws[step, DRAWS - 1] < math.exp(gained_m2 / hot):
            now_m2 += gained_m2
            take(trial, now, one)
            take(trial, now, other)
            if now_m2 > best_m2:
                best_m2 = now_m2
                legs[:], count[:], flown[:] = now.legs, now.number, now.flown
        else:
            look_at_what_differs(site, trial, now, one)
            if other != one:
                look_at_what_differs(site, trial, now, other)
    return before_m2, best_m2


@compiled
def _change(site: Site, now: Routes, trial: Routes, others: IntArray, draw: FloatArray) -> tuple[int, int]:
    """Makes a trial of routes that differ from those now in a leg or some; returns the helpers whose do, which may be
    one and the same."""
    one = int(draw[0] * now.number.size)
    take(now, trial, one)
    legs, count, most = trial.legs[one], now.number[one], now.legs.shape[1]
    which, place = draw[1], int(draw[2] * count)
    turned_from = count  # legs behind it are turned round
    if count == 0 or which < INSERT:
        if count < most and len(others) > 0:
            place = int(draw[2] * (count + 1))
            _put_in(legs, count, place)
            legs[place, :UP] = others[int(draw[3] * len(others))]
            legs[place, UP] = draw[4] < 0.5
            count += 1
            turned_from = place + 1 if draw[5] < 0.5 else count
    elif which < TAKE_OUT:
        _take_out(legs, count, place)
        count -= 1
        turned_from = place if draw[5] < 0.5 else count
    elif which < EXCHANGE:
        if len(others) > 0:
            legs[place, :UP] = others[int(draw[3] * len(others))]
    elif which < ALL_ASIDE:
        end = place + 1 if which < ASIDE else place + 1 + int(draw[3] * (count - place))
        for its in range(place, end):
            _move_aside(site, legs[its], _by(draw[4], MOST_ASIDE))
    elif which < LONGER:
        _make_longer(site, legs[place], _by(draw[3], MOST_LONGER), _by(draw[4], MOST_LONGER))
    elif which < LATER:
        by = _by(draw[3], MOST_LATER)
        for its in range(place, min(place + 2, count)):
            if legs[its, ACROSS] == legs[place, ACROSS]:
                if (legs[its, UP] == 1) == (its > place):  # of the next leg the begin, of this one the end
                    _make_longer(site, legs[its], by, 0)
                else:
                    _make_longer(site, legs[its], 0, by)
    elif which < TURN:
        turned_from = place
    else:
        other = int(draw[3] * now.number.size)
        its_count = now.number[other] if other != one else count - 1
        if its_count < most:
            given = legs[place].copy()
            if other != one:
                take(now, trial, other)
            _take_out(legs, count, place)
            its_place = int(draw[4] * (its_count + 1))
            _put_in(trial.legs[other], its_count, its_place)
            trial.legs[other, its_place] = given
            trial.number[one] = count - 1
            trial.number[other] = its_count + 1
            return one, other
    for its in range(turned_from, count):
        legs[its, UP] = 1 - legs[its, UP]
    trial.number[one] = count
    return one, one


@compiled
def _by(draw: float, most: int) -> int:
    """A whole number of at most so many, up or down."""
    return int(draw * (2 * most + 1)) - most


@compiled
def _put_in(legs: IntArray, count: int, place: int) -> None:
    """Makes room for a leg before that at a place, of so many."""
    for its in range(count, place, -1):
        for which in range(LEG):
            legs[its, which] = legs[its - 1, which]


@compiled
def _take_out(legs: IntArray, count: int, place: int) -> None:
    for its in range(place, count - 1):
        for which in range(LEG):
            legs[its, which] = legs[its + 1, which]


@compiled
def _move_aside(site: Site, leg: IntArray, by: int) -> None:
    """As far as the ground goes."""
    first, size = (0, site.counts_m2.shape[1]) if leg[ACROSS] == 1 else (2, site.counts_m2.shape[2])
    by = min(max(by, -leg[first]), size - leg[first + 1])
    leg[first] += by
    leg[first + 1] += by


@compiled
def _make_longer(site: Site, leg: IntArray, begin: int, end: int) -> None:
    """Moves its ends by so many blocks, as far as the ground goes, if it is then as long as a strip may be."""
    first, size = (2, site.counts_m2.shape[2]) if leg[ACROSS] == 1 else (0, site.counts_m2.shape[1])
    begin, end = min(max(leg[first] + begin, 0), size), min(max(leg[first + 1] + end, 0), size)
    if site.shortest <= end - begin <= site.longest:
        leg[first], leg[first + 1] = begin, end


def _sample() -> tuple[Site, FloatArray, IntArray, IntArray, IntArray, IntArray, FloatArray]:
    site = Site(np.ones((MOST_LOOKS, 2, 2)), 1.0, 0.5, 1, 2)
    legs, count = np.array([[[0, 2, 0, 1, 0, 1]]]), np.ones(1, dtype=np.int64)
    fliers, flown = np.ones((1, len(Flier._fields))), np.zeros((1, 1, ACROSS), dtype=np.int64)
    return site, fliers, legs, count, flown, legs[0, :, :UP].copy(), np.full((1, DRAWS), 0.5)


_lay.called_with(_sample)
