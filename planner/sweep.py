"""The revisit sweep: legs over a strip, the ways to fly them, and which is the shortest from where one is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from planner.dubins import TIE_M, Pose, shifted
from planner.footprints.footprint import Footprint
from planner.keep_out import NOWHERE, KeepOut
from planner.types import Point, Strip, SweepFrame, Track
from planner.ways import shortest_way, way_length_m, way_or_direct

LENGTH_TOLERANCE_M = 1e-6


class NoSweepError(ValueError):
    """A strip that cannot be flown from where one is."""


class Pass(NamedTuple):
    """A leg with its run-in and run-out: where the one begins and the other ends."""

    begin: Pose
    end: Pose

    @property
    def length_m(self) -> float:
        """From the run-in's beginning to the run-out's end."""
        return math.dist(self.begin[:2], self.end[:2])


@dataclass(frozen=True)
class Sweep:
    """A way to fly a strip's legs, which are numbered from 1 in the order of flying.

    `length_m`: from the first leg's run-in to the last one's run-out, turns included.
    """

    legs: tuple[Track, ...]
    passes: tuple[Pass, ...]
    length_m: float

    @property
    def entry(self) -> Pose:
        """Where the first run-in begins."""
        return self.passes[0].begin

    @property
    def leave(self) -> Pose:
        """Where the last run-out ends."""
        return self.passes[-1].end


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
        start, end = ends if index % 2 == 0 else reversed(ends)
        legs.append(Track(index + 1, across_m, start, end))
    return legs


@lru_cache(maxsize=10_000)
def sweeps_over(
    strip: Strip,
    swath_m: float,
    turn_radius_m: float,
    run_in_m: float,
    beside_m: float = 0.0,
    lead_m: float = 0.0,
    keep_out: KeepOut = NOWHERE,
) -> tuple[Sweep, ...]:
    """The ways to fly the legs over a strip (see `legs_over_strip`): in sequence from the first or from the last, in
    their directions or all turned round; where they lie beside what they cover, on either side of it.

    Each leg is entered and left straight for `run_in_m` >= 0, and flown `lead_m` earlier, see `pass_over`. None that
    enters ground to keep out of, or leaves no room to turn before a leg or behind it. Raises
    ValueError where the run-in, or the turn radius where there are turns, is not finite or out of its range.
    """
    if not (math.isfinite(run_in_m) and run_in_m >= 0):
        raise ValueError(f"the run-in must be finite and 0 or more, not {run_in_m} m")
    found = []
    for side_m in (beside_m, -beside_m) if beside_m else (0.0,):
        legs = legs_over_strip(strip, swath_m, side_m)
        turned = [replace(leg, start=leg.end, end=leg.start) for leg in legs]
        for way in [legs, turned] if len(legs) == 1 else [legs, legs[::-1], turned, turned[::-1]]:
            passes = tuple(pass_over(leg.start, leg.end, run_in_m, lead_m) for leg in way)
            numbered = tuple(replace(leg, number=number) for number, leg in enumerate(way, start=1))
            if _stays_out(passes, turn_radius_m, keep_out):
                found.append(Sweep(numbered, passes, length_over(passes, turn_radius_m, keep_out)))
    return tuple(found)


def _stays_out(passes: Sequence[Pass], turn_radius_m: float, keep_out: KeepOut) -> bool:
    if not keep_out:
        return True
    rooms = all(keep_out.is_room(one.begin, one.end, turn_radius_m) for one in passes)
    return rooms and all(shortest_way(one.end, other.begin, turn_radius_m, keep_out) for one, other in pairwise(passes))


def sweeps_by(
    sees: Footprint, strip: Strip, turn_radius_m: float, run_in_m: float, keep_out: KeepOut = NOWHERE
) -> tuple[Sweep, ...]:
    """The ways in which a vehicle with such a sonar may fly the legs over a strip, see `sweeps_over`."""
    reach = sees.reach
    return sweeps_over(strip, reach.strip_width_m, turn_radius_m, run_in_m, reach.beside_m, sees.lead_m, keep_out)


def shortest_sweep(
    sweeps: Sequence[Sweep], pose: Pose, turn_radius_m: float, keep_out: KeepOut = NOWHERE
) -> tuple[Sweep, float]:
    """The sweep that is shortest with the way there from `pose`, of those equally long, to within TIE_M, the first, and
    the length of that way in metres. Raises NoSweepError where there is none, or no way there stays out."""
    best, best_m = None, math.inf
    for sweep in sweeps:
        way = shortest_way(pose, sweep.entry, turn_radius_m, keep_out)
        way_m = math.inf if way is None else way_length_m(way)
        if way_m + sweep.length_m < best_m - TIE_M:
            best, best_m = sweep, way_m + sweep.length_m
    if best is None:
        raise NoSweepError("there is no sweep to choose from")
    return best, best_m - best.length_m


def pass_over(start: Point, end: Point, run_in_m: float, lead_m: float = 0.0) -> Pass:
    """The pass over a leg from `start` to `end`, flown `lead_m` earlier (`planner.footprints.footprint.Footprint`)."""
    heading_rad = math.atan2(end[0] - start[0], end[1] - start[1]) % (2 * math.pi)
    return Pass(shifted(start, heading_rad, -run_in_m - lead_m), shifted(end, heading_rad, run_in_m - lead_m))


def length_over(passes: Sequence[Pass], turn_radius_m: float, keep_out: KeepOut = NOWHERE) -> float:
    """How far it is, in metres, over passes in their order, with the turns between them. Raises ValueError where the
    turn radius is not finite and above 0."""
    turns_m = (
        way_length_m(way_or_direct(one.end, other.begin, turn_radius_m, keep_out)) for one, other in pairwise(passes)
    )
    return sum(one.length_m for one in passes) + sum(turns_m)


def distance_over(pose: Pose, passes: Sequence[Pass], turn_radius_m: float, keep_out: KeepOut = NOWHERE) -> float:
    """How far it is, in metres, from a pose over passes in their order to the last one's end; 0 without passes."""
    if not passes:
        return 0.0
    way_m = way_length_m(way_or_direct(pose, passes[0].begin, turn_radius_m, keep_out))
    return way_m + length_over(passes, turn_radius_m, keep_out)
