"""Contacts joined to objects: which detections, by any vehicle and look, are of the same thing on the seabed, and how
likely that is a mine.

Gated nearest neighbour: a contact belongs to the nearest object within what both positions' errors allow, else it is a
new one. Its chance follows from its scores by Bayes' rule: scores of mines and of false alarms are distributed as the
recogniser's maker tells, and the share of mines among all objects is the one under which all their scores are likeliest
(found by expectation maximisation).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from planner.types import FloatArray

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


def likelihood_ratio(score: float) -> float:
    """How much likelier a score in [0, 1] is of a mine than of a false alarm.

    The recogniser's scores of mines are 0.5 + 0.5 B(2, 2), of false alarms 0.75 B(2, 3), B a beta distribution.
    """
    up, over = 2.0 * score - 1.0, score / 0.75
    mine = 12.0 * up * (1.0 - up) if 0.0 < up < 1.0 else 0.0
    false = 16.0 * over * (1.0 - over) ** 2 if 0.0 < over < 1.0 else 0.0
    return mine / false if false > 0.0 else math.inf if mine > 0.0 else 0.0


@dataclass
class _Object:
    """Where it is believed, with the standard deviation of that, of how many contacts, and the logarithm of their
    likelihood ratios' product."""

    x_m: float
    y_m: float
    sigma_m: float
    contacts: int
    log_ratio: float


class Objects:
    """All objects that contacts have told of so far."""

    def __init__(self) -> None:
        self._by_place: dict[tuple[int, int], list[_Object]] = {}
        self._widest_m = 0.0

    def __len__(self) -> int:
        return sum(len(some) for some in self._by_place.values())

    def hear(self, x_m: float, y_m: float, sigma_m: float, score: float) -> None:
        """Joins a contact: where it is believed, with the standard deviation of that, and its score in [0, 1]."""
        ratio = likelihood_ratio(score)
        log_ratio = math.copysign(SURE, ratio - 0.5) if ratio in (0.0, math.inf) else math.log(ratio)
        near = self._nearest(x_m, y_m, sigma_m)
        if near is None:
            near = _Object(x_m, y_m, sigma_m, 0, 0.0)
        else:
            self._by_place[_place(near.x_m, near.y_m)].remove(near)
        weight, other = near.contacts / _variance(near.sigma_m), 1.0 / _variance(sigma_m)
        near.x_m = (weight * near.x_m + other * x_m) / (weight + other)
        near.y_m = (weight * near.y_m + other * y_m) / (weight + other)
        near.sigma_m = max(near.sigma_m, sigma_m)
        near.contacts += 1
        near.log_ratio += log_ratio
        self._widest_m = max(self._widest_m, sigma_m)
        self._by_place.setdefault(_place(near.x_m, near.y_m), []).append(near)

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

    def mine_chances(self) -> FloatArray:
        """Of each object the chance that it is a mine, shape (objects,), by place."""
        logs = [one.log_ratio for place in sorted(self._by_place) for one in self._by_place[place]]
        ratios = np.exp(np.clip(logs, -SURE, SURE))
        share, chances = 0.5, np.zeros(len(logs))
        for _ in range(ROUNDS if logs else 0):
            chances = share * ratios / (share * ratios + 1.0 - share)
            share = min(max(float(chances.mean()), LEAST_SHARE), 1.0 - LEAST_SHARE)
        return chances

    @property
    def mines(self) -> float:
        """How many of them are expected to be mines."""
        return float(self.mine_chances().sum())


def _place(x_m: float, y_m: float) -> tuple[int, int]:
    return math.floor(x_m / PLACE_M), math.floor(y_m / PLACE_M)


def _gate_m(one_sigma_m: float, other_sigma_m: float) -> float:
    return min(MOST_GATE_M, max(LEAST_GATE_M, GATE_SIGMAS * math.hypot(one_sigma_m, other_sigma_m)))


def _variance(sigma_m: float) -> float:
    return max(sigma_m, LEAST_SIGMA_M) ** 2
