"""The revisit sweep: legs over a strip, and how to fly them from where one is."""

from __future__ import annotations

import math
from dataclasses import replace

from planner.dubins import Pose, shortest_path
from planner.types import Point, Strip, SweepFrame, Track

LENGTH_TOLERANCE_M = 1e-6


def legs_over_strip(strip: Strip, swath_m: float, beside_m: float = 0.0) -> list[Track]:
    """The fewest parallel legs along a strip that cover its width with a swath of `swath_m`, evenly spread.

    Numbered from 1; `across_m` is the offset from the strip's left edge. Directions alternate, the first leg runs the
    strip's way. `beside_m`: how far the legs lie to the right of what they cover, for a sensor that looks to the side;
    less than 0 to the left. Raises ValueError where the swath, or the strip's length or width, is not finite and
    above 0.
    """
    if not all(math.isfinite(extent_m) and extent_m > 0 for extent_m in (swath_m, strip.length_m, strip.width_m)):
        raise ValueError(
            f"a sweep needs lengths above 0: swath {swath_m} m, strip {strip.length_m} m by {strip.width_m} m"
        )
    count = max(1, math.ceil((strip.width_m - LENGTH_TOLERANCE_M) / swath_m))
    frame = SweepFrame(*strip.start, strip.heading_rad)
    legs = []
    for index in range(count):
        across_m = strip.width_m * (index + 0.5) / count + beside_m
        ends = [frame.to_mission(across_m - strip.width_m / 2, along_m) for along_m in (0.0, strip.length_m)]
        start, end = ((float(x_m), float(y_m)) for x_m, y_m in (ends if index % 2 == 0 else reversed(ends)))
        legs.append(Track(index + 1, across_m, start, end))
    return legs


def cheapest_entry(legs: list[Track], pose: Pose, turn_radius_m: float, run_in_m: float) -> tuple[list[Track], float]:
    """The legs in the order and direction that is shortest from `pose`, and the whole distance in metres.

    The legs are kept in sequence, from the first or from the last, and in their directions or all turned round; of ways
    equally long the first in this sentence is taken. They are numbered from 1 in the order of flying. Each is entered
    straight for `run_in_m` >= 0, and left so where another follows. Raises ValueError where there are no legs, or the
    run-in or the turn radius is not finite or out of its range.
    """
    if not legs:
        raise ValueError("a sweep has at least one leg")
    if not (math.isfinite(run_in_m) and run_in_m >= 0):
        raise ValueError(f"the run-in must be finite and 0 or more, not {run_in_m} m")
    best, best_m = legs, math.inf
    for way in ways_over(legs):
        distance_m = distance_over(way, pose, turn_radius_m, run_in_m)
        if distance_m < best_m - LENGTH_TOLERANCE_M:
            best, best_m = way, distance_m
    return [replace(leg, number=number) for number, leg in enumerate(best, start=1)], best_m


def ways_over(legs: list[Track]) -> list[list[Track]]:
    """The ways to fly legs in sequence: from the first or from the last, in their directions or all turned round."""
    turned = [replace(leg, start=leg.end, end=leg.start) for leg in legs]
    return [legs, turned] if len(legs) == 1 else [legs, legs[::-1], turned, turned[::-1]]


def distance_over(legs: list[Track], pose: Pose, turn_radius_m: float, run_in_m: float) -> float:
    """How far it is, in metres, from `pose` over all legs in their order to the last one's end.

    Each is entered straight for `run_in_m` >= 0, and left so where another follows. Raises ValueError where the turn
    radius is not finite and above 0.
    """
    total_m = 0.0
    for index, leg in enumerate(legs):
        entry = shifted(leg.start, leg.heading_rad, -run_in_m)
        total_m += shortest_path(pose, entry, turn_radius_m).length_m + run_in_m + leg.length_m
        if index + 1 < len(legs):
            total_m += run_in_m
            pose = shifted(leg.end, leg.heading_rad, run_in_m)
    return total_m


def shifted(point: Point, heading_rad: float, distance_m: float) -> Pose:
    """The pose a distance ahead of a point, negative for behind it."""
    return Pose(
        point[0] + distance_m * math.sin(heading_rad), point[1] + distance_m * math.cos(heading_rad), heading_rad
    )
