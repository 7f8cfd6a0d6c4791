"""What the coordinator is taken to know of a vehicle between its states, the same on both sides: so a state need only
be said where it tells something else, or seldom, and whoever hears anything of a vehicle may say where it is by now.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from comms.said.announcement import Role, RosterVehicle
from comms.said.messages import FARTHEST_M, AgentState, Mode, TaskState, TaskStatus
from modem.config import ModemConfig
from modem.layers import MOST_LEGS
from planner.dubins import Pose, poses_along, shifted
from planner.footprints import footprint_of
from planner.keep_out import NOWHERE, KeepOut
from planner.sweep import NoSweepError, Sweep, shortest_sweep, sweeps_by
from planner.types import Point, Strip
from planner.ways import Way, way_length_m, way_or_direct

STATE_BITS = 80
"""That a state takes, with what is about it."""
STATES_SHARE = 0.1
"""Of what a vehicle may say its states take as much, if nothing but the time has changed."""
REPORT_MS = 10_000
"""So often an agent says its state."""
ASTRAY_M = 60.0
"""A vehicle without work that is farther from where it is taken to be says so."""
_MODES = {TaskState.ACCEPTED: Mode.TRANSIT, TaskState.UNDER_WAY: Mode.REVISIT}


def seldom_ms(config: ModemConfig) -> int:
    """How often a vehicle says its state at least, by what its slot carries."""
    a_cycle = config.frames * config.room * STATES_SHARE
    return max(REPORT_MS, math.ceil(STATE_BITS / a_cycle) * config.cycle_ms if a_cycle < STATE_BITS else 0)


class Presence:
    """A vehicle as it is reckoned with. `entry`: as it was announced; `keep_out`: what it may not enter. `told_ms`:
    when its last state was said, or a word on a task that tells as much. `strips`: those it was given, by number.
    `reckons_ways`: it is reckoned on its way to a strip, where words tell when they were said; without, it stands still
    until it is heard to have begun."""

    def __init__(self, entry: RosterVehicle, keep_out: KeepOut = NOWHERE, *, reckons_ways: bool = True) -> None:
        self.told_ms = 0
        self.strips: dict[int, Strip] = {}
        self._entry, self._keep_out, self._reckons_ways = entry, keep_out, reckons_ways
        self._state: AgentState | None = None
        self._incarnation = 0
        self._takes_strips = entry.role is not Role.SURVEY_REVISIT  # which does once it has surveyed
        self._said_ms = 0
        self._sweep: Sweep | None = None  # as it is taken to fly the strip that it works on
        self._way: Way = ()  # and to come there from where it was told

    def hear_state(self, state: AgentState, incarnation: int, said_ms: int) -> None:
        """It says its state."""
        if self._entry.role is Role.SURVEY_REVISIT:  # started anew it may survey anew: what it works on is a track
            has_surveyed = self._takes_strips and incarnation == self._incarnation
            self._takes_strips = has_surveyed or state.mode in (Mode.FINISHED, Mode.REVISIT)
        if self._state is None or state.works_on != self._state.works_on or not self._takes_strips:
            self._sweep = None
        self._state, self._incarnation = state, incarnation
        self.told_ms = self._said_ms = said_ms
        self._way = ()
        if state.mode is Mode.TRANSIT and self._takes_strips and state.works_on in self.strips:
            self._set_out(state, self.strips[state.works_on])

    def hear_status(self, status: TaskStatus, said_ms: int) -> bool:
        """What it says of a task tells of its work, too: returns whether it does."""
        if status.state in _MODES:
            self._takes_strips = True
        state = self.at(said_ms)
        if state is None or state.mode.is_out_of_work or state.mode is Mode.HOME:
            return state is None and status.state in (TaskState.ACCEPTED, TaskState.UNDER_WAY)
        told = self._state
        if told is not None and (told.mode, told.works_on) == (_MODES.get(status.state), status.strip):
            return False  # it has said so before, and has gone on since
        if status.state is TaskState.ACCEPTED:
            self._accept(state, status, said_ms)
        elif status.state is TaskState.UNDER_WAY:
            if self._sweep is not None and status.strip == state.works_on:
                state = _at(state, self._sweep.legs[0].start, self._sweep.entry.heading_rad)
                said_ms = self._began_ms(self._sweep, status, said_ms)
            ends_ms = status.ends_ms or state.expected_end_ms
            self._state = replace(state, mode=Mode.REVISIT, works_on=status.strip, expected_end_ms=ends_ms)
        elif not self._takes_strips:
            return False  # asked back of it, from before it was started anew: what it works on is a track
        elif status.state not in (TaskState.NEXT, TaskState.REFUSED) and status.strip == state.works_on:
            if self._sweep is not None and status.state is TaskState.DONE:
                state = _at(state, self._sweep.leave[:2], self._sweep.leave.heading_rad)
            rest = Mode.FINISHED if self._entry.role is Role.SURVEY_REVISIT else Mode.IDLE
            self._state, self._sweep = replace(state, mode=rest, works_on=0, expected_end_ms=0), None
        else:
            return False
        self.told_ms = said_ms
        return True

    def at(self, now_ms: int) -> AgentState | None:
        """Its state as it is reckoned by now; None before it has said any. On a track it goes straight on, for as long
        as it has expected, to a strip the shortest way, and over it leg by leg; elsewhere it may turn, and is where it
        was."""
        state = self._state
        if state is None:
            return None
        way_m = self._entry.speed_mps * max(0, now_ms - self.told_ms) / 1000
        if state.mode is Mode.REVISIT and self._sweep is not None:
            return self._along_legs(state, self._sweep, way_m)
        if state.mode is Mode.TRANSIT and self._sweep is not None and self._reckons_ways:
            return self._on_its_way(state, self._sweep, way_m)
        if state.mode is Mode.SURVEY and state.expected_end_ms > 0:
            left_m = self._entry.speed_mps * max(0, state.expected_end_ms - self.told_ms) / 1000
            ahead = shifted((state.x_m, state.y_m), state.heading_rad, min(way_m, left_m))
            return replace(state, x_m=ahead.x_m, y_m=ahead.y_m)
        return state

    def is_news(self, state: AgentState, incarnation: int, now_ms: int, seldom_ms: int) -> bool:
        """Whether its state tells what is not known, or was not told for so long."""
        known = self.at(now_ms)
        if known is None or incarnation != self._incarnation:
            return True
        if seldom_ms <= REPORT_MS or now_ms - self._said_ms >= seldom_ms:
            return True
        if (known.mode, known.works_on) != (state.mode, state.works_on):
            return True
        is_free = state.mode in (Mode.IDLE, Mode.FINISHED)
        return is_free and math.dist((known.x_m, known.y_m), (state.x_m, state.y_m)) > ASTRAY_M

    def _accept(self, state: AgentState, status: TaskStatus, said_ms: int) -> None:
        """It goes to a strip, from where it is."""
        self._sweep, self._way, ends_ms = None, (), status.ends_ms
        strip = self.strips.get(status.strip)
        if strip is not None:
            self._set_out(state, strip)
        if self._sweep is not None and ends_ms == 0:
            way_m = way_length_m(self._way) + self._sweep.length_m
            ends_ms = said_ms + round(way_m / self._entry.speed_mps * 1000)
        self._state = replace(state, mode=Mode.TRANSIT, works_on=status.strip, expected_end_ms=ends_ms)

    def _set_out(self, state: AgentState, strip: Strip) -> None:
        """It goes to a strip the shortest way, if it can be flown."""
        entry, sees = self._entry, footprint_of(self._entry.sonar)
        if strip.length_m <= 0 or not 0 < strip.width_m <= MOST_LEGS * sees.reach.strip_width_m:
            return
        radius_m, pose = entry.turn_radius_m, Pose(state.x_m, state.y_m, state.heading_rad)
        ways = sweeps_by(sees, strip, radius_m, entry.run_in_m, self._keep_out)
        try:
            self._sweep, _ = shortest_sweep(ways, pose, radius_m, self._keep_out)
        except NoSweepError:
            return
        self._way = way_or_direct(pose, self._sweep.entry, radius_m, self._keep_out)

    def _began_ms(self, sweep: Sweep, status: TaskStatus, said_ms: int) -> int:
        """When it has begun a sweep of which it says that it is under way: by when it expects to be done, if it
        says that and no current makes it another time."""
        if status.ends_ms == 0 or self._entry.drift_mps > 0:
            return said_ms
        sweep_m = sweep.length_m - 2 * self._entry.run_in_m
        return min(said_ms, status.ends_ms - round(sweep_m / self._entry.speed_mps * 1000))

    def _on_its_way(self, state: AgentState, sweep: Sweep, way_m: float) -> AgentState:
        """So far on its way, behind which it is on the strip: the word of that may be long under way."""
        begun_m = way_m - way_length_m(self._way) - self._entry.run_in_m
        begin = sweep.legs[0].start
        if begun_m >= 0:
            begun = _at(replace(state, mode=Mode.REVISIT), begin, sweep.entry.heading_rad)
            return self._along_legs(begun, sweep, begun_m)
        if begun_m >= -self._entry.run_in_m:
            return _at(state, shifted(begin, sweep.entry.heading_rad, begun_m)[:2], sweep.entry.heading_rad)
        x_m, y_m, heading_rad = poses_along(self._way, np.array([way_m]))[0].tolist()
        return _at(state, (x_m, y_m), heading_rad)

    def _along_legs(self, state: AgentState, sweep: Sweep, way_m: float) -> AgentState:
        """So far behind where it was told, which lies on the first leg."""
        ends = [(state.x_m, state.y_m), sweep.legs[0].end]
        ends += [end for leg in sweep.legs[1:] for end in (leg.start, leg.end)]
        for begin, end in pairwise(ends):
            length_m = math.dist(begin, end)
            if length_m > way_m:
                heading_rad = math.atan2(end[0] - begin[0], end[1] - begin[1]) % math.tau
                return _at(state, shifted(begin, heading_rad, way_m)[:2], heading_rad)
            way_m -= length_m
        return _at(state, ends[-1], state.heading_rad)


def _at(state: AgentState, place: Point, heading_rad: float) -> AgentState:
    within = [max(-FARTHEST_M, min(FARTHEST_M, one)) for one in place]
    return replace(state, x_m=within[0], y_m=within[1], heading_rad=heading_rad % math.tau)
