"""What the coordinator means to do, each by a time of its own, and when it is to be woken for that."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum, auto


class Item(Enum):
    """What can be on the agenda."""

    CUT = auto()
    ASSIGN = auto()
    KEEP_APART = auto()
    ASK_AGAIN = auto()
    SAY_OVER = auto()


class Agenda:
    """Holds each item once, with its deadline. Times are milliseconds since the mission's start."""

    def __init__(self) -> None:
        self._deadlines_ms: dict[Item, int] = {}

    def add(self, item: Item, deadline_ms: int) -> None:
        """An item is to be done at a time at the latest: of two deadlines the earlier counts. One that is now, or past,
        is met with the next wake-up."""
        self._deadlines_ms[item] = min(deadline_ms, self._deadlines_ms.get(item, deadline_ms))

    def strike(self, item: Item, now_ms: int) -> bool:
        """Strikes an item off if it is due, whatever was to come of it later; returns whether it was."""
        deadline_ms = self._deadlines_ms.get(item)
        if deadline_ms is None or deadline_ms > now_ms:
            return False
        del self._deadlines_ms[item]
        return True

    def deadline_ms(self, item: Item) -> int | None:
        """When an item is to be done; None where it is not on the agenda."""
        return self._deadlines_ms.get(item)

    def next_wake_ms(self, now_ms: int, others_ms: Iterable[int]) -> int | None:
        """The earliest deadline, of the agenda and of these others, in the future; None where there is none."""
        first_ms = min(self._deadlines_ms.values(), default=None)
        if first_ms is None or first_ms > now_ms + 1:  # else the others need not be asked
            first_ms = min(others_ms if first_ms is None else (first_ms, *others_ms), default=None)
        return None if first_ms is None else max(first_ms, now_ms + 1)
