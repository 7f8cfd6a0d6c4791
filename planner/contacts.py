"""Contacts joined to objects: which detections, by any vehicle and look, are of the same thing on the seabed, how
likely that is a mine, and how much surer a further look would make it.

Gated nearest neighbour: a contact belongs to the nearest object within what both positions' errors allow, else it is a
new one. An object is a mine; or clutter, which lies there as well and is seen as often, but looks like no mine; or
nothing at all, an alarm that is not raised again. Its chances of these follow by Bayes' rule from the scores of its
contacts, and from how often it was seen, beside how often one would be that lies there: scores of mines and of the
others are distributed as the recogniser's maker tells, and the shares of the three among all objects are those under
which all this together is likeliest (found by expectation maximisation).
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from itertools import product

import numpy as np

from planner.fleet_map import FleetMap
from planner.types import BoolArray, FloatArray

GATE_SIGMAS = 3.0
LEAST_GATE_M = 2.0
"""What the sonar itself cannot tell apart."""
MOST_GATE_M = 60.0
"""Contacts farther apart are two objects, however little is known of where they are."""
LEAST_SIGMA_M = 0.1
PLACE_M = 20.0  # objects are looked up by squares of this side
ROUNDS = 200
SURE = 50.0  # the logarithm of a ratio beyond which nothing is surer
LEAST_SHARE = 1e-6
LEAST_NATS = 1e-3  # of what was seen: a map may come later than a contact
LISTED_FROM = 0.35
"""Chance to be a mine from which an object is listed as one: a mine that is not on the list costs more than a stone
that is."""
COINCIDENCE = 1e-3  # how likely an alarm is raised again where one was, of nothing


def likelihood_ratio(score: float) -> float:
    """How much likelier a score in [0, 1] is of a mine than of a false alarm.

    The recogniser's scores of mines are 0.5 + 0.5 B(2, 2), of false alarms 0.75 B(2, 3), B a beta distribution.
    """
    mine, other = _mine_density(score), _other_density(score)
    return mine / other if other > 0.0 else math.inf if mine > 0.0 else 0.0


@dataclass
class _Object:
    """Where it is believed, with the standard deviation of that, of how many contacts, the logarithm of their
    likelihood ratios' product, and whether it was seen from along the tracks and from across."""

    x_m: float
    y_m: float
    sigma_m: float
    contacts: int = 0
    log_ratio: float = 0.0
    along: bool = False
    across: bool = False


class Objects:
    """All objects that contacts have told of so far."""

    def __init__(self) -> None:
        self._by_place: dict[tuple[int, int], list[_Object]] = {}
        self._widest_m = 0.0
        self._heard: set[Hashable] = set()

    def __len__(self) -> int:
        return sum(len(some) for some in self._by_place.values())

    def hear(
        self, x_m: float, y_m: float, sigma_m: float, score: float, number: Hashable = None, *, across: bool = False
    ) -> bool:
        """Joins a contact: where it is believed, with the standard deviation of that, and its score in [0, 1].
        `number`: what tells it from others; one that was heard before is not joined again, and False is returned.
        `across`: it was seen from a strip across the tracks."""
        if number is not None and number in self._heard:
            return False
        self._heard.add(number)
        ratio = likelihood_ratio(score)
        log_ratio = math.copysign(SURE, ratio - 0.5) if ratio in (0.0, math.inf) else math.log(ratio)
        near = self._nearest(x_m, y_m, sigma_m)
        if near is None:
            near = _Object(x_m, y_m, sigma_m)
        else:
            self._by_place[_place(near.x_m, near.y_m)].remove(near)
        weight, other = near.contacts / _variance(near.sigma_m), 1.0 / _variance(sigma_m)
        near.x_m = (weight * near.x_m + other * x_m) / (weight + other)
        near.y_m = (weight * near.y_m + other * y_m) / (weight + other)
        near.sigma_m = max(near.sigma_m, sigma_m)
        near.contacts += 1
        near.log_ratio += log_ratio
        near.across |= across
        near.along |= not across
        self._widest_m = max(self._widest_m, sigma_m)
        self._by_place.setdefault(_place(near.x_m, near.y_m), []).append(near)
        return True

    def _nearest(self, x_m: float, y_m: float, sigma_m: float) -> _Object | None:
        """The object that a contact is of, if it is known."""
        best, best_m = None, math.inf
        reach = math.ceil(_gate_m(self._widest_m, sigma_m) / PLACE_M)
        column, row = _place(x_m, y_m)
        for place in product(range(column - reach, column + reach + 1), range(row - reach, row + reach + 1)):
            for one in self._by_place.get(place, ()):
                away_m = math.hypot(one.x_m - x_m, one.y_m - y_m)
                if away_m <= _gate_m(one.sigma_m, sigma_m) and away_m < best_m:
                    best, best_m = one, away_m
        return best

    def seen(self) -> SeenObjects:
        """All of them, by place."""
        some = [one for place in sorted(self._by_place) for one in self._by_place[place]]
        return SeenObjects(
            x_m=np.array([one.x_m for one in some], dtype=np.float64),
            y_m=np.array([one.y_m for one in some], dtype=np.float64),
            sigma_m=np.array([one.sigma_m for one in some], dtype=np.float64),
            contacts=np.array([one.contacts for one in some], dtype=np.float64),
            log_ratio=np.array([one.log_ratio for one in some], dtype=np.float64),
            along=np.array([one.along for one in some], dtype=np.bool_),
            across=np.array([one.across for one in some], dtype=np.bool_),
        )


@dataclass(frozen=True, eq=False)
class SeenObjects:
    """Objects as they are known; all arrays have shape (objects,). Where each is believed, mission frame, with the
    standard deviation of that, of how many `contacts`, the logarithm of how much likelier their scores are of a mine
    than not, and whether it was seen from along the tracks, and from across."""

    x_m: FloatArray
    y_m: FloatArray
    sigma_m: FloatArray
    contacts: FloatArray
    log_ratio: FloatArray
    along: BoolArray
    across: BoolArray

    @property
    def gate_m(self) -> FloatArray:
        """Within which distance of where it is believed each lies, as good as certainly."""
        return np.clip(GATE_SIGMAS * self.sigma_m, LEAST_GATE_M, MOST_GATE_M)

    def chances(self, nats: FloatArray) -> FloatArray:
        """With which chance each is a mine, clutter, nothing; shape (objects, 3). `nats`: what looks have seen at the
        place of each, -ln(1 - P_d) summed over all of them, >= 0, shape (objects,).

        What lies there and is missed with exp(-nats) by all looks together is taken to be seen as often as a Poisson
        process of that mean has it; of objects it is known that they were seen at all.
        """
        if not self.contacts.size:
            return np.zeros((0, 3))
        nats = np.maximum(nats, LEAST_NATS)
        often = self.contacts * np.log(nats) - nats - np.log(-np.expm1(-nats))
        often -= [math.lgamma(one + 1.0) for one in self.contacts.tolist()]
        alarms = (self.contacts - 1.0) * math.log(COINCIDENCE)
        logs = np.stack([often + np.clip(self.log_ratio, -SURE, SURE), often, alarms], axis=1)
        likely: FloatArray = np.exp(logs - logs.max(axis=1, keepdims=True))
        shares, found = np.full(3, 1.0 / 3.0), likely
        for _ in range(ROUNDS):
            weighed = likely * shares
            found = weighed / weighed.sum(axis=1, keepdims=True)
            shares = np.maximum(found.mean(axis=0), LEAST_SHARE)
        return found


class ObjectsOnMap:
    """Objects, and what each probably is by what a fleet's `map` has seen at its place; without a map as where next to
    nothing was seen. What they probably are is worked out once for all who ask until there is news."""

    def __init__(self, map_: FleetMap | None = None) -> None:
        self.map = map_
        self._objects = Objects()
        self._heard = 0
        self._known: tuple[tuple[int, FleetMap | None, int], SeenObjects, FloatArray] | None = None

    def __len__(self) -> int:
        return len(self._objects)

    def hear(
        self, x_m: float, y_m: float, sigma_m: float, score: float, number: Hashable = None, *, across: bool = False
    ) -> None:
        """See `Objects.hear`."""
        self._heard += self._objects.hear(x_m, y_m, sigma_m, score, number, across=across)

    def known(self) -> tuple[SeenObjects, FloatArray]:
        """All objects, and with which chance each is a mine, clutter, nothing; shape (objects, 3)."""
        as_of = self._heard, self.map, 0 if self.map is None else self.map.changes
        if self._known is None or self._known[0] != as_of:
            seen = self._objects.seen()
            nats = np.zeros(len(self)) if self.map is None else self.map.nats_at(seen.x_m, seen.y_m)
            self._known = as_of, seen, seen.chances(nats)
        return self._known[1:]

    @property
    def mines(self) -> float:
        """How many of them are expected to be mines."""
        return float(self.known()[1][:, 0].sum())


def surer_by(chances: FloatArray, nats: FloatArray | float) -> FloatArray:
    """By how much a further look is expected to lower the variance of how many of some objects are mines, of each;
    shape (objects,), 0 to 0.25. `chances`: as `SeenObjects.chances` tells them; `nats`: what the look sees there,
    -ln(1 - P_d).

    What the look finds, nothing or a contact with a score, moves each chance; the mean of its square over all that may
    be found is the variance that goes.
    """
    sees = -np.expm1(-np.asarray(nats, dtype=np.float64))
    mine, clutter, nothing = chances.T
    missed = mine * (1.0 - sees)
    of_missed = missed + clutter * (1.0 - sees) + nothing
    squares = missed**2 / np.maximum(of_missed, LEAST_SHARE)
    for of_mines, of_clutter in SCORES:
        seen = mine * sees * of_mines
        squares += seen**2 / np.maximum(seen + clutter * sees * of_clutter, LEAST_SHARE)
    return np.asarray(np.maximum(squares - mine**2, 0.0))


def _mine_density(score: float) -> float:
    up = 2.0 * score - 1.0
    return 12.0 * up * (1.0 - up) if 0.0 < up < 1.0 else 0.0


def _other_density(score: float) -> float:
    over = score / 0.75
    return 16.0 * over * (1.0 - over) ** 2 if 0.0 < over < 1.0 else 0.0


def _shares_of_scores() -> list[tuple[float, float]]:
    """Of SCORE_BINS scores side by side how many mines, and how many others, have each."""
    middles = [(number + 0.5) / SCORE_BINS for number in range(SCORE_BINS)]
    mines, others = [_mine_density(one) for one in middles], [_other_density(one) for one in middles]
    return [(one / sum(mines), other / sum(others)) for one, other in zip(mines, others, strict=True)]


SCORE_BINS = 20
SCORES = _shares_of_scores()


def _place(x_m: float, y_m: float) -> tuple[int, int]:
    return math.floor(x_m / PLACE_M), math.floor(y_m / PLACE_M)


def _gate_m(one_sigma_m: float, other_sigma_m: float) -> float:
    return min(MOST_GATE_M, max(LEAST_GATE_M, GATE_SIGMAS * math.hypot(one_sigma_m, other_sigma_m)))


def _variance(sigma_m: float) -> float:
    return max(sigma_m, LEAST_SIGMA_M) ** 2
