"""When to draw what changes often: not at each change, and not before all that was said at one time is in."""

from __future__ import annotations


class Pace:
    """Notes changes, and tells when they are to be drawn: at most once per `every_ms` of simulated time."""

    def __init__(self, every_ms: int) -> None:
        self._every_ms = every_ms
        self._changed_ms = 0
        self._is_drawn = True
        self._due_ms = 0

    def note(self, time_ms: int) -> None:
        """There is a change of this time to be drawn."""
        self._changed_ms = max(self._changed_ms, time_ms)
        self._is_drawn = False

    def due(self, time_ms: int) -> int | None:
        """The time of the latest change of all if what was noted is to be drawn now, else None.

        A change that comes late is so drawn over those after it, which it has to be if it is to show.
        """
        if self._is_drawn or time_ms <= self._changed_ms or time_ms < self._due_ms:
            return None
        self._due_ms = time_ms + self._every_ms
        return self.rest()

    def rest(self) -> int | None:
        """The same for what is not drawn yet, however soon it is."""
        if self._is_drawn:
            return None
        self._is_drawn = True
        return self._changed_ms
