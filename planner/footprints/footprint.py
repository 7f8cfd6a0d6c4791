"""What may be asked of a sonar's footprint, whatever its kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from planner.types import DetectionCurve, FloatArray, LookGeometry, Point


@dataclass(frozen=True)
class Reach:
    """From which lateral range to which a sonar sees, either side. 0 <= `near_m` <= `far_m`."""

    near_m: float
    far_m: float

    @classmethod
    def of_look(cls, look: LookGeometry, p_detect: FloatArray) -> Reach | None:
        """As far as a look saw, None where it saw nothing. `p_detect`: shape (2, along bins, range bins)."""
        seen = p_detect.max(axis=(0, 1)).nonzero()[0]
        return cls(float(seen[0] * look.range_bin_m), float(seen[-1] * look.range_bin_m)) if seen.size else None

    def joined(self, other: Reach) -> Reach:
        """From the nearer of both to the farther."""
        return Reach(min(self.near_m, other.near_m), max(self.far_m, other.far_m))

    @property
    def strip_width_m(self) -> float:
        """The widest strip that one pass covers: with both sides, or with one where there is a nadir gap between."""
        return self.far_m - self.near_m if self.near_m > 0 else 2 * self.far_m

    @property
    def beside_m(self) -> float:
        """How far to a side of the track the middle of such a strip lies; 0 without a nadir gap."""
        return (self.near_m + self.far_m) / 2 if self.near_m > 0 else 0.0


class Footprint(Protocol):
    """What ground a sonar sees, at a time and on a pass, which is to say on the whole of a straight track.

    Its looks are rectangles of bins beside a stretch of track, or beside and ahead of it.
    """

    @property
    def name(self) -> str:
        """What such a sonar is called."""

    @property
    def reach(self) -> Reach:
        """Within which lateral ranges a pass leaves no ground without a look."""

    @property
    def ahead_m(self) -> float:
        """How far ahead of the vehicle it sees, >= 0."""

    @property
    def lead_m(self) -> float:
        """How far before the ground that it is to see the vehicle passes along a track, >= 0: a pass is flown as much
        earlier, so that all ground beside its track is seen, from its beginning to its end."""

    @property
    def outline(self) -> tuple[tuple[Point, ...], ...]:
        """What it sees at a time, as lines in the vehicle's frame: metres to starboard and ahead."""

    @property
    def words(self) -> str:
        """How far it sees, in words for people."""

    def told(self, range_m: float) -> Footprint:
        """The same kind of sonar as who plans is told to count on it: with a reach up to `range_m` > 0."""

    def track_length_m(self, look: LookGeometry) -> float:
        """The length of the stretch of track that a look stands for; it begins where the look's bins begin."""

    def pass_curve(self, curve: DetectionCurve) -> DetectionCurve:
        """P(y) of a pass over lateral range, all its looks together. `curve`: P_d of one look over the range."""

    def pass_profile(self, look: LookGeometry, p_detect: FloatArray) -> FloatArray:
        """P_d that a pass of looks such as this one comes to, shape (2, n, range bins): one profile over lateral range
        for each of n places along the track. `p_detect`: the look's, shape (2, along bins, range bins)."""
