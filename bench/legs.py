"""Legs along the grid: how long they take to fly, one after the other, and what looks from them remove."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bench.removable import LegHelper, Removable
from planner.dubins import Pose, shortest_path
from planner.types import FloatArray


@dataclass(frozen=True, slots=True)
class Leg:
    """Along a column over rows `first` to `end` - 1, in their order if `up`. `waits`: not begun before all that it
    looks at is released; else as soon as the helper is there, and what is not released yet does not count."""

    column: int
    first: int
    end: int
    up: bool = True
    waits: bool = True


Schedule = tuple[tuple[Leg, ...], ...]
"""For each helper its legs in order."""


@dataclass
class Simulator:
    """Flies schedules exactly: shortest Dubins paths, straight run-ins, no turns within a leg."""

    mission: Removable
    _ways_m: dict[tuple[float, ...], float] = field(default_factory=dict)
    _nats: dict[tuple[int, int], tuple[slice, FloatArray]] = field(default_factory=dict)
    _ready_s: dict[tuple[int, Leg], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mission = self.mission
        self._released_s = np.where(mission.inside, mission.released_s, -np.inf)
        self._worth_m2 = mission.risk * mission.grid.cell_area_m2
        # What is released after the deadline is not waited for.
        self._awaited_s = np.where(mission.released_s < mission.ends_s, self._released_s, -np.inf)

    def removed_m2(self, schedule: Schedule) -> float:
        """The risk that a schedule removes, times the area."""
        nats = np.zeros(self.mission.grid.shape)
        for helper, legs in enumerate(schedule):
            for leg, begins_s in zip(legs, self.begins_s(helper, legs), strict=True):
                self._look(helper, leg, begins_s, nats)
        return float((self._worth_m2 * -np.expm1(-nats)).sum())

    def in_time(self, schedule: Schedule) -> Schedule:
        """The schedule without the legs that would begin after the deadline or a helper's endurance."""
        return tuple(
            tuple(
                leg
                for leg, begins_s in zip(legs, self.begins_s(helper, legs), strict=True)
                if begins_s < min(self.mission.ends_s, self.mission.helpers[helper].lasts_s)
            )
            for helper, legs in enumerate(schedule)
        )

    def begins_s(self, helper: int, legs: Sequence[Leg]) -> list[float]:
        """When a helper begins each of its legs."""
        flown_by = self.mission.helpers[helper]
        now_s, before, begins = 0.0, None, []
        for leg in legs:
            now_s += self.way_m(helper, before, leg) / flown_by.speed_mps
            if leg.waits:
                now_s = max(now_s, self.ready_s(helper, leg))
            begins.append(now_s)
            now_s += (leg.end - leg.first) * self.mission.grid.cell_m / flown_by.speed_mps
            before = leg
        return begins

    def ready_s(self, helper: int, leg: Leg) -> float:
        """The earliest time to begin a leg at which all is released when it is looked at."""
        if (helper, leg) not in self._ready_s:
            columns, _ = self._swath(helper, leg.column)
            released_s = self._awaited_s[leg.first : leg.end, columns].max(axis=1)
            after_s = self._after_s(self.mission.helpers[helper], leg)
            self._ready_s[helper, leg] = float((released_s - after_s).max())
        return self._ready_s[helper, leg]

    def way_m(self, helper: int, before: Leg | None, leg: Leg) -> float:
        """The way from the end of one leg, or the start, to the begin of another, run-in included."""
        flown_by, cell_m = self.mission.helpers[helper], self.mission.grid.cell_m
        heading_rad = 0.0 if leg.up else math.pi
        to_along_m = (leg.first if leg.up else leg.end) * cell_m - flown_by.run_in_m * math.cos(heading_rad)
        to_across_m = leg.column * cell_m
        if before is None:
            frame = self.mission.grid.frame
            across_m, along_m = frame.to_sweep(flown_by.start.x_m, flown_by.start.y_m)
            key: tuple[float, ...] = (helper, to_across_m, to_along_m, heading_rad)
            pose = Pose(float(across_m), float(along_m), flown_by.start.heading_rad - frame.heading_rad)
            goal = Pose(to_across_m, to_along_m, heading_rad)
        else:
            # Only where one lies from the other matters.
            pose = Pose(0.0, 0.0, 0.0 if before.up else math.pi)
            from_m = (before.end if before.up else before.first) * cell_m
            goal = Pose(to_across_m - before.column * cell_m, to_along_m - from_m, heading_rad)
            key = (flown_by.turn_radius_m, flown_by.run_in_m, goal.x_m, goal.y_m, heading_rad, pose.heading_rad)
        if key not in self._ways_m:
            self._ways_m[key] = shortest_path(pose, goal, flown_by.turn_radius_m).length_m + flown_by.run_in_m
        return self._ways_m[key]

    def _look(self, helper: int, leg: Leg, begins_s: float, nats: FloatArray) -> None:
        columns, swath_nats = self._swath(helper, leg.column)
        rows = slice(leg.first, leg.end)
        at_s = begins_s + self._after_s(self.mission.helpers[helper], leg)
        counts = self._released_s[rows, columns] <= at_s[:, np.newaxis]
        counts[at_s > self.mission.ends_s] = False
        nats[rows, columns] += swath_nats[rows] * counts

    def _after_s(self, flown_by: LegHelper, leg: Leg) -> FloatArray:
        """How long after a leg's begin each of its rows is passed."""
        rows = np.arange(leg.end - leg.first, dtype=np.float64) + 0.5
        return (rows if leg.up else rows[::-1]) * float(self.mission.grid.cell_m / flown_by.speed_mps)

    def _swath(self, helper: int, column: int) -> tuple[slice, FloatArray]:
        """The columns within reach, and -ln(1 - P_d) of a look at each of their cells."""
        if (helper, column) not in self._nats:
            sensor = self.mission.helpers[helper].sensor
            columns = slice(max(0, column - sensor.reach), min(self.mission.grid.columns, column + sensor.reach + 1))
            distance = np.abs(np.arange(columns.start, columns.stop) - column)
            p_detect = sensor.p_detect[distance, :, np.arange(columns.start, columns.stop)].T
            self._nats[helper, column] = columns, -np.log1p(-p_detect)
        return self._nats[helper, column]
