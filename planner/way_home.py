"""The way home: how long it takes from anywhere, and how much of a plan can be flown before it must be begun."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.dubins import Pose, shortest_path
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
    """A vehicle's way to `home`, mission frame, at `speed_mps` > 0: a turn of `turn_radius_m` > 0 to either side until
    it heads for home, and then straight on. From where it is there already it is none."""

    home: Point
    speed_mps: float
    turn_radius_m: float

    def from_pose(self, pose: Pose) -> tuple[float, float]:
        """How long it takes from a pose, in seconds, and the compass heading of arrival, [0, 2 pi)."""
        length_m, heading_rad = self._ways(np.array([pose], dtype=np.float64))
        return float(length_m[0]) / self.speed_mps, float(heading_rad[0]) % _FULL_TURN_RAD

    def times_s(self, poses: FloatArray) -> FloatArray:
        """How long it takes from poses, shape (n, 3) of x, y and heading; shape (n,)."""
        times_s: FloatArray = self._ways(poses)[0] / self.speed_mps
        return times_s

    def passes_within(self, pose: Pose, passes: Sequence[Pass], time_s: float) -> int:
        """How many passes, the first ones, can be flown in their order from a pose so that there is time to come home
        before `time_s` have passed."""
        spent_s, here = 0.0, pose
        for count, one in enumerate(passes):
            way_m = shortest_path(here, one.begin, self.turn_radius_m).length_m + one.length_m
            spent_s, here = spent_s + way_m / self.speed_mps, one.end
            if spent_s + self.from_pose(here)[0] > time_s:
                return count
        return len(passes)

    def _ways(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Length and heading of arrival of the shorter of the ways over either side."""
        x_m, y_m, heading_rad = poses[:, 0], poses[:, 1], poses[:, 2]
        lengths_m, arrivals_rad = [], []
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
        to_port = lengths_m[1] < lengths_m[0]
        length_m = np.where(to_port, lengths_m[1], lengths_m[0])
        there = np.hypot(self.home[0] - x_m, self.home[1] - y_m) <= THERE_M
        return np.where(there, 0.0, length_m), np.where(to_port, arrivals_rad[1], arrivals_rad[0])
