"""What is kept of what was said, as the topic table says: of a key the latest message, or every one. No I/O."""

from __future__ import annotations

from collections.abc import Callable

from comms.said.topics import Keep, Topic


class Kept:
    """Messages in the order in which they were added, but those in whose place a newer one has come."""

    def __init__(self) -> None:
        self._count = 0
        self._latest: dict[tuple[str, int], tuple[int, bytes]] = {}
        self._events: list[tuple[int, str, bytes]] = []

    def add(self, topic: Topic, key: str, payload: bytes, incarnation: int = 0) -> int:
        """Adds the next message; returns by how much it counts for a tally of its topic: its place among all, from 1,
        less that of the message in whose place it comes, one of the same incarnation of its sender: what an earlier one
        has told, of what it has seen for one, counts on."""
        place = self._count
        self._count += 1
        if topic.keep is Keep.EVENTS:
            self._events.append((place, key, payload))
            return place + 1
        before = self._latest.get((key, incarnation), (-1, b""))[0]
        self._latest[key, incarnation] = (place, payload)
        return place - before

    def messages(self, wanted: Callable[[str], bool] = lambda key: True) -> list[tuple[str, bytes]]:
        """Key and payload of what is kept under wanted keys, in order."""
        found = [(place, key, payload) for (key, _), (place, payload) in self._latest.items() if wanted(key)]
        found += [one for one in self._events if wanted(one[1])]
        return [(key, payload) for _, key, payload in sorted(found)]
