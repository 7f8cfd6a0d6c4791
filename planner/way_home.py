"""The way home: how long it takes from anywhere, and how much of a plan can be flown before it must be begun."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.currents import Sailing
from planner.dubins import Pose
from planner.sweep import Pass
from planner.types import FloatArray, Point

THERE_M = 0.05
"""Who is so near to a place is there."""
MARGIN_S = 10.0
"""Nothing is begun that leaves less beside the reserve: words that are lost, and asked for again, take their time."""
_FULL_TURN_RAD = 2 * math.pi
_ROUNDING_RAD = 1e-7


@dataclass(frozen=True)
class WayHome:
    """A vehicle's way to `home`, mission frame: a turn of `turn_radius_m` > 0 to either side until it heads for home,
    and then straight on; of the two the shorter one. From where it is there already it is none."""

    home: Point
    sailing: Sailing
    turn_radius_m: float

    def from_pose(self, pose: Pose) -> tuple[float, float]:
        """How long it takes from a pose, in seconds, and the compass heading of arrival, [0, 2 pi)."""
        time_s, heading_rad = self._ways(np.array([pose], dtype=np.float64))
        return float(time_s[0]), float(heading_rad[0]) % _FULL_TURN_RAD

    def times_s(self, poses: FloatArray) -> FloatArray:
        """How long it takes from poses, shape (n, 3) of x, y and heading; shape (n,)."""
        return self._ways(poses)[0]

    def passes_within(self, pose: Pose, passes: Sequence[Pass], time_s: float) -> int:
        """How many passes, the first ones, can be flown in their order from a pose so that there is time to come home
        before `time_s` have passed."""
        spent_s, here = 0.0, pose
        for count, one in enumerate(passes):
            spent_s, here = spent_s + self.sailing.passes_s([one], self.turn_radius_m, here), one.end
            if spent_s + self.from_pose(here)[0] > time_s:
                return count
        return len(passes)

    def _ways(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How long the shorter of the ways over either side takes, and its heading of arrival."""
        x_m, y_m, heading_rad = poses[:, 0], poses[:, 1], poses[:, 2]
        lengths_m, arrivals_rad, turns_rad, straights_m = [], [], [], []
        for side in (1.0, -1.0):
            to_x_m = self.home[0] - (x_m + side * self.turn_radius_m * np.cos(heading_rad))
            to_y_m = self.home[1] - (y_m - side * self.turn_radius_m * np.sin(heading_rad))
            straight_m = np.sqrt(np.maximum(to_x_m**2 + to_y_m**2 - self.turn_radius_m**2, 0.0))
            arrival_rad = np.arctan2(to_x_m, to_y_m) + side * np.arctan2(self.turn_radius_m, straight_m)
            turn_rad = np.mod(side * (arrival_rad - heading_rad) + _ROUNDING_RAD, _FULL_TURN_RAD)
            # Within the circle that it turns on it cannot come to.
            within = np.hypot(to_x_m, to_y_m) < self.turn_radius_m * (1 - _ROUNDING_RAD)
            lengths_m.append(np.where(within, np.inf, self.turn_radius_m * turn_rad + straight_m))
            arrivals_rad.append(arrival_rad)
            turns_rad.append(side * turn_rad)
            straights_m.append(straight_m)
        to_port = lengths_m[1] < lengths_m[0]
        arrival_rad = np.where(to_port, *arrivals_rad[::-1])
        if self.sailing.is_in_still_water:
            time_s = np.where(to_port, *lengths_m[::-1]) / self.sailing.speed_mps
        else:
            turn_rad, straight_m = np.where(to_port, *turns_rad[::-1]), np.where(to_port, *straights_m[::-1])
            time_s = self.sailing.turns_s(self.turn_radius_m, heading_rad, turn_rad)
            time_s += straight_m / self.sailing.made_good_mps(arrival_rad)
        there = np.hypot(self.home[0] - x_m, self.home[1] - y_m) <= THERE_M
        return np.where(there, 0.0, time_s), arrival_rad
