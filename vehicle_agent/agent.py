"""What every agent does alike: listen to its vehicle, command it, report state every 10 s, publish coverage."""

from __future__ import annotations

import logging

from comms.node import Publication, Received, Step
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import (
    FARTHEST_M,
    AgentState,
    Contact,
    Look,
    Maneuver,
    ManeuverKind,
    ManeuverState,
    ManeuverStatus,
    MissionOver,
    Mode,
    Nav,
    Task,
    TaskAction,
)
from comms.said.topics import CONTACT, MANEUVER, STATE
from planner.dubins import Pose, shifted
from planner.footprints.footprint import Footprint
from planner.keep_out import NOWHERE, KeepOut
from planner.reckoning import Course
from planner.region import Region
from planner.sweep import pass_over
from planner.types import Point, Strip, SweepFrame, Track
from vehicle_agent.config import Homing
from vehicle_agent.coverage import CoverageLayer
from vehicle_agent.endurance import Endurance

log = logging.getLogger("secondlook.agent")

REPORT_EVERY_MS = 10_000
STRAIGHT_IN_M = 100.0  # behind home lies the start of the way there, which tells the heading of arrival


class Agent:
    """An agent in the back seat of one vehicle.

    Before `run` has told it area and grid it does nothing. Subclasses say what to do then, and with each look, each
    manoeuvre's end and each task.
    """

    def __init__(self, vehicle: str, footprint: Footprint, endurance_ms: int, homing: Homing | None = None) -> None:
        self.vehicle = vehicle
        self.endurance = Endurance(endurance_ms, homing)
        self.footprint = footprint
        self.mode = Mode.IDLE
        self.works_on = 0
        self.expected_end_ms = 0
        self.course: Course | None = None
        self.coverage: CoverageLayer | None = None
        self.region: Region
        self.keep_out: KeepOut = NOWHERE
        self.maneuver: Maneuver | None = None
        self._word_due_ms: int | None = None  # when the vehicle should have said more of the present manoeuvre
        self._looks_taken: set[tuple[int, int]] = set()
        self._started_ms = 0
        self._now_ms = 0
        self._maneuvers = 0
        self._contacts = 0
        self._outbox: list[Publication] = []
        self._wake_ms: int | None = None
        self._over = False
        self._complained = False
        self._task_order = (-1, -1)

    def start(self, now_ms: int) -> Step:
        """Waits for the run's announcement. A later start numbers its manoeuvres from its second on: a word on one of
        an earlier start, which may come late, is then none on one of its own."""
        self._started_ms = now_ms
        self._maneuvers = now_ms // 1000
        return Step()

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Takes in what the vehicle and the coordinator say."""
        message = received.message
        self._now_ms = now_ms
        waited = self._waits
        if isinstance(message, Nav):
            self._hear_nav(message, received.header.sent_ms, now_ms)
        elif isinstance(message, RunInfo) and self.coverage is None:
            self.coverage = CoverageLayer(self.vehicle, message.grid.spec, message.rho)
            self.region = Region(message.outline, message.hole_outlines, message.keep_out_outlines)
            self.keep_out = KeepOut(message.keep_out_outlines, message.keep_out_margin_m)
            self.endurance.keep_out_of(self.keep_out)
            self._wake_ms = now_ms + REPORT_EVERY_MS
            self.on_run(message, now_ms)
        elif self.coverage is not None and not self._over:
            if isinstance(message, Look):
                if received.header.sent_ms >= self._started_ms:  # else its predecessor's, who has told of it
                    self._hear_look(message, received.header.incarnation, now_ms)
            elif isinstance(message, ManeuverStatus):
                self._hear_status(message, now_ms)
            elif isinstance(message, Task):
                if self._is_for_now(received.header):
                    self._hear_task(message, now_ms)
            elif isinstance(message, MissionOver):
                self._over = True
                self._wake_ms = None
                self.on_over(now_ms)
                self.report(now_ms)
        elif self.coverage is not None and isinstance(message, MissionOver):  # said again: of the answer some was lost
            self._outbox.extend(self.coverage.all_again())
            self.tell_again()
            self.report_state(now_ms)
        if self._waits and not waited and not self._over and self._is_low(now_ms):
            self.turn_home(now_ms)  # by its next report it may have turned away from there
        return self._step()

    @property
    def _waits(self) -> bool:
        return self.mode in (Mode.IDLE, Mode.FINISHED)

    def _is_low(self, now_ms: int) -> bool:
        """Whether its battery tells it to go home, once it is known where it is."""
        pose = self.pose
        return pose is not None and self.endurance.is_low(pose, now_ms, circles=self._waits)

    def on_wake(self, now_ms: int) -> Step:
        """Reports, every 10 s; asks again of a manoeuvre of which too long nothing was heard."""
        self._now_ms = now_ms
        self._wake_ms = now_ms + REPORT_EVERY_MS
        if self._word_due_ms is not None and now_ms >= self._word_due_ms:
            self._send_maneuver()
        works, was_refused = not self.mode.is_out_of_work, self.mode is Mode.RETURNING and self.maneuver is None
        if was_refused or (works and self._is_low(now_ms)):
            self.turn_home(now_ms)
        else:
            self.report(now_ms)
        return self._step()

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """The run is announced; the coverage layer is there."""

    def on_look(self, look: Look, now_ms: int) -> None:
        """A valid look has been added to the coverage layer."""

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """The present manoeuvre has come further."""

    def on_task(self, task: Task, now_ms: int) -> None:
        """The coordinator offers a strip or wants it back."""

    def hotspots_told(self) -> int:
        """The tally of the newest revisions of all hotspots that were told; 0 for an agent that finds none."""
        return 0

    def tell_again(self) -> None:
        """Something of what was told has not arrived; tiles are said again without this."""

    def on_over(self, now_ms: int) -> None:
        """The mission is over; the last report follows."""

    def leave_work(self, now_ms: int) -> None:
        """The battery lasts for no more of the present work: it ends here."""

    def publish(self, key: str, message: object) -> None:
        """Puts a message into the present step."""
        self._outbox.append(Publication(key, message))  # type: ignore[arg-type]

    def follow(self, track: Track, run_in_m: float) -> None:
        """Commands the vehicle to fly a track with the sonar on, so that what lies beside the track is seen."""
        begin, end = pass_over(track.start, track.end, 0.0, self.footprint.lead_m)
        self._command(ManeuverKind.FOLLOW, begin[:2], end[:2], run_in_m)

    def go_to(self, place: Point) -> None:
        """Commands the vehicle to a place, to wait there."""
        pose = self.pose
        self._command(ManeuverKind.GOTO, place if pose is None else pose[:2], place, 0.0)

    def hold(self) -> None:
        """Commands the vehicle to stay where it is."""
        pose = self.pose
        here = (0.0, 0.0) if pose is None else pose[:2]  # a hold needs no place
        self._command(ManeuverKind.HOLD, here, here, 0.0)

    @property
    def pose(self) -> Pose | None:
        """Where the vehicle is by what it said last of its course; None before it has said so."""
        return None if self.course is None else self.course.pose_at(self._now_ms)

    def turn_home(self, now_ms: int) -> None:
        """Leaves what it does, and commands the vehicle home."""
        homing, pose = self.endurance.homing, self.pose
        assert homing is not None
        self.leave_work(now_ms)
        self.mode = Mode.RETURNING
        self.works_on = 0
        self.expected_end_ms, begin = 0, homing.way.home
        if pose is not None:
            way_s, heading_rad = homing.way.from_pose(pose)
            if way_s == 0.0 and self.maneuver is None and self.course is not None and self.course.speed_mps == 0.0:
                self._rest(Mode.HOME, now_ms)  # it has never left
                return
            self.expected_end_ms = now_ms + round(way_s * 1000)
            begin = shifted(homing.way.home, heading_rad, -STRAIGHT_IN_M)[:2]
        self._command(ManeuverKind.GOTO, begin, homing.way.home, 0.0)
        self.report(now_ms)

    def report(self, now_ms: int) -> None:
        """Publishes the tiles that changed and the state."""
        assert self.coverage is not None
        self._outbox.extend(self.coverage.changed_tiles())
        self.report_state(now_ms)

    def report_again(self, strip: Strip) -> None:
        """Publishes once more the tiles about a strip, of which some may have been lost."""
        assert self.coverage is not None
        self._outbox.extend(self.coverage.again_at(strip))

    def report_state(self, now_ms: int) -> None:
        """Publishes the state alone, once the vehicle has said where it is."""
        pose = self.pose
        if pose is None:
            return
        assert self.coverage is not None
        message = AgentState(
            mode=self.mode,
            works_on=self.works_on,
            battery=self.battery(now_ms),
            expected_end_ms=self.expected_end_ms,
            x_m=pose.x_m,
            y_m=pose.y_m,
            heading_rad=pose.heading_rad,
            tiles_told=self.coverage.told(),
            hotspots_told=self.hotspots_told(),
        )
        self.publish(STATE.key(vehicle=self.vehicle), message)

    def battery(self, now_ms: int) -> float:
        """Share of the endurance that is left."""
        return self.endurance.left(now_ms)

    def _hear_nav(self, nav: Nav, sent_ms: int, now_ms: int) -> None:
        first = self.course is None
        is_late = self.course is not None and sent_ms < self.course.begun_ms  # a newer one holds
        if is_late or max(abs(nav.x_m), abs(nav.y_m)) > FARTHEST_M:
            return
        self.course = Course.of(nav, sent_ms)
        if first and self.coverage is not None and not self._over:
            self.report_state(now_ms)

    def _hear_status(self, status: ManeuverStatus, now_ms: int) -> None:
        if self.maneuver is None or status.number != self.maneuver.number or self.mode in (Mode.HOME, Mode.EMPTY):
            return
        self._word_due_ms = _next_word_due_ms(status)
        if status.state is ManeuverState.EMPTY:
            self.leave_work(now_ms)
            self._rest(Mode.EMPTY, now_ms)
        elif not self.mode.is_out_of_work:
            self.on_maneuver(status, now_ms)
        elif status.state is ManeuverState.DONE:
            self._rest(Mode.HOME, now_ms)
        elif status.state is ManeuverState.REFUSED:
            self.maneuver = None  # from elsewhere it may find a way home

    def _rest(self, mode: Mode, now_ms: int) -> None:
        """The vehicle lies, at home or where its battery has run empty."""
        self.mode = mode
        self.works_on = self.expected_end_ms = 0
        self._word_due_ms = None
        self.endurance.rest(now_ms)
        self.report(now_ms)

    def _hear_task(self, task: Task, now_ms: int) -> None:
        if task.action is TaskAction.TELL_AGAIN:
            assert self.coverage is not None
            self._outbox.extend(self.coverage.again())
            self.tell_again()
            self.report_state(now_ms)
        else:
            self.on_task(task, now_ms)

    def _is_for_now(self, header: Header) -> bool:
        """Whether a task is for who is here now, and newer than all that were; takes note of it."""
        order = header.newness
        # Of what has come by modem the second alone is known in which it was said.
        if header.sent_ms < self._started_ms // 1000 * 1000 or order <= self._task_order:
            return False
        self._task_order = order
        return True

    def _command(self, kind: ManeuverKind, start: Point, end: Point, run_in_m: float) -> None:
        self._maneuvers += 1
        self.maneuver = Maneuver(self._maneuvers, kind, *start, *end, run_in_m)
        self._send_maneuver()

    def _send_maneuver(self) -> None:
        self._word_due_ms = self._now_ms + REPORT_EVERY_MS
        self.publish(MANEUVER.key(vehicle=self.vehicle), self.maneuver)

    def _hear_look(self, look: Look, incarnation: int, now_ms: int) -> None:
        if (incarnation, look.number) in self._looks_taken:  # a look that comes twice was one look
            return
        self._looks_taken.add((incarnation, look.number))
        if not look.makes_sense:
            if not self._complained:
                self._complained = True
                log.warning("%s: dropped a look that makes no sense (said once)", self.vehicle)
            return
        for contact in look.contacts:
            self._contacts += 1
            key = CONTACT.key(vehicle=self.vehicle, number=self._contacts)
            x_m, y_m = _in_mission_frame(look, contact.along_m, contact.lateral_m)
            self.publish(key, Contact(x_m, y_m, look.position_sigma_m, contact.score, look.number))
        if look.valid and self.coverage is not None:
            self.coverage.add(look)
            self.on_look(look, now_ms)

    def _step(self) -> Step:
        published = tuple(self._outbox)
        self._outbox.clear()
        return Step(published, self._wake_ms)


def _next_word_due_ms(status: ManeuverStatus) -> int | None:
    """When the vehicle has to say more, a report's time granted; None where it has said its last."""
    if status.state in (ManeuverState.DONE, ManeuverState.REFUSED, ManeuverState.EMPTY) or status.ends_ms == 0:
        return None
    return status.ends_ms + REPORT_EVERY_MS


def _in_mission_frame(look: Look, along_m: float, lateral_m: float) -> Point:
    frame = SweepFrame(look.origin_x_m, look.origin_y_m, look.heading_rad)
    return frame.to_mission(lateral_m, along_m)
