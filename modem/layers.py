"""The layers of vehicles as the coordinator's modem puts them together: from stretches, and from strips that are done.

Where words are to be short nothing else of such a strip crosses the water: a helper is taken to have flown all of it,
looking as well as it was expected to.
"""

from __future__ import annotations

from comms.said.announcement import Role, RosterVehicle, RunInfo
from comms.said.messages import Curve
from modem.config import ModemConfig
from modem.corrections import Correction
from modem.stretches import LayerOf, Seen, Stretch, Told
from planner.footprints import footprint_of
from planner.sweep import legs_over_strip
from planner.types import Strip, SweepFrame

MOST_LEGS = 1000


class Layers:
    """By vehicle and start. `by_strips`: the vehicles whose strips tell by themselves what was seen of them."""

    def __init__(self, config: ModemConfig, run: RunInfo) -> None:
        self._entries = {one.vehicle: one for one in run.vehicles}
        self._grid = run.grid.spec
        self._layers: dict[tuple[str, int], LayerOf] = {}
        self.by_strips = {one.vehicle for one in run.vehicles if config.is_small and _tells_by_strips(one)}

    def hear(self, vehicle: str, incarnation: int, message: Curve | Stretch | Correction) -> list[Told]:
        """Takes a vehicle's curve, stretch or correction; returns the tiles that are others now."""
        layer = self._layer(vehicle, incarnation)
        if isinstance(message, Correction):
            return layer.correct(message)
        return layer.hear(message) if isinstance(message, Stretch) else layer.hear_curve(message)

    def hear_done(self, vehicle: str, incarnation: int, strip: Strip | None) -> list[Told]:
        """A vehicle's strip is done, which may not be known; returns the tiles that are others by that alone."""
        if strip is None or vehicle not in self.by_strips:
            return []
        layer = self._layer(vehicle, incarnation)
        return [tile for one in stretches_over(self._entries[vehicle], strip) for tile in layer.hear(one)]

    def _layer(self, vehicle: str, incarnation: int) -> LayerOf:
        if (vehicle, incarnation) not in self._layers:
            self._layers[vehicle, incarnation] = LayerOf(self._entries[vehicle], self._grid)
        return self._layers[vehicle, incarnation]


def _tells_by_strips(entry: RosterVehicle) -> bool:
    """A helper's strips do, if its sonar sees below its own track."""
    return entry.role is Role.REVISIT and footprint_of(entry.sonar).reach.beside_m == 0.0


def stretches_over(entry: RosterVehicle, strip: Strip) -> list[Stretch]:
    """The stretches flown over a strip, with numbers below 0, as of no other strip; none over what is no strip."""
    swath_m = footprint_of(entry.sonar).reach.strip_width_m
    if strip.length_m <= 0 or not 0 < strip.width_m <= MOST_LEGS * swath_m:
        return []
    frame = SweepFrame(*strip.start, strip.heading_rad)
    found = []
    for leg in legs_over_strip(strip, swath_m):
        x_m, y_m = frame.to_mission(leg.across_m - strip.width_m / 2, 0.0)
        number = -(strip.number * MOST_LEGS + leg.number)
        found.append(Stretch(number, x_m, y_m, strip.heading_rad, strip.length_m, 0, (Seen(0, 0),)))
    return found
