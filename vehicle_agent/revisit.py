"""The revisit agent: takes strips from the coordinator, sweeps them with the sonar on, reports what came of it."""

from __future__ import annotations

from comms.messages import (
    Look,
    ManeuverState,
    ManeuverStatus,
    Mode,
    RunInfo,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.topics import TASK_STATUS
from planner.dubins import Pose
from planner.sweep import cheapest_entry, legs_over_strip
from planner.types import Strip, Track
from vehicle_agent.agent import FARTHEST_M, Agent
from vehicle_agent.config import RevisitConfig

BATTERY_TOO_LOW = "the battery does not last"


class RevisitAgent(Agent):
    """A helper: see the module. It works on one strip at a time; repeated words about a strip change nothing."""

    def __init__(self, config: RevisitConfig) -> None:
        super().__init__(config.vehicle, config.endurance_ms)
        self.config = config
        self.strip: Strip | None = None
        self._legs: list[Track] = []
        self._length_m = 0.0
        self._swept_m = 0.0
        self._answers: dict[int, tuple[Strip, TaskState]] = {}
        self._status_number = 0

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """Reports for duty."""
        self.report_state(now_ms)

    def on_task(self, task: Task, now_ms: int) -> None:
        """Answers an offer, or gives a strip back."""
        strip = Strip(task.strip, (task.start_x_m, task.start_y_m), task.heading_rad, task.length_m, task.width_m)
        known, answer = self._answers.get(task.strip, (None, None))
        if task.action is TaskAction.GIVE_BACK:
            self._give_back(task.strip, now_ms)
        elif self.strip is not None and self.strip.number == task.strip:
            under_way = self.mode is Mode.REVISIT
            self._tell(task.strip, TaskState.UNDER_WAY if under_way else TaskState.ACCEPTED, self.expected_end_ms)
        elif known == strip and answer is TaskState.DONE:
            self._tell(task.strip, TaskState.DONE, now_ms)
        else:
            self._consider(strip, now_ms)

    def on_look(self, look: Look, now_ms: int) -> None:
        """Counts what has been swept of the present leg."""
        if self.maneuver is not None and look.maneuver == self.maneuver.number:
            self._swept_m += look.p_detect.shape[1] * look.along_bin_m

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Goes from leg to leg."""
        if self.strip is None or not self._legs:
            return
        if status.state is ManeuverState.ON_TRACK:
            if self.mode is not Mode.REVISIT:
                self.mode = Mode.REVISIT
                self._tell(self.strip.number, TaskState.UNDER_WAY, self.expected_end_ms)
                self.report_state(now_ms)
        elif status.state is ManeuverState.DONE:
            self._legs.pop(0)
            if self._legs:
                self.follow(self._legs[0], self.config.run_in_m)
            else:
                self._leave(TaskState.DONE, now_ms)
        elif status.state is ManeuverState.REFUSED:
            self._leave(TaskState.FAILED, now_ms, status.reason)

    def on_over(self, now_ms: int) -> None:
        """Stops where it is."""
        if self.strip is not None:
            self._leave(TaskState.FAILED, now_ms, "the mission is over")
        self.mode = Mode.FINISHED
        self.hold()

    def report(self, now_ms: int) -> None:
        """Adds the progress of a strip under way to the report."""
        super().report(now_ms)
        if self.strip is not None and self.mode is Mode.REVISIT:
            self._tell(self.strip.number, TaskState.UNDER_WAY, self.expected_end_ms)

    def _consider(self, strip: Strip, now_ms: int) -> None:
        if self.strip is not None:
            self._tell(strip.number, TaskState.REFUSED, 0, f"at work on strip {self.strip.number}")
            return
        if self.nav is None:
            self._tell(strip.number, TaskState.REFUSED, 0, "no position yet")
            return
        if not _makes_sense(strip):
            self._tell(strip.number, TaskState.REFUSED, 0, "that is no strip")
            return
        least_ms = round((strip.length_m + strip.width_m - self.config.swath_m) / self.config.speed_mps * 1000)
        if self.battery(now_ms + least_ms) <= 0.0:  # told before the legs of what may be far too large are laid
            self._tell(strip.number, TaskState.REFUSED, 0, BATTERY_TOO_LOW)
            return
        legs = legs_over_strip(strip, self.config.swath_m)
        pose = Pose(self.nav.x_m, self.nav.y_m, self.nav.heading_rad)
        ordered, distance_m = cheapest_entry(legs, pose, self.config.turn_radius_m, self.config.run_in_m)
        ends_ms = now_ms + round(distance_m / self.config.speed_mps * 1000)
        if self.battery(ends_ms) <= 0.0:
            self._tell(strip.number, TaskState.REFUSED, 0, BATTERY_TOO_LOW)
            return
        self.strip = strip
        self._legs = ordered
        self._length_m = sum(leg.length_m for leg in ordered)
        self._swept_m = 0.0
        self.mode = Mode.TRANSIT
        self.works_on = strip.number
        self.expected_end_ms = ends_ms
        self._tell(strip.number, TaskState.ACCEPTED, ends_ms)
        self.follow(ordered[0], self.config.run_in_m)
        self.report_state(now_ms)

    def _give_back(self, number: int, now_ms: int) -> None:
        if self.strip is not None and self.strip.number == number:
            self._leave(TaskState.GIVEN_BACK, now_ms)
            self.hold()
        else:
            self._tell(number, TaskState.GIVEN_BACK, now_ms)

    def _leave(self, state: TaskState, now_ms: int, reason: str = "") -> None:
        """Ends the work on the present strip. The tiles go out first: whoever hears of the end knows the map."""
        assert self.strip is not None
        strip = self.strip
        self.mode = Mode.IDLE
        self.works_on = 0
        self.expected_end_ms = 0
        self.strip = None
        self._legs = []
        super().report(now_ms)
        self._answers[strip.number] = (strip, state)
        self._tell(strip.number, state, now_ms, reason)

    def _tell(self, number: int, state: TaskState, ends_ms: int, reason: str = "") -> None:
        progress = 1.0 if state is TaskState.DONE else 0.0
        if self.strip is not None and self.strip.number == number and self._length_m > 0:
            progress = min(1.0, self._swept_m / self._length_m)
        self._status_number += 1
        key = TASK_STATUS.key(vehicle=self.vehicle, number=self._status_number)
        self.publish(key, TaskStatus(number, state, progress, ends_ms, reason))


def _makes_sense(strip: Strip) -> bool:
    near_enough = all(abs(place_m) <= FARTHEST_M for place_m in strip.start)
    return near_enough and 0 < strip.length_m <= FARTHEST_M and 0 < strip.width_m <= FARTHEST_M
