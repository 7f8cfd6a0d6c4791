"""Where each vehicle of the fleet is expected to be, from what it has said and what it was told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from coordinator.vehicles import KnownVehicle, pose_of, tracks_of, way_home_of
from planner.dubins import DubinsPath, Pose
from planner.footprints import footprint_of
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import NoSweepError, Pass, Sweep, shortest_sweep, sweeps_by
from planner.types import Point, Strip
from planner.ways import shortest_way, way_or_direct


@dataclass(frozen=True)
class _Sweeping:
    """A helper's work on a strip: how far it is known to have come, 0 offered, 1 on its way, 2 on the first leg."""

    strip: Strip
    stage: int
    sweep: Sweep
    course: Course


@dataclass(frozen=True)
class _Errand:
    """A helper's way to a place at which it was told to wait."""

    place: Point
    course: Course


OFF_COURSE_M = 10.0
"""Of two ways to a place that are hardly longer than each other a vehicle may take the other than is expected, and a
current that flows to and fro may help it: farther off than this its course is laid anew."""


class Traffic:
    """Courses are laid when asked for, and kept until something is heard that changes them. `keep_out`: round what all
    of them lead."""

    def __init__(self, keep_out: KeepOut = NOWHERE) -> None:
        self._keep_out = keep_out
        self._surveys: dict[str, tuple[object, int, Course]] = {}
        self._sweeps: dict[str, _Sweeping] = {}
        self._entered: dict[str, Sweep] = {}
        """Of each helper the sweep that it has begun last."""
        self._errands: dict[str, _Errand] = {}
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
        # Until it has said where it is there, it circles where it was sent, not where it was heard on its way.
        if errand is not None and vehicle.heard_ms / 1000 < errand.course.arrives_s:
            return self._on_errand(vehicle, errand)
        return self._rest(vehicle)

    def here(self, vehicle: KnownVehicle, strip: Strip | None, now_s: float) -> Pose:
        """Where a vehicle is that is told something now."""
        state = vehicle.state
        assert state is not None
        laid = self.course(vehicle, strip, now_s)
        return pose_of(state) if laid is None else laid.at(now_s)

    def to_strip(self, vehicle: KnownVehicle, strip: Strip | None, other: Strip, now_s: float) -> tuple[Course, Sweep]:
        """The course of a helper that leaves what it does and sets out to another strip now, and how it sweeps it."""
        pose = self.here(vehicle, strip, now_s)
        return self.onward(vehicle, pose, now_s, other, self._run_out_m(vehicle, pose))

    def onward(
        self, vehicle: KnownVehicle, pose: Pose, from_s: float, other: Strip, run_out_m: float = 0.0
    ) -> tuple[Course, Sweep]:
        """The course of a helper that sets out to another strip from a pose at a time, and how it sweeps it.
        `run_out_m`: what it has first to sail straight on."""
        sweep = self._sweep_from(pose, vehicle, other)
        radius_m, keep_out = vehicle.entry.turn_radius_m, self._keep_out
        laid = sweep_course(
            pose, from_s, vehicle.sailing, radius_m, sweep.passes, run_out_m=run_out_m, keep_out=keep_out
        )
        return laid, sweep

    def aside(self, vehicle: KnownVehicle, strip: Strip | None, place: Point, now_s: float) -> Course:
        """The course of a helper that leaves what it does and waits at a place."""
        return self._to_place(vehicle, self.here(vehicle, strip, now_s), now_s, place)

    def has_room(self, vehicle: KnownVehicle, strip: Strip | None, place: Point, now_s: float) -> bool:
        """Whether a helper that leaves what it does can go to a place and circle there."""
        if not self._keep_out:
            return True
        pose, radius_m = self.here(vehicle, strip, now_s), vehicle.entry.turn_radius_m
        run_out = self._run_out(vehicle, pose)
        end = run_out.pose_at(run_out.length_m)
        there = _arrival(pose, place)
        way = shortest_way(end, there, radius_m, self._keep_out)
        return way is not None and self._keep_out.circling(there, radius_m) is not None

    def holding(self, vehicle: KnownVehicle, strip: Strip | None, now_s: float) -> Course:
        """The course of a helper that leaves what it does and circles where it is."""
        pose = self.here(vehicle, strip, now_s)
        entry, run_out = vehicle.entry, self._run_out(vehicle, pose)
        return course(pose, now_s, vehicle.sailing, entry.turn_radius_m, [run_out], self._keep_out)

    def offered(self, name: str, strip: Strip, laid: Course, sweep: Sweep) -> None:
        """A helper was sent to a strip."""
        self._errands.pop(name, None)
        self._sweeps[name] = _Sweeping(strip, 0, sweep, laid)

    def sent_aside(self, vehicle: KnownVehicle, strip: Strip | None, place: Point, now_s: float) -> None:
        """A helper was told to wait at a place."""
        self._errands[vehicle.entry.vehicle] = _Errand(place, self.aside(vehicle, strip, place, now_s))

    def _survey(self, vehicle: KnownVehicle, now_s: float) -> Course:
        state, plan, name = vehicle.state, vehicle.plan, vehicle.entry.vehicle
        assert state is not None
        ends_ms = state.expected_end_ms if state.mode is Mode.SURVEY else 0
        told = (plan.revision if plan else 0, state.mode, state.works_on, ends_ms)
        known = self._surveys.get(name)
        # One that should have sailed its tracks, or has none yet, is where it was heard last.
        is_past = known is not None and known[1] != vehicle.heard_ms and now_s >= known[2].arrives_s
        if known is None or known[0] != told or is_past or _is_carried_off(vehicle, known[2]):
            laid = survey_course(vehicle.entry, state, plan, vehicle.heard_ms / 1000, self._keep_out, vehicle.flows)
            known = self._surveys[name] = told, vehicle.heard_ms, laid
        return known[2]

    def _sweep(self, vehicle: KnownVehicle, strip: Strip) -> Course:
        state, entry = vehicle.state, vehicle.entry
        assert state is not None
        stage = 0 if state.works_on != strip.number else 2 if state.mode is Mode.REVISIT else 1
        known = self._sweeps.get(entry.vehicle)
        if known is None or known.strip != strip or known.stage < stage:
            entered = known is not None and known.strip == strip and stage == 2
            pose = pose_of(state)
            sweep = known.sweep if known and entered else self._sweep_from(pose, vehicle, strip)
            laid = self._over(vehicle, sweep.passes, entered=entered)
            known = self._sweeps[entry.vehicle] = _Sweeping(strip, stage, sweep, laid)
        elif stage == 1 and _is_off(vehicle, known.course):
            # The end of the strip to which it is nearer by now is that to which it goes.
            sweep = self._sweep_from(pose_of(state), vehicle, strip)
            laid = self._over(vehicle, sweep.passes, entered=False)
            known = self._sweeps[entry.vehicle] = replace(known, sweep=sweep, course=laid)
        elif stage == 2 and _is_off(vehicle, known.course):
            passes = _left_of(known.sweep.passes, state)
            if passes:  # else it turns, and is on the next before long
                known = replace(known, course=self._over(vehicle, passes, entered=True))
                self._sweeps[entry.vehicle] = known
        if stage == 2:
            self._entered[entry.vehicle] = known.sweep
        return known.course

    def _over(self, vehicle: KnownVehicle, passes: Sequence[Pass], *, entered: bool) -> Course:
        """Over the legs of a strip from where it was heard; `entered`: on the first of them."""
        state, entry = vehicle.state, vehicle.entry
        assert state is not None
        pose = pose_of(state)
        return sweep_course(
            *(pose, vehicle.heard_ms / 1000, vehicle.sailing, entry.turn_radius_m, passes),
            entered=entered,
            run_out_m=0.0 if entered else self._run_out_m(vehicle, pose),
            keep_out=self._keep_out,
        )

    def _homeward(self, vehicle: KnownVehicle, state: AgentState) -> Course:
        """On its way home, or where it lies."""
        entry = vehicle.entry
        known = self._rests.get(entry.vehicle)
        if known is None or known[0] != vehicle.heard_ms:
            pose, heard_s = pose_of(state), vehicle.heard_ms / 1000
            laid = lying_still(pose, heard_s)
            if state.mode is Mode.RETURNING:
                run_out = self._run_out(vehicle, pose)
                end = run_out.pose_at(run_out.length_m)
                way = way_home_of(entry, self._keep_out, vehicle.flows).way(end)
                laid = course(pose, heard_s, vehicle.sailing, entry.turn_radius_m, [run_out, *way], self._keep_out)
            known = self._rests[entry.vehicle] = vehicle.heard_ms, laid
        return known[1]

    def _on_errand(self, vehicle: KnownVehicle, errand: _Errand) -> Course:
        """Laid anew from where it was heard, if that is off its course; where it is at the place already, it rests."""
        state, entry, heard_s = vehicle.state, vehicle.entry, vehicle.heard_ms / 1000
        assert state is not None
        pose = pose_of(state)
        is_on_course = math.dist(errand.course.at(heard_s)[:2], pose[:2]) <= OFF_COURSE_M
        if is_on_course or heard_s < errand.course.start_s:  # or was heard before it was sent
            return errand.course
        if math.dist(pose[:2], errand.place) <= 2 * entry.turn_radius_m + OFF_COURSE_M:
            return self._rest(vehicle)
        laid = self._to_place(vehicle, pose, heard_s, errand.place)
        self._errands[entry.vehicle] = _Errand(errand.place, laid)
        return laid

    def _to_place(self, vehicle: KnownVehicle, pose: Pose, start_s: float, place: Point) -> Course:
        """From a pose at a time to a place, what is left of a run-out first."""
        radius_m, run_out = vehicle.entry.turn_radius_m, self._run_out(vehicle, pose)
        end = run_out.pose_at(run_out.length_m)
        way = way_or_direct(end, _arrival(pose, place), radius_m, self._keep_out)
        return course(pose, start_s, vehicle.sailing, radius_m, [run_out, *way], self._keep_out)

    def _rest(self, vehicle: KnownVehicle) -> Course:
        """It circles from where it was last, if it has ever been under way."""
        state, entry = vehicle.state, vehicle.entry
        assert state is not None
        known = self._rests.get(entry.vehicle)
        if known is None or known[0] != vehicle.heard_ms:
            heard_s = vehicle.heard_ms / 1000
            pose = pose_of(state)
            if entry.role.surveys and not entry.role.revisits:
                laid = survey_course(entry, state, vehicle.plan, heard_s, self._keep_out, vehicle.flows)
            elif not (entry.role.surveys or vehicle.offers or entry.vehicle in self._errands):
                laid = lying_still(pose, heard_s)
            else:
                run_out = self._run_out(vehicle, pose)
                laid = course(pose, heard_s, vehicle.sailing, entry.turn_radius_m, [run_out], self._keep_out)
            known = self._rests[entry.vehicle] = vehicle.heard_ms, laid
        return known[1]

    def _sweep_from(self, pose: Pose, vehicle: KnownVehicle, strip: Strip) -> Sweep:
        """How a helper sweeps a strip that it sets out to from a pose."""
        entry, keep_out = vehicle.entry, self._keep_out
        for heeded in (keep_out, NOWHERE) if keep_out else (NOWHERE,):
            sweeps = sweeps_by(footprint_of(entry.sonar), strip, entry.turn_radius_m, entry.run_in_m, heeded)
            try:
                return shortest_sweep(sweeps, pose, entry.turn_radius_m, heeded)[0]
            except NoSweepError:  # it will refuse the strip
                continue
        raise AssertionError("every strip can be flown where nothing is in the way")

    def _run_out(self, vehicle: KnownVehicle, pose: Pose) -> DubinsPath:
        return straight(pose, self._run_out_m(vehicle, pose), vehicle.entry.turn_radius_m)

    def _run_out_m(self, vehicle: KnownVehicle, pose: Pose) -> float:
        """What a vehicle at a pose has still to sail straight on, whatever it is told, as it has just left a leg or a
        track."""
        entry, entered = vehicle.entry, self._entered.get(vehicle.entry.vehicle)
        lefts_m = [run_out_left_m(leg.end, pose, entry.run_in_m) for leg in entered.passes] if entered else []
        assert vehicle.state is not None
        behind, _ = tracks_of(vehicle.plan, vehicle.state)
        return max([*lefts_m, survey_run_out_left_m(entry, behind, pose)])


def _is_off(vehicle: KnownVehicle, laid: Course) -> bool:
    """Whether a vehicle was heard somewhere else than its course leads. In a current that is known it never is: by
    modem places are reckoned without one."""
    sailing, state, heard_s = vehicle.sailing, vehicle.state, vehicle.heard_ms / 1000
    if state is None or heard_s <= laid.start_s or (sailing.is_known and not sailing.is_in_still_water):
        return False
    return math.dist(laid.at(heard_s)[:2], (state.x_m, state.y_m)) > OFF_COURSE_M


def _is_carried_off(vehicle: KnownVehicle, laid: Course) -> bool:
    """The same in a current of which not all is known."""
    return not vehicle.sailing.is_known and _is_off(vehicle, laid)


def _left_of(passes: Sequence[Pass], state: AgentState) -> Sequence[Pass]:
    """Those from the one on that a vehicle is on; empty where it is on none."""
    pose = pose_of(state)
    for place, one in enumerate(passes):
        if run_out_left_m(one.end, pose, one.length_m) > 0:
            return passes[place:]
    return ()


def _arrival(pose: Pose, place: Point) -> Pose:
    """How a vehicle that is sent to a place comes there: the way it lies from where it is told, before any run-out."""
    return Pose(*place, math.atan2(place[0] - pose.x_m, place[1] - pose.y_m) % (2 * math.pi))
