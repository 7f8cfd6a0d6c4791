"""A simulated vehicle: takes manoeuvres, says how far they got, and tells which stretches of track it has passed."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from comms.node import random_stream
from comms.said.messages import FARTHEST_M, Maneuver, ManeuverKind, ManeuverState, ManeuverStatus, Nav, TruthPose
from planner.dubins import Pose
from planner.keep_out import NOWHERE, KeepOut
from planner.types import Point
from planner.way_home import THERE_M
from sim_world.config import VehicleConfig
from sim_world.motion import OFF_M, FollowedTrack, Motion, NoWayError, bearing_rad
from sim_world.steadiness import STILL_WATER, Stream

HEARTBEAT_MS = 10_000
"""Whenever so much time has passed a course is told again, as one may have been lost: by all at once."""
TRACK_ROUNDING_M = 0.02
"""Two ends in whole centimetres make a track up to 1.5 cm too long; no bin is added for that."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of a followed track that the vehicle has passed: what one look covers, `bins` along-track bins."""

    maneuver: Maneuver
    heading_rad: float
    first_along_m: float
    bins: int


Event = ManeuverStatus | Stretch
EMPTY = "the battery is empty"


class SimulatedVehicle:
    """One vehicle's body. It steers by its believed pose; the true one lies beside it, see `offset_at`.

    A vehicle does what it was told last. Of a manoeuvre that is replaced nothing more is heard, and the stretch of
    track it was on is not looked at. Where it was sent home it lies when it is there, and needs no battery. When that
    is empty it lies where it is, and says so.
    """

    def __init__(
        self, config: VehicleConfig, seed: int, current: Stream = STILL_WATER, keep_out: KeepOut = NOWHERE
    ) -> None:
        self.config = config
        self._error_rad, self._drift_rad = (
            random_stream(seed, "world", config.vehicle, name).uniform(0.0, 2 * math.pi)
            for name in ("position_error", "position_drift")
        )
        self._motion = Motion(
            Pose(config.start_x_m, config.start_y_m, config.start_heading_rad),
            speed_mps=config.speed_mps,
            turn_radius_m=config.turn_radius_m,
            current=current if current.carries else None,
            keep_out=keep_out,
        )
        self._to_come: deque[tuple[int, Event]] = deque()
        self._home = (config.start_x_m, config.start_y_m) if config.home is None else config.home
        self._is_home = self._is_at_home((config.start_x_m, config.start_y_m))
        self._goes_home = False
        self._number = self._begun_ms = 0
        self._emptied_ms: int | None = None

    def offset_at(self, now_ms: int) -> Point:
        """How far the true position lies east and north of the believed one."""
        error_m, drift_m = self.config.position_error_m, self._drift_m(now_ms)
        return (
            error_m * math.sin(self._error_rad) + drift_m * math.sin(self._drift_rad),
            error_m * math.cos(self._error_rad) + drift_m * math.cos(self._drift_rad),
        )

    def sigma_at(self, now_ms: int) -> float:
        """What it gives as its position's sigma: what it may be off at most."""
        return self.config.position_error_m + self._drift_m(now_ms)

    def _drift_m(self, now_ms: int) -> float:
        return self.config.position_drift_mps * now_ms / 1000

    def nav(self, now_ms: int) -> Nav:
        """The course it believes in."""
        motion, config = self._motion, self.config
        speed_mps, curvature = motion.speed_mps(now_ms), motion.curvature_at(now_ms)
        pose, sigma_m = motion.pose_at(now_ms), self.sigma_at(now_ms)
        return Nav(*pose, speed_mps, config.altitude_m, sigma_m, turn_radps=curvature * speed_mps)

    def truth(self, now_ms: int) -> TruthPose:
        """Its course."""
        nav, (east_m, north_m) = self.nav(now_ms), self.offset_at(now_ms)
        return TruthPose(nav.x_m + east_m, nav.y_m + north_m, nav.heading_rad, nav.speed_mps, nav.turn_radps)

    def true_place(self, time_ms: int) -> Point:
        """Where it truly is."""
        (x_m, y_m), (east_m, north_m) = self._motion.place_at(time_ms), self.offset_at(time_ms)
        return x_m + east_m, y_m + north_m

    @property
    def lies(self) -> bool:
        """Whether it has not been told to go anywhere yet, or has come home, or its battery is empty."""
        return self._motion.lies

    def steady_until_ms(self, from_ms: int) -> int:
        """Until when what it tells of its course at a time is true within OFF_M; at most until the next heartbeat."""
        heartbeat_ms = (from_ms // HEARTBEAT_MS + 1) * HEARTBEAT_MS
        drift_mps = self.config.position_drift_mps
        off_ms = from_ms + round(OFF_M / drift_mps * 1000) if drift_mps > 0.0 else heartbeat_ms
        return self._motion.steady_until_ms(from_ms, min(heartbeat_ms, off_ms))

    def command(self, maneuver: Maneuver, now_ms: int) -> ManeuverStatus:
        """Begins a manoeuvre, or refuses it and goes on with what it does.

        A hold has no end: it is accepted with `ends_ms` 0 and never done. With an empty battery it can do nothing.
        """
        if self._emptied_ms is not None:
            return ManeuverStatus(maneuver.number, ManeuverState.EMPTY, self._emptied_ms, EMPTY)
        reason = _reason_to_refuse(maneuver)
        if reason:
            return ManeuverStatus(maneuver.number, ManeuverState.REFUSED, 0, reason)
        try:
            ends_ms = self._begin(maneuver, now_ms)
        except NoWayError as error:
            return ManeuverStatus(maneuver.number, ManeuverState.REFUSED, 0, str(error))
        return ManeuverStatus(maneuver.number, ManeuverState.ACCEPTED, ends_ms, "")

    def _begin(self, maneuver: Maneuver, now_ms: int) -> int:
        """Begins a manoeuvre, and tells when it ends, 0 for never; raises NoWayError and goes on with what it does."""
        start, end = (maneuver.start_x_m, maneuver.start_y_m), (maneuver.end_x_m, maneuver.end_y_m)
        ends_ms, goes_home = 0, maneuver.kind is ManeuverKind.GOTO and self._is_at_home(end)
        match maneuver.kind:
            case ManeuverKind.HOLD:
                self._motion.hold(now_ms)
                self._to_come = deque()
            case ManeuverKind.GOTO:
                heading_rad = None if start == end else bearing_rad(start, end)
                ends_ms = now_ms
                if not (goes_home and self._is_at_home(self._motion.place_at(now_ms))):  # else it is there
                    ends_ms = self._motion.go_to(end, heading_rad, now_ms, loiters=not goes_home)
                done = ManeuverStatus(maneuver.number, ManeuverState.DONE, ends_ms, "")
                self._to_come = deque([(ends_ms, done)])
            case ManeuverKind.FOLLOW:
                track = self._motion.follow(start, end, maneuver.run_in_m, now_ms)
                ends_ms = track.time_ms(track.length_m)
                self._to_come = deque(self._on_track(maneuver, track, bearing_rad(start, end)))
        self._number, self._begun_ms = maneuver.number, now_ms
        self._is_home, self._goes_home = False, goes_home
        return ends_ms

    @property
    def next_event_ms(self) -> int | None:
        """When `pop_event` has something next, None for never."""
        to_come_ms = self._to_come[0][0] if self._to_come else None
        empty_ms = self.config.endurance_ms
        if empty_ms is None or self._is_home or self._emptied_ms is not None:
            return to_come_ms
        empty_ms = max(empty_ms, self._begun_ms)  # who leaves home too late gets nowhere
        return empty_ms if to_come_ms is None else min(to_come_ms, empty_ms)

    def pop_event(self) -> Event:
        """The next event, once its time has come.

        Raises:
            LookupError: there is none.
        """
        at_ms = self.next_event_ms
        if at_ms is None:
            raise LookupError("nothing is to come")
        if not self._to_come or at_ms < self._to_come[0][0]:
            return self._run_empty(at_ms)
        event = self._to_come.popleft()[1]
        if self._goes_home:
            self._is_home, self._goes_home = True, False
            self._motion.stop(at_ms)
        return event

    def _run_empty(self, at_ms: int) -> ManeuverStatus:
        self._emptied_ms = at_ms
        self._to_come.clear()
        self._motion.stop(at_ms)
        return ManeuverStatus(self._number, ManeuverState.EMPTY, at_ms, EMPTY)

    def _is_at_home(self, place: Point) -> bool:
        return math.dist(place, self._home) <= THERE_M

    def _on_track(self, maneuver: Maneuver, track: FollowedTrack, heading_rad: float) -> Iterator[tuple[int, Event]]:
        sensor = self.config.sensor
        ends_ms = track.time_ms(track.length_m)
        yield track.time_ms(0.0), ManeuverStatus(maneuver.number, ManeuverState.ON_TRACK, ends_ms, "")
        all_bins = max(1, math.ceil((track.length_m - TRACK_ROUNDING_M) / sensor.along_bin_m))
        for first_bin in range(0, all_bins, sensor.bins_per_look):
            bins = min(sensor.bins_per_look, all_bins - first_bin)
            last = first_bin + bins == all_bins
            passed_ms = ends_ms if last else track.time_ms((first_bin + bins) * sensor.along_bin_m)
            yield passed_ms, Stretch(maneuver, heading_rad, first_bin * sensor.along_bin_m, bins)
        yield ends_ms, ManeuverStatus(maneuver.number, ManeuverState.DONE, ends_ms, "")


def _reason_to_refuse(maneuver: Maneuver) -> str:
    """Why a manoeuvre cannot be sailed, "" where it can."""
    if maneuver.kind is ManeuverKind.HOLD:
        return ""
    start: Point = (maneuver.start_x_m, maneuver.start_y_m)
    end: Point = (maneuver.end_x_m, maneuver.end_y_m)
    if any(abs(coordinate) > FARTHEST_M for coordinate in (*start, *end)):
        return f"a point lies more than {FARTHEST_M / 1000:.0f} km from the origin along an axis"
    if maneuver.kind is ManeuverKind.FOLLOW:
        if start == end:
            return "the track has no length"
        if not 0.0 <= maneuver.run_in_m <= FARTHEST_M:
            return f"a run-in of {maneuver.run_in_m} m is not within 0 to {FARTHEST_M / 1000:.0f} km"
    return ""
