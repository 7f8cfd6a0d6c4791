"""How often, and how soon, a process that has died is started again: one alone, and those of a run. Pure but for the
log, which tells of each of a run's."""

from __future__ import annotations

import logging
from collections import Counter

from secondlook.launch.verdict import Fate

log = logging.getLogger("secondlook.mission")

FIRST_S, LONGEST_S = 1.0, 30.0  # the second time in a row it waits for so long, then twice as long each time
MOST_IN_A_ROW = 6
LASTED_S = 60.0  # a process that has lasted for so long begins a new row


class Restarts:
    """Those of one process."""

    def __init__(self) -> None:
        self.in_a_row = 0

    def again(self, lived_s: float) -> float | None:
        """It has died after so many seconds: in how many it is started again, None where it has died too often."""
        if lived_s >= LASTED_S:
            self.in_a_row = 0
        self.in_a_row += 1
        if self.in_a_row > MOST_IN_A_ROW:
            return None
        return min(FIRST_S * 2.0 ** (self.in_a_row - 2), LONGEST_S) if self.in_a_row > 1 else 0.0

    @property
    def in_words(self) -> str:
        """Which it is."""
        return f"restart {self.in_a_row} of at most {MOST_IN_A_ROW} in a row"


class Revival:
    """Those of the processes of a run that goes on without who has died.

    Tell it who has died, and ask who is due; times are seconds of a clock that never goes back. `counts`: how often
    each host was due."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._restarts: dict[str, Restarts] = {}
        self._due_s: dict[str, float] = {}
        self._last_words: dict[str, str] = {}

    def says(self, host: str, sentence: str) -> None:
        """A host has said why it fails."""
        self._last_words[host] = sentence

    def dies(self, host: str, fate: Fate, lived_s: float, now_s: float) -> str | None:
        """A host's process has ended; returns why the run has failed if it is not to be started again, as it has ended
        so too often."""
        restarts = self._restarts.setdefault(host, Restarts())
        delay_s = restarts.again(lived_s)
        why = self._last_words.pop(host, fate.last_words)
        told = f"{host} {fate.how}{f': {why}' if why else ''}"
        if delay_s is None:
            return f"{told}; that was too often in a row to start it again"
        log.warning("%s; it is started again, %s", told, restarts.in_words)
        self._due_s[host] = now_s + delay_s
        return None

    def due(self, now_s: float) -> list[str]:
        """Those that are to be started now."""
        due = [host for host, due_s in self._due_s.items() if now_s >= due_s]
        for host in due:
            del self._due_s[host]
            self.counts[host] += 1
        return due
