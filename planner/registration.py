"""Registration: how far the places that several vehicles tell lie apart, found from what more than one has seen.

A vehicle that is not where it believes it is tells of all that it finds as far off, in the same direction: its error is
one, and not one for each contact. Of two vehicles' errors that may be 30 m, and mines lie closer than that; but laid
over each other the right way, what both have seen falls together. Each way to lay a place of the one on a place of the
other is a guess at how far they are apart. It is as likely as their errors make it, times how well all that the one has
seen then falls on what the other has, where the rest lies at random. What lies in even rows, closer than those errors,
may be laid a step too far.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from planner.types import FloatArray

REACH_SIGMAS = 3.0
MOST_APART_M = 60.0
"""Places farther apart are not of one thing, however little is known of where they are."""
SAME_M = 1.0
"""Standard deviation of how far apart two vehicles that know where they are tell the same thing."""
SEEN_BY_BOTH = np.arange(0.025, 1.0, 0.05)
"""Of what the one has seen the share that the other has, too: nobody knows, and each is as likely."""
MOST_PAIRS = 2000
"""Of those that might be of one thing so many are looked at: each is a guess, and weighed against all of them."""
DECIMALS = 2


@dataclass(frozen=True)
class Frame:
    """How a vehicle's places lie: east and north of the reference's by so much, to a standard deviation of `sigma_m`.
    Moved by that they are known to `placed_m`, where the vehicle itself does not know better. The reference is the
    vehicle that knows best where it is."""

    east_m: float = 0.0
    north_m: float = 0.0
    sigma_m: float = 0.0
    placed_m: float = math.inf


AS_TOLD = Frame()
"""Of the reference, and of all that are where they believe."""


def registered(seen: Mapping[str, FloatArray]) -> dict[str, Frame]:
    """The frame of each vehicle by what each has `seen`: east, north and the standard deviation that it told of its
    place, for each thing it has seen; arrays of shape (>= 1, 3), in metres.

    Vehicles join in the order of how well they know where they are, each laid over all before it. Who has seen nothing
    with them lies where it says that it does, to the standard deviation of both.
    """
    order = sorted(seen, key=lambda one: (float(seen[one][:, 2].mean()), one))
    frames: dict[str, Frame] = {}
    pool: list[FloatArray] = []
    for name in order:
        places, sigma_m = seen[name], float(seen[name][:, 2].mean())
        if not frames:
            frames[name], reference_m = AS_TOLD, sigma_m
        elif sigma_m == 0.0:  # nor is any before it off
            frames[name] = AS_TOLD
        else:
            known = np.concatenate(pool)
            prior_m = math.hypot(sigma_m, reference_m)
            drift_m = math.hypot(float(places[:, 2].std()), float(known[:, 2].std()))
            east_m, north_m, off_m = _laid_over(places[:, :2], known[:, :2], prior_m, math.hypot(SAME_M, drift_m))
            apart_m = min(prior_m, math.hypot(off_m, drift_m))
            placed_m = math.hypot(reference_m, apart_m)
            frames[name] = Frame(*(round(one, DECIMALS) for one in (east_m, north_m, apart_m, placed_m)))
        frame = frames[name]
        pool.append(places - [frame.east_m, frame.north_m, 0.0])
    return frames


def _laid_over(places: FloatArray, known: FloatArray, prior_m: float, same_m: float) -> tuple[float, float, float]:
    """How far east and north `places` lie of those `known`, both of shape (n, 2), and the standard deviation of that.

    `prior_m`: that of how far off they may be; `same_m`: of how far apart the same thing is told once that is known.
    """
    reach_m = min(MOST_APART_M, REACH_SIGMAS * math.hypot(prior_m, same_m))
    near = shapely.STRtree(_points(known)).query(_points(places), "dwithin", reach_m)
    if not near.shape[1]:
        return 0.0, 0.0, prior_m
    of_place, of_known = near[:, np.lexsort(near[::-1])][:, :MOST_PAIRS]
    guesses = places[of_place] - known[of_known]
    (first,) = np.nonzero(np.diff(of_place, prepend=-1))  # each place's pairs begin here
    squares = ((guesses[:, np.newaxis] - guesses) ** 2).sum(axis=2)
    falls = np.exp(-0.5 * squares / same_m**2)
    # How much denser what is known lies where a place falls than about it, which is what chance would have.
    same_m2, about_m2 = 2.0 * math.pi * same_m**2, math.pi * reach_m**2
    denser = np.add.reduceat(falls, first, axis=1) * about_m2 / same_m2 * len(first) / len(guesses)
    logs = np.logaddexp.reduce([np.log1p(share * (denser - 1.0)).sum(axis=1) for share in SEEN_BY_BOTH])
    logs -= 0.5 * (guesses**2).sum(axis=1) / prior_m**2
    logs += math.log(same_m**2 / prior_m**2) - np.log(falls.sum(axis=1))  # each of those that agree is a part of one
    logs = np.append(logs, np.logaddexp.reduce(len(first) * np.log1p(-SEEN_BY_BOTH)))  # nothing was seen by both
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    weights, none = weights[:-1], float(weights[-1])
    mean = weights @ guesses
    variance = float(weights @ ((guesses - mean) ** 2).sum(axis=1)) / 2.0
    variance += none * (prior_m**2 + float(mean @ mean) / 2.0)
    return float(mean[0]), float(mean[1]), math.sqrt(variance)


def _points(places: FloatArray) -> list[shapely.Point]:
    return [shapely.Point(*one) for one in places.tolist()]
