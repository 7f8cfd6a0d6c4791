"""A survey flown dry: a vehicle's own agent and its simulated body in the mission's sea, with a sonar that has no noise
and looks now and then. It lays and flies about the tracks that the mission's will."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace

from comms.node import Publication, Received
from comms.said.announcement import RunInfo
from comms.said.codec import Header
from comms.said.messages import MOST_TRACKS, Look, Maneuver, ManeuverStatus, Mode, Nav
from comms.said.topics import LOOK, MANEUVER_STATUS, NAV, RUN, Topic
from planner.dubins import shifted
from planner.keep_out import KeepOut
from sim_world.config import VehicleConfig
from sim_world.looks import Looks
from sim_world.sonar import Seabed
from sim_world.steadiness import Stream
from sim_world.targets import NO_TARGETS, Recogniser
from sim_world.vehicle import SimulatedVehicle, Stretch
from vehicle_agent.config import SurveyConfig
from vehicle_agent.survey import SurveyAgent

LOOKS_A_TRACK = 16
"""Spread over a track, so many tell what it sees."""
STEP_OF_RADIUS = 0.25
"""Between two places by which the way is summed up a vehicle goes no farther than so much of its turn radius."""
FOR_EVER_MS = 10**12


@dataclass(frozen=True)
class DrySurvey:
    """`tracks`: how many there were when it ended, flown or not; beyond MOST_TRACKS it is given up. `ends_s`: when each
    of those flown ends, in their order. `over_s`: when the last of them does, or the vehicle is home; `way_m`: flown
    until then, with all turns. `back_s`: when it would be home at the latest, if it went home after any of its tracks.
    `is_cut_short`: the battery lasts for no more tracks; `is_empty`: not even for the way home."""

    tracks: int
    ends_s: tuple[float, ...]
    over_s: float
    way_m: float
    back_s: float
    is_cut_short: bool
    is_empty: bool


@dataclass(frozen=True)
class Sea:
    """What vehicles meet, as the simulated world makes it."""

    seabed: Seabed
    current: Stream
    keep_out: KeepOut


def fly_dry(config: SurveyConfig, body: VehicleConfig, run: RunInfo, sea: Sea, *, for_ever: bool = False) -> DrySurvey:
    """Flies a survey as it is announced. `for_ever`: on a battery that never ends. Spacing planners are asked as in a
    mission, and what they raise is raised."""
    if for_ever:
        config, body = replace(config, endurance_ms=FOR_EVER_MS), replace(body, endurance_ms=None)
    return _DryFlight(copy.deepcopy(config), body, run, sea).fly()


class _DryAgent(SurveyAgent):
    """Looks for no hotspots, as nobody would cut strips from them."""

    def _find_hotspots(self, now_ms: int) -> None:
        pass


class _DryFlight:
    def __init__(self, config: SurveyConfig, body: VehicleConfig, run: RunInfo, sea: Sea) -> None:
        errors = body.sensor.estimate.without_chance
        sensor = replace(body.sensor, noise_cell=0.0, noise_track=0.0, estimate=errors, sonar=None)
        self._run = run
        self._agent = _DryAgent(config)
        self._vehicle = SimulatedVehicle(body, run.seed, sea.current, sea.keep_out)
        self._looks = Looks(
            replace(body, sensor=sensor),
            sonar=sensor.sonar_over(sea.seabed, body.vehicle),
            believed=sensor.believed_over(sea.seabed, body.vehicle),
            targets=NO_TARGETS,
            recogniser=Recogniser(sensor.curve, false_alarms_per_km2=0.0),
            seed=run.seed,
            current=sea.current,
        )
        self._look_m = sensor.look_m
        self._step_ms = max(1, round(STEP_OF_RADIUS * body.turn_radius_m / body.speed_mps * 1000))
        self._now_ms = self._heard = 0
        self._way_m = 0.0
        self._told: Maneuver | None = None

    def fly(self) -> DrySurvey:
        """From the run's announcement to where the survey ends, or the vehicle is home or empty."""
        agent, ends_s, back_s = self._agent, list[float](), 0.0
        agent.start(0)
        self._hear(RUN, self._run)  # first, as in the mission: the agent sets out before it knows where it is
        self._hear(NAV, self._vehicle.nav(0))
        while not agent.mode.has_ended and self._tracks() <= MOST_TRACKS:
            if self._told is not None:
                maneuver, self._told = self._told, None
                self._hear(MANEUVER_STATUS, self._vehicle.command(maneuver, self._now_ms))
                continue
            at_ms = self._vehicle.next_event_ms
            if at_ms is None:
                break
            self._sail_until(at_ms)
            event = self._vehicle.pop_event()
            if isinstance(event, Stretch):
                self._look(event)
            else:
                self._hear(NAV, self._vehicle.nav(self._now_ms))
                self._hear(MANEUVER_STATUS, event)
            if len(agent.flown) > len(ends_s):
                ends_s.append(self._now_ms / 1000)
                back_s = max(back_s, ends_s[-1] + self._home_s())
        cut_short = agent.mode is not Mode.FINISHED
        is_empty = cut_short and agent.mode is not Mode.HOME
        return DrySurvey(self._tracks(), tuple(ends_s), self._now_ms / 1000, self._way_m, back_s, cut_short, is_empty)

    def _tracks(self) -> int:
        agent = self._agent
        return len(agent.flown) + len(agent.ahead) + len(agent.later)

    def _home_s(self) -> float:
        """How long it is home from a track's end, its run-out first."""
        homing, pose, run_in_m = self._agent.endurance.homing, self._agent.pose, self._agent.config.run_in_m
        if homing is None or pose is None:
            return 0.0
        run_out_s = homing.way.sailing.straight_s(run_in_m, pose)
        return run_out_s + homing.way.from_pose(shifted(pose[:2], pose.heading_rad, run_in_m))[0]

    def _sail_until(self, at_ms: int) -> None:
        here = self._vehicle.nav(self._now_ms)
        while self._now_ms < at_ms:
            self._now_ms = min(self._now_ms + self._step_ms, at_ms)
            before, here = here, self._vehicle.nav(self._now_ms)
            self._way_m += math.hypot(here.x_m - before.x_m, here.y_m - before.y_m)

    def _look(self, stretch: Stretch) -> None:
        track = stretch.maneuver
        length_m = math.hypot(track.end_x_m - track.start_x_m, track.end_y_m - track.start_y_m)
        every = max(1, math.ceil(length_m / self._look_m) // LOOKS_A_TRACK)
        if round(stretch.first_along_m / self._look_m) % every == 0:
            self._hear(LOOK, self._looks.look(stretch, self._now_ms / 1000, (0.0, 0.0), 0.0)[0])

    def _hear(self, topic: Topic, message: Nav | RunInfo | ManeuverStatus | Look) -> None:
        """Tells the agent something, and notes what it then commands."""
        vehicle = self._agent.vehicle if topic is not RUN else ""
        key = topic.key(vehicle=vehicle) if vehicle else topic.key()
        header = Header("dry", 0, self._heard, self._now_ms)
        self._heard += 1
        step = self._agent.on_message(Received(key, topic, vehicle, header, message), self._now_ms)
        self._note(step.publish)

    def _note(self, published: tuple[Publication, ...]) -> None:
        for one in published:
            if isinstance(one.message, Maneuver):
                self._told = one.message
