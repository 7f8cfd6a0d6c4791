"""Track spacing by the whole P(y), not by its range alone: as many tracks as Algorithm 1 would lay, or the fewest that
reach a wanted risk, where they leave least in the worst 30 % of the width (the paper's future work)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, runtime_checkable

from planner.across import MOST_MOVED, NOBODY, Across, HelperLooks, Measured
from planner.curve import effective_range_m
from planner.spacing import NARROWEST_M
from planner.spacing_planners import (
    AdaptiveSpacing,
    FlownTrack,
    SinglesPlanner,
    SpacingDecision,
    SpacingPlanner,
    checked_decision,
    checked_if_any,
    counted_range_m,
    told_of,
)
from planner.types import DetectionCurve

MOST_TIMES = 3
"""No more tracks for a wanted risk than so many times those of Algorithm 1."""

PUSHES = ((24, 0), (0, 24), (-24, 0), (0, -24))
"""Bins by which the tracks of odd and of even places are pushed: about as far as from one optimum to the next."""


@dataclass(frozen=True)
class PartSoFar:
    """How far the survey of one part is.

    `before_m`: r_eff when it began, None if nothing was measured then. `flown`: its tracks so far, each with its curve.
    `planned_m`: the offsets that the last decision laid beyond those. `curve`: P(y) as it is known now, from this part,
    from one before it, or from earlier missions. `r_eff_m`: after the last track, or else that of `curve`.
    """

    width_m: float
    before_m: int | None
    flown: tuple[FlownTrack, ...]
    planned_m: tuple[float, ...]
    curve: DetectionCurve
    r_eff_m: int


@dataclass(frozen=True)
class Known:
    """What is known of the sonar when a part is begun: P(y) and its r_eff. `measured`: on this survey; else on earlier
    missions, and then Algorithm 1 goes by the range that it was told."""

    curve: DetectionCurve
    r_eff_m: int
    measured: bool


@dataclass(frozen=True)
class SpacingTerms:
    """What holds for all parts. `cell_m`: of the map, > 0. `rho`: of residual risk. `wanted_risk`: the mean residual
    risk of the worst 30 % that is to be reached, in (0, 1); None for as many tracks as Algorithm 1 would lay.
    `helpers`: what they are expected to look at."""

    cell_m: float = 1.0
    rho: float = 0.0
    wanted_risk: float | None = None
    helpers: HelperLooks = NOBODY


@runtime_checkable
class ProfilePlanner(SpacingPlanner, Protocol):
    """A planner that is told P(y) in full. As soon as one is known it is asked for nothing else."""

    def lay(self, part: PartSoFar, terms: SpacingTerms) -> SpacingDecision | None:
        """Tracks for what is left; None where that is nothing."""


@dataclass(frozen=True)
class ProfileSpacing(AdaptiveSpacing):
    """Algorithm 1 until a curve is known, and single tracks as there where r_eff falls below 3 r_min. Else its tracks,
    moved so that the worst 30 % across the tracks is least, anew after each track. What Algorithm 1's own would
    see of the width is seen, within r_eff what they would see so; if that takes more tracks, more are laid."""

    counts_helpers: ClassVar[bool] = False

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        """As Algorithm 1; to be asked again after one track."""
        return replace(super().decide(width_m, covered_m, r_eff_m), asks_after=1)

    def lay(self, part: PartSoFar, terms: SpacingTerms) -> SpacingDecision | None:
        """See `ProfilePlanner`."""
        if part.flown or part.before_m is not None:
            singles = self.cover(part.width_m, part.flown, part.r_eff_m)
            if singles is not None:
                return singles if singles.offsets_m else None
        theirs = self._algorithm_1(part)
        flown = [Measured(one.across_m, one.curve or part.curve, one.range_m) for one in part.flown]
        to_come = [Measured(across_m, part.curve, part.r_eff_m) for across_m in theirs[len(flown) :]]
        as_theirs = [one._replace(across_m=across_m) for one, across_m in zip(flown, theirs, strict=False)]
        helpers = terms.helpers if self.counts_helpers else NOBODY
        across = Across(part.width_m, flown, part.curve, part.r_eff_m, terms.cell_m, terms.rho, helpers)
        across.ask_for([*as_theirs, *to_come])
        bins = _seeing_all(across, to_come, self._starts(part, theirs))
        if bins is None:
            offsets_m = [one.across_m for one in to_come]
        else:
            if terms.wanted_risk is not None:
                most = MOST_TIMES * len(theirs) - len(flown)
                bins = _fewest(across, bins, terms.wanted_risk, most, may_lose=helpers != NOBODY)
            offsets_m = [float(place * across.step_m) for place in bins]
        if not offsets_m:
            return None
        range_m = math.floor(counted_range_m(part.r_eff_m, self.nadir_gap_m, self.told_range_m))
        note = "" if bins is None else f"by P(y), worst 30 % expected at {across.worst30(bins):.3f}"
        # What is asked for beyond Algorithm 1's last track is asked for once.
        replans = bool(to_come) or terms.wanted_risk is not None
        return SpacingDecision(range_m, tuple(offsets_m), replans=replans, note=note, asks_after=1)

    def _starts(self, part: PartSoFar, theirs: Sequence[float]) -> list[Sequence[float]]:
        """Offsets to move tracks from: Algorithm 1's beyond as many as are flown, drawn out or together from where the
        last of these lies, and those that were planned before, if they are as many."""
        flown, far_m = len(part.flown), part.width_m
        last_m, their_last_m = (part.flown[-1].across_m, theirs[min(flown, len(theirs)) - 1]) if flown else (0.0, 0.0)
        drawn = (far_m - last_m) / (far_m - their_last_m) if last_m < far_m and their_last_m < far_m else 1.0
        starts: list[Sequence[float]] = [[far_m - (far_m - across_m) * drawn for across_m in theirs[flown:]]]
        if len(part.planned_m) == len(starts[0]):
            starts.append(part.planned_m)
        return starts

    def _algorithm_1(self, part: PartSoFar) -> list[float]:
        """All tracks that Algorithm 1 would lay in the part, in the order of flying, with each r_eff as it was measured
        and those to come as the newest."""
        laid: list[float] = []
        covered_m, r_eff_m = 0.0, part.before_m
        while covered_m < part.width_m - NARROWEST_M:
            decision = super().decide(part.width_m, covered_m, r_eff_m)
            pair = decision.offsets_m[:2]
            laid += pair
            known = len(laid) <= len(part.flown)
            r_eff_m = math.floor(part.flown[len(laid) - 1].range_m) if known else part.r_eff_m
            counted_m = counted_range_m(r_eff_m, self.nadir_gap_m, self.told_range_m)
            covered_m = max(covered_m, max(pair) + min(decision.range_m, counted_m))
        return laid


def known_before(prior: DetectionCurve, threshold: float) -> Known:
    """What earlier missions have measured; `threshold` as for `planner.curve.effective_range_m`."""
    return Known(prior, effective_range_m(prior, threshold) or 0, measured=False)


def first_decision(
    spacing: SpacingPlanner, width_m: float, known: Known | None, terms: SpacingTerms
) -> SpacingDecision:
    """The tracks for a whole part, by all that the spacing planner can make use of. Raises ValueError for an answer of
    a user's own that is no decision (`checked_decision`), or lays no track by `decide`."""
    measured_m = known.r_eff_m if known is not None and known.measured else None
    decision = None
    if known is not None and isinstance(spacing, ProfilePlanner):
        part = PartSoFar(width_m, measured_m, (), (), known.curve, known.r_eff_m)
        decision = checked_if_any(spacing, "lay", spacing.lay(part, terms))
    elif measured_m is not None and isinstance(spacing, SinglesPlanner):
        decision = checked_if_any(spacing, "cover", spacing.cover(width_m, (), measured_m))
    if decision is None:
        decision = checked_decision(spacing, "decide", spacing.decide(width_m, 0.0, measured_m))
        if not decision.offsets_m:
            raise ValueError(f"{told_of(spacing)} lays no track by decide; must lay one or more over {width_m:g} m")
    return decision


@dataclass(frozen=True)
class JointSpacing(ProfileSpacing):
    """By the whole P(y), and together with what helpers are expected to look at while the tracks are flown: wherever
    these leave most. To reach a wanted risk with fewer tracks it leaves ground unseen, to the helpers."""

    counts_helpers: ClassVar[bool] = True


def _seeing_all(across: Across, to_come: Sequence[Measured], starts: Sequence[Sequence[float]]) -> list[int] | None:
    """The tracks moved from where they start so that they are worth most; more of them, where these see not all that is
    asked. None where tracks on whole bins would have to be more though those to come as Algorithm 1 has them need
    not."""
    moved = [across.refined([round(across_m / across.step_m) for across_m in start]) for start in starts]
    bins = min(moved, key=across.worth)
    for push in PUSHES:
        # From where no small move is better there may be a way on for every second track.
        pushed = [place + push[index % 2] for index, place in enumerate(bins[:MOST_MOVED])]
        bins = min(bins, across.refined([*pushed, *bins[MOST_MOVED:]]), key=across.worth)
    lost_m = across.worth(bins).lost_m
    if lost_m and across.lost_m(to_come) == 0.0:
        return None
    while lost_m:
        more = across.refined(across.with_one_more(bins))
        left_m = across.worth(more).lost_m
        if left_m >= lost_m:
            break
        bins, lost_m = more, left_m
    return bins


def _fewest(across: Across, bins: list[int], wanted_risk: float, most: int, *, may_lose: bool) -> list[int]:
    """The fewest tracks that leave no more than is wanted in the worst 30 %, at most so many; `may_lose`: even if they
    miss more of what is asked."""
    lost_m = across.worth(bins).lost_m
    while across.worst30(bins) > wanted_risk and len(bins) < most:
        bins = across.refined(across.with_one_more(bins))
    while bins:
        fewer = across.refined(across.with_one_less(bins))
        if across.worst30(fewer) > wanted_risk or (across.worth(fewer).lost_m > lost_m and not may_lose):
            break
        bins = fewer
    return bins
