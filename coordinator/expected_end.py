"""When a primary is expected to have surveyed all: from its plan, its state and how it moves."""

from __future__ import annotations

import math

from comms.messages import AgentState, Mode, Plan, PlannedTrack, RosterVehicle
from planner.dubins import Pose, shortest_path
from planner.sweep import shifted


def expected_end_ms(entry: RosterVehicle, state: AgentState | None, plan: Plan | None, heard_ms: int) -> int | None:
    """Milliseconds since the mission's start; None where that cannot be told.

    The track that the state tells it works on ends when the state expects; each further one takes the shortest way
    there, with run-in and run-out. `heard_ms`: when the state was sent. Tracks that a later plan adds or drops are not
    known.
    """
    if state is None or plan is None or state.mode is Mode.FINISHED:
        return None
    ahead = [track for track in plan.tracks if not track.flown]
    at_ms, pose = heard_ms, Pose(state.x_m, state.y_m, state.heading_rad)
    if ahead and ahead[0].number == state.works_on and state.expected_end_ms > 0:
        at_ms = max(at_ms, state.expected_end_ms)
        pose = run_of(ahead[0], entry.run_in_m)[1]
        ahead = ahead[1:]
        at_ms += round(entry.run_in_m / entry.speed_mps * 1000) if ahead else 0
    way_m = 0.0
    for track in ahead:
        begin, end = run_of(track, entry.run_in_m)
        way_m += shortest_path(pose, begin, entry.turn_radius_m).length_m
        way_m += math.dist(begin[:2], end[:2])
        pose = end
    if ahead:
        way_m -= entry.run_in_m  # the last track's run-out comes after its end
    return at_ms + round(way_m / entry.speed_mps * 1000)


def run_of(track: PlannedTrack, run_in_m: float) -> tuple[Pose, Pose]:
    """Where a track's run-in begins and where its run-out ends."""
    heading_rad = math.atan2(track.end_x_m - track.start_x_m, track.end_y_m - track.start_y_m) % (2 * math.pi)
    begin = shifted((track.start_x_m, track.start_y_m), heading_rad, -run_in_m)
    return begin, shifted((track.end_x_m, track.end_y_m), heading_rad, run_in_m)
