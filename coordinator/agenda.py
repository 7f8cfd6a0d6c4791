"""What the coordinator means to do, each by a time of its own, and when it is to be woken for that."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum, auto


class Item(Enum):
    """What can be on the agenda; CUT and ASSIGN are of a sector each."""

    CUT = auto()
    ASSIGN = auto()
    KEEP_APART = auto()
    ASK_AGAIN = auto()
    GOAL = auto()
    SAY_OVER = auto()


class Agenda:
    """Holds each item once, by sector, with its deadline. Times are milliseconds since the mission's start."""

    def __init__(self) -> None:
        self._deadlines_ms: dict[tuple[Item, int], int] = {}

    def add(self, item: Item, deadline_ms: int, sector: int = 0) -> None:
        """An item is to be done at a time at the latest: of two deadlines the earlier counts. One that is now, or past,
        is met with the next wake-up."""
        key = item, sector
        self._deadlines_ms[key] = min(deadline_ms, self._deadlines_ms.get(key, deadline_ms))

    def strike(self, item: Item, now_ms: int, most: int | None = None) -> list[int]:
        """Strikes an item off where it is due, whatever was to come of it later; returns of which sectors it was, those
        first that were due first. `most`: of so many sectors at most, of the others it stays due."""
        due = [(due_ms, sector) for (one, sector), due_ms in self._deadlines_ms.items() if one is item]
        struck = [sector for due_ms, sector in sorted(due) if due_ms <= now_ms][:most]
        for sector in struck:
            del self._deadlines_ms[item, sector]
        return struck

    def deadline_ms(self, item: Item) -> int | None:
        """When an item is to be done, of any sector; None where it is not on the agenda."""
        return min((due_ms for (one, _), due_ms in self._deadlines_ms.items() if one is item), default=None)

    def sectors(self, item: Item) -> list[int]:
        """Of which sectors an item is on the agenda."""
        return [sector for one, sector in self._deadlines_ms if one is item]

    def next_wake_ms(self, now_ms: int, others_ms: Iterable[int]) -> int | None:
        """The earliest deadline, of the agenda and of these others, in the future; None where there is none."""
        first_ms = min(self._deadlines_ms.values(), default=None)
        if first_ms is None or first_ms > now_ms + 1:  # else the others need not be asked
            first_ms = min(others_ms if first_ms is None else (first_ms, *others_ms), default=None)
        return None if first_ms is None else max(first_ms, now_ms + 1)
