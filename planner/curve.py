"""Detection curves P(y): estimated from looks, and what a planner reads off them (paper, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.types import DetectionCurve, FloatArray

NEWEST_CURVES = 4
"""What a vehicle sees is taken to be the mean P(y) of so many tracks: a track's own has an error in common over all of
it."""
_TOLERANCE = 1e-9
"""Of probabilities and metres: a mean of equal numbers is not bent by the last bits of their sum."""


class RangeTally:
    """Estimates P(y) from looks by integrating out everything but range.

    Takes the mean of P_d over sides, along-track bins and looks in each range bin. Bins are centred on whole
    multiples of `range_bin_m`, the first at 0. Where a look saw nothing counts as P_d = 0, and so does what lies
    beyond the end of a look that has fewer range bins than others.
    """

    def __init__(self, range_bin_m: float) -> None:
        if not (math.isfinite(range_bin_m) and range_bin_m > 0):
            raise ValueError(f"a range bin's width must be finite and above 0, not {range_bin_m} m")
        self._range_bin_m = range_bin_m
        self._sums: FloatArray = np.zeros(0)
        self._profiles = 0

    def add(self, p_detect: FloatArray) -> None:
        """Adds one look.

        Args:
            p_detect: P_d in [0, 1), shape (sides, along bins, range bins); no axis empty, at least 2 range bins.

        Raises:
            ValueError: the shape is another, or a number is not a probability below 1.
        """
        if p_detect.ndim != 3 or p_detect.size == 0 or p_detect.shape[2] < 2:
            raise ValueError(f"a look has shape (sides, along bins, 2 or more range bins), not {p_detect.shape}")
        if not (p_detect.min() >= 0 and p_detect.max() < 1):
            raise ValueError("a look's P_d must lie in [0, 1)")
        sides, along_bins, range_bins = p_detect.shape
        if range_bins > self._sums.size:
            self._sums = np.pad(self._sums, (0, range_bins - self._sums.size))
        self._sums[:range_bins] += p_detect.sum(axis=(0, 1))
        self._profiles += sides * along_bins

    def curve(self) -> DetectionCurve:
        """P(y) over the looks so far, one point per range bin.

        Raises:
            ValueError: no look has been added.
        """
        if self._profiles == 0:
            raise ValueError("no detection curve without a look")
        return DetectionCurve(
            np.arange(self._sums.size, dtype=np.float64) * self._range_bin_m, self._sums / self._profiles
        )


def mean_curve(curves: Sequence[DetectionCurve]) -> DetectionCurve:
    """The mean P(y) of curves, at the points of the one that has most. Raises ValueError where there is no curve."""
    range_m = max((one.range_m for one in curves), key=len)
    return DetectionCurve(range_m, np.mean([one.at(range_m) for one in curves], axis=0))


def effective_range_m(curve: DetectionCurve, threshold: float) -> int | None:
    """r_eff: the largest whole metre up to which P(y) stays at or above a threshold, outward from its peak.

    What lies nearer than the peak plays no part, nor does what lies beyond the first fall below the threshold. Of
    several equal peaks the nearest counts.

    Args:
        curve: P(y).
        threshold: P_d at and above which data is admissible, in (0, 1); 0.05 in the paper.

    Returns:
        r_eff in metres, or None where even the peak lies below the threshold.

    Raises:
        ValueError: the threshold lies outside (0, 1).
    """
    if not 0 < threshold < 1:
        raise ValueError(f"the threshold of P_d must lie between 0 and 1, not at {threshold}")
    peak = int(np.argmax(curve.p_detect))
    admissible = curve.p_detect[peak:] >= threshold - _TOLERANCE
    if not admissible[0]:
        return None
    if admissible.all():
        return math.floor(float(curve.range_m[-1]) + _TOLERANCE)
    outer = peak + int(np.argmin(admissible))
    (near_m, far_m), (above, below) = curve.range_m[outer - 1 : outer + 1], curve.p_detect[outer - 1 : outer + 1]
    crossing_m = near_m + (far_m - near_m) * max(above - threshold, 0.0) / (above - below)
    return math.floor(float(crossing_m) + _TOLERANCE)
