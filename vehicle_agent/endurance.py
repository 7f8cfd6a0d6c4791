"""What a vehicle's battery is reckoned to last for: work, and the way home after it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from planner.dubins import Pose
from planner.keep_out import KeepOut
from planner.sweep import Pass
from planner.way_home import MARGIN_S
from vehicle_agent.config import Homing

MARGIN_MS = round(MARGIN_S * 1000)
ON_ITS_WAY_HOME = "its battery is low, it has gone home"


class Endurance:
    """`endurance_ms`: how long it lasts from the mission's start. `homing`: None where the vehicle need not come
    home."""

    def __init__(self, endurance_ms: int, homing: Homing | None) -> None:
        self.homing = homing
        self._endurance_ms = endurance_ms
        self._rests_ms: int | None = None

    def keep_out_of(self, keep_out: KeepOut) -> None:
        """The way home leads round ground to keep out of."""
        if self.homing is not None:
            self.homing = replace(self.homing, way=replace(self.homing.way, keep_out=keep_out))

    def rest(self, since_ms: int) -> None:
        """The vehicle lies, and needs none any more."""
        self._rests_ms = since_ms

    def left(self, now_ms: int) -> float:
        """Share that is left."""
        if self._rests_ms is not None:
            now_ms = min(now_ms, self._rests_ms)
        return max(0.0, 1.0 - now_ms / self._endurance_ms)

    def run_out_ms(self, one: Pass, run_in_m: float) -> int:
        """How long the run-out of a pass takes where that counts, as the vehicle must come home; else 0."""
        if self.homing is None:
            return 0
        return round(self.homing.way.sailing.straight_s(run_in_m, one.end) * 1000)

    def lasts_from(self, pose: Pose, at_ms: int, margin_ms: int = 0) -> bool:
        """Whether the vehicle comes home with its reserve, and a margin, from a pose in which it is at a time."""
        if self.homing is None:
            return self.left(at_ms) > 0.0
        left_ms = self._endurance_ms - self.homing.reserve_ms - at_ms - margin_ms
        way = self.homing.way
        return way.is_well_within(pose, left_ms / 1000) or round(way.from_pose(pose)[0] * 1000) <= left_ms

    def lasts_for(self, pose: Pose, passes: Sequence[Pass], now_ms: int) -> int:
        """For how many of some passes it lasts, the first ones, flown in their order from a pose now."""
        if self.homing is None:
            return len(passes)
        left_ms = self._endurance_ms - self.homing.reserve_ms - MARGIN_MS - now_ms
        return self.homing.way.passes_within(pose, passes, left_ms / 1000)

    def is_low(self, pose: Pose, now_ms: int, *, circles: bool) -> bool:
        """Whether it is time to go home. `circles`: the vehicle only waits, and may turn towards home as far as it can,
        until this is asked again."""
        if self.homing is None:
            return False
        way = self.homing.way
        circle_s = 2 * math.pi * way.turn_radius_m / way.sailing.slowest_mps
        wait_ms = MARGIN_MS + round(circle_s * 1000) if circles else 0
        return not self.lasts_from(pose, now_ms, wait_ms)
