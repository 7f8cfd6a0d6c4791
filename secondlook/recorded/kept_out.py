"""Which vehicles entered ground to keep out of, and when. Pure; used while the mission runs and afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from planner.types import Point
from secondlook.recorded.whereabouts import Place


@dataclass(frozen=True)
class Entered:
    """A vehicle was in a zone, which are numbered from 1, first at a time in seconds since the mission's start."""

    vehicle: str
    zone: int
    t_s: float


class Entries:
    """Take the places of each vehicle in order; ask at any time."""

    def __init__(self, zones: Sequence[Sequence[Point]]) -> None:
        self._zones = [shapely.Polygon(zone) for zone in zones]
        shapely.prepare(self._zones)
        self._places: dict[str, Place] = {}
        self._found: dict[tuple[str, int], Entered] = {}

    def hear(self, place: Place) -> None:
        """Folds one place in."""
        if not self._zones or not place.counts:
            return
        name = place.vehicle
        before = self._places.get(name, place)
        if before.is_true is not place.is_true:  # from where it believed to be no way leads to where it is
            before = place
        way, at = shapely.LineString([before.at, place.at]), shapely.Point(place.at)
        self._places[name] = place
        for number, zone in enumerate(self._zones, start=1):
            if (name, number) not in self._found and (zone.intersects(at) or zone.intersects(way)):
                self._found[name, number] = Entered(name, number, place.t_s)

    def found(self) -> list[Entered]:
        """Each vehicle and zone once, in the order of time."""
        return sorted(self._found.values(), key=lambda one: (one.t_s, one.vehicle, one.zone))
