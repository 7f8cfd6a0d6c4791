"""How steadily a vehicle carries its sonar, as it settles after a turn and crabs in a current: what P_d that leaves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from comms.node import random_stream
from planner.currents import Current, Flow, along_and_across_mps
from planner.types import FloatArray, Point
from sim_world.config import CurrentConfig, VehicleConfig

CRAB_STEEPNESS = 4
"""Assumed: no figures of a sonar's P_d over its crab angle are published."""


@dataclass(frozen=True)
class Stream(Current):
    """A current, and what vehicles keep in it: their speed `over_ground`, or that through the water."""

    over_ground: bool = True

    @property
    def carries(self) -> bool:
        """Whether it makes a difference to where a vehicle is."""
        return not self.over_ground and self.drift_mps > 0.0


STILL_WATER = Stream(0.0, 0.0)


def make_current(config: CurrentConfig | None, seed: int) -> Stream:
    """The current of a world; when one that flows to and fro is slack is drawn."""
    if config is None:
        return STILL_WATER
    if config.grid is not None:
        return Stream(config.drift_mps, config.set_rad, grid=config.grid, over_ground=config.over_ground)
    slack_s = random_stream(seed, "world", "current").uniform(0.0, config.period_s or 0.0)
    return Stream(config.drift_mps, config.set_rad, config.period_s, slack_s, over_ground=config.over_ground)


def crab_rad(heading_rad: float, speed_mps: float, flow_mps: Flow, *, over_ground: bool = True) -> float:
    """How far the bow points off the track of a vehicle along `heading_rad` in a slower flow, to starboard above 0,
    within a right angle: it swims the difference of its way over the ground and the flow.

    `over_ground`: whether `speed_mps` is what it makes good; else it is what it swims.
    """
    along_mps, across_mps = along_and_across_mps(heading_rad, flow_mps)
    if over_ground:
        return math.atan2(-across_mps, speed_mps - along_mps)
    return -math.asin(across_mps / speed_mps)


class Steadiness:
    """What P_d is left of a vehicle's sonar for how it is carried.

    After a turn a share of P_d is lost, less the farther it has gone straight, evenly down to nothing
    (`SettlingConfig`). A sonar bears some crab and no more: at the sensor's `half_at_crab_rad` half of P_d is lost, at
    half that angle a 17th, and at twice it all but a 17th.
    """

    def __init__(self, config: VehicleConfig, current: Stream) -> None:
        self._settling = config.settling
        self._half_at_crab_rad = config.sensor.half_at_crab_rad
        self._speed_mps = config.speed_mps
        self._current = current

    @property
    def leaves_all(self) -> bool:
        """Whether nothing is ever lost."""
        return self._settling is None and self._half_at_crab_rad is None and not self.shears_looks

    @property
    def shears_looks(self) -> bool:
        """Whether its swath lies askew to its track."""
        return self._current.carries

    def crab_rad(self, heading_rad: float, time_s: float, place: Point = (0.0, 0.0)) -> float:
        """How far its bow points off a track at a place, to starboard above 0."""
        flow_mps = self._current.flow_mps(time_s, place)
        return crab_rad(heading_rad, self._speed_mps, flow_mps, over_ground=self._current.over_ground)

    def factor(
        self, straight_m: FloatArray, heading_rad: float, time_s: float, place: Point = (0.0, 0.0)
    ) -> FloatArray:
        """The share of P_d that is left, [0, 1], shape of `straight_m`: how far the vehicle has gone straight since its
        last turn, >= 0, on a track along the compass heading `heading_rad`; it is at `place`."""
        left = np.ones_like(straight_m)
        if self._settling is not None:
            left -= self._settling.share * np.maximum(0.0, 1.0 - straight_m / self._settling.length_m)
        if self._half_at_crab_rad is not None:
            angle_rad = abs(self.crab_rad(heading_rad, time_s, place))
            left /= 1.0 + (angle_rad / self._half_at_crab_rad) ** CRAB_STEEPNESS
        return left
