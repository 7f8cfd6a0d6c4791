"""The revisit agent, and the work on strips of any agent that takes them: answers offers, sweeps strip by strip
with the sonar on, reports what came of it."""

from __future__ import annotations

import math

from comms.said.announcement import RunInfo
from comms.said.messages import (
    FARTHEST_M,
    ManeuverState,
    ManeuverStatus,
    Mode,
    Task,
    TaskAction,
    TaskState,
    TaskStatus,
)
from comms.said.topics import TASK_STATUS
from planner.currents import Sailing
from planner.dubins import Pose
from planner.region import share_within
from planner.sweep import NoSweepError, Pass, Sweep, shortest_sweep, sweeps_by
from planner.types import Strip, Track
from vehicle_agent.agent import Agent
from vehicle_agent.config import RevisitConfig
from vehicle_agent.endurance import MARGIN_MS, ON_ITS_WAY_HOME

SWEPT_SHARE = 0.5
BATTERY_TOO_LOW = "the battery does not last"
THE_MISSION_IS_OVER = "the mission is over"
NO_ROOM = "it cannot be flown without entering ground to keep out of"


class SecondLooks:
    """Works on one strip at a time, with the agent's vehicle, and keeps the one it is to do next; repeated words about
    a strip change nothing.

    `rest`: the agent's mode between two strips.
    """

    def __init__(self, agent: Agent, config: RevisitConfig, rest: Mode) -> None:
        self.config = config
        self.strip: Strip | None = None
        self._next: Strip | None = None
        self._agent = agent
        self._sailing = Sailing(config.speed_mps) if config.homing is None else config.homing.way.sailing
        self._rest = rest
        self._legs: list[Track] = []
        self._passes: list[Pass] = []
        self._answers: dict[int, tuple[Strip, TaskState]] = {}
        self._status_number = 0

    def on_task(self, task: Task, now_ms: int, *, busy: str = "") -> None:
        """Answers an offer, or gives a strip back. `busy`: why none can be taken now, if so."""
        agent = self._agent
        strip = task.as_strip
        known, answer = self._answers.get(task.strip, (None, None))
        wanted_back = task.action is TaskAction.GIVE_BACK
        tells_not_where = wanted_back and task.length_m == 0  # as over a link
        is_it = known is not None and (tells_not_where or _is_done_with(known, strip))
        is_done = is_it and answer is TaskState.DONE
        if wanted_back and (self._has(task.strip) or not is_done):
            self._give_back(task.strip, now_ms)
        elif task.action is TaskAction.STAND_ASIDE:
            may = self.strip is None and not busy and not agent.mode.is_out_of_work
            if may and all(abs(place_m) <= FARTHEST_M for place_m in strip.start):
                agent.go_to(strip.start)
        elif self.strip is not None and self.strip.number == task.strip:
            under_way = agent.mode is Mode.REVISIT
            self._tell(task.strip, TaskState.UNDER_WAY if under_way else TaskState.ACCEPTED, agent.expected_end_ms)
        elif known is not None and is_done:
            agent.report_again(known)  # whoever offers it again, or wants it back, does not know what was seen there
            self._tell(task.strip, TaskState.DONE, now_ms)
        elif busy or agent.mode.is_out_of_work:
            self._tell(task.strip, TaskState.REFUSED, 0, busy or ON_ITS_WAY_HOME)
        elif self.strip is not None and task.action is TaskAction.TAKE_NEXT:
            self._keep(strip)
        else:
            self._consider(strip, now_ms)

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Goes from leg to leg."""
        agent = self._agent
        if self.strip is None or not self._legs:
            return
        if status.state is ManeuverState.ACCEPTED:
            if not self._battery_lasts(status.ends_ms):
                agent.turn_home(now_ms)
        elif status.state is ManeuverState.ON_TRACK:
            if agent.mode is not Mode.REVISIT:
                agent.mode = Mode.REVISIT
                self._tell(self.strip.number, TaskState.UNDER_WAY, agent.expected_end_ms)
                agent.report_state(now_ms)
        elif status.state is ManeuverState.DONE:
            self._legs.pop(0)
            self._passes.pop(0)
            if self._legs:
                agent.follow(self._legs[0], self.config.run_in_m)
            else:
                self._leave(TaskState.DONE, now_ms)
                self._go_on(now_ms)
        elif status.state is ManeuverState.REFUSED:
            self._leave(TaskState.FAILED, now_ms, status.reason)
            self._go_on(now_ms)

    def leave(self, now_ms: int, why: str) -> None:
        """What is not done of a strip under way is left, and what was to be done next."""
        if self._next is not None:
            self._tell(self._next.number, TaskState.REFUSED, 0, why)
            self._next = None
        if self.strip is not None:
            self._leave(TaskState.FAILED, now_ms, why)

    def _consider(self, strip: Strip, now_ms: int) -> None:
        """Goes to a strip, or tells why not."""
        agent = self._agent
        if self.strip is not None:
            self._tell(strip.number, TaskState.REFUSED, 0, f"at work on strip {self.strip.number}")
            return
        if agent.pose is None:
            self._tell(strip.number, TaskState.REFUSED, 0, "no position yet")
            return
        try:
            sweep, ends_ms = self._planned(strip, agent.pose, now_ms)
        except _RefusedError as refused:
            self._tell(strip.number, TaskState.REFUSED, 0, str(refused))
            return
        self.strip = strip
        self._legs, self._passes = list(sweep.legs), list(sweep.passes)
        agent.mode = Mode.TRANSIT
        agent.works_on = strip.number
        agent.expected_end_ms = ends_ms
        self._tell(strip.number, TaskState.ACCEPTED, ends_ms)
        agent.follow(sweep.legs[0], self.config.run_in_m)
        agent.report_state(now_ms)

    def _keep(self, strip: Strip) -> None:
        """Keeps a strip as the next one, in place of any other, or tells why not: as it looks from the end of the
        present one. It is considered again from where the vehicle is by then."""
        try:
            _, ends_ms = self._planned(strip, self._passes[-1].end, self._agent.expected_end_ms)
        except _RefusedError as refused:
            self._tell(strip.number, TaskState.REFUSED, 0, str(refused))
            return
        if self._next is not None and self._next.number != strip.number:
            self._tell(self._next.number, TaskState.GIVEN_BACK, 0)
        self._next = strip
        self._tell(strip.number, TaskState.NEXT, ends_ms)

    def _go_on(self, now_ms: int) -> None:
        """Goes on with the next strip, if there is one."""
        strip, self._next = self._next, None
        if strip is not None:
            self._consider(strip, now_ms)

    def _planned(self, strip: Strip, pose: Pose, begin_ms: int) -> tuple[Sweep, int]:
        """The sweep of a strip from a pose, and when it ends if it is begun then; else why it cannot be swept."""
        agent, config = self._agent, self.config
        if not _makes_sense(strip):
            raise _RefusedError("that is no strip")
        if not agent.region.meets(strip):
            raise _RefusedError("it lies outside the area")
        least_ms = round(
            (strip.length_m + strip.width_m - agent.footprint.reach.strip_width_m)
            / (config.speed_mps + self._sailing.drift_mps)
            * 1000
        )
        if agent.endurance.left(begin_ms + least_ms) <= 0.0:  # before the legs of what may be far too large are laid
            raise _RefusedError(BATTERY_TOO_LOW)
        radius_m, keep_out = config.turn_radius_m, agent.keep_out.nearer()
        ways = sweeps_by(agent.footprint, strip, radius_m, config.run_in_m, keep_out)
        try:
            sweep, way_m = shortest_sweep(ways, pose, radius_m, keep_out)
        except NoSweepError:
            raise _RefusedError(NO_ROOM) from None
        ends_ms = begin_ms + self._takes_ms(sweep, pose, way_m)
        free_ms = ends_ms + agent.endurance.run_out_ms(sweep.passes[-1], config.run_in_m)
        if not agent.endurance.lasts_from(sweep.leave, free_ms, MARGIN_MS):
            raise _RefusedError(BATTERY_TOO_LOW)
        return sweep, ends_ms

    def _takes_ms(self, sweep: Sweep, pose: Pose, way_m: float) -> int:
        """How long a sweep takes, with the way there from a pose, which is so long."""
        config = self.config
        if self._sailing.is_in_still_water:
            return round((way_m + sweep.length_m - config.run_in_m) / config.speed_mps * 1000)
        run_out_s = self._sailing.straight_s(config.run_in_m, sweep.passes[-1].end)
        keep_out = self._agent.keep_out.nearer()
        return round((self._sailing.passes_s(sweep.passes, config.turn_radius_m, pose, keep_out) - run_out_s) * 1000)

    def _battery_lasts(self, leg_ends_ms: int) -> bool:
        """Whether it does for what is left of the sweep, if the present leg ends then."""
        config, endurance = self.config, self._agent.endurance
        if config.homing is None:
            return True
        leg, *others = self._passes
        left_s = self._sailing.passes_s(others, config.turn_radius_m, leg.end, self._agent.keep_out.nearer())
        free_ms = leg_ends_ms + endurance.run_out_ms(leg, config.run_in_m) + round(left_s * 1000)
        return endurance.lasts_from(self._passes[-1].end, free_ms)

    def _has(self, number: int) -> bool:
        return any(one is not None and one.number == number for one in (self.strip, self._next))

    def _give_back(self, number: int, now_ms: int) -> None:
        is_at_it = self.strip is not None and self.strip.number == number
        if self._has(number):
            self._next = None  # what was to come after it rests on what is no more
        if is_at_it:
            self._leave(TaskState.GIVEN_BACK, now_ms)
            self._agent.hold()
        else:
            self._tell(number, TaskState.GIVEN_BACK, now_ms)

    def _leave(self, state: TaskState, now_ms: int, reason: str = "") -> None:
        """Ends the work on the present strip. The tiles go out first: whoever hears of the end knows the map."""
        assert self.strip is not None
        agent, strip = self._agent, self.strip
        agent.mode = self._rest
        agent.works_on = 0
        agent.expected_end_ms = 0
        self.strip = None
        self._legs, self._passes = [], []
        agent.report(now_ms)
        if state is TaskState.DONE:
            agent.report_again(strip)
        self._answers[strip.number] = (strip, state)
        self._tell(strip.number, state, now_ms, reason)

    def _tell(self, number: int, state: TaskState, ends_ms: int, reason: str = "") -> None:
        self._status_number += 1
        key = TASK_STATUS.key(vehicle=self._agent.vehicle, number=self._status_number)
        self._agent.publish(key, TaskStatus(number, state, ends_ms, reason))


class _RefusedError(Exception):
    """Why a strip is not taken."""


def _is_done_with(known: Strip, strip: Strip) -> bool:
    """Whether who has swept the one has swept at least half of the other."""
    return _makes_sense(strip) and share_within(strip, known) >= SWEPT_SHARE


def _makes_sense(strip: Strip) -> bool:
    near_enough = all(abs(place_m) <= FARTHEST_M for place_m in strip.start) and math.isfinite(strip.heading_rad)
    return near_enough and 0 < strip.length_m <= FARTHEST_M and 0 < strip.width_m <= FARTHEST_M


class RevisitAgent(Agent):
    """A helper: see the module."""

    def __init__(self, config: RevisitConfig) -> None:
        super().__init__(config.vehicle, config.footprint, config.endurance_ms, config.homing)
        self.config = config
        self._looks = SecondLooks(self, config, rest=Mode.IDLE)

    def on_run(self, run: RunInfo, now_ms: int) -> None:
        """Reports for duty."""
        self.report_state(now_ms)

    def on_task(self, task: Task, now_ms: int) -> None:
        """Answers an offer, or gives a strip back."""
        self._looks.on_task(task, now_ms)

    def on_maneuver(self, status: ManeuverStatus, now_ms: int) -> None:
        """Goes from leg to leg."""
        self._looks.on_maneuver(status, now_ms)

    def on_over(self, now_ms: int) -> None:
        """Stops where it is, unless it is on its way home."""
        self._looks.leave(now_ms, THE_MISSION_IS_OVER)
        if not self.mode.is_out_of_work:
            self.mode = Mode.FINISHED
            self.hold()

    def leave_work(self, now_ms: int) -> None:
        """Leaves what it has of a strip."""
        self._looks.leave(now_ms, BATTERY_TOO_LOW)
