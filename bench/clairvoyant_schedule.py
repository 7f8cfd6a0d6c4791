"""A good schedule of second looks for who knows the whole mission beforehand: what a bound is to be compared with.

Schedules that were flown, and lanes along the area and across it, are flown in `legs.Simulator`, where looks that
overlap count for what they are, and improved by simulated annealing: legs are moved sideways, made shorter or longer,
turned round, given to others, taken out and put in, and turns from one to the next made sooner or later. Those that are
put in were flown, or are cut where most is to be had at the price of a look. As the schedule that is best to begin with
is often not the one that becomes best, all are annealed for a while, then the best few of what came of them, and at
last one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.clairvoyant_bound import Bound
from bench.legs import Leg, Schedule, Simulator
from bench.removable import Removable
from coordinator.cut.ground import OBJECTIVES, Objective

PRICES = (0.5, 0.7, 1.0)
"""Of a look, as shares of that at the bound."""
MOST_CUT = 100
TURN_STEPS = 3
"""As many looks as in so many steps a leg must bring beyond its own, for the turn before it."""
SURVIVORS = 0.3
"""Share of the schedules that are annealed further, after each round."""
HOTTEST, COLDEST = (1e-2, 1e-3), 1e-5
"""Temperatures of annealing, as shares of what is gained: where the first round begins, where the others do, and where
all end."""


@dataclass(frozen=True)
class Solution:
    """The best schedule found, how much less it makes the objective, times the area, and how much less the best that
    annealing began with does."""

    gain_m2: float
    schedule: Schedule
    started_m2: float


def best_schedule(
    mission: Removable,
    bound: Bound,
    steps: int,
    seed: int,
    known: Sequence[Schedule] = (),
    objective: Objective = OBJECTIVES["mean"],
) -> Solution:
    """Searches in so many steps of annealing. `known`: schedules to begin with; the result is at least as good as each
    of them."""
    simulator = Simulator(mission, objective)
    starts = [*known, lanes(mission, across=False), lanes(mission, across=True)]
    prices_m2 = [bound.price_m2 * share for share in PRICES]
    candidates = [leg for price_m2 in prices_m2 for way in (False, True) for leg in _cut(mission, price_m2, across=way)]
    candidates += [leg for schedule in starts for legs in schedule for leg in legs]
    chance = np.random.default_rng(seed)
    found = [(simulator.gain_m2(start), simulator.in_time(start)) for start in starts]
    started_m2 = max(gain_m2 for gain_m2, _ in found)
    counts = _rounds(len(found))
    for number, count in enumerate(counts):
        found = sorted(found, key=lambda one: -one[0])[:count]
        each, hottest = steps // len(counts) // count, HOTTEST[number > 0]
        found = [_annealed(simulator, start, candidates, each, hottest, chance) for _, start in found]
    return Solution(*max(found, key=lambda one: one[0]), started_m2)


def _rounds(count: int) -> list[int]:
    """How many schedules are annealed in each round."""
    counts = [count]
    while counts[-1] > 1:
        counts.append(math.ceil(counts[-1] * SURVIVORS))
    return counts


def lanes(mission: Removable, *, across: bool) -> Schedule:
    """Lanes over all the area, to and fro, shared evenly among the helpers, each its own swath apart."""
    steps, lines = mission.extent(across=across)
    shares = np.linspace(0, lines, len(mission.helpers) + 1).round().astype(int).tolist()
    schedule = []
    for number, helper in enumerate(mission.helpers):
        swath, end = helper.sensor(across=across).swath, shares[number + 1]
        places = [min(place, end - 1) for place in range(shares[number] + swath.left, end + swath.left, swath.width)]
        schedule.append(tuple(Leg(place, 0, steps, turn % 2 == 0, across) for turn, place in enumerate(places)))
    return tuple(schedule)


def _cut(mission: Removable, price_m2: float, *, across: bool) -> list[Leg]:
    """The leg that brings most beyond the price of its looks, again and again; `price_m2` of one look."""
    swath = max((one.sensor(across=across).swath for one in mission.helpers), key=lambda swath: swath.width)
    p_detect = np.max([helper.best_p_detect for helper in mission.helpers], axis=0)
    worth_m2 = mission.risk * p_detect * mission.grid.cell_area_m2
    if across:
        worth_m2, p_detect = worth_m2.T.copy(), p_detect.T
    step_m2 = price_m2 * swath.width
    legs: list[Leg] = []
    while len(legs) < MOST_CUT:
        padded = np.pad(worth_m2, ((0, 0), (swath.left, swath.right)))
        profit = np.lib.stride_tricks.sliding_window_view(padded, swath.width, axis=1).sum(axis=2) - step_m2
        total = np.vstack([np.zeros(profit.shape[1]), np.cumsum(profit, axis=0)])
        gain = total - np.minimum.accumulate(total, axis=0)
        end, place = map(int, np.unravel_index(int(gain.argmax()), gain.shape))
        if gain[end, place] <= TURN_STEPS * step_m2:
            break
        first = int(total[: end + 1, place].argmin())
        legs.append(Leg(place, first, end, across=across))
        lines = swath.columns(place, profit.shape[1])
        worth_m2[first:end, lines] *= 1 - p_detect[first:end, lines]
    return legs


def _annealed(
    simulator: Simulator,
    start: Schedule,
    candidates: Sequence[Leg],
    steps: int,
    hottest: float,
    chance: np.random.Generator,
) -> tuple[float, Schedule]:
    """The best schedule on a walk through schedules that begins at `start`, and at the temperature `hottest`."""
    now, now_m2 = start, simulator.gain_m2(start)
    best, best_m2 = now, now_m2
    for step in range(steps):
        changed = _changed(now, candidates, simulator.mission, chance)
        changed_m2 = simulator.gain_m2(changed)
        temperature = max(best_m2, 1.0) * hottest * (COLDEST / hottest) ** (step / steps)
        if changed_m2 >= now_m2 or chance.random() < math.exp((changed_m2 - now_m2) / temperature):
            now, now_m2 = simulator.in_time(changed), changed_m2
            if now_m2 > best_m2:
                best, best_m2 = now, now_m2
    return best_m2, best


def _changed(
    schedule: Schedule, candidates: Sequence[Leg], mission: Removable, chance: np.random.Generator
) -> Schedule:
    """A schedule that differs in a leg or two, or in where or in which direction a run of legs is flown."""
    helper = int(chance.integers(len(schedule)))
    legs = list(schedule[helper])
    others = list(schedule)
    move = chance.random()
    place = int(chance.integers(len(legs))) if legs else 0
    behind = place  # from which leg on directions may change
    if not legs or move < 0.14:
        leg = candidates[int(chance.integers(len(candidates)))]
        place = int(chance.integers(len(legs) + 1))
        legs.insert(place, leg._replace(up=bool(chance.integers(2))))
        behind = place + 1
    elif move < 0.22:
        legs.pop(place)
    elif move < 0.3:
        legs[place] = candidates[int(chance.integers(len(candidates)))]._replace(up=legs[place].up)
    elif move < 0.58:
        end = place + 1 if move < 0.42 else int(chance.integers(place + 1, len(legs) + 1))
        by = int(chance.integers(-3, 4))
        legs[place:end] = [_aside(leg, by, mission) for leg in legs[place:end]]
    elif move < 0.72:
        begin, end = chance.integers(-6, 7, 2).tolist()
        legs[place] = _stretched(legs[place], begin, end, mission)
    elif move < 0.85:  # where it turns from one leg to the next
        by = int(chance.integers(-20, 21))
        for number, leg in enumerate(legs[place : place + 2]):
            if leg.across == legs[place].across:
                first = leg.up == (number == 1)  # of the leg before it the end moves, of the next the begin
                legs[place + number] = _stretched(leg, by if first else 0, 0 if first else by, mission)
    elif move >= 0.92:
        given = legs.pop(place)
        taker = int(chance.integers(len(schedule)))
        takers = legs if taker == helper else list(others[taker])
        takers.insert(int(chance.integers(len(takers) + 1)), given)
        others[taker] = tuple(takers)
    if 0.85 <= move < 0.92 or (move < 0.22 and chance.integers(2)):  # what is put in or taken out turns the rest round
        legs[behind:] = [leg._replace(up=not leg.up) for leg in legs[behind:]]
    others[helper] = tuple(legs)
    return tuple(others)


def _aside(leg: Leg, by: int, mission: Removable) -> Leg:
    """The leg so many lines to the side."""
    _, lines = mission.extent(across=leg.across)
    return leg._replace(place=min(max(leg.place + by, 0), lines - 1))


def _stretched(leg: Leg, begin: int, end: int, mission: Removable) -> Leg:
    """The leg with its ends so many cells farther on."""
    steps, _ = mission.extent(across=leg.across)
    first = min(max(leg.first + begin, 0), steps - 1)
    return leg._replace(first=first, end=min(max(leg.end + end, first + 1), steps))
