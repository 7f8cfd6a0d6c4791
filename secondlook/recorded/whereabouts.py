"""Where vehicles were, place by place, from the courses they tell. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from comms.node import Received
from comms.said.messages import Nav, TruthPose
from planner.dubins import Pose
from planner.reckoning import Course, Trace
from planner.types import Point


class Place(NamedTuple):
    """Where a vehicle was; to there from its place before it is taken to have gone straight.

    `moves`: it tells that it does. `is_true`: it was indeed here, else it believed to be. `counts`: it is true, or
    nothing true is told of this vehicle.
    """

    vehicle: str
    t_s: float
    at: Point
    moves: bool
    is_true: bool
    counts: bool


class Whereabouts:
    """Take the messages in order. `telling`: those that tell of places."""

    telling = (Nav, TruthPose)

    def __init__(self) -> None:
        self._believed: dict[str, Trace] = {}
        self._true: dict[str, Trace] = {}

    def hear(self, received: Received) -> list[Place]:
        """The places that a message adds, in the order of time: those up to where a course begins, that included."""
        message, name = received.message, received.vehicle
        if not isinstance(message, self.telling):
            return []
        is_true = isinstance(message, TruthPose)
        traces = self._true if is_true else self._believed
        course = Course.of(message, received.header.sent_ms)
        found = traces.setdefault(name, Trace()).hear(course)
        return self._places(name, found, is_true, moves=not is_true and message.speed_mps > 0)

    def end(self, now_ms: int) -> list[Place]:
        """The places up to now, vehicle by vehicle: as a mission is over, or no more is told."""
        return [
            place
            for is_true, traces in ((False, self._believed), (True, self._true))
            for name, trace in traces.items()
            for place in self._places(name, trace.end(now_ms), is_true, moves=False)
        ]

    def _places(self, name: str, found: Iterable[tuple[int, Pose]], is_true: bool, *, moves: bool) -> list[Place]:
        counts = is_true or name not in self._true
        return [Place(name, at_ms / 1000, pose[:2], moves, is_true, counts) for at_ms, pose in found]
