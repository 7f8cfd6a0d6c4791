"""Legs along the grid or across it: how long they take to fly, one after the other, and what looks from them remove."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bench.removable import LegHelper, Removable
from coordinator.cut.ground import OBJECTIVES, Objective
from planner.dubins import Pose, shifted, shortest_path
from planner.types import FloatArray


class Leg(NamedTuple):
    """At a column, see `bench.swath`, over rows `first` to `end` - 1, in their order if `up`. If `across`, at a row and
    over columns."""

    place: int
    first: int
    end: int
    up: bool = True
    across: bool = False


Schedule = tuple[tuple[Leg, ...], ...]
"""For each helper its legs in order."""


@dataclass
class Simulator:
    """Flies schedules exactly: shortest Dubins paths, straight run-ins, no turns within a leg. `objective`: by which
    schedules are judged."""

    mission: Removable
    objective: Objective = OBJECTIVES["mean"]
    _ways_m: dict[tuple[float, ...], float] = field(default_factory=dict)
    _looks: dict[tuple[int, int, bool], tuple[slice, FloatArray]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._cell_m = self.mission.grid.cell_m

    def gain_m2(self, schedule: Schedule) -> float:
        """How much less a schedule makes the objective, times the area."""
        return self.mission.gain_m2(self.left(schedule), self.objective)

    def left(self, schedule: Schedule) -> FloatArray:
        """The residual risk that a schedule leaves, grid shape: what is passed until the deadline counts."""
        left = self.mission.risk.copy()
        for helper, legs in enumerate(schedule):
            for leg, begins_s in zip(legs, self.begins_s(helper, legs), strict=True):
                if begins_s >= self._until_s(helper):
                    break
                self._look(helper, leg, begins_s, left)
        return left

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
        speed_mps = self.mission.helpers[helper].speed_mps
        now_s, before, begins = 0.0, None, []
        for leg in legs:
            now_s += self.way_m(helper, before, leg) / speed_mps
            begins.append(now_s)
            now_s += (leg.end - leg.first) * self._cell_m / speed_mps
            before = leg
        return begins

    def way_m(self, helper: int, before: Leg | None, leg: Leg) -> float:
        """The way from the end of one leg, or the start, to the begin of another, run-in included."""
        place, first, end, up, across = leg
        to = first if up else end
        key: tuple[float, ...] = (helper, place, to, up, across)
        if before is not None:  # only where one lies from the other matters
            origin, ends = before.place, before.end if before.up else before.first
            away = (place - origin, to - ends) if across == before.across else (to - origin, place - ends)
            key = (helper, *away, up, across, before.up, before.across)
        if key not in self._ways_m:
            self._ways_m[key] = self._path_m(helper, before, leg)
        return self._ways_m[key]

    def _path_m(self, helper: int, before: Leg | None, leg: Leg) -> float:
        flown_by, frame = self.mission.helpers[helper], self.mission.grid.frame
        if before is None:
            across_m, along_m = frame.to_sweep(flown_by.start.x_m, flown_by.start.y_m)
            pose = Pose(across_m, along_m, flown_by.start.heading_rad - frame.heading_rad)
        else:
            pose = self._pose(flown_by, before, before.end if before.up else before.first)
        first = self._pose(flown_by, leg, leg.first if leg.up else leg.end)
        begin = shifted(first[:2], first.heading_rad, -flown_by.run_in_m)
        return shortest_path(pose, begin, flown_by.turn_radius_m).length_m + flown_by.run_in_m

    def _pose(self, flown_by: LegHelper, leg: Leg, edge: int) -> Pose:
        """On a leg, at the edge before a row, or a column if it lies across; sweep frame."""
        line_m = flown_by.sensor(across=leg.across).swath.line(leg.place) * self._cell_m
        edge_m, half_m = edge * self._cell_m, self._cell_m / 2
        # Row 0 has its middle half a cell from the origin, column 0 at the origin.
        if leg.across:
            return Pose(edge_m - half_m, line_m + half_m, math.pi / 2 if leg.up else -math.pi / 2)
        return Pose(line_m, edge_m, 0.0 if leg.up else math.pi)

    def _until_s(self, helper: int) -> float:
        return min(self.mission.ends_s, self.mission.helpers[helper].lasts_s)

    def _look(self, helper: int, leg: Leg, begins_s: float, left: FloatArray) -> None:
        place, first, end, up, across = leg
        lines, leaves = self._swath(helper, place, across)
        step_s = self._cell_m / self.mission.helpers[helper].speed_mps
        passed = math.floor((self.mission.ends_s - begins_s) / step_s + 0.5)  # up to the middle of the last
        if passed < end - first:
            first, end = (first, first + passed) if up else (end - passed, end)
        ground = left.T if across else left
        ground[first:end, lines] *= leaves[first:end]

    def _swath(self, helper: int, place: int, across: bool) -> tuple[slice, FloatArray]:
        """The lines of cells in a leg's swath, and the share of the risk of each of their cells that a look leaves."""
        if (helper, place, across) not in self._looks:
            sensor = self.mission.helpers[helper].sensor(across=across)
            lines = sensor.swath.columns(place, sensor.p_detect.shape[2])
            seen = np.arange(lines.start, lines.stop)
            leaves = 1 - sensor.p_detect[seen - (place - sensor.swath.left), :, seen].T
            self._looks[helper, place, across] = lines, leaves
        return self._looks[helper, place, across]
