"""The world's node: it moves the simulated vehicles, lets them look, and publishes what they say and the truth."""

from __future__ import annotations

from operator import itemgetter

from comms.node import Publication, Received, Step
from comms.said.messages import Maneuver, MissionOver
from comms.said.topics import TRUTH_TARGETS
from sim_world.body import Body
from sim_world.config import WorldConfig
from sim_world.seabed import make_seabed
from sim_world.targets import Targets

NAV_PERIOD_MS = 1000


class World:
    """The node of the simulated sea, for all its vehicles (`comms.node.Node`).

    Reads manoeuvres and the mission's end. Publishes the targets once; for each vehicle its navigation at every whole
    second, a word on each manoeuvre, and a look for each stretch of track, the moment it is passed.
    """

    def __init__(self, config: WorldConfig) -> None:
        self._targets = Targets(config.area, config.targets.count, config.seed, config.holes)
        seabed = make_seabed(config.seabed, config.area, config.seed)
        by_id = sorted(config.vehicles, key=lambda vehicle: vehicle.vehicle)
        self._bodies = {one.vehicle: Body(one, config, seabed, self._targets) for one in by_id}
        self._next_nav_ms = 0
        self._over = False

    def start(self, now_ms: int) -> Step:
        """Publishes the targets and where the vehicles are."""
        targets = Publication(TRUTH_TARGETS.key(), self._targets.truth())
        publish, wake_ms = self._due(now_ms)
        return Step((targets, *publish), wake_ms)

    def on_message(self, received: Received, now_ms: int) -> Step:
        """Takes a manoeuvre, after all that was due until now; falls silent when the mission is over."""
        if isinstance(received.message, MissionOver):
            self._over = True
        if self._over:
            return Step()
        publish, wake_ms = self._due(now_ms)
        body = self._bodies.get(received.vehicle)
        if body is not None and isinstance(received.message, Maneuver):
            publish.append(body.command(received.message, received.header.incarnation, now_ms))
            more, wake_ms = self._due(now_ms)  # a manoeuvre may be done, or on its track, at once
            publish += more
        return Step(tuple(publish), wake_ms)

    def on_wake(self, now_ms: int) -> Step:
        """Publishes what has happened since."""
        if self._over:
            return Step()
        publish, wake_ms = self._due(now_ms)
        return Step(tuple(publish), wake_ms)

    def _due(self, now_ms: int) -> tuple[list[Publication], int | None]:
        """What there is to say by now, and when there is more."""
        publish: list[Publication] = []
        if not self._bodies:
            return publish, None
        if self._next_nav_ms <= now_ms:
            publish += self._navigation(now_ms)
        while True:
            # Of several events at one time min takes the first body's: bodies are in the order of their ids.
            due = [(at_ms, body) for body in self._bodies.values() if (at_ms := body.next_event_ms) is not None]
            if not due:
                return publish, self._next_nav_ms
            at_ms, body = min(due, key=itemgetter(0))
            if at_ms > now_ms:
                return publish, min(at_ms, self._next_nav_ms)
            publish += body.next_event(at_ms)

    def _navigation(self, now_ms: int) -> list[Publication]:
        self._next_nav_ms = (now_ms // NAV_PERIOD_MS + 1) * NAV_PERIOD_MS
        return [one for body in self._bodies.values() for one in body.navigation(now_ms)]
