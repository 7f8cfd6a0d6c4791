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
    """At a column, see `bench.swath`, over rows `first` to `end` - 1, in their order if `up`. `waits`: not begun before
    all that it looks at is released; else as soon as the helper is there, though not before `from_s`, and what is not
    released yet does not count."""

    column: int
    first: int
    end: int
    up: bool = True
    waits: bool = True
    from_s: float = 0.0


Schedule = tuple[tuple[Leg, ...], ...]
"""For each helper its legs in order."""


@dataclass
class Simulator:
    """Flies schedules exactly: shortest Dubins paths, straight run-ins, no turns within a leg."""

    mission: Removable
    _ways_m: dict[tuple[float, ...], float] = field(default_factory=dict)
    _looks: dict[tuple[int, int], tuple[slice, FloatArray]] = field(default_factory=dict)
    _ready_s: dict[tuple[int, Leg], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mission = self.mission
        # What is released after the deadline is neither worth anything nor waited for.
        in_time = mission.inside & (mission.released_s < mission.ends_s)
        self._released_s = np.where(in_time, mission.released_s, -np.inf)
        self._worth_m2 = np.where(in_time, mission.risk, 0.0) * mission.grid.cell_area_m2
        self._total_m2 = float(self._worth_m2.sum())

    def removed_m2(self, schedule: Schedule) -> float:
        """The risk that a schedule removes, times the area."""
        left_m2 = self._worth_m2.copy()
        for helper, legs in enumerate(schedule):
            for leg, begins_s in zip(legs, self.begins_s(helper, legs), strict=True):
                if begins_s >= self._until_s(helper):
                    break
                self._look(helper, leg, begins_s, left_m2)
        return self._total_m2 - float(left_m2.sum())

    def in_time(self, schedule: Schedule) -> Schedule:
        """The schedule without the legs that would begin after the deadline or a helper's endurance."""
        return tuple(
            tuple(
                leg
                for leg, begins_s in zip(legs, self.begins_s(helper, legs), strict=True)
                if begins_s < self._until_s(helper)
            )
            for helper, legs in enumerate(schedule)
        )

    def begins_s(self, helper: int, legs: Sequence[Leg]) -> list[float]:
        """When a helper begins each of its legs."""
        flown_by = self.mission.helpers[helper]
        now_s, before, begins = 0.0, None, []
        for leg in legs:
            now_s += self.way_m(helper, before, leg) / flown_by.speed_mps
            now_s = max(now_s, self.ready_s(helper, leg) if leg.waits else leg.from_s)
            begins.append(now_s)
            now_s += (leg.end - leg.first) * self.mission.grid.cell_m / flown_by.speed_mps
            before = leg
        return begins

    def ready_s(self, helper: int, leg: Leg) -> float:
        """The earliest time to begin a leg at which all is released when it is looked at."""
        if (helper, leg) not in self._ready_s:
            columns, _ = self._swath(helper, leg.column)
            released_s = self._released_s[leg.first : leg.end, columns].max(axis=1)
            after_s = self._after_s(self.mission.helpers[helper], leg)
            self._ready_s[helper, leg] = float((released_s - after_s).max())
        return self._ready_s[helper, leg]

    def way_m(self, helper: int, before: Leg | None, leg: Leg) -> float:
        """The way from the end of one leg, or the start, to the begin of another, run-in included."""
        to_row = leg.first if leg.up else leg.end
        if before is None:
            key: tuple[float, ...] = (helper, leg.column, to_row, leg.up)
        else:
            # Only where one lies from the other matters.
            from_row = before.end if before.up else before.first
            key = (helper, leg.column - before.column, to_row - from_row, leg.up, before.up)
        if key not in self._ways_m:
            self._ways_m[key] = self._path_m(helper, before, leg)
        return self._ways_m[key]

    def _path_m(self, helper: int, before: Leg | None, leg: Leg) -> float:
        flown_by, frame = self.mission.helpers[helper], self.mission.grid.frame
        if before is None:
            across_m, along_m = map(float, frame.to_sweep(flown_by.start.x_m, flown_by.start.y_m))
            pose = Pose(across_m, along_m, flown_by.start.heading_rad - frame.heading_rad)
        else:
            pose = self._pose(flown_by, before, before.end if before.up else before.first)
        entry = self._pose(flown_by, leg, leg.first if leg.up else leg.end)
        begin = Pose(entry.x_m, entry.y_m - flown_by.run_in_m * math.cos(entry.heading_rad), entry.heading_rad)
        return shortest_path(pose, begin, flown_by.turn_radius_m).length_m + flown_by.run_in_m

    def _pose(self, flown_by: LegHelper, leg: Leg, row: int) -> Pose:
        """On a leg, at the edge before a row, sweep frame."""
        cell_m = self.mission.grid.cell_m
        return Pose(flown_by.sensor.swath.line(leg.column) * cell_m, row * cell_m, 0.0 if leg.up else math.pi)

    def _until_s(self, helper: int) -> float:
        return min(self.mission.ends_s, self.mission.helpers[helper].lasts_s)

    def _look(self, helper: int, leg: Leg, begins_s: float, left_m2: FloatArray) -> None:
        columns, leaves = self._swath(helper, leg.column)
        rows = slice(leg.first, leg.end)
        flown_by = self.mission.helpers[helper]
        ends_s = begins_s + (leg.end - leg.first) * self.mission.grid.cell_m / flown_by.speed_mps
        if ends_s <= self.mission.ends_s and begins_s >= self.ready_s(helper, leg):
            left_m2[rows, columns] *= leaves[rows]  # most legs; the rest takes longer
            return
        at_s = begins_s + self._after_s(flown_by, leg)
        counts = self._released_s[rows, columns] <= at_s[:, np.newaxis]
        counts[at_s > self.mission.ends_s] = False
        left_m2[rows, columns] *= np.where(counts, leaves[rows], 1.0)

    def _after_s(self, flown_by: LegHelper, leg: Leg) -> FloatArray:
        """How long after a leg's begin each of its rows is passed."""
        rows = np.arange(leg.end - leg.first, dtype=np.float64) + 0.5
        return (rows if leg.up else rows[::-1]) * float(self.mission.grid.cell_m / flown_by.speed_mps)

    def _swath(self, helper: int, column: int) -> tuple[slice, FloatArray]:
        """The columns of a leg's swath, and the share of the risk of each of their cells that a look leaves."""
        if (helper, column) not in self._looks:
            sensor = self.mission.helpers[helper].sensor
            columns = sensor.swath.columns(column, self.mission.grid.columns)
            seen = np.arange(columns.start, columns.stop)
            leaves = 1 - sensor.p_detect[seen - (column - sensor.swath.left), :, seen].T
            self._looks[helper, column] = columns, leaves
        return self._looks[helper, column]
