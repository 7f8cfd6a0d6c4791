"""Which vehicles entered ground to keep out of, and when. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from comms.node import Received
from comms.said.messages import Nav, TruthPose
from planner.types import Point


@dataclass(frozen=True)
class Entered:
    """A vehicle was in a zone, which are numbered from 1, first at a time in seconds since the mission's start."""

    vehicle: str
    zone: int
    t_s: float


class Entries:
    """Take the messages in order; ask at any time.

    True positions count where they are told, else those that vehicles believe in. From one to the next a vehicle is
    taken to go straight.
    """

    def __init__(self, zones: Sequence[Sequence[Point]]) -> None:
        self._zones = [shapely.Polygon(zone) for zone in zones]
        shapely.prepare(self._zones)
        self._places: dict[str, Point] = {}
        self._told_true: set[str] = set()
        self._found: dict[tuple[str, int], Entered] = {}

    def hear(self, received: Received) -> None:
        """Folds one message in."""
        message, name = received.message, received.vehicle
        if not self._zones or not isinstance(message, Nav | TruthPose):
            return
        if isinstance(message, TruthPose) and name not in self._told_true:
            self._told_true.add(name)
            self._places.pop(name, None)
        if isinstance(message, Nav) and name in self._told_true:
            return
        place = (message.x_m, message.y_m)
        way = shapely.LineString([self._places.get(name, place), place])
        at = shapely.Point(place)
        self._places[name] = place
        for number, zone in enumerate(self._zones, start=1):
            if (name, number) not in self._found and (zone.intersects(at) or zone.intersects(way)):
                self._found[name, number] = Entered(name, number, received.t_s)

    def found(self) -> list[Entered]:
        """Each vehicle and zone once, in the order of time."""
        return sorted(self._found.values(), key=lambda one: (one.t_s, one.vehicle, one.zone))
