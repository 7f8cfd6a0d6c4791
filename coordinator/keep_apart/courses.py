"""Where a vehicle will be: paths sailed one after another, and a circle to starboard after the last. And whether two
vehicles on their courses come too close to each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from comms.said.announcement import RosterVehicle
from comms.said.messages import AgentState, Mode, Plan, PlannedTrack
from coordinator.vehicles import pass_of, pose_of, sailing_of, tracks_of
from planner.currents import FlowGrid, Sailing
from planner.dubins import DubinsPath, Pose, poses_along, shifted
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import Pass
from planner.types import FloatArray
from planner.ways import way_or_direct

STEP_S = 2.0
"""Courses are sampled at the whole multiples of this, so that any two are at the same times."""
AHEAD_S = 900.0
"""A course is laid so far beyond its paths' end."""
LONGEST_S = 86_400.0
"""A course is laid no farther ahead, whatever a vehicle says of when it will be where."""
ON_TRACK_M = 2.0


@dataclass(frozen=True, eq=False)
class Sails:
    """How a vehicle sails paths that follow each other from `start_s` on, for `sails_s`, and then in a circle.
    `still_mps`: what it makes through the water. `knots`: in a current, how far it has come when, both of shape (n,),
    else None."""

    start_s: float
    still_mps: float
    paths: tuple[DubinsPath, ...]
    circle: DubinsPath
    sails_s: float
    knots: tuple[FloatArray, FloatArray] | None

    def way_m(self, sails_for_s: FloatArray) -> FloatArray:
        """How far it has come after some times; shape as theirs."""
        still_m: FloatArray = self.still_mps * sails_for_s
        if self.knots is None:
            return still_m
        return np.interp(sails_for_s, *self.knots) + np.maximum(still_m - self.still_mps * self.sails_s, 0.0)

    @property
    def fastest_mps(self) -> float:
        """No faster does it come anywhere; infinite where that is not known."""
        return self.still_mps if self.knots is None else math.inf

    def pose_at(self, time_s: float) -> Pose:
        """Where it is."""
        left_m = float(self.way_m(np.array(time_s - self.start_s)))
        for path in self.paths:
            if left_m < path.length_m:
                return path.pose_at(left_m)
            left_m -= path.length_m
        return self.circle.pose_at(left_m)


@dataclass(frozen=True, eq=False)
class Course:
    """`poses[k]`, shape (n, 3), is where the vehicle is `first + k` steps after the mission's start: x_m, y_m,
    heading_rad, mission frame. `arrives_s`: when it has sailed its paths, and begins to circle. `sails`: tells the pose
    at any time in s, between the steps exactly; before `start_s` as then."""

    start_s: float
    first: int
    poses: FloatArray
    arrives_s: float
    sails: Sails
    late_s: float = 0.0
    """By so much it is later than `sails` tells."""
    _asked: dict[float, Pose] = field(default_factory=dict)
    """What was asked for last, as many courses are laid against one at one time."""

    @property
    def end(self) -> int:
        """The first step that it does not tell of any more."""
        return self.first + len(self.poses)

    def at(self, time_s: float) -> Pose:
        """Where the vehicle is; before its start and after its last step as then."""
        if time_s not in self._asked:
            self._asked.clear()
            self._asked[time_s] = self.sails.pose_at(min(time_s, (self.end - 1) * STEP_S) - self.late_s)
        return self._asked[time_s]

    def later(self, steps: int) -> Course:
        """The same, so many steps later; until then the vehicle is where it begins."""
        waiting, late_s = np.repeat(self.poses[:1], steps, axis=0), steps * STEP_S
        return replace(
            self,
            poses=np.concatenate([waiting, self.poses]),
            arrives_s=self.arrives_s + late_s,
            late_s=self.late_s + late_s,
            _asked={},
        )


def course(
    start: Pose,
    start_s: float,
    sailing: Sailing,
    turn_radius_m: float,
    paths: Sequence[DubinsPath],
    keep_out: KeepOut = NOWHERE,
) -> Course:
    """The course from a pose at a time, along paths that follow each other, and then in a circle to starboard, or to
    port where there is only room for that; of paths that take longer than LONGEST_S no more than that."""
    first = math.ceil(start_s / STEP_S)
    speed_mps, knots = sailing.speed_mps, None
    sails_s = sum(path.length_m for path in paths) / speed_mps
    if not sailing.is_in_still_water:
        knots = sailing.knots(paths)
        sails_s = float(knots[0][-1])
    lasts_s = min(sails_s + AHEAD_S, LONGEST_S)
    end = paths[-1].pose_at(paths[-1].length_m) if paths else start
    side = keep_out.circling(end, turn_radius_m) or 1
    circle = DubinsPath(end, turn_radius_m, (side, 0, 0), (speed_mps * (AHEAD_S + STEP_S), 0.0, 0.0))
    sails = Sails(start_s, speed_mps, tuple(paths), circle, sails_s, knots)
    times_s = STEP_S * np.arange(first, first + math.ceil(lasts_s / STEP_S), dtype=np.float64)
    poses = poses_along([*paths, circle], sails.way_m(times_s - start_s))
    return Course(start_s, first, poses, start_s + sails_s, sails)


def lying_still(pose: Pose, from_s: float) -> Course:
    """The course of a vehicle that has not been under way yet."""
    poses = np.tile(np.array(pose, dtype=np.float64), (math.ceil(AHEAD_S / STEP_S), 1))
    sails = Sails(from_s, 0.0, (), straight(pose, 0.0, 1.0), 0.0, None)
    return Course(from_s, math.ceil(from_s / STEP_S), poses, from_s, sails)


def survey_course(
    entry: RosterVehicle,
    state: AgentState,
    plan: Plan | None,
    heard_s: float,
    keep_out: KeepOut = NOWHERE,
    flows: FlowGrid | None = None,
) -> Course:
    """The course of a primary along all tracks that it has planned, from what it said at `heard_s`."""
    pose, radius_m, sailing = (
        pose_of(state),
        entry.turn_radius_m,
        sailing_of(entry, flows),
    )
    behind, ahead = tracks_of(plan, state)
    if state.mode is Mode.FINISHED:
        ahead = []
    if state.mode is Mode.SURVEY and ahead and ahead[0].number == state.works_on and state.expected_end_ms > 0:
        # When the track ends is known more exactly than where the vehicle was last.
        begin, end = pass_of(ahead.pop(0), entry)
        left_s = max(0.0, state.expected_end_ms / 1000 - heard_s)
        left_m = left_s / sailing.straight_s(1.0, end) + entry.run_in_m
        if not sailing.is_known:  # what it makes good until then
            left_m = run_out_left_m(end, pose, math.dist(begin[:2], end[:2])) or left_m
        pose = shifted(end[:2], end.heading_rad, -left_m)
    else:
        left_m = survey_run_out_left_m(entry, behind, pose)
        end = shifted(pose[:2], pose.heading_rad, left_m)
    paths, here = [straight(pose, left_m, radius_m)], end
    for track in ahead:
        one = pass_of(track, entry)
        paths += [*way_or_direct(here, one.begin, radius_m, keep_out), straight(one.begin, one.length_m, radius_m)]
        here = one.end
    return course(pose, heard_s, sailing, radius_m, paths, keep_out)


def sweep_course(
    pose: Pose,
    start_s: float,
    sailing: Sailing,
    turn_radius_m: float,
    passes: Sequence[Pass],
    *,
    entered: bool = False,
    run_out_m: float = 0.0,
    keep_out: KeepOut = NOWHERE,
) -> Course:
    """The course over passes of a strip's legs from a pose at a time; `entered`: the pose is on the first of them;
    `run_out_m`: what is first to be sailed straight on, see `run_out_left_m`."""
    paths, here = [straight(pose, run_out_m, turn_radius_m)], shifted(pose[:2], pose.heading_rad, run_out_m)
    for place, (begin, end) in enumerate(passes):
        if not (entered and place == 0):
            paths += way_or_direct(here, begin, turn_radius_m, keep_out)
            here = begin
        paths.append(straight(here, math.dist(here[:2], end[:2]), turn_radius_m))
        here = end
    return course(pose, start_s, sailing, turn_radius_m, paths, keep_out)


def straight(start: Pose, length_m: float, turn_radius_m: float) -> DubinsPath:
    """A path straight ahead."""
    return DubinsPath(start, turn_radius_m, (0, 0, 0), (length_m, 0.0, 0.0))


def run_out_left_m(end: Pose, pose: Pose, run_in_m: float) -> float:
    """What a vehicle has still to sail straight to a run-out's end; 0 where it is not on the run-out."""
    sin, cos = math.sin(end.heading_rad), math.cos(end.heading_rad)
    dx_m, dy_m = end.x_m - pose.x_m, end.y_m - pose.y_m
    ahead_m, beside_m = dx_m * sin + dy_m * cos, dx_m * cos - dy_m * sin
    on_it = abs(beside_m) <= ON_TRACK_M and 0 < ahead_m <= run_in_m + ON_TRACK_M
    return ahead_m if on_it and math.cos(pose.heading_rad - end.heading_rad) > 0.99 else 0.0


def survey_run_out_left_m(entry: RosterVehicle, behind: Sequence[PlannedTrack], pose: Pose) -> float:
    """The same of the run-out behind the last of the tracks that a primary has `behind` it."""
    return run_out_left_m(pass_of(behind[-1], entry).end, pose, entry.run_in_m) if behind else 0.0


ROUNDING_M = 0.01
"""Courses that are said to be too far off to meet are so by more than this: what is summed step by step is rounded."""
NO_NEARER_M = 1.0
"""Vehicles that begin too close may part; they come no nearer by more than this."""
SOON_S = 10.0
"""So long courses are known well enough for those that part to come as near as to `soon_m`."""


@dataclass(frozen=True)
class Approach:
    """How near two vehicles come, and when they are first nearer than they may be."""

    distance_m: float
    time_s: float


def too_close(
    one: Course, other: Course, least_m: float, from_s: float, until_s: float, soon_m: float = math.inf
) -> Approach | None:
    """The first time at which two vehicles come nearer to each other than `least_m`, and how near; None for never.

    Between two steps both are assumed to go straight, which in a turn of 6 m at 2 m/s is wrong by 0.3 m. Vehicles that
    are nearer at the beginning are too close only if they come nearer still, at once than `soon_m`, or again after they
    were apart.
    """
    first = max(one.first, other.first, int(from_s / STEP_S) + 1)
    last = min(one.end, other.end, int(until_s / STEP_S) + 2)
    if last - first < 1:
        return None
    (x_m, y_m), (its_x_m, its_y_m) = one.at(from_s)[:2], other.at(from_s)[:2]
    lasts_s = (last - 1) * STEP_S - from_s
    closing_m = lasts_s * (one.sails.fastest_mps + other.sails.fastest_mps)
    if math.hypot(x_m - its_x_m, y_m - its_y_m) - closing_m > least_m + ROUNDING_M:
        return None
    apart = np.empty((1 + last - first, 2))
    apart[0] = x_m - its_x_m, y_m - its_y_m
    np.subtract(
        one.poses[first - one.first : last - one.first, :2],
        other.poses[first - other.first : last - other.first, :2],
        out=apart[1:],
    )
    nearest_m = _nearest_m(apart)
    near = nearest_m < least_m
    if not near.any():
        return None
    begin_m = float(np.hypot(*apart[0]))
    if begin_m < least_m:
        parting = near.size if near.all() else int(near.argmin())
        soon = min(parting, 1 + int(SOON_S / STEP_S))
        near[:soon] = nearest_m[:soon] < min(begin_m - NO_NEARER_M, soon_m)
        near[soon:parting] = nearest_m[soon:parting] < begin_m - NO_NEARER_M
        if not near.any():
            return None
    step = int(near.argmax())
    return Approach(float(nearest_m[step:][near[step:]].min()), (first + step - 1) * STEP_S if step else from_s)


def _nearest_m(apart: FloatArray) -> FloatArray:
    """The least distance within each step; `apart`, shape (n, 2): from one to the other, between the steps linear."""
    begin, change = apart[:-1], apart[1:] - apart[:-1]
    square = np.einsum("ij,ij->i", change, change)
    share = -np.einsum("ij,ij->i", begin, change) / np.maximum(square, 1e-12)
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    nearest: FloatArray = np.hypot(*(begin + share[:, np.newaxis] * change).T)
    return nearest
