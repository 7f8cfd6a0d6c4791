"""What was said so far of all that one node may read, kept for when it joins, as the topic table says. No I/O."""

from __future__ import annotations

from collections import Counter

from comms.said.routing import Routing
from comms.said.topics import Keep


class KeptMessages:
    """Kept for the node `node_id`; `arrived` counts by sender all that it may read."""

    def __init__(self, node_id: str, routing: Routing) -> None:
        self.arrived: Counter[str] = Counter()
        self._node_id = node_id
        self._routing = routing
        self._latest: dict[str, bytes] = {}
        self._events: list[tuple[str, bytes]] = []

    def take(self, key: str, payload: bytes) -> None:
        """Takes note of a message; messages of one key come in the order in which they were sent."""
        route = self._routing.route(key)
        if route is None or self._node_id not in route.readers:
            return
        self.arrived[route.writer] += 1
        if route.topic.keep is Keep.LATEST:
            self._latest[key] = payload
        elif route.topic.keep is Keep.EVENTS:
            self._events.append((key, payload))

    def has_all(self, said: Counter[str]) -> bool:
        """Whether as much has arrived of each sender as was said."""
        return all(self.arrived[sender] >= count for sender, count in said.items())

    def messages(self) -> list[tuple[str, bytes]]:
        """Key and payload of each kept message, in no particular order."""
        return [*self._latest.items(), *self._events]
