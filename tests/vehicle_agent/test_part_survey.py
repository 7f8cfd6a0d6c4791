"""The survey of one part, asked by hand: when it decides anew, on what, and what may still be seen by later tracks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from by_hand import PRIMARY

from planner.area import SurveyArea
from planner.footprints.footprint import Reach
from planner.footprints.side import SideLooking
from planner.profile_spacing import Known, ProfileSpacing, SpacingTerms
from planner.spacing_planners import AdaptiveSpacing, FixedSpacing, SpacingDecision, SpacingPlanner
from planner.types import DetectionCurve, SonarShape, Track
from vehicle_agent.config import SurveyConfig
from vehicle_agent.part_survey import PartSurvey

CURVE = DetectionCurve(np.array([25.0, 135.0]), np.array([0.3, 0.3]))
ADAPTIVE = AdaptiveSpacing(40, 145)
SEES = Reach(25.0, 135.5)


def part_of(width_m: float = 800.0, spacing: SpacingPlanner = ADAPTIVE) -> PartSurvey:
    """A part 200 m long from (100, 50), surveyed with a sonar of 40 to 145 m."""
    corners = ((100.0, 50.0), (100.0 + width_m, 50.0), (100.0 + width_m, 250.0), (100.0, 250.0))
    sonar = SideLooking(SonarShape("side", 40, 145))
    config = SurveyConfig(PRIMARY, spacing, sonar, 40, 145, 0.05, 0.6, 20, 36_000_000)
    return PartSurvey(SurveyArea(corners, 0.0), config, SpacingTerms())


def at(*offsets_m: float) -> list[Track]:
    """Tracks at these offsets."""
    return [Track(number, across_m, (0, 0), (0, 200)) for number, across_m in enumerate(offsets_m, start=1)]


def after(part: PartSurvey, flown_m: Sequence[float], r_eff_m: int) -> tuple[float, ...] | None:
    """Where the next tracks are laid once tracks at these offsets are flown, of which the last saw so far."""
    for track in at(*flown_m):
        part.flown(track, r_eff_m, CURVE)
    decision = part.next(r_eff_m, CURVE)
    return None if decision is None else decision.offsets_m


def test_tracks_lie_in_the_part_numbered_on_there_and_back() -> None:
    part = part_of()
    decision = part.first(None)
    assert (decision.range_m, decision.offsets_m) == (132, (132, 224, 488, 580, 668))
    first, second = part.tracks(decision, 7, reverse=True)[:2]
    assert first == Track(7, 132, (232, 250), (232, 50))
    assert second == Track(8, 224, (324, 50), (324, 250))
    assert part.tracks(decision, 7, reverse=False)[0] == Track(7, 132, (232, 50), (232, 250))


def test_it_is_time_to_decide_after_a_pair_or_when_nothing_is_left_and_something_was_flown() -> None:
    part = part_of()
    part.first(None)
    laid = at(132, 224, 488, 580, 668)
    assert part.replans
    assert (part.is_due(laid), part.tentative(laid)) == (False, 3)
    assert not part.is_due([])  # all were refused
    part.flown(laid[0], 135, CURVE)
    assert part.is_due([])
    assert (part.is_due(laid[1:]), part.tentative(laid[1:])) == (False, 3)
    assert part.tentative(laid[2:]) == 2  # the second was refused, the third makes the pair
    part.flown(laid[1], 135, CURVE)
    assert not part.is_due(at(224, 488))  # another piece of the second
    assert part.tentative(at(224, 488)) == 1
    assert (part.is_due(laid[2:]), part.tentative(laid[2:])) == (True, 3)
    part.flown(laid[2], 135, CURVE)
    assert part.tentative(laid[3:]) == 2
    assert part.next(135, CURVE) is not None
    assert not part.is_due(at(487))
    once = part_of(spacing=FixedSpacing(40, 145))
    once.first(None)
    for track in laid[:2]:
        once.flown(track, 135, CURVE)
    assert (once.replans, once.is_due(laid[2:]), once.is_due([]), once.tentative(laid[2:])) == (False, False, False, 0)


def test_what_a_pair_has_covered_ends_at_its_effective_range_or_that_which_it_was_laid_for() -> None:
    # Laid for 132 m; 124 m, and less than 120 m count as that where there is nothing to plan with.
    for r_eff_m, edge_m in ((135, 356), (132, 356), (124, 348), (0, 344)):
        part = part_of()
        part.first(None)
        assert after(part, (132, 224), r_eff_m) == ADAPTIVE.decide(800, edge_m, r_eff_m).offsets_m


def test_what_was_covered_stays_covered() -> None:
    part = part_of()
    part.first(None)
    assert after(part, (500, 580), 130) == ADAPTIVE.decide(800, 710, 130).offsets_m
    assert after(part, (132, 224), 130) == ADAPTIVE.decide(800, 710, 130).offsets_m
    assert after(part, (652,), 130) == ADAPTIVE.decide(800, 652 + 120, 130).offsets_m  # laid for 120 m
    before = part_of()
    before.first(None)
    assert after(before, (-200,), 130) == ADAPTIVE.decide(800, 0, 130).offsets_m  # what lies before it does not count


class Eager(AdaptiveSpacing):
    """As a user may write one: lays a track in the middle, whatever is left."""

    def decide(self, width_m: float, covered_m: float, r_eff_m: int | None) -> SpacingDecision:
        return SpacingDecision(132, (width_m / 2,), replans=True)


@pytest.mark.parametrize(("covered_m", "ends"), [(799.998, False), (799.9995, True), (800.0, True), (900.0, True)])
@pytest.mark.parametrize("spacing", [ADAPTIVE, Eager(40, 145)])
def test_nothing_is_laid_for_less_than_a_millimetre(covered_m: float, ends: bool, spacing: SpacingPlanner) -> None:
    part = part_of(spacing=spacing)
    part.first(None)
    assert (after(part, (covered_m - 132,), 140) is None) is ends


def test_of_single_tracks_each_counts_for_the_range_that_it_was_laid_for() -> None:
    part = part_of()
    part.first(None)
    singles = after(part, (132, 224), 100)
    assert singles is not None
    assert singles == ADAPTIVE.cover(800, part._looked, 100).offsets_m  # type: ignore[union-attr]
    laid_for_m = part._decision.range_m
    part.flown(at(singles[0])[0], 50, CURVE)
    part.flown(at(singles[1])[0], 140, CURVE)
    assert [(one.range_m, one.single) for one in part._looked] == [
        *((100, False), (100, False), (max(50, laid_for_m), True), (140, True)),
    ]
    assert [one.across_m for one in part._looked] == [132, 224, *singles[:2]]


class TestWhatLaterTracksMaySee:
    def test_where_nothing_is_decided_any_more_they_see_nothing(self) -> None:
        part = part_of()
        part.first(None)
        assert part.frontier_m([], SEES, 130, 5) is None
        once = part_of(spacing=FixedSpacing(40, 145))
        once.first(None)
        assert once.frontier_m(at(132, 224, 488), SEES, 130, 5) is None

    def test_beyond_a_pair_they_begin_two_least_ranges_farther_or_where_they_are_pulled_in(self) -> None:
        part = part_of()
        part.first(None)
        laid = at(132, 224, 488, 580, 668)
        # A next pair begins at 224 + 2 * 120 m or beyond; seen from there as far as 135.5 m back, and a cell of 5 m.
        for r_eff_m in (None, 130):
            assert part.frontier_m(laid, SEES, r_eff_m, 5) == 224 + 240 - 135.5 - 5
        for track in laid[:2]:
            part.flown(track, 135, CURVE)
        assert part.next(135, CURVE) is not None  # laid for 131 m, at 487, 578 and 669 m
        part.flown(at(487)[0], 135, CURVE)
        # What 135 m leave, 91 m, takes a track at 800 - 131 m, and what 125 m leave, 97 m, two: at 600 and 680 m.
        for r_eff_m, next_m in ((135, 669), (None, 669), (125, 600)):
            assert part.frontier_m(at(578, 669), SEES, r_eff_m, 5) == next_m - 135.5 - 5
        # Of a reach of 135.5 m the whole metres count: 95.5 m take two tracks, and with 136 m would take one.
        assert part.frontier_m(at(573.5, 669), SEES, None, 5) == 600 - 135.5 - 5
        # Of a piece of the track that was flown last: the pair is that and the next.
        assert part.frontier_m(at(487, 578, 669), SEES, 125, 5) == 600 - 135.5 - 5

    @pytest.mark.parametrize(("far_m", "is_last"), [(575.998, False), (575.9995, True), (576.0, True), (600.0, True)])
    def test_beyond_the_last_pair_there_are_none(self, far_m: float, is_last: bool) -> None:
        part = part_of(708)
        part.first(None)  # laid for 132 m
        assert (part.frontier_m(at(484, far_m), SEES, 140, 5) is None) is is_last

    def test_single_tracks_will_not_lie_nearer_than_they_do_now(self) -> None:
        part = part_of()
        part.first(None)
        after(part, (132, 224), 100)
        laid = at(178, 40, 400, 300)
        assert part.frontier_m(laid, SEES, 100, 5) == 300 - 135.5  # the first two are flown before it decides anew
        assert part.frontier_m(laid[:2], SEES, 100, 5) is None

    def test_by_the_whole_curve_all_but_the_first_may_be_laid_anew(self) -> None:
        part = part_of(spacing=ProfileSpacing(40, 145))
        part.first(Known(CURVE, 135, measured=False))
        assert part.frontier_m(at(130, 220, 480), SEES, None, 5) == 130 - 135.5
        assert part.frontier_m(at(130, 480, 220), SEES, 130, 5) == 220 - 135.5


def test_by_the_whole_curve_it_is_told_what_was_flown_and_what_is_still_to_come() -> None:
    part = part_of(spacing=ProfileSpacing(40, 145))
    laid = part.first(Known(CURVE, 130, measured=True)).offsets_m
    part.flown(at(laid[0])[0], 130, CURVE)
    so_far = part._so_far(128, CURVE)
    assert (so_far.width_m, so_far.flown[0].across_m, so_far.r_eff_m) == (800, laid[0], 128)
    assert so_far.planned_m == laid[1:]
    assert part._before_m == 130
    part.first(Known(CURVE, 130, measured=False))
    assert part._before_m is None
    part.first(None)
    assert part._before_m is None
