"""Which tracks to lay next: the adaptive planner of the paper, and the fixed one it is compared with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from planner.spacing import adapt_range, track_offsets

LENGTH_TOLERANCE_M = 1e-6


@dataclass(frozen=True)
class SpacingDecision:
    """Tracks for what is still to be covered.

    `range_m`: the sensor range that spaces them (r_adpt). `offsets_m`: across-track offsets in the order of flying.
    `replans`: whether to ask again after the first pair. `note`: in words, what is out of the ordinary; else empty.
    """

    range_m: int
    offsets_m: tuple[float, ...]
    replans: bool
    note: str = ""


class SpacingPlanner(Protocol):
    """Lays tracks over a width; asked at the start and, where its decision says so, after each pair."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """Tracks for [covered_m, width_m]. `r_eff_m`: the effective range after the last track flown (0: nothing
        admissible), None before the first pair is flown."""


@dataclass(frozen=True)
class AdaptiveSpacing:
    """Algorithm 1 of the paper, run again after every pair on the width beyond the covered edge.

    `nadir_gap_m`: r_min. `told_range_m`: the upper limit until the first pair is flown; then r_eff takes its place.
    """

    nadir_gap_m: float
    told_range_m: float

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """See `SpacingPlanner`."""
        lowest_m = lowest_range_m(self.nadir_gap_m)
        highest_m = counted_range_m(r_eff_m, self.nadir_gap_m, self.told_range_m)
        note = ""
        if r_eff_m is not None and r_eff_m < highest_m:
            # Paired tracks cannot close the nadir gap at such a range (equation 1): the gaps become hotspots.
            why = "is below 3 r_min" if self.nadir_gap_m > 0 else "is nothing to plan with"
            note = f"r_eff {r_eff_m} m {why}: planning with {highest_m:g} m, gaps remain"
        choice = adapt_range(width_m - covered_m, self.nadir_gap_m, lowest_m, highest_m)
        offsets = track_offsets(width_m, self.nadir_gap_m, choice.range_m, covered_m=covered_m)
        return SpacingDecision(choice.range_m, tuple(offsets), replans=True, note=note)


@dataclass(frozen=True)
class FixedSpacing:
    """The control of the paper's experiments: tracks laid once, with the range that the mission was told."""

    nadir_gap_m: float
    told_range_m: float

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """See `SpacingPlanner`; what was measured changes nothing."""
        range_m = max(math.floor(self.told_range_m + LENGTH_TOLERANCE_M), lowest_range_m(self.nadir_gap_m))
        offsets = track_offsets(width_m, self.nadir_gap_m, range_m, covered_m=covered_m)
        return SpacingDecision(range_m, tuple(offsets), replans=False)


def lowest_range_m(nadir_gap_m: float) -> int:
    """The least whole metre that can space pairs: they cover each other's nadir gap from 3 r_min on (equation 1)."""
    return max(1, math.ceil(3 * nadir_gap_m - LENGTH_TOLERANCE_M))


def counted_range_m(r_eff_m: int | None, nadir_gap_m: float, told_range_m: float) -> float:
    """How far from a track what it covers is counted: r_eff; where that is less than planning can use, what planning
    uses instead. `r_eff_m`: as for `SpacingPlanner.decide`.

    What a track misses nearer than that stays a gap. If it were planned for again, a survey with such a sensor would
    fly its last tracks for ever.
    """
    lowest_m = lowest_range_m(nadir_gap_m)
    if r_eff_m is None or (r_eff_m == 0 and nadir_gap_m == 0.0):
        # Without a nadir gap no range is too short to plan with, and one that nothing was seen at tells of none.
        return max(told_range_m, lowest_m)
    return max(r_eff_m, lowest_m)
