"""How far the fleet may run ahead of those that only listen. Pure; the hub sends the marks and counts the answers.

No round waits for a listener. From time to time it is sent a mark, and acknowledges it when it has dealt with all that
was said before; the clock grants nothing while one of them is too far behind.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from comms.lockstep.clock import LockstepClock

MARK_EVERY_S = 0.5  # of the wall clock: the more a listener takes at once, the less each message costs it
MARKS_A_BOUND = 8  # so often is a listener marked on its way to the bound
MOST_BEHIND_BYTES = 4 << 20


class Pacing:
    """Marks for `listeners`, ids of nodes in the clock's roster; none may be `most_behind_bytes` and more behind."""

    def __init__(self, clock: LockstepClock, listeners: Iterable[str], most_behind_bytes: int) -> None:
        self.mark = 0
        self._clock = clock
        self._most_behind_bytes = most_behind_bytes
        self._mark_s = -math.inf
        self._marked_bytes = dict.fromkeys(listeners, 0)
        self._acknowledged_bytes = dict(self._marked_bytes)
        self._bytes_at: dict[str, dict[int, int]] = {node: {} for node in self._marked_bytes}

    def next_mark(self, now_s: float) -> bool:
        """Whether it is time for a mark; if so `mark` is its number, and it holds for all said so far. `now_s`: of a
        clock that never goes back."""
        said = self._clock.watched_bytes
        unmarked = max((said[node] - marked for node, marked in self._marked_bytes.items()), default=0)
        if now_s - self._mark_s < MARK_EVERY_S and unmarked * MARKS_A_BOUND < self._most_behind_bytes:
            return False
        self.mark += 1
        self._mark_s = now_s
        for node in self._marked_bytes:
            self._marked_bytes[node] = self._bytes_at[node][self.mark] = said[node]
        return True

    def acknowledge(self, node_id: str, mark: int) -> None:
        """A listener has dealt with all that was said before a mark; ValueError for a mark it was not sent."""
        if mark not in self._bytes_at.get(node_id, ()):
            raise ValueError(f"{node_id} has acknowledged a mark that it was not sent: {mark!r}")
        self._acknowledged_bytes[node_id] = self._bytes_at[node_id].pop(mark)

    def behind(self) -> list[str]:
        """The listeners that the clock has to wait for."""
        said = self._clock.watched_bytes
        return [
            node
            for node, acknowledged in self._acknowledged_bytes.items()
            if said[node] - acknowledged >= self._most_behind_bytes
        ]
