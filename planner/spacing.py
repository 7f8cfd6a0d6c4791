"""Track spacing: how many tracks a width needs, at which range, and where they lie (paper, Algorithm 1).

A sensor of range r with a nadir gap r_min sees, on either side of the track, lateral distances r_min to r. Tracks are
flown in pairs, the second `r - r_min` beyond the first, so that each covers the other's nadir gap; a pair covers
`3 r - r_min`, and that without a gap as long as `r >= 3 r_min` (paper, equation 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

TOLERANCE_M = 1e-6
"""Lengths that differ by no more are taken as equal."""
NARROWEST_M = 1e-3
"""No track is laid for what is narrower: headings travel in microradians, which makes a turned area wider by as much,
and a cell whose centre is as near to a swath is seen (`planner.footprints`)."""


@dataclass(frozen=True)
class RangeChoice:
    """What Algorithm 1 picks: the adapted range r_adpt, in whole metres, and the number of tracks it needs."""

    range_m: int
    tracks: int


def track_count(width_m: float, nadir_gap_m: float, range_m: float) -> int:
    """The number of tracks that cover a width.

    Pairs as long as a whole one fits; for what is left nothing, one track if one side of it suffices
    (`range_m - nadir_gap_m`), else one more pair.

    Args:
        width_m: width still to cover; 0 or less needs no track.
        nadir_gap_m: r_min, per side, >= 0.
        range_m: r, > 0 and >= 3 r_min.

    Raises:
        ValueError: a number is not finite or out of its range.
    """
    pairs, singles = _pairs_and_singles(width_m, nadir_gap_m, range_m)
    return 2 * pairs + singles


def adapt_range(width_m: float, nadir_gap_m: float, lowest_m: float, highest_m: float) -> RangeChoice:
    """The smallest range in whole metres that covers a width with the fewest tracks (paper, Algorithm 1).

    The smallest, because what is left of the coverage is then spread as overlap over all tracks, at the far end of
    the swath where detection is poorest.

    Args:
        width_m: width still to cover.
        nadir_gap_m: r_min, per side, >= 0.
        lowest_m: lower limit of the range, > 0 and >= 3 r_min.
        highest_m: upper limit of the range: the r_max that was told, later r_eff.

    Raises:
        ValueError: no whole metre lies between the limits, or a number is not finite or out of its range.
    """
    if not (math.isfinite(lowest_m) and math.isfinite(highest_m)):
        raise ValueError(f"the limits of the range must be finite, not {lowest_m} and {highest_m} m")
    if lowest_m < 3 * nadir_gap_m - TOLERANCE_M:
        raise ValueError(
            f"the lower limit of the range is {lowest_m:g} m, but paired tracks cover each other's nadir gap of "
            f"{nadir_gap_m:g} m only from {3 * nadir_gap_m:g} m on"
        )
    lowest, highest = math.ceil(lowest_m - TOLERANCE_M), math.floor(highest_m + TOLERANCE_M)
    if lowest > highest:
        raise ValueError(f"no whole metre lies between the limits of the range, {lowest_m:g} and {highest_m:g} m")
    tracks, range_m = min((track_count(width_m, nadir_gap_m, r), r) for r in range(lowest, highest + 1))
    return RangeChoice(range_m, tracks)


def track_offsets(width_m: float, nadir_gap_m: float, range_m: float, *, covered_m: float = 0.0) -> list[float]:
    """Where the tracks lie that cover an area from the edge covered so far to its far side.

    A last pair that does not fit is pulled in, so that it ends at the far side; if it is the area's only pair, it is
    centred. A last single track lies at `width_m - range_m`: outside the area where the area is narrow.

    Args:
        width_m: width of the whole area.
        nadir_gap_m: r_min, per side, >= 0.
        range_m: r, > 0 and >= 3 r_min.
        covered_m: what lies from 0 to here is covered already, >= 0.

    Returns:
        Offsets across the area in metres, ascending; as many as `track_count` gives for `width_m - covered_m`.

    Raises:
        ValueError: a number is not finite or out of its range.
    """
    if not covered_m >= 0:
        raise ValueError(f"the edge covered so far must be 0 or more, not {covered_m} m")
    pairs, singles = _pairs_and_singles(width_m - covered_m, nadir_gap_m, range_m)
    within_pair_m = range_m - nadir_gap_m
    offsets = []
    for pair in range(pairs):
        first_m = covered_m + pair * (3 * range_m - nadir_gap_m) + range_m
        offsets += [first_m, first_m + within_pair_m]
    if singles == 1:
        offsets.append(width_m - range_m)
    elif singles == 2:
        only_pair = pairs == 0 and covered_m <= TOLERANCE_M
        first_m = (width_m - within_pair_m) / 2 if only_pair else width_m - range_m - within_pair_m
        offsets += [first_m, first_m + within_pair_m]
    return offsets


def _pairs_and_singles(width_m: float, nadir_gap_m: float, range_m: float) -> tuple[int, int]:
    """How many whole pairs fit into a width, and how many tracks (0, 1 or 2) what is left needs."""
    if not (math.isfinite(width_m) and math.isfinite(nadir_gap_m) and math.isfinite(range_m)):
        raise ValueError(f"width, nadir gap and range must be finite, not {width_m}, {nadir_gap_m} and {range_m} m")
    if nadir_gap_m < 0:
        raise ValueError(f"the nadir gap must be 0 or more, not {nadir_gap_m:g} m")
    if range_m <= 0 or range_m < 3 * nadir_gap_m - TOLERANCE_M:
        raise ValueError(
            f"the range must be above 0 and at least three nadir gaps ({3 * nadir_gap_m:g} m), not {range_m:g} m"
        )
    width_m = max(width_m, 0.0)
    pair_m = 3 * range_m - nadir_gap_m
    pairs = math.floor(width_m / pair_m)
    left_m = width_m - pairs * pair_m
    if left_m <= NARROWEST_M:
        return pairs, 0
    return pairs, 1 if left_m <= range_m - nadir_gap_m + NARROWEST_M else 2
