"""The survey of one convex part of the area: where its next tracks lie, given how those flown saw."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.area import SurveyArea, lawnmower
from planner.footprints.footprint import Reach
from planner.profile_spacing import Known, PartSoFar, ProfilePlanner, SpacingTerms, first_decision
from planner.spacing import NARROWEST_M
from planner.spacing_planners import (
    FlownTrack,
    SinglesPlanner,
    SpacingDecision,
    checked_decision,
    checked_if_any,
    counted_range_m,
    lowest_range_m,
)
from planner.types import DetectionCurve, Track
from vehicle_agent.config import SurveyConfig

TRACKS_A_PAIR = 2


class PartSurvey:
    """Asks the spacing planner and keeps what it is to be told. All offsets are in the part's own sweep frame.

    `r_eff_m` is the effective range after the last track flown, in whatever part; None before the first. `curve`: P(y)
    of that track, or by now.
    """

    def __init__(self, area: SurveyArea, config: SurveyConfig, terms: SpacingTerms) -> None:
        self.area = area
        self._config = config
        self._terms = terms
        self._by_profile = isinstance(config.spacing, ProfilePlanner)  # to ask a protocol takes long
        self._before_m: int | None  # this and the next: since the part's first tracks
        self._decision: SpacingDecision
        self._covered_m = 0.0
        self._looked: list[FlownTrack] = []
        self._since: list[Track] = []

    def first(self, known: Known | None) -> SpacingDecision:
        """The tracks for the whole part."""
        self._before_m = known.r_eff_m if known is not None and known.measured else None
        self._decision = first_decision(self._config.spacing, self.area.width_m, known, self._terms)
        return self._decision

    def tracks(self, decision: SpacingDecision, first_number: int, *, reverse: bool) -> list[Track]:
        """The tracks of a decision, there and back; the first one against the part's heading or not."""
        offsets_m, range_m = decision.offsets_m, decision.range_m
        return lawnmower(self.area, offsets_m, range_m, first_number=first_number, first_reverse=reverse)

    def flown(self, track: Track, r_eff_m: int, curve: DetectionCurve) -> None:
        """Notes a track flown and how well it saw."""
        singles = self._decision.singles
        counted_m = max(r_eff_m, self._decision.range_m) if singles else r_eff_m
        self._looked.append(FlownTrack(track.across_m, counted_m, singles, curve))
        self._since.append(track)

    def is_due(self, ahead: Sequence[Track]) -> bool:
        """Whether it is time to decide again, `ahead` being the tracks of this part still to be flown."""
        # Where all that a decision laid was refused there is nothing new to decide on.
        new = self._done(ahead)
        return self._decision.replans and (new >= self._decision.asks_after or (new > 0 and not ahead))

    def tentative(self, ahead: Sequence[Track]) -> int:
        """How many of the tracks of this part still to be flown, the last ones, the next decision may lay elsewhere."""
        return len(self._beyond(ahead)) if self.replans else 0

    def _done(self, ahead: Sequence[Track]) -> int:
        """How many tracks are flown since the last decision; one that was cut in pieces when all of them are."""
        offsets_m = {track.across_m for track in self._since}
        return len(offsets_m - {ahead[0].across_m} if ahead else offsets_m)

    def _beyond(self, ahead: Sequence[Track]) -> list[Track]:
        """Of the tracks still to be flown those that the next decision may lay elsewhere."""
        due = max(0, self._decision.asks_after - self._done(ahead))
        until_then = set(list(dict.fromkeys(track.across_m for track in ahead))[:due])
        return [track for track in ahead if track.across_m not in until_then]

    @property
    def replans(self) -> bool:
        """Whether the tracks laid for it so far may be laid anew."""
        return self._decision.replans

    def next(self, r_eff_m: int, curve: DetectionCurve) -> SpacingDecision | None:
        """The tracks for what is left; None where that is nothing. Raises ValueError for an answer that is no decision
        (`planner.spacing_planners.checked_decision`)."""
        spacing, width_m = self._config.spacing, self.area.width_m
        if isinstance(spacing, ProfilePlanner):
            decision = checked_if_any(spacing, "lay", spacing.lay(self._so_far(r_eff_m, curve), self._terms))
        else:
            self._covered_m = max(self._covered_m, self._edge_m(self._since, r_eff_m))
            decision = None
            if isinstance(spacing, SinglesPlanner):
                decision = checked_if_any(spacing, "cover", spacing.cover(width_m, self._looked, r_eff_m))
            if decision is None and self._covered_m < width_m - NARROWEST_M:
                decision = self._decided(self._covered_m, r_eff_m)
        if decision is None or not decision.offsets_m:
            return None
        self._decision, self._since = decision, []
        return decision

    def frontier_m(self, ahead: Sequence[Track], reach: Reach, r_eff_m: int | None, cell_m: float) -> float | None:
        """The offset beyond which the next decision may still lay tracks that see; None where it will not."""
        if not self._decision.replans or not ahead:
            return None
        if self._by_profile and r_eff_m is None:
            # Nothing but the range that it was told has laid what comes after the first track.
            return ahead[0].across_m - reach.far_m
        if self._decision.singles or self._by_profile:
            # They will not lie much nearer than they do now.
            beyond = self._beyond(ahead)
            return min(track.across_m for track in beyond) - reach.far_m if beyond else None
        pair = list({track.across_m: track for track in (*self._since, *ahead)}.values())[:TRACKS_A_PAIR]
        known_m = math.floor(reach.far_m) if r_eff_m is None else r_eff_m
        edge_m = self._edge_m(pair, known_m)
        if edge_m >= self.area.width_m - NARROWEST_M:
            return None
        # Whatever r_eff will be, a next pair begins no nearer to this one than at twice the least range. Where the far
        # side is near its tracks are pulled in; then they lie as they would with what is known now.
        nearest_m = max(track.across_m for track in pair) + 2 * lowest_range_m(self._config.nadir_gap_m)
        pulled_in_m = min(self._decided(edge_m, known_m).offsets_m)
        return min(nearest_m, pulled_in_m) - reach.far_m - cell_m

    def _decided(self, covered_m: float, r_eff_m: int) -> SpacingDecision:
        spacing = self._config.spacing
        return checked_decision(spacing, "decide", spacing.decide(self.area.width_m, covered_m, r_eff_m))

    def _so_far(self, r_eff_m: int, curve: DetectionCurve) -> PartSoFar:
        planned_m = self._decision.offsets_m[self._done([]) :]
        return PartSoFar(self.area.width_m, self._before_m, tuple(self._looked), planned_m, curve, r_eff_m)

    def _edge_m(self, tracks: Sequence[Track], r_eff_m: int) -> float:
        """The edge up to which pairs that end with these cover the part."""
        counted_m = counted_range_m(r_eff_m, self._config.nadir_gap_m, self._config.range_m)
        return max(track.across_m for track in tracks) + min(self._decision.range_m, counted_m)
