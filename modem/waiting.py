"""What a platform has to say, and what of it is said first: what is worth most a bit, the longer it waits the more."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from comms.said.bits import BitWriter
from comms.said.topics import Crossing

PIECES_TTL_S = 300.0
"""A piece of a message that has waited for so long is worth twice as much."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A message that waits. `to`: the platform that it is for. `key`: what it is about; of a topic with `newest_only` a
    newer one with the same takes its place, and has waited for as long. `until_ms`: from then on nobody waits for it
    any more."""

    key: str
    to: str
    crossing: Crossing
    said: BitWriter
    queued_ms: int
    until_ms: float = math.inf

    def worth(self, now_ms: int) -> float:
        """What a bit of it is worth."""
        return worth(self.crossing.value, self.crossing.ttl_s, self.queued_ms, now_ms) / self.said.bits


def worth(value: float, ttl_s: float, queued_ms: int, now_ms: int) -> float:
    """What something is worth that has waited since a time."""
    return value * (1.0 + (now_ms - queued_ms) / 1000 / ttl_s)


def by_age(crossing: Crossing, bits: int) -> Crossing:
    """How a message of so many bits goes where what has waited longest is said first: a bit of each is worth the same,
    and of pieces as well."""
    return replace(crossing, value=float(bits), ttl_s=PIECES_TTL_S)


class Queue:
    """Messages that wait, none of which was said yet."""

    def __init__(self) -> None:
        self._waiting: dict[int, Waiting] = {}
        self._count = 0

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def bits(self) -> int:
        """Of all of them, but for what may as well be left out."""
        return sum(one.said.bits for one in self._waiting.values() if not one.crossing.is_fine)

    def add(self, one: Waiting) -> None:
        """Takes a message."""
        if one.crossing.newest_only:
            for number, before in list(self._waiting.items()):
                if (before.key, before.to) == (one.key, one.to):
                    one = replace(one, queued_ms=before.queued_ms)
                    del self._waiting[number]
        self._waiting[self._count] = one
        self._count += 1

    def holds(self, key: str, *, for_sure: bool = False) -> bool:
        """Whether a message about something waits; `for_sure`: one that is to be acknowledged."""
        return any(one.key == key and one.crossing.acknowledged >= for_sure for one in self._waiting.values())

    def forget(self, key: str) -> None:
        """What waits about something is not said."""
        self._waiting = {number: one for number, one in self._waiting.items() if one.key != key}

    def remove(self, one: Waiting) -> None:
        """It is said now."""
        number = next(number for number, other in self._waiting.items() if other is one)
        del self._waiting[number]

    def drop_old(self, now_ms: int) -> None:
        """What nobody waits for any more is not said."""
        self._waiting = {number: one for number, one in self._waiting.items() if now_ms < one.until_ms}

    def best_first(self, now_ms: int) -> Iterable[Waiting]:
        """All, what is worth most a bit first; of equals what waits longer."""
        return sorted(self._waiting.values(), key=lambda one: -one.worth(now_ms))
