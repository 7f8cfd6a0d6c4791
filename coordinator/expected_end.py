"""When a primary is expected to have surveyed all: from its plan, its state and how it moves."""

from __future__ import annotations

from comms.said.messages import AgentState, Mode, Plan, PlannedTrack, RosterVehicle
from planner.dubins import Pose
from planner.sweep import Run, distance_over, run_over


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
        pose = run_of(ahead[0], entry.run_in_m).end
        ahead = ahead[1:]
        at_ms += round(entry.run_in_m / entry.speed_mps * 1000) if ahead else 0
    if not ahead:
        return at_ms
    runs = [run_of(track, entry.run_in_m) for track in ahead]
    # The last track's run-out comes after its end.
    way_m = distance_over(pose, runs, entry.turn_radius_m) - entry.run_in_m
    return at_ms + round(way_m / entry.speed_mps * 1000)


def run_of(track: PlannedTrack, run_in_m: float) -> Run:
    """A planned track with its run-in and run-out."""
    return run_over((track.start_x_m, track.start_y_m), (track.end_x_m, track.end_y_m), run_in_m)
