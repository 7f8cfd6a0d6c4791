"""A world in the hands of a test: stepped by its wake-ups, and told what was sent, as lockstep does."""

from __future__ import annotations

from typing import Self

from comms.node import Node, Publication, Received, Step
from comms.said.codec import Header
from comms.said.messages import Message
from comms.said.topics import Topic
from sim_world.config import WorldConfig
from sim_world.world import World


class SteppedWorld:
    """Keeps what the world publishes, and when. What it is told was sent a millisecond ago."""

    def __init__(self, config: WorldConfig) -> None:
        self.world: Node = World(config)
        self.now_ms = 0
        self.wake_ms: int | None = None
        self.published: list[tuple[int, Publication]] = []
        self.take(self.world.start(0))

    def until(self, time_ms: int) -> Self:
        """Lets time pass."""
        while self.wake_ms is not None and self.wake_ms <= time_ms:
            self.now_ms = self.wake_ms
            self.take(self.world.on_wake(self.now_ms))
        self.now_ms = time_ms
        return self

    def tell(self, topic: Topic, message: Message, vehicle: str = "") -> Self:
        """Tells it something."""
        header = Header("sender", 0, 0, max(0, self.now_ms - 1))
        received = Received(topic.key(vehicle=vehicle), topic, vehicle, header, message)
        self.take(self.world.on_message(received, self.now_ms))
        return self

    def take(self, step: Step) -> None:
        """Takes what it has done now."""
        # Stricter than the protocol asks: nothing is left due, also after a message.
        assert step.wake_ms is None or step.wake_ms > self.now_ms
        self.wake_ms = step.wake_ms
        self.published += [(self.now_ms, one) for one in step.publish]
