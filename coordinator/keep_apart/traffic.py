"""Where each vehicle of the fleet is expected to be, from what it has said and what it was told."""

from __future__ import annotations

import math
from dataclasses import dataclass

from comms.said.messages import AgentState, Mode
from coordinator.keep_apart.courses import (
    Course,
    course,
    lying_still,
    run_out_left_m,
    straight,
    survey_course,
    survey_run_out_left_m,
    sweep_course,
)
from coordinator.vehicles import KnownVehicle, sailing_of
from planner.dubins import DubinsPath, Pose, shortest_path
from planner.footprints import footprint_of
from planner.sweep import Sweep, shortest_sweep, sweeps_by
from planner.types import Point, Strip


@dataclass(frozen=True)
class _Sweeping:
    """A helper's work on a strip: how far it is known to have come, 0 offered, 1 on its way, 2 on the first leg."""

    strip: Strip
    stage: int
    sweep: Sweep
    course: Course


class Traffic:
    """Courses are laid when asked for, and kept until something is heard that changes them."""

    def __init__(self) -> None:
        self._surveys: dict[str, tuple[object, int, Course]] = {}
        self._sweeps: dict[str, _Sweeping] = {}
        self._entered: dict[str, Sweep] = {}
        """Of each helper the sweep that it has begun last."""
        self._errands: dict[str, Course] = {}
        self._rests: dict[str, tuple[int, Course]] = {}

    def course(self, vehicle: KnownVehicle, strip: Strip | None, now_s: float) -> Course | None:
        """Where a vehicle will be; None for one that is lost, was never heard or rests at home.

        `strip`: what it has of the coordinator.
        """
        state = vehicle.state
        if vehicle.lost or state is None:
            return None
        if state.mode.is_out_of_work:
            return None if state.mode is Mode.HOME else self._homeward(vehicle, state)
        if vehicle.entry.role.surveys and vehicle.finished_ms is None:
            return self._survey(vehicle, now_s)
        if strip is not None:
            return self._sweep(vehicle, strip)
        errand = self._errands.get(vehicle.entry.vehicle)
        if errand is not None and now_s < errand.arrives_s:
            return errand
        return self._rest(vehicle)

    def to_strip(self, vehicle: KnownVehicle, strip: Strip | None, other: Strip, now_s: float) -> tuple[Course, Sweep]:
        """The course of a helper that leaves what it does and sets out to another strip now, and how it sweeps it."""
        pose, start_s = self._here(vehicle, now_s, strip)
        entry, run_out_m = vehicle.entry, self._run_out_m(vehicle, pose)
        sweep = _sweep_from(pose, vehicle, other)
        return sweep_course(pose, start_s, sailing_of(entry), entry.turn_radius_m, sweep, run_out_m=run_out_m), sweep

    def aside(self, vehicle: KnownVehicle, strip: Strip | None, place: Point, now_s: float) -> Course:
        """The course of a helper that leaves what it does and waits at a place."""
        pose, start_s = self._here(vehicle, now_s, strip)
        entry, run_out = vehicle.entry, self._run_out(vehicle, pose)
        end = run_out.pose_at(run_out.length_m)
        way = shortest_path(end, _arrival(end, place), entry.turn_radius_m)
        return course(pose, start_s, sailing_of(entry), entry.turn_radius_m, [run_out, way])

    def holding(self, vehicle: KnownVehicle, strip: Strip | None, now_s: float) -> Course:
        """The course of a helper that leaves what it does and circles where it is."""
        pose, start_s = self._here(vehicle, now_s, strip)
        entry, run_out = vehicle.entry, self._run_out(vehicle, pose)
        return course(pose, start_s, sailing_of(entry), entry.turn_radius_m, [run_out])

    def offered(self, name: str, strip: Strip, laid: Course, sweep: Sweep) -> None:
        """A helper was sent to a strip."""
        self._errands.pop(name, None)
        self._sweeps[name] = _Sweeping(strip, 0, sweep, laid)

    def sent_aside(self, vehicle: KnownVehicle, strip: Strip | None, place: Point, now_s: float) -> None:
        """A helper was told to wait at a place."""
        self._errands[vehicle.entry.vehicle] = self.aside(vehicle, strip, place, now_s)

    def _here(self, vehicle: KnownVehicle, now_s: float, strip: Strip | None = None) -> tuple[Pose, float]:
        state = vehicle.state
        assert state is not None
        laid = self.course(vehicle, strip, now_s)
        return (Pose(state.x_m, state.y_m, state.heading_rad), now_s) if laid is None else laid.at(now_s)

    def _survey(self, vehicle: KnownVehicle, now_s: float) -> Course:
        state, plan, name = vehicle.state, vehicle.plan, vehicle.entry.vehicle
        assert state is not None
        ends_ms = state.expected_end_ms if state.mode is Mode.SURVEY else 0
        told = (plan.revision if plan else 0, state.mode, state.works_on, ends_ms)
        known = self._surveys.get(name)
        # One that should have sailed its tracks, or has none yet, is where it was heard last.
        if known is None or known[0] != told or (known[1] != vehicle.heard_ms and now_s >= known[2].arrives_s):
            laid = survey_course(vehicle.entry, state, plan, vehicle.heard_ms / 1000)
            known = self._surveys[name] = told, vehicle.heard_ms, laid
        return known[2]

    def _sweep(self, vehicle: KnownVehicle, strip: Strip) -> Course:
        state, entry = vehicle.state, vehicle.entry
        assert state is not None
        stage = 0 if state.works_on != strip.number else 2 if state.mode is Mode.REVISIT else 1
        known = self._sweeps.get(entry.vehicle)
        if known is None or known.strip != strip or known.stage < stage:
            pose, heard_s = Pose(state.x_m, state.y_m, state.heading_rad), vehicle.heard_ms / 1000
            entered = known is not None and known.strip == strip and stage == 2
            sweep = known.sweep if known and entered else _sweep_from(pose, vehicle, strip)
            run_out_m = 0.0 if entered else self._run_out_m(vehicle, pose)
            radius_m = entry.turn_radius_m
            laid = sweep_course(pose, heard_s, sailing_of(entry), radius_m, sweep, entered=entered, run_out_m=run_out_m)
            known = self._sweeps[entry.vehicle] = _Sweeping(strip, stage, sweep, laid)
        if stage == 2:
            self._entered[entry.vehicle] = known.sweep
        return known.course

    def _homeward(self, vehicle: KnownVehicle, state: AgentState) -> Course:
        """On its way home, or where it lies."""
        entry = vehicle.entry
        known = self._rests.get(entry.vehicle)
        if known is None or known[0] != vehicle.heard_ms:
            pose, heard_s = Pose(state.x_m, state.y_m, state.heading_rad), vehicle.heard_ms / 1000
            laid = lying_still(pose, heard_s)
            if state.mode is Mode.RETURNING:
                run_out = self._run_out(vehicle, pose)
                end = run_out.pose_at(run_out.length_m)
                way = shortest_path(end, _arrival(end, (entry.home_x_m, entry.home_y_m)), entry.turn_radius_m)
                laid = course(pose, heard_s, sailing_of(entry), entry.turn_radius_m, [run_out, way])
            known = self._rests[entry.vehicle] = vehicle.heard_ms, laid
        return known[1]

    def _rest(self, vehicle: KnownVehicle) -> Course:
        """It circles from where it was last, if it has ever been under way."""
        state, entry = vehicle.state, vehicle.entry
        assert state is not None
        known = self._rests.get(entry.vehicle)
        if known is None or known[0] != vehicle.heard_ms:
            heard_s = vehicle.heard_ms / 1000
            pose = Pose(state.x_m, state.y_m, state.heading_rad)
            if entry.role.surveys and not entry.role.revisits:
                laid = survey_course(entry, state, vehicle.plan, heard_s)
            elif not (entry.role.surveys or vehicle.offers or entry.vehicle in self._errands):
                laid = lying_still(pose, heard_s)
            else:
                laid = course(pose, heard_s, sailing_of(entry), entry.turn_radius_m, [self._run_out(vehicle, pose)])
            known = self._rests[entry.vehicle] = vehicle.heard_ms, laid
        return known[1]

    def _run_out(self, vehicle: KnownVehicle, pose: Pose) -> DubinsPath:
        return straight(pose, self._run_out_m(vehicle, pose), vehicle.entry.turn_radius_m)

    def _run_out_m(self, vehicle: KnownVehicle, pose: Pose) -> float:
        """What a vehicle at a pose has still to sail straight on, whatever it is told, as it has just left a leg or a
        track."""
        entry, entered = vehicle.entry, self._entered.get(vehicle.entry.vehicle)
        lefts_m = [run_out_left_m(leg.end, pose, entry.run_in_m) for leg in entered.passes] if entered else []
        return max(*lefts_m, 0.0, survey_run_out_left_m(entry, vehicle.plan, pose))


def _arrival(pose: Pose, place: Point) -> Pose:
    """How a vehicle that is sent to a place comes there: the way it lies."""
    return Pose(*place, math.atan2(place[0] - pose.x_m, place[1] - pose.y_m) % (2 * math.pi))


def _sweep_from(pose: Pose, vehicle: KnownVehicle, strip: Strip) -> Sweep:
    """How a helper sweeps a strip that it sets out to from a pose."""
    entry = vehicle.entry
    sweeps = sweeps_by(footprint_of(entry.sonar), strip, entry.turn_radius_m, entry.run_in_m)
    return shortest_sweep(sweeps, pose, entry.turn_radius_m)[0]
