"""A clock that stands still while its process is stopped: a fleet that is simulated goes on from where it was."""

from __future__ import annotations

import time
from collections.abc import Callable

MOST_S = 2.0


class AwakeClock:
    """Seconds, as `time.monotonic`, of which no time in which the process did not run is counted: stopped by Ctrl-Z or
    SIGSTOP, or frozen with the machine. What the system tells of that is too little; but whoever reads the clock again
    and again sees a long time pass between two readings, without work.

    `most_s`: more passes between two readings, beyond the time that the process was at work, only where it was stopped:
    then that time alone counts. `held`: while it says so the clock stands still as well. `real`, `worked`: the clocks
    of the wall and of the process's own work; the system's.
    """

    def __init__(
        self,
        most_s: float = MOST_S,
        held: Callable[[], bool] = lambda: False,
        *,
        real: Callable[[], float] | None = None,
        worked: Callable[[], float] | None = None,
    ) -> None:
        self._most_s = most_s
        self._held = held
        self._real = time.monotonic if real is None else real
        self._worked = time.process_time if worked is None else worked
        self._real_s, self._worked_s = self._real(), self._worked()
        self._now_s = self._real_s
        self.times_stopped = 0
        """How often the process was stopped, as far as readings have told."""

    @property
    def is_held(self) -> bool:
        """Whether it stands still as someone else does."""
        return self._held()

    def __call__(self) -> float:
        """The time now. Never goes back, and never beyond `real`."""
        real_s, worked_s = self._real(), self._worked()
        passed_s, busy_s = real_s - self._real_s, worked_s - self._worked_s
        stopped = passed_s > self._most_s + busy_s
        self.times_stopped += stopped
        if not self._held():
            self._now_s += busy_s if stopped else passed_s
        self._real_s, self._worked_s = real_s, worked_s
        return self._now_s
