"""What the coordinator is taken to know of a vehicle between its states, the same on both sides: so a state need only be
said where it tells something else, or seldom, and whoever hears anything of a vehicle may say where it is by now.
"""

from __future__ import annotations

import math
from dataclasses import replace

from comms.said.announcement import Role, RosterVehicle
from comms.said.messages import AgentState, Mode, TaskState, TaskStatus
from modem.config import ModemConfig
from planner.sweep import shifted

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
    """A vehicle as it is reckoned with. `entry`: as it was announced. `told_ms`: when its last state was said."""

    def __init__(self, entry: RosterVehicle) -> None:
        self._entry = entry
        self._state: AgentState | None = None
        self._incarnation = 0
        self.told_ms = 0

    def hear_state(self, state: AgentState, incarnation: int, said_ms: int) -> None:
        """It says its state."""
        self._state, self._incarnation, self.told_ms = state, incarnation, said_ms

    def hear_status(self, status: TaskStatus, now_ms: int) -> None:
        """What it says of a task tells of its work, too."""
        state = self.at(now_ms)
        if state is None or state.mode.is_out_of_work or state.mode.has_ended:
            return
        if status.state in _MODES:
            self._state = replace(state, mode=_MODES[status.state], works_on=status.strip)
        elif status.state is not TaskState.REFUSED and status.strip == state.works_on:
            rest = Mode.FINISHED if self._entry.role is Role.SURVEY_REVISIT else Mode.IDLE
            self._state = replace(state, mode=rest, works_on=0, expected_end_ms=0)
        else:
            return
        self.told_ms = now_ms

    def at(self, now_ms: int) -> AgentState | None:
        """Its state as it is reckoned by now; None before it has said any. On a track it goes straight on, for as long as
        it has expected; elsewhere it may turn, and is where it was."""
        state = self._state
        if state is None or state.mode is not Mode.SURVEY:
            return state
        until_ms = min(now_ms, state.expected_end_ms) if state.expected_end_ms > 0 else self.told_ms
        way_m = self._entry.speed_mps * max(0, until_ms - self.told_ms) / 1000
        x_m, y_m, _ = shifted((state.x_m, state.y_m), state.heading_rad, way_m)
        return replace(state, x_m=x_m, y_m=y_m)

    def is_news(self, state: AgentState, incarnation: int, now_ms: int, seldom_ms: int) -> bool:
        """Whether its state tells what is not known, or was not told for so long."""
        known = self.at(now_ms)
        if known is None or incarnation != self._incarnation or now_ms - self.told_ms >= seldom_ms:
            return True
        if (known.mode, known.works_on) != (state.mode, state.works_on):
            return True
        is_free = state.mode in (Mode.IDLE, Mode.FINISHED)
        return is_free and math.dist((known.x_m, known.y_m), (state.x_m, state.y_m)) > ASTRAY_M
