"""What is kept of what was said, as the topic table says: of a key the latest message, every one, or none. No I/O."""

from __future__ import annotations

from collections.abc import Callable

from comms.said.topics import Keep, Topic


class Kept:
    """Messages in the order in which they were added, those that are kept alone."""

    def __init__(self) -> None:
        self._count = 0
        self._latest: dict[str, tuple[int, bytes]] = {}
        self._events: list[tuple[int, str, bytes]] = []

    def add(self, topic: Topic, key: str, payload: bytes) -> int:
        """Adds the next message, also where it is not kept; returns by how much it counts for a tally of its topic:
        its place among all, from 1, less that of the message in whose place it comes; 0 where it is not kept."""
        place = self._count
        self._count += 1
        match topic.keep:
            case Keep.EVENTS:
                self._events.append((place, key, payload))
                return place + 1
            case Keep.LATEST:
                before = self._latest.get(key, (-1, b""))[0]
                self._latest[key] = (place, payload)
                return place - before
            case Keep.NOTHING:
                return 0

    def messages(self, wanted: Callable[[str], bool] = lambda key: True) -> list[tuple[str, bytes]]:
        """Key and payload of what is kept under wanted keys, in order."""
        found = [(place, key, payload) for key, (place, payload) in self._latest.items() if wanted(key)]
        found += [one for one in self._events if wanted(one[1])]
        return [(key, payload) for _, key, payload in sorted(found)]
