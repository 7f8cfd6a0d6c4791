"""How long a helper needs for a strip, the way there included, and what it removes there in time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from coordinator.situation import Helper, OpenStrip
from planner.dubins import Pose, shortest_path
from planner.sweep import LENGTH_TOLERANCE_M, legs_over_strip, shifted, ways_over
from planner.types import Strip


@dataclass(frozen=True)
class Sweep:
    """A way to fly a strip's legs: from `entry`, where the first run-in begins, to `leave`, where the last run-out
    ends. `length_m`: of all that, turns from leg to leg included. `follows`: it is one leg, the strip's way. `legs`:
    where each leg's run-in begins and where its run-out ends."""

    entry: Pose
    leave: Pose
    length_m: float
    follows: bool
    legs: tuple[tuple[Pose, Pose], ...]


@dataclass(frozen=True)
class Service:
    """A helper's service of a strip: when it sets out, when its sonar goes on, when it has seen all, and where and when
    it is free."""

    leaves_s: float
    begins_s: float
    ends_s: float
    free_at: Pose
    free_s: float

    def share_by(self, time_s: float) -> float:
        """Share of the sweep that is flown by a time."""
        return min(1.0, max(0.0, (time_s - self.begins_s) / (self.ends_s - self.begins_s)))


def sweeps(strip: Strip, helper: Helper) -> tuple[Sweep, ...]:
    """The ways in which a helper may fly a strip."""
    return _sweeps(strip, helper.swath_m, helper.turn_radius_m, helper.run_in_m)


def service(one: OpenStrip, helper: Helper) -> Service:
    """The service of a strip from where and when a helper is free, flown the way its agent takes: see
    `cheapest_sweep`. Where the strip is still settling the helper sets out as late as it must."""
    sweep, way_m = cheapest_sweep(one.strip, helper)
    return timed(one, sweep, way_m, helper)


def cheapest_sweep(strip: Strip, helper: Helper) -> tuple[Sweep, float]:
    """The sweep that is shortest with the way there from where a helper is free, of equals the strip's own, and the
    length of that way in metres."""
    best, best_m = None, math.inf
    for sweep in sweeps(strip, helper):
        way_m = shortest_path(helper.free_at, sweep.entry, helper.turn_radius_m).length_m
        if way_m + sweep.length_m < best_m - LENGTH_TOLERANCE_M:
            best, best_m = sweep, way_m + sweep.length_m
    assert best is not None
    return best, best_m - best.length_m


def timed(one: OpenStrip, sweep: Sweep, way_m: float, helper: Helper) -> Service:
    """The service that flies a sweep after a way of this length."""
    to_begin_s = (way_m + helper.run_in_m) / helper.speed_mps
    sonar_on_s = (sweep.length_m - 2 * helper.run_in_m) / helper.speed_mps
    begins_s = helper.free_s + to_begin_s
    if one.settles_s > 0:
        wake_s = one.settles_s - (one.strip.length_m / helper.speed_mps if sweep.follows else 0.0)
        begins_s = max(begins_s, wake_s)
    ends_s = begins_s + sonar_on_s
    return Service(
        leaves_s=begins_s - to_begin_s,
        begins_s=begins_s,
        ends_s=ends_s,
        free_at=sweep.leave,
        free_s=ends_s + helper.run_in_m / helper.speed_mps,
    )


def removed_m2(one: OpenStrip, helper: Helper, served: Service, deadline_s: float) -> float:
    """What a service is expected to remove by the deadline; nothing where the battery does not last to its end."""
    if served.ends_s > helper.lasts_until_s:
        return 0.0
    return helper.p_detect * one.risk_m2 * served.share_by(deadline_s)


@lru_cache(maxsize=10_000)
def _sweeps(strip: Strip, swath_m: float, turn_radius_m: float, run_in_m: float) -> tuple[Sweep, ...]:
    found = []
    for way in ways_over(legs_over_strip(strip, swath_m)):
        legs = [
            (shifted(leg.start, leg.heading_rad, -run_in_m), shifted(leg.end, leg.heading_rad, run_in_m)) for leg in way
        ]
        flown_m = sum(leg.length_m + 2 * run_in_m for leg in way)
        turns_m = sum(shortest_path(one[1], other[0], turn_radius_m).length_m for one, other in pairwise(legs))
        follows = len(way) == 1 and way[0].start == strip.start
        found.append(Sweep(legs[0][0], legs[-1][1], flown_m + turns_m, follows, tuple(legs)))
    return tuple(found)
