"""How steadily a vehicle carries its sonar: it settles after a turn and crabs in a current, and what P_d that leaves.

Neither moves it: it keeps its track and its speed over the ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from comms.node import random_stream
from planner.types import FloatArray
from sim_world.config import CurrentConfig, VehicleConfig


@dataclass(frozen=True)
class Current:
    """How the water flows, everywhere alike: at `speed_mps` towards the compass heading `toward_rad`.

    With `period_s` it flows to and fro as a sine does, so fast at most; at `slack_s` it turns towards that heading.
    """

    speed_mps: float
    toward_rad: float
    period_s: float | None = None
    slack_s: float = 0.0

    def flow_mps(self, time_s: float) -> tuple[float, float]:
        """The flow at a time, to the east and to the north."""
        speed_mps = self.speed_mps
        if self.period_s is not None:
            speed_mps *= math.sin(2 * math.pi * (time_s - self.slack_s) / self.period_s)
        return speed_mps * math.sin(self.toward_rad), speed_mps * math.cos(self.toward_rad)


CRAB_STEEPNESS = 4
"""Assumed: no figures of a sonar's P_d over its crab angle are published."""
STILL_WATER = Current(0.0, 0.0)


def make_current(config: CurrentConfig | None, seed: int) -> Current:
    """The current of a world; when one that flows to and fro is slack is drawn."""
    if config is None:
        return STILL_WATER
    slack_s = random_stream(seed, "world", "current").uniform(0.0, config.period_s or 0.0)
    return Current(config.speed_mps, config.toward_rad, config.period_s, slack_s)


def crab_rad(heading_rad: float, speed_mps: float, flow_mps: tuple[float, float]) -> float:
    """How far the bow points off the track of a vehicle that makes `speed_mps` over the ground along `heading_rad` in a
    slower flow, to either side, [0, pi / 2): it swims the difference of the two."""
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    east_mps, north_mps = flow_mps
    along_mps, across_mps = east_mps * sin + north_mps * cos, east_mps * cos - north_mps * sin
    return math.atan2(abs(across_mps), speed_mps - along_mps)


class Steadiness:
    """What P_d is left of a vehicle's sonar for how it is carried.

    After a turn a share of P_d is lost, less the farther it has gone straight, evenly down to nothing
    (`SettlingConfig`). A sonar bears some crab and no more: at the sensor's `half_at_crab_rad` half of P_d is lost, at
    half that angle a 17th, and at twice it all but a 17th.
    """

    def __init__(self, config: VehicleConfig, current: Current) -> None:
        self._settling = config.settling
        self._half_at_crab_rad = config.sensor.half_at_crab_rad
        self._speed_mps = config.speed_mps
        self._current = current

    def factor(self, straight_m: FloatArray, heading_rad: float, time_s: float) -> FloatArray:
        """The share of P_d that is left, [0, 1], shape of `straight_m`: how far the vehicle has gone straight since its
        last turn, >= 0, on a track along the compass heading `heading_rad`."""
        left = np.ones_like(straight_m)
        if self._settling is not None:
            left -= self._settling.share * np.maximum(0.0, 1.0 - straight_m / self._settling.length_m)
        if self._half_at_crab_rad is not None:
            angle_rad = crab_rad(heading_rad, self._speed_mps, self._current.flow_mps(time_s))
            left /= 1.0 + (angle_rad / self._half_at_crab_rad) ** CRAB_STEEPNESS
        return left
