"""Contacts joined to objects: which detections, by any vehicle and look, are of the same thing on the seabed, how
likely that is a mine, and how much surer a further look would make it.

Gated nearest neighbour: a contact belongs to the nearest object within what both positions' errors allow, else it is a
new one. An object is a mine; or clutter, which lies there as well and is seen as often, but looks like no mine; or
nothing at all, an alarm that is not raised again. Its chances of these follow by Bayes' rule from the scores of its
contacts, and from how often it was seen, beside how often one would be that lies there: scores of mines and of the
others are distributed as the recogniser's maker tells, and the shares of the three among all objects are those under
which all this together is likeliest (found by expectation maximisation), with one object more of each kind than was
heard of: few contacts do not tell for sure that there is nothing but mines (a Dirichlet prior of one each).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from planner.fleet_map import FleetMap
from planner.registration import AS_TOLD, MOST_APART_M, REACH_SIGMAS, Frame, registered
from planner.rounding import rounded
from planner.types import BoolArray, FloatArray

LEAST_GATE_M = 2.0
"""What the sonar itself cannot tell apart."""
LEAST_SIGMA_M = 0.1
PLACE_M = 20.0  # objects are looked up by squares of this side
ROUNDS = 200
SURE = 50.0  # the logarithm of a ratio beyond which nothing is surer
LEAST_SHARE = 1e-6
LEAST_NATS = 1e-3  # of what was seen: a map may come later than a contact
LISTED_FROM = 0.35
"""Chance to be a mine from which an object is listed as one: a mine that is not on the list costs more than a stone
that is."""
OTHERS_UP_TO = 0.75
"""No clutter and no false alarm is taken to score higher."""
COINCIDENCE = 1e-3  # how likely an alarm is raised again where one was, of nothing


def likelihood_ratio(score: float) -> float:
    """How much likelier a score in [0, 1] is of a mine than of a false alarm.

    The recogniser's scores of mines are 0.5 + 0.5 B(2, 2), of false alarms 0.75 B(2, 3), B a beta distribution.
    """
    if score >= OTHERS_UP_TO:  # the surest score, which none has in theory, too
        return math.inf
    mine, other = _mine_density(score), _other_density(score)
    return mine / other if other > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Sighting:
    """A contact by `vehicle`: where it believes it, in the mission frame, with the standard deviation of its own place,
    the recogniser's score in [0, 1], and whether it was seen from a strip across the tracks."""

    vehicle: str
    x_m: float
    y_m: float
    sigma_m: float
    score: float
    across: bool = False

    @property
    def log_ratio(self) -> float:
        """The logarithm of how much likelier the score is of a mine, -SURE to SURE."""
        ratio = likelihood_ratio(self.score)
        return math.copysign(SURE, ratio - 0.5) if ratio in (0.0, math.inf) else math.log(ratio)


@dataclass(slots=True)
class _Spot:
    """Where one vehicle has an object by its own account: the means of its contacts of it."""

    contacts: int
    x_m: float
    y_m: float
    sigma_m: float

    def join(self, sighting: Sighting) -> None:
        self.contacts += 1
        share = 1.0 / self.contacts
        self.x_m += share * (sighting.x_m - self.x_m)
        self.y_m += share * (sighting.y_m - self.y_m)
        self.sigma_m += share * (sighting.sigma_m - self.sigma_m)


@dataclass(slots=True)
class _Object:
    """Where it is believed, with the standard deviation of that and the weight of all its contacts, of how many, the
    logarithm of their likelihood ratios' product, whether it was seen from along the tracks and from across, and where
    each vehicle has it."""

    x_m: float
    y_m: float
    sigma_m: float = 0.0
    weight: float = 0.0
    contacts: int = 0
    log_ratio: float = 0.0
    along: bool = False
    across: bool = False
    spots: dict[str, _Spot] = field(default_factory=dict)


class _Joined:
    """Objects by squares of PLACE_M, as contacts are joined to them one by one. `frames`: of vehicles that do not tell
    places as the reference does."""

    def __init__(self, frames: Mapping[str, Frame]) -> None:
        self.frames = frames
        self._by_place: dict[tuple[int, int], list[_Object]] = {}
        self._widest_m = 0.0

    def __iter__(self) -> Iterator[_Object]:
        """All of them, by place."""
        return (one for place in sorted(self._by_place) for one in self._by_place[place])

    def spots(self, vehicle: str) -> FloatArray:
        """Where a vehicle has what it has seen, and to what standard deviation; shape (objects, 3)."""
        of = [one.spots[vehicle] for one in self if vehicle in one.spots]
        return np.array([(one.x_m, one.y_m, one.sigma_m) for one in of], dtype=np.float64).reshape(-1, 3)

    def join(self, sighting: Sighting) -> None:
        frame = self.frames.get(sighting.vehicle, AS_TOLD)
        x_m, y_m = sighting.x_m - frame.east_m, sighting.y_m - frame.north_m
        found = self._nearest(sighting, frame, x_m, y_m)
        if found is None:
            found = _Object(x_m, y_m)
        else:
            self._by_place[_place(found.x_m, found.y_m)].remove(found)
        weight = 1.0 / max(frame.sigma_m, LEAST_SIGMA_M) ** 2
        found.x_m = (found.weight * found.x_m + weight * x_m) / (found.weight + weight)
        found.y_m = (found.weight * found.y_m + weight * y_m) / (found.weight + weight)
        found.weight += weight
        found.sigma_m = max(found.sigma_m, min(sighting.sigma_m, frame.placed_m))
        found.contacts += 1
        found.log_ratio += sighting.log_ratio
        found.across |= sighting.across
        found.along |= not sighting.across
        found.spots.setdefault(sighting.vehicle, _Spot(0, 0.0, 0.0, 0.0)).join(sighting)
        self._by_place.setdefault(_place(found.x_m, found.y_m), []).append(found)

    def _nearest(self, sighting: Sighting, frame: Frame, x_m: float, y_m: float) -> _Object | None:
        """The object that a contact is of, if it is known; in their frame the contact lies at (x_m, y_m)."""
        self._widest_m = max(self._widest_m, sighting.sigma_m)
        best, best_m = None, math.inf
        reach = math.ceil(2.0 * _gate_m(math.hypot(self._widest_m, sighting.sigma_m)) / PLACE_M)
        column, row = _place(x_m, y_m)
        for place in product(range(column - reach, column + reach + 1), range(row - reach, row + reach + 1)):
            for one in self._by_place.get(place, ()):
                spot = one.spots.get(sighting.vehicle)
                if spot is None:
                    away_m = math.hypot(one.x_m - x_m, one.y_m - y_m)
                    sigma_m = min(self.frames.get(name, AS_TOLD).sigma_m for name in one.spots)
                    gate_m = _gate_m(math.hypot(frame.sigma_m, sigma_m))
                else:
                    away_m = math.hypot(spot.x_m - sighting.x_m, spot.y_m - sighting.y_m)
                    gate_m = _gate_m(sighting.sigma_m - spot.sigma_m)
                if away_m <= gate_m and away_m < best_m:
                    best, best_m = one, away_m
        return best


class Objects:
    """All objects that contacts have told of so far."""

    def __init__(self) -> None:
        self._heard: set[Hashable] = set()
        self._sightings: list[Sighting] = []
        self._is_off = False
        """Whether a vehicle is not sure where it is."""
        self._alone: dict[str, _Joined] = {}
        self._joined_alone = 0
        self._together = _Joined({})
        self._joined = 0

    def hear(self, sighting: Sighting, number: Hashable = None) -> bool:
        """Joins a sighting. `number`: what tells it from others; one that was heard before is not joined again, and
        False is returned."""
        if number is not None and number in self._heard:
            return False
        self._heard.add(number)
        self._sightings.append(sighting)
        self._is_off |= sighting.sigma_m > 0.0
        return True

    def seen(self) -> SeenObjects:
        """All of them, by place."""
        frames = self._registered() if self._is_off else {}
        if frames != self._together.frames:  # what is known of how far they are off has changed: all are joined anew
            self._together, self._joined = _Joined(frames), 0
        for sighting in self._sightings[self._joined :]:
            self._together.join(sighting)
        self._joined = len(self._sightings)
        some = list(self._together)
        return SeenObjects(
            x_m=np.array([one.x_m for one in some], dtype=np.float64),
            y_m=np.array([one.y_m for one in some], dtype=np.float64),
            sigma_m=np.array([one.sigma_m for one in some], dtype=np.float64),
            contacts=np.array([one.contacts for one in some], dtype=np.float64),
            log_ratio=np.array([one.log_ratio for one in some], dtype=np.float64),
            along=np.array([one.along for one in some], dtype=np.bool_),
            across=np.array([one.across for one in some], dtype=np.bool_),
        )

    def _registered(self) -> dict[str, Frame]:
        """By what each vehicle has seen, as it has it alone."""
        for sighting in self._sightings[self._joined_alone :]:
            self._alone.setdefault(sighting.vehicle, _Joined({})).join(sighting)
        self._joined_alone = len(self._sightings)
        return registered({name: joined.spots(name) for name, joined in self._alone.items()})


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
        return np.clip(REACH_SIGMAS * self.sigma_m, LEAST_GATE_M, MOST_APART_M)

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
            shares = (found.sum(axis=0) + 1.0) / (len(found) + 3.0)
        return found


class ObjectsOnMap:
    """Objects, and what each probably is by what a fleet's `map` has seen at its place; without a map as where next to
    nothing was seen. What they probably are is worked out once for all who ask until there is news."""

    def __init__(self, map_: FleetMap | None = None) -> None:
        self.map = map_
        self._objects = Objects()
        self._heard = 0
        self._known: tuple[tuple[int, FleetMap | None, int], SeenObjects, FloatArray] | None = None

    def hear(self, sighting: Sighting, number: Hashable = None) -> None:
        """See `Objects.hear`."""
        self._heard += self._objects.hear(sighting, number)

    def known(self) -> tuple[SeenObjects, FloatArray]:
        """All objects, and with which chance each is a mine, clutter, nothing; shape (objects, 3)."""
        as_of = self._heard, self.map, 0 if self.map is None else self.map.changes
        if self._known is None or self._known[0] != as_of:
            seen = self._objects.seen()
            nats = np.zeros(seen.x_m.shape) if self.map is None else self.map.nats_at(seen.x_m, seen.y_m)
            self._known = as_of, seen, seen.chances(nats)
        return self._known[1:]

    @property
    def mines(self) -> float:
        """How many of them are expected to be mines."""
        return float(self.known()[1][:, 0].sum())


def are_listed(mine_chances: FloatArray) -> BoolArray:
    """Which objects are listed as mines, by the chance that each is one; shape (objects,)."""
    return rounded(mine_chances) >= LISTED_FROM


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
    over = score / OTHERS_UP_TO
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


def _gate_m(sigma_m: float) -> float:
    return min(MOST_APART_M, max(LEAST_GATE_M, REACH_SIGMAS * abs(sigma_m)))
