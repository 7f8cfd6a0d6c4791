"""The way home: how long it takes from anywhere, and how much of a plan can be flown before it must be begun."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from planner.currents import Sailing
from planner.dubins import Pose, path_lengths_m, shortest_path
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import Pass
from planner.types import FloatArray, Point
from planner.ways import Way, shortest_way, way_lengths_m, way_or_direct

THERE_M = 0.05
"""Who is so near to a place is there."""
MARGIN_S = 10.0
"""Nothing is begun that leaves less beside the reserve: words that are lost, and asked for again, take their time."""
ARRIVALS = 16
"""Headings of arrival that are compared where a way home leads round ground to keep out of, beside the direct one."""
DETOUR = 3.0
"""A way past zones is never so many times as long as is expected of it, circles that its turns add included."""
MOST_RADII = 8.0
"""By less than so many turn radii a way home in open water is longer than the beeline: a whole turn, and from its
circle."""
_FULL_TURN_RAD = 2 * math.pi
_ROUNDING_RAD = 1e-7


@dataclass(frozen=True)
class WayHome:
    """A vehicle's way to `home`, mission frame: a turn of `turn_radius_m` > 0 to either side until it heads for home,
    and then straight on; of the two the shorter one. From where it is there already it is none.

    Where ground to `keep_out` of is in the way it leads round that, to home with whichever of some headings takes
    least; where no such way is found the direct one counts.
    """

    home: Point
    sailing: Sailing
    turn_radius_m: float
    keep_out: KeepOut = NOWHERE

    def from_pose(self, pose: Pose) -> tuple[float, float]:
        """How long it takes from a pose, in seconds, and the compass heading of arrival, [0, 2 pi)."""
        time_s, heading_rad = self._ways(np.array([pose], dtype=np.float64))
        direct = float(time_s[0]), float(heading_rad[0]) % _FULL_TURN_RAD
        if not self.keep_out or direct[0] == 0.0:
            return direct
        return _past_zones(self, pose, direct)

    def way(self, pose: Pose) -> Way:
        """The same as paths that a vehicle sails."""
        return way_or_direct(pose, Pose(*self.home, self.from_pose(pose)[1]), self.turn_radius_m, self.keep_out)

    def times_s(self, poses: FloatArray) -> FloatArray:
        """About how long it takes from poses, shape (n, 3) of x, y and heading; shape (n,). Exactly where no ground to
        keep out of is in the way; there the way from corner to corner counts, as `planner.ways.way_lengths_m` tells
        it."""
        time_s = self._ways(poses)[0]
        if not self.keep_out:
            return time_s
        home = np.array([[*self.home, 0.0]])
        round_m = way_lengths_m(poses, home, self.turn_radius_m, self.keep_out)[:, 0]
        further_m = round_m - path_lengths_m(poses, home, self.turn_radius_m)[:, 0]
        further_m[~np.isfinite(further_m)] = 0.0
        times_s: FloatArray = time_s + further_m / self.sailing.slowest_mps
        return times_s

    def is_well_within(self, pose: Pose, time_s: float) -> bool:
        """Whether it takes so much less than a time, by what is known without looking for the way, that nobody need
        look for it."""
        slowest_mps = self.sailing.slowest_mps
        in_open_water_s = (math.dist(pose[:2], self.home) + MOST_RADII * self.turn_radius_m) / slowest_mps
        if not self.keep_out:
            return in_open_water_s < time_s
        circles_s = DETOUR * _FULL_TURN_RAD * self.turn_radius_m / slowest_mps
        beeline = shapely.LineString([pose[:2], self.home])
        if DETOUR * (in_open_water_s + circles_s) < time_s and self.keep_out.are_clear(beeline):
            return True  # it takes no longer than in open water, which is sooner told
        about_s = float(self.times_s(np.array([pose], dtype=np.float64))[0])
        return DETOUR * (about_s + circles_s) < time_s

    def passes_within(self, pose: Pose, passes: Sequence[Pass], time_s: float) -> int:
        """How many passes, the first ones, can be flown in their order from a pose so that there is time to come home
        before `time_s` have passed."""
        spent_s, here = 0.0, pose
        for count, one in enumerate(passes):
            spent_s, here = spent_s + self.sailing.passes_s([one], self.turn_radius_m, here, self.keep_out), one.end
            if spent_s + self.from_pose(here)[0] > time_s:
                return count
        return len(passes)

    def _ways(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How long the shorter of the ways over either side takes, and its heading of arrival."""
        (x_m, y_m, heading_rad), radius_m = poses.T, self.turn_radius_m
        side = np.array([[1.0], [-1.0]])
        to_x_m = self.home[0] - (x_m + side * (radius_m * np.cos(heading_rad)))
        to_y_m = self.home[1] - (y_m - side * (radius_m * np.sin(heading_rad)))
        straight_m = np.sqrt(np.maximum(to_x_m**2 + to_y_m**2 - radius_m**2, 0.0))
        arrival_rad = np.arctan2(to_x_m, to_y_m) + side * np.arctan2(radius_m, straight_m)
        turn_rad = np.mod(side * (arrival_rad - heading_rad) + _ROUNDING_RAD, _FULL_TURN_RAD)
        # Within the circle that it turns on it cannot come to.
        within = np.hypot(to_x_m, to_y_m) < radius_m * (1 - _ROUNDING_RAD)
        length_m = np.where(within, np.inf, radius_m * turn_rad + straight_m)
        shorter = length_m.argmin(axis=0), np.arange(len(poses))
        arrival_rad = arrival_rad[shorter]
        if self.sailing.is_in_still_water:
            time_s = length_m[shorter] / self.sailing.speed_mps
        else:
            turn_rad, straight_m = (side * turn_rad)[shorter], straight_m[shorter]
            time_s = self.sailing.turns_s(radius_m, poses, turn_rad)
            turned_x_m = self.home[0] - straight_m * np.sin(arrival_rad)
            turned_y_m = self.home[1] - straight_m * np.cos(arrival_rad)
            time_s += self.sailing.straights_s(straight_m, np.stack([turned_x_m, turned_y_m, arrival_rad], axis=-1))
        there = np.hypot(self.home[0] - x_m, self.home[1] - y_m) <= THERE_M
        return np.where(there, 0.0, time_s), arrival_rad


@lru_cache(maxsize=10_000)
def _past_zones(home: WayHome, pose: Pose, direct: tuple[float, float]) -> tuple[float, float]:
    """Time and heading of arrival of the way that takes least; `direct`: those where nothing is in the way."""
    radius_m, keep_out = home.turn_radius_m, home.keep_out
    if keep_out.is_clear([shortest_path(pose, Pose(*home.home, direct[1]), radius_m)]):
        return direct
    found = []
    for heading_rad in (direct[1], *(_FULL_TURN_RAD * number / ARRIVALS for number in range(ARRIVALS))):
        way = shortest_way(pose, Pose(*home.home, heading_rad), radius_m, keep_out)
        if way is not None:
            found.append((home.sailing.way_s(way), heading_rad))
    return min(found, default=direct)
