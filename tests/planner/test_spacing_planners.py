"""The adaptive planner and the fixed one, asked as an agent asks them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.spacing import track_count
from planner.spacing_planners import (
    AdaptiveSpacing,
    FixedSpacing,
    FlownTrack,
    SinglesPlanner,
    SpacingDecision,
    checked_decision,
    counted_range_m,
    lowest_range_m,
)

WIDTH_M = 1212
NADIR_GAP_M = 40
R_EFF_M = 130


def fly(planner: AdaptiveSpacing | FixedSpacing, width_m: float, r_eff_m: int) -> tuple[list[float], list[int]]:
    """Flies pair after pair as long as the planner replans; returns the offsets flown and the ranges decided."""
    flown: list[float] = []
    ranges: list[int] = []
    covered_m, known_m = 0.0, None
    while covered_m < width_m - 1e-6:
        decision = planner.decide(width_m, covered_m, known_m)
        ranges.append(decision.range_m)
        if not decision.replans:
            return flown + list(decision.offsets_m), ranges
        flown += decision.offsets_m[:2]
        known_m = r_eff_m
        covered_m = max(flown) + min(
            decision.range_m, counted_range_m(known_m, planner.nadir_gap_m, planner.told_range_m)
        )
    return flown, ranges


class TestThePapersFigures:
    """Section V: an area 1212 m wide, a nadir gap of 40 m, an effective range of 130 m."""

    def test_experiment_1(self) -> None:
        planner = AdaptiveSpacing(NADIR_GAP_M, 145)
        first = planner.decide(WIDTH_M, 0, None)
        assert (first.range_m, len(first.offsets_m), first.replans, first.note) == (138, 7, True, "")
        assert first.offsets_m[:2] == (138, 236)
        covered_m = 236 + min(138, counted_range_m(R_EFF_M, planner.nadir_gap_m, planner.told_range_m))
        assert covered_m == 366
        then = planner.decide(WIDTH_M, covered_m, R_EFF_M)
        assert then == SpacingDecision(120, (486, 566, 806, 886, 1012, 1092), replans=True)

    @pytest.mark.parametrize(("told_m", "ranges_m"), [(145, [138, 120, 120, 120]), (120, [120] * 4), (130, [120] * 4)])
    def test_each_adaptive_mission_flies_eight_tracks(self, told_m: float, ranges_m: list[int]) -> None:
        offsets, ranges = fly(AdaptiveSpacing(NADIR_GAP_M, told_m), WIDTH_M, R_EFF_M)
        assert len(offsets) == 8
        assert ranges == ranges_m

    @pytest.mark.parametrize(("told_m", "tracks"), [(145, 7), (120, 8), (130, 8)])
    def test_the_control_missions(self, told_m: float, tracks: int) -> None:
        offsets, ranges = fly(FixedSpacing(NADIR_GAP_M, told_m), WIDTH_M, R_EFF_M)
        assert len(offsets) == tracks
        assert ranges == [told_m]


class TestAdaptiveSpacing:
    @pytest.mark.parametrize("r_eff_m", [40, 1, 0])
    def test_where_nothing_is_admissible_plans_with_three_nadir_gaps_and_says_so(self, r_eff_m: int) -> None:
        planner = AdaptiveSpacing(NADIR_GAP_M, 145)
        assert planner.cover(WIDTH_M, [], r_eff_m) is None
        decision = planner.decide(WIDTH_M, 366, r_eff_m)
        assert decision.range_m == 120
        assert decision.note == f"r_eff {r_eff_m} m is nothing to plan with: planning with 120 m, gaps remain"
        assert counted_range_m(r_eff_m, planner.nadir_gap_m, planner.told_range_m) == 120

    @pytest.mark.parametrize("r_eff_m", [None, 120, 130])
    def test_has_nothing_to_say_otherwise(self, r_eff_m: int | None) -> None:
        assert AdaptiveSpacing(NADIR_GAP_M, 145).decide(WIDTH_M, 366, r_eff_m).note == ""

    def test_r_eff_may_be_more_than_what_was_told(self) -> None:
        # One pair of 124 m covers the 332 m that are left; of 120 m it would not.
        planner = AdaptiveSpacing(NADIR_GAP_M, 120)
        assert planner.decide(332, 0, None) == SpacingDecision(120, (120, 200, 212), replans=True)
        assert planner.decide(332, 0, 150) == SpacingDecision(124, (124, 208), replans=True)

    def test_adapts_to_what_is_left_of_the_width(self) -> None:
        decision = AdaptiveSpacing(NADIR_GAP_M, 145).decide(366 + 332, 366, 150)
        assert decision == SpacingDecision(124, (490, 574), replans=True)

    def test_without_a_nadir_gap_every_range_can_be_planned_with(self) -> None:
        planner = AdaptiveSpacing(0, 50)
        assert planner.decide(90, 0, None) == SpacingDecision(45, (45,), replans=True, singles=True)
        assert planner.decide(90, 0, 10).note == ""
        assert planner.decide(90, 0, 10).range_m == 9  # five tracks see 18 m each

    def test_without_a_nadir_gap_single_tracks_are_a_quarter_fewer_than_pairs(self) -> None:
        planner, widths_m = AdaptiveSpacing(0, 73), range(200, 1000, 10)
        singles = sum(len(planner.decide(width_m, 0, None).offsets_m) for width_m in widths_m)
        assert singles == sum(math.ceil(width_m / (2 * 73)) for width_m in widths_m)
        assert singles < 0.76 * sum(track_count(width_m, 0, 73) for width_m in widths_m)

    def test_a_track_without_a_nadir_gap_that_saw_nothing_tells_no_range(self) -> None:
        planner = AdaptiveSpacing(0, 50)
        decision = planner.decide(90, 0, 0)
        assert (decision.range_m, decision.offsets_m) == (45, (45,))
        assert decision.note == "r_eff 0 m is nothing to plan with: planning with 50 m, gaps remain"
        going_on = planner.cover(200, [FlownTrack(45.0, 45.0, single=True)], 0)
        assert going_on is not None
        assert (going_on.range_m, going_on.offsets_m) == (28, (118, 172))  # 110 m are left
        assert going_on.note == "r_eff 0 m is nothing to plan with: the fewest single tracks for 50 m, gaps remain"

    @given(
        width_m=st.floats(1, 5000),
        nadir_gap_m=st.integers(0, 60),
        told_m=st.integers(1, 300),
        r_eff_m=st.integers(0, 300),
    )
    def test_the_survey_ends_and_reaches_the_far_side(
        self, width_m: float, nadir_gap_m: int, told_m: int, r_eff_m: int
    ) -> None:
        planner = AdaptiveSpacing(nadir_gap_m, max(told_m, lowest_range_m(nadir_gap_m)))
        offsets, ranges = fly(planner, width_m, r_eff_m)
        assert all(lowest_range_m(nadir_gap_m) <= range_m for range_m in ranges)
        assert all(
            range_m <= counted_range_m(r_eff_m, planner.nadir_gap_m, planner.told_range_m) for range_m in ranges[1:]
        )
        assert ranges[0] <= planner.told_range_m
        # No pair covers less than one of the least range.
        least_m = 3 * lowest_range_m(nadir_gap_m) - nadir_gap_m
        assert len(offsets) <= 2 * (math.ceil(width_m / least_m) + 1)
        assert max(offsets) + counted_range_m(r_eff_m, planner.nadir_gap_m, planner.told_range_m) >= width_m - 1e-6


def pairs(*flown: tuple[float, float]) -> list[FlownTrack]:
    return [FlownTrack(across_m, range_m, single=False) for across_m, range_m in flown]


class TestSingleTracks:
    def test_are_not_laid_while_pairs_suffice(self) -> None:
        planner = AdaptiveSpacing(NADIR_GAP_M, 145)
        assert planner.cover(WIDTH_M, pairs((138, 119), (236, 120)), 120) is None
        assert AdaptiveSpacing(0, 50).cover(90, [], 1) is None
        assert isinstance(planner, SinglesPlanner)
        assert not isinstance(FixedSpacing(NADIR_GAP_M, 145), SinglesPlanner)

    def test_cover_all_that_is_left_before_and_behind(self) -> None:
        # Left are 0 to 38, 98 to 136, 238 to 276 and 336 to 836 m. Of r 100 m: two tracks behind see the three gaps
        # (no one sees more than two of them), four beyond cover 380 m of the 500, five 440, six 640.
        decision = AdaptiveSpacing(NADIR_GAP_M, 145).cover(836, pairs((138, 100), (236, 100)), 100)
        assert decision is not None
        assert (decision.singles, decision.replans, len(decision.offsets_m)) == (True, True, 8)
        assert decision.range_m <= 100
        assert decision.note == "r_eff 100 m is below 3 r_min: the fewest single tracks over all that is left"

    def test_go_on_whatever_r_eff_is_once_begun(self) -> None:
        planner = AdaptiveSpacing(NADIR_GAP_M, 145)
        begun = [FlownTrack(100, 100, single=True), FlownTrack(160, 100, single=True)]
        wide = planner.cover(320, begun, 130)
        assert wide is not None
        assert (len(wide.offsets_m), wide.note) == (1, "the fewest single tracks over all that is left")
        blind = planner.cover(320, begun, 0)
        assert blind is not None
        assert (len(blind.offsets_m), blind.note) == (
            1,
            "r_eff 0 m is nothing to plan with: the fewest single tracks for 120 m, gaps remain",
        )

    def test_end_where_nothing_is_left(self) -> None:
        begun = [FlownTrack(float(across_m), 100, single=True) for across_m in (100, 160, 220)]
        decision = AdaptiveSpacing(NADIR_GAP_M, 145).cover(320, begun, 100)
        assert decision is not None
        assert decision.offsets_m == ()

    @given(
        width_m=st.floats(1, 600),
        nadir_gap_m=st.sampled_from([0.5, 10.0, 20.0, 25.3]),
        reaches_m=st.lists(st.integers(0, 90), min_size=1, max_size=6),
    )
    def test_any_survey_ends_with_everything_counted(
        self, width_m: float, nadir_gap_m: float, reaches_m: list[int]
    ) -> None:
        planner = AdaptiveSpacing(nadir_gap_m, 80)
        flown = pairs((80, reaches_m[0]), (140, reaches_m[-1]))
        r_eff_m = math.ceil(nadir_gap_m) + 1
        for _ in range(1 + math.ceil(width_m)):
            decision = planner.cover(width_m, flown, r_eff_m)
            if decision is None:
                assert r_eff_m >= lowest_range_m(nadir_gap_m)
                return
            if not decision.offsets_m:
                return
            for across_m in decision.offsets_m[:2]:
                r_eff_m = reaches_m[len(flown) % len(reaches_m)]
                flown.append(FlownTrack(across_m, max(r_eff_m, decision.range_m), single=True))
        raise AssertionError("the survey does not end")


class TestFixedSpacing:
    @given(
        width_m=st.floats(1, 5000), told_m=st.floats(120, 300), covered_m=st.floats(0, 500), r_eff_m=st.integers(0, 300)
    )
    def test_never_replans_whatever_was_measured(
        self, width_m: float, told_m: float, covered_m: float, r_eff_m: int
    ) -> None:
        planner = FixedSpacing(NADIR_GAP_M, told_m)
        decision = planner.decide(width_m, covered_m, r_eff_m)
        assert decision == planner.decide(width_m, covered_m, None)
        assert not decision.replans
        assert decision.range_m == math.floor(told_m + 1e-6)
        assert len(decision.offsets_m) == track_count(width_m - covered_m, NADIR_GAP_M, decision.range_m)

    def test_counts_a_range_in_whole_metres(self) -> None:
        assert FixedSpacing(NADIR_GAP_M, 145.9).decide(WIDTH_M, 0, None).range_m == 145
        assert FixedSpacing(NADIR_GAP_M, 145 - 1e-9).decide(WIDTH_M, 0, None).range_m == 145


@pytest.mark.parametrize(
    ("nadir_gap_m", "lowest_m"), [(40, 120), (0, 1), (0.2, 1), (0.5, 2), (10.1, 31), (40 + 1e-9, 120)]
)
def test_the_lowest_range_is_three_nadir_gaps_in_whole_metres(nadir_gap_m: float, lowest_m: int) -> None:
    assert lowest_range_m(nadir_gap_m) == lowest_m


@pytest.mark.parametrize("holds", [list, iter, np.array, lambda offsets_m: (one for one in offsets_m)])
def test_offsets_are_taken_out_once_whatever_holds_them(holds: Callable[[tuple[float, ...]], Any]) -> None:
    decision = SpacingDecision(80, (20.0, 60.0), replans=False)
    answer = replace(decision, offsets_m=holds(decision.offsets_m))
    assert checked_decision(FixedSpacing(20.0, 80.0), "lay", answer) == decision


def test_what_a_generator_of_offsets_raises_is_its_own() -> None:
    answer: Any = SimpleNamespace(**vars(SpacingDecision(80, (), replans=False)))
    answer.offsets_m = (one + "m" for one in (20.0, 60.0))  # type: ignore[operator]
    with pytest.raises(TypeError, match="unsupported operand"):
        checked_decision(FixedSpacing(20.0, 80.0), "lay", answer)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"asks_after": 0}, "answers lay with asks_after 0; must be a whole number of tracks, 1 or more"),
        ({"range_m": 0}, "answers lay with range_m 0; must be whole metres, 1 or more"),
        ({"range_m": True}, "answers lay with range_m True; must be whole metres, 1 or more"),
        ({"range_m": np.array([80, 90])}, "answers lay with range_m array([80, 90]); must be whole metres, 1 or more"),
        ({"range_m": None}, "answers lay with range_m None; must be whole metres, 1 or more"),
        ({"offsets_m": (40.0, math.inf)}, "lays a track at inf m by lay; must be a finite number of metres"),
        ({"offsets_m": ("40",)}, "answers lay with offsets_m ('40',); must be a tuple of metres across the tracks"),
    ],
)
def test_a_decision_that_cannot_be_planned_with_is_told_with_who_made_it(
    changed: dict[str, Any], sentence: str
) -> None:
    planner = FixedSpacing(20.0, 80.0)
    decision = SpacingDecision(80, (20.0, 60.0), replans=False)
    assert checked_decision(planner, "lay", decision) == decision
    by_numpy: dict[str, Any] = {"range_m": np.int64(80), "offsets_m": tuple(np.array([20.0, 60.0]))}
    whole = replace(decision, **by_numpy)
    assert checked_decision(planner, "lay", whole) == decision
    assert type(checked_decision(planner, "lay", whole).range_m) is int
    told = re.escape(f"the spacing planner planner.spacing_planners:FixedSpacing {sentence}")
    with pytest.raises(ValueError, match=f"^{told}$"):
        checked_decision(planner, "lay", replace(decision, **changed))
