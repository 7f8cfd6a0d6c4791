"""What the observer hears of a mission, in the order of sending, found by key."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import overload

from comms.node import Received
from secondlook.testing.patterns import key_pattern


class Heard(Sequence[Received]):
    """All messages so far. Each has its `key`, its typed `message` and its `header`: who sent it, and when.

    Asking again and again for the same pattern while the mission goes on looks at each message once.
    """

    def __init__(self, vehicles: tuple[str, ...], messages: Iterable[Received] = ()) -> None:
        self._vehicles = vehicles
        self._all: list[Received] = []
        self._found: dict[str, tuple[list[Received], int]] = {}
        for one in messages:
            self.take(one)

    def take(self, received: Received) -> None:
        """Takes one more message."""
        self._all.append(received)

    def messages(self, keys: str = "*") -> list[Received]:
        """The messages whose keys are like a pattern, `agent/*/hotspot/*` say; UserError where none ever can be."""
        if keys == "*":
            return list(self._all)
        return list(self._like(keys))

    def last(self, keys: str = "*") -> Received | None:
        """The newest message whose key is like a pattern, None if there is none yet."""
        found = self._all if keys == "*" else self._like(keys)
        return found[-1] if found else None

    @property
    def now_ms(self) -> int:
        """When the newest message was sent, simulated milliseconds; 0 before the first."""
        return self._all[-1].header.sent_ms if self._all else 0

    @property
    def now_s(self) -> float:
        """The same in seconds."""
        return self.now_ms / 1000

    def __len__(self) -> int:
        return len(self._all)

    @overload
    def __getitem__(self, place: int) -> Received: ...
    @overload
    def __getitem__(self, place: slice) -> list[Received]: ...
    def __getitem__(self, place: int | slice) -> Received | list[Received]:
        return self._all[place]

    def __iter__(self) -> Iterator[Received]:
        return iter(self._all)

    def _like(self, keys: str) -> list[Received]:
        found, looked_at = self._found.get(keys, ([], 0))
        pattern = key_pattern(keys, self._vehicles)
        found.extend(one for one in self._all[looked_at:] if pattern.match(one.key))
        self._found[keys] = found, len(self._all)
        return found
