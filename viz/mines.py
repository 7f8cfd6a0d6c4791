"""How many mines may be left, over time: the mean and the 90 % interval, and how many are found; with which chance a
mine has been found, and none is left."""

from __future__ import annotations

import rerun as rr

from comms.node import Received
from comms.said.messages import Contact, Curve
from planner.clearance import mines_left_by, scatter_of_all
from planner.contacts import ObjectsOnMap, Sighting
from planner.fleet_map import FleetMap
from planner.types import BoolArray, DetectionCurve
from viz import palette, paths
from viz.canvas import Canvas

DRAW_EVERY_MS = 120_000
SERIES = {
    paths.MINES_FOUND: ("found", palette.COVERED, 2.0),
    paths.MINES_LEFT: ("may be left", palette.WORST_RISK, 2.0),
    paths.MINES_LEFT_LOW: ("at least, with 95 %", palette.WORST_RISK, 0.75),
    paths.MINES_LEFT_HIGH: ("at most, with 95 %", palette.WORST_RISK, 0.75),
    paths.CLEARANCE_SHARE: ("chance that a mine has been found", palette.COVERED, 2.0),
    paths.NONE_LEFT: ("chance that none is left", palette.WORST_RISK, 2.0),
}


class Mines:
    """Draws them every DRAW_EVERY_MS of the mission from what contacts, P(y) and the map, with the area's cells
    `inside`, tell then; nothing before a first look."""

    def __init__(self, canvas: Canvas, map_: FleetMap, inside: BoolArray) -> None:
        self._canvas, self._inside = canvas, inside
        self._objects = ObjectsOnMap(map_)
        self._curves: dict[str, dict[int, DetectionCurve]] = {}
        self._due_ms = DRAW_EVERY_MS
        for path, (name, colour, width) in SERIES.items():
            canvas.put_static(path, rr.SeriesLines(colors=[colour], names=[name], widths=[width]))

    def on_contact(self, received: Received, contact: Contact) -> None:
        """Joins a contact."""
        number = received.vehicle, received.header.incarnation, received.number
        place = contact.x_m, contact.y_m, contact.sigma_m
        self._objects.hear(Sighting(received.vehicle, *place, contact.score), number)

    def on_curve(self, received: Received, curve: Curve) -> None:
        """Notes what a track has measured."""
        if curve.track > 0 and curve.detection_curve is not None:
            self._curves.setdefault(received.vehicle, {})[curve.track] = curve.detection_curve

    def advance(self, time_ms: int) -> None:
        """Time passes to this one."""
        if time_ms >= self._due_ms:
            self._draw(self._due_ms)
            self._due_ms = time_ms - time_ms % DRAW_EVERY_MS + DRAW_EVERY_MS

    def finish(self, time_ms: int) -> None:
        """Draws how it ends."""
        self._draw(time_ms)

    def _draw(self, time_ms: int) -> None:
        scatter = scatter_of_all(list(one.values()) for one in self._curves.values())
        left = mines_left_by(self._objects, self._inside, scatter)
        if left is not None:
            values = left.found, left.mean, left.low, left.high, left.clearance, left.none
            for path, value in zip(SERIES, values, strict=True):
                self._canvas.put(time_ms, path, rr.Scalars(float(value)))
