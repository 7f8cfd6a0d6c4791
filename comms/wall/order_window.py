"""Puts messages that arrive at any time into the order of their sending, within a small window. Pure."""

from __future__ import annotations

import heapq
from itertools import count

from comms.node import Received


class OrderWindow:
    """Holds each message until the mission time is `window_ms` beyond its send time. One that comes later than that is
    passed on at once: nothing is lost, but it is out of order."""

    def __init__(self, window_ms: int) -> None:
        self._window_ms = window_ms
        self._held: list[tuple[tuple[int, bool, str, int, int], int, Received]] = []
        self._arrivals = count()

    def add(self, received: Received) -> None:
        """A message has arrived."""
        heapq.heappush(self._held, (received.header.order, next(self._arrivals), received))

    def due(self, now_ms: int | None) -> list[Received]:
        """In order, those that need wait no longer at this mission time; all of them where it is None."""
        found = []
        while self._held and (now_ms is None or self._held[0][2].header.sent_ms + self._window_ms <= now_ms):
            found.append(heapq.heappop(self._held)[2])
        return found

    @property
    def due_ms(self) -> int | None:
        """The mission time at which the next one is due."""
        return self._held[0][2].header.sent_ms + self._window_ms if self._held else None
