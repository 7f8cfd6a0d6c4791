"""What time it is in the mission, when the wall clock drives it. Pure: the local clock's readings are arguments."""

from __future__ import annotations

import math
from collections import deque

SIGNALS_KEPT = 32


class MissionTime:
    """Mission time by a local clock that is set by the time signals of the mission's clock.

    A signal tells the mission time at which it was sent, and by how much that runs faster than the wall. It is heard a
    little later, so that of the last signals the one that was least under way is the right one. Local times are those
    of a monotonic clock, in seconds. Mission time never goes back.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._zeros_ms: deque[float] = deque(maxlen=SIGNALS_KEPT)
        self._latest_ms = 0

    @property
    def known(self) -> bool:
        """Whether a signal has told it."""
        return bool(self._zeros_ms)

    def hear(self, told_ms: float, factor: float, local_s: float) -> None:
        """A signal has arrived at this local time."""
        if factor != self.factor:
            self._zeros_ms.clear()
            self.factor = factor
        self._zeros_ms.append(told_ms - local_s * 1000 * factor)

    def now_ms(self, local_s: float) -> int:
        """Mission time in whole milliseconds; to be asked once it is known."""
        self._latest_ms = max(self._latest_ms, math.floor(max(self._zeros_ms) + local_s * 1000 * self.factor))
        return self._latest_ms

    def local_s(self, mission_ms: int) -> float:
        """When by the local clock a mission time comes."""
        return (mission_ms - max(self._zeros_ms)) / 1000 / self.factor
