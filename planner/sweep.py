"""The revisit sweep: legs over a strip for a sensor without a nadir gap, and how to fly them from where one is."""

from __future__ import annotations

import math

from planner.dubins import Pose, shortest_path
from planner.types import Strip, SweepFrame, Track

LENGTH_TOLERANCE_M = 1e-6


def legs_over_strip(strip: Strip, swath_m: float) -> list[Track]:
    """The fewest parallel legs along a strip that cover its width with a swath of `swath_m` > 0, evenly spread.

    Numbered from 1; `across_m` is the offset from the strip's left edge. Directions alternate, the first leg runs the
    strip's way.
    """
    count = max(1, math.ceil((strip.width_m - LENGTH_TOLERANCE_M) / swath_m))
    frame = SweepFrame(*strip.start, strip.heading_rad)
    legs = []
    for index in range(count):
        across_m = strip.width_m * (index + 0.5) / count
        ends = [frame.to_mission(across_m - strip.width_m / 2, along_m) for along_m in (0.0, strip.length_m)]
        start, end = ((float(x_m), float(y_m)) for x_m, y_m in (ends if index % 2 == 0 else reversed(ends)))
        legs.append(Track(index + 1, across_m, start, end))
    return legs


def cheapest_entry(legs: list[Track], pose: Pose, turn_radius_m: float, run_in_m: float) -> tuple[list[Track], float]:
    """The legs in the order and direction that is shortest from `pose`, and the whole distance in metres.

    The legs are kept in sequence, from the first or from the last, and in their directions or all turned round; each
    is entered and left straight for `run_in_m`.
    """
    turned = [Track(leg.number, leg.across_m, leg.end, leg.start) for leg in legs]
    ways = [legs, legs[::-1], turned, turned[::-1]]
    return min(((way, _distance_m(way, pose, turn_radius_m, run_in_m)) for way in ways), key=lambda found: found[1])


def _distance_m(legs: list[Track], pose: Pose, turn_radius_m: float, run_in_m: float) -> float:
    total_m = 0.0
    for index, leg in enumerate(legs):
        entry = _shifted(leg.start, leg.heading_rad, -run_in_m)
        total_m += shortest_path(pose, entry, turn_radius_m).length_m + run_in_m + leg.length_m
        if index + 1 < len(legs):
            total_m += run_in_m
            pose = _shifted(leg.end, leg.heading_rad, run_in_m)
    return total_m


def _shifted(point: tuple[float, float], heading_rad: float, distance_m: float) -> Pose:
    return Pose(
        point[0] + distance_m * math.sin(heading_rad), point[1] + distance_m * math.cos(heading_rad), heading_rad
    )
