"""Which of a run's processes are started again, and when, where a run goes on without those that have died. Pure but
for the log, which tells of each."""

from __future__ import annotations

import logging
from collections import Counter

from secondlook.launch.restarts import Restarts
from secondlook.launch.verdict import Fate

log = logging.getLogger("secondlook.mission")


class Revival:
    """Tell it who has died, and ask who is due; times are seconds of a clock that never goes back. `counts`: how often
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
