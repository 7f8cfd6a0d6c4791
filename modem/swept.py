"""What a strip tells of its coverage by itself, once its vehicle has said that it is done: the stretches that a helper has
flown over it, looking as well as it was expected to. Where words are to be short nothing else of it crosses the water.
"""

from __future__ import annotations

from comms.said.announcement import Role, RosterVehicle
from modem.config import ModemConfig
from modem.stretches import Seen, Stretch
from planner.footprints import footprint_of
from planner.sweep import legs_over_strip
from planner.types import Strip, SweepFrame

MOST_LEGS = 1000


def tells_by_strips(config: ModemConfig, entry: RosterVehicle) -> bool:
    """Whether a vehicle's strips tell what it has seen: of a helper, whose sonar sees below its own track."""
    return config.is_small and entry.role is Role.REVISIT and footprint_of(entry.sonar).reach.beside_m == 0.0


def stretches_over(entry: RosterVehicle, strip: Strip) -> list[Stretch]:
    """The stretches flown over a strip, with numbers below 0, as of no other strip; none over what is no strip."""
    if strip.length_m <= 0 or strip.width_m <= 0:
        return []
    legs = legs_over_strip(strip, footprint_of(entry.sonar).reach.strip_width_m)
    if len(legs) > MOST_LEGS:
        return []
    frame = SweepFrame(*strip.start, strip.heading_rad)
    found = []
    for leg in legs:
        x_m, y_m = frame.to_mission(leg.across_m - strip.width_m / 2, 0.0)
        number = -(strip.number * MOST_LEGS + leg.number)
        found.append(Stretch(number, float(x_m), float(y_m), strip.heading_rad, strip.length_m, 0, (Seen(0, 0),)))
    return found
