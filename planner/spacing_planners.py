"""Which tracks to lay next: the adaptive planner of the paper, and the fixed one it is compared with."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, runtime_checkable

from planner.cover import fewest_tracks, spans_left
from planner.spacing import adapt_range, track_offsets
from planner.types import DetectionCurve, whole_number

LENGTH_TOLERANCE_M = 1e-6


@dataclass(frozen=True)
class SpacingDecision:
    """Tracks for what is still to be covered.

    `range_m`: the sensor range that spaces them (r_adpt). `offsets_m`: across-track offsets in the order of flying.
    `replans`: whether to ask again, after the first `asks_after`. `note`: in words, what is out of the ordinary; else
    empty. `singles`: single tracks, not pairs.
    """

    range_m: int
    offsets_m: tuple[float, ...]
    replans: bool
    note: str = ""
    singles: bool = False
    asks_after: int = 2


@dataclass(frozen=True)
class FlownTrack:
    """A track flown: its offset, and up to which range what lies beside it counts as covered. That is its own r_eff;
    of a `single` one at least the range that it was laid for, so that no place is planned for twice as it was.
    `curve`: P(y) as it measured it, for who plans by that."""

    across_m: float
    range_m: float
    single: bool
    curve: DetectionCurve | None = None


class SpacingPlanner(Protocol):
    """Lays tracks over a width; asked at the start and, where its decision says so, after each pair."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """Tracks for [covered_m, width_m]. `r_eff_m`: the effective range after the last track flown (0: nothing
        admissible), None before the first pair is flown."""


@runtime_checkable
class SinglesPlanner(SpacingPlanner, Protocol):
    """A planner that can also lay single tracks, wherever something is left. It is asked for those first."""

    def cover(self, width_m: float, flown: Sequence[FlownTrack], r_eff_m: int) -> SpacingDecision | None:
        """Tracks for what these have left of [0, width_m], none if that is nothing; None to go on with `decide`."""


def checked_decision(spacing: SpacingPlanner, method: str, answer: Any) -> SpacingDecision:
    """What a spacing planner, which may be a user's own, has answered to a method of its, if it can be planned with:
    a range in whole metres from 1 on, finite offsets, and to be asked again after 1 track or more. Its offsets are
    taken out once, whatever holds them: a generator has none the second time. Raises ValueError, which names the
    planner, for anything else."""
    told = told_of(spacing)
    if not all(hasattr(answer, one.name) for one in fields(SpacingDecision)):
        must = f"must answer {method} with a planner.spacing_planners.SpacingDecision"
        raise ValueError(f"{told} {must}, not {reprlib.repr(answer)}")
    for name, must in (("range_m", "whole metres"), ("asks_after", "a whole number of tracks")):
        value = getattr(answer, name)
        if whole_number(value) is None or value < 1:
            given = f"answers {method} with {name} {reprlib.repr(value)}"
            raise ValueError(f"{told} {given}; must be {must}, 1 or more")
    given = f"answers {method} with offsets_m {reprlib.repr(answer.offsets_m)}"
    try:
        each = iter(answer.offsets_m)
    except TypeError:
        raise ValueError(f"{told} {given}; must be a tuple of metres across the tracks") from None
    offsets_m = tuple(each)  # what a generator of theirs raises is told as theirs
    try:
        wrong = [one for one in offsets_m if not math.isfinite(one)]
    except TypeError:
        raise ValueError(f"{told} {given}; must be a tuple of metres across the tracks") from None
    if wrong:
        raise ValueError(f"{told} lays a track at {wrong[0]} m by {method}; must be a finite number of metres")
    return SpacingDecision(
        int(answer.range_m),
        tuple(map(float, offsets_m)),
        answer.replans,
        answer.note,
        answer.singles,
        int(answer.asks_after),
    )


def told_of(spacing: SpacingPlanner) -> str:
    """Who a spacing planner is, for a sentence."""
    kind = type(spacing)
    return f"the spacing planner {kind.__module__}:{kind.__qualname__}"


def checked_if_any(spacing: SpacingPlanner, method: str, answer: Any) -> SpacingDecision | None:
    """The same of a method that may answer None, which says that it decides nothing. Raises ValueError."""
    return None if answer is None else checked_decision(spacing, method, answer)


@dataclass(frozen=True)
class AdaptiveSpacing:
    """Algorithm 1 of the paper, run again after every pair on the width beyond the covered edge.

    Where r_eff falls below 3 r_min, pairs do not close their nadir gaps (equation 1). From then on the fewest single
    tracks are laid over all that is left, before and behind. Without a nadir gap there is none to close, and they are
    laid from the first: a pair covers 3 r, two single tracks 4 r.

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
            note = f"r_eff {r_eff_m} m is nothing to plan with: planning with {highest_m:g} m, gaps remain"
        if self.nadir_gap_m == 0.0:
            found = fewest_tracks([(covered_m, width_m)], 0.0, highest_m)
            return SpacingDecision(found.range_m, found.offsets_m, replans=True, note=note, singles=True)
        choice = adapt_range(width_m - covered_m, self.nadir_gap_m, lowest_m, highest_m)
        offsets = track_offsets(width_m, self.nadir_gap_m, choice.range_m, covered_m=covered_m)
        return SpacingDecision(choice.range_m, tuple(offsets), replans=True, note=note)

    def cover(self, width_m: float, flown: Sequence[FlownTrack], r_eff_m: int) -> SpacingDecision | None:
        """See `SinglesPlanner`."""
        pairs_m = lowest_range_m(self.nadir_gap_m)
        covers = r_eff_m > math.ceil(self.nadir_gap_m - LENGTH_TOLERANCE_M)
        goes_on = any(track.single for track in flown)
        if not goes_on and not (covers and r_eff_m < pairs_m):
            return None
        left = spans_left(width_m, self.nadir_gap_m, [(track.across_m, track.range_m) for track in flown])
        planned_m = r_eff_m if covers else counted_range_m(r_eff_m, self.nadir_gap_m, self.told_range_m)
        found = fewest_tracks(left, self.nadir_gap_m, planned_m)
        many = "the fewest" if found.fewest else "few"
        if not covers:
            note = f"r_eff {r_eff_m} m is nothing to plan with: {many} single tracks for {planned_m:g} m, gaps remain"
        elif r_eff_m < pairs_m:
            note = f"r_eff {r_eff_m} m is below 3 r_min: {many} single tracks over all that is left"
        else:
            note = f"{many} single tracks over all that is left"
        return SpacingDecision(found.range_m, found.offsets_m, replans=True, note=note, singles=True)


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
