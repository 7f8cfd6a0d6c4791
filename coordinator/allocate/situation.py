"""What an allocator is asked: which strips are open, where each helper is and will be, how long the mission lasts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from planner.currents import Sailing
from planner.dubins import Pose
from planner.keep_out import NOWHERE, KeepOut
from planner.types import FloatArray, Strip
from planner.way_home import WayHome

HORIZON_S = 4 * 3600.0
"""How far ahead is planned while nobody can tell when the mission ends."""
LONG_WAIT_S = 60.0
"""So long is taken to be waited where nobody can tell how long it must be: what is shorter is told."""


@dataclass(frozen=True)
class OpenStrip:
    """A strip and the residual risk on it as it counts in the objective, summed over its cells and times their area; a
    sweep by a helper is expected to remove its `p_detect` of that."""

    strip: Strip
    risk_m2: float


@dataclass(frozen=True)
class Helper:
    """A helper that is there, free or at work.

    `pose`: where it is, mission frame. `free_at`, `free_s`: where and when it will be free; where it is, and now, if it
    is free. `task`: the strip that it has, None if it is free, or so soon that it is to be given its next now.
    `swath_m`: the full width that one leg covers; `p_detect`: its P_d there. `lasts_until_s`: until when its battery
    lasts, less its reserve; with `way_home` it must be home by then, else at the end of a sweep. `refused`: strips that
    it is not to be offered. `sweeping`: whether it is on its task's strip already, or cannot be turned round otherwise.
    `beside_m`: how far beside the middle of what a leg covers it flies it, on either side; `lead_m`: how much earlier
    than over the ground that it sees. Times are seconds since the mission's start. `keep_out`: what it may not enter;
    strips that it cannot fly therefore are among those refused. `heard_s`: when it has said what is known of it, which
    over a slow link may be minutes ago. `waits_s`: how long it must wait before it may set out, by number of the strip
    to which that is known; from its task's strip if it has one. Where that is for long it is `LONG_WAIT_S`, and the
    strip among those refused.
    """

    vehicle: str
    pose: Pose
    free_at: Pose
    free_s: float
    task: OpenStrip | None
    speed_mps: float
    turn_radius_m: float
    run_in_m: float
    swath_m: float
    p_detect: float
    lasts_until_s: float
    refused: frozenset[int]
    sweeping: bool = False
    beside_m: float = 0.0
    lead_m: float = 0.0
    keep_out: KeepOut = NOWHERE
    way_home: WayHome | None = None
    heard_s: float = 0.0
    waits_s: Mapping[int, float] = field(default_factory=dict)

    def wait_s(self, strips: Sequence[OpenStrip]) -> FloatArray:
        """How long it must wait, free as it is, before it may set out to each of some strips."""
        return np.array([self.waits_s.get(one.strip.number, 0.0) for one in strips], dtype=np.float64)

    @property
    def sailing(self) -> Sailing:
        """What it makes good over the ground."""
        return Sailing(self.speed_mps) if self.way_home is None else self.way_home.sailing

    def run_in_s(self, poses: FloatArray) -> FloatArray:
        """How long run-ins that begin in poses take, or run-outs about there; x, y and heading along a last axis of 3,
        shape without it."""
        if self.sailing.is_in_still_water:
            return np.full(poses.shape[:-1], self.run_in_m / self.speed_mps)
        return self.sailing.straights_s(np.full(poses.shape[:-1], self.run_in_m), poses)

    def home_s(self, poses: FloatArray) -> FloatArray:
        """How long its battery must last after sweeps: until it is home, where it must come home, from the poses in
        which it leaves them, behind the run-out; shape (n, 3). Shape (n,)."""
        if self.way_home is None:
            return np.zeros(len(poses))
        return self.way_home.times_s(poses) + self.run_in_s(poses)


@dataclass(frozen=True)
class Situation:
    """All that an allocator decides on. Times are seconds since the mission's start.

    `deadline_s`: when the mission is expected to be over, infinite while nobody can tell. `strips`: the open ones.
    `helpers`: those that are there. `switch_margin`: share of a task's worth by which turning a helper round must be
    better. `price`: what a metre flown brings where strips are cut, as what they count per metre; 0 while nothing is
    known of it. `soonest`: whether what is worth most is to be removed as soon as may be, as the mission's goal is
    expected to be reached before the deadline with much to spare.
    """

    now_s: float
    deadline_s: float
    strips: tuple[OpenStrip, ...]
    helpers: tuple[Helper, ...]
    switch_margin: float = 0.2
    price: float = 0.0
    soonest: bool = False

    @property
    def free(self) -> tuple[Helper, ...]:
        """The helpers without a task."""
        return tuple(helper for helper in self.helpers if helper.task is None)


class Allocator(Protocol):
    """Decides offers. Pure: the same situation gives the same answer.

    One that plans routes over the open strips, and offers these one after the other, may say so by an attribute
    `lays_strips`, True: strips are then laid for the best routes over them before one is offered, see
    `coordinator.cut.laying`.
    """

    def assign(self, situation: Situation) -> Mapping[str, int]:
        """The number of an open strip for each helper that is to be sent to one; each strip at most once.
        An int, or one of numpy's.

        A helper that has a task is told to give it back, which is no loss: it is offered a strip once it is free.
        """
