"""What helpers are expected to look at while a primary flies one track, from what is announced of the fleet."""

from __future__ import annotations

from collections.abc import Sequence

from comms.said.announcement import Role, RosterVehicle
from planner.across import HelperLooks
from planner.footprints import footprint_of


def helper_looks(fleet: Sequence[RosterVehicle], vehicle: str) -> HelperLooks:
    """By all helpers of a fleet, of which each primary has an equal share, while `vehicle` flies a track.

    A helper is taken to look along strips for as great a share of its time as a primary along tracks; the rest are ways
    and turns. Nothing is expected while one flies that is not announced, or without speed.
    """
    primaries = [one for one in fleet if one.role is not Role.REVISIT]
    helpers = [(one, _width_m(one)) for one in fleet if one.role is Role.REVISIT]
    speed_mps = next((one.speed_mps for one in primaries if one.vehicle == vehicle), 0.0)
    area_m2ps = sum(one.speed_mps * width_m for one, width_m in helpers)
    if area_m2ps <= 0.0 or speed_mps <= 0.0:
        return HelperLooks()
    p_detect = sum(one.speed_mps * width_m * one.p_detect for one, width_m in helpers) / area_m2ps
    return HelperLooks(area_m2ps / speed_mps / len(primaries), p_detect)


def _width_m(helper: RosterVehicle) -> float:
    return footprint_of(helper.sonar).reach.strip_width_m
