"""Track spacing: every figure of the paper's experiments, and what holds for every width."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.spacing import NARROWEST_M, TOLERANCE_M, RangeChoice, adapt_range, track_count, track_offsets

WIDTH_M = 1212
NADIR_GAP_M = 40


def widest_gap_m(offsets: list[float], nadir_gap_m: float, range_m: float, from_m: float, to_m: float) -> float:
    """The widest stretch of [from, to] that no side of any track sees."""
    tracks = np.asarray(offsets)
    starts = np.concatenate([tracks - range_m, tracks + nadir_gap_m])
    ends = np.concatenate([tracks - nadir_gap_m, tracks + range_m])
    order = np.argsort(starts)
    starts, ends = np.append(starts[order], to_m), ends[order]
    seen_to = np.maximum.accumulate(np.concatenate([[from_m], ends]))
    return float(np.max(np.minimum(starts, to_m) - seen_to))


class TestThePapersFigures:
    """Section V: an area 1212 m wide, a nadir gap of 40 m."""

    def test_experiment_1_needs_seven_tracks_as_told_and_eight_when_adapted(self) -> None:
        assert track_count(WIDTH_M, NADIR_GAP_M, 145) == 7
        first = adapt_range(WIDTH_M, NADIR_GAP_M, 120, 145)
        assert first == RangeChoice(138, 7)
        second_track_m = track_offsets(WIDTH_M, NADIR_GAP_M, first.range_m)[1]
        assert second_track_m == 236
        covered_m = second_track_m + min(first.range_m, 130)
        then = adapt_range(WIDTH_M - covered_m, NADIR_GAP_M, 120, 130)
        assert then == RangeChoice(120, 6)
        assert 2 + then.tracks == 8

    @pytest.mark.parametrize("told_m", [120, 130])
    def test_experiments_2_and_3_need_eight_tracks_either_way(self, told_m: int) -> None:
        assert track_count(WIDTH_M, NADIR_GAP_M, told_m) == 8
        first = adapt_range(WIDTH_M, NADIR_GAP_M, 120, told_m)
        assert first == RangeChoice(120, 8)
        second_track_m = track_offsets(WIDTH_M, NADIR_GAP_M, first.range_m)[1]
        then = adapt_range(WIDTH_M - (second_track_m + min(first.range_m, 130)), NADIR_GAP_M, 120, 130)
        assert then == RangeChoice(120, 6)

    def test_the_choice_is_repeated_after_every_pair(self) -> None:
        covered_m, tracks = 0.0, 0
        for _ in range(4):
            choice = adapt_range(WIDTH_M - covered_m, NADIR_GAP_M, 120, 130)
            assert choice.range_m == 120
            pair = track_offsets(WIDTH_M, NADIR_GAP_M, choice.range_m, covered_m=covered_m)[:2]
            tracks += len(pair)
            covered_m = pair[-1] + choice.range_m
        assert (covered_m, tracks) == (WIDTH_M, 8)

    def test_offsets_of_the_control_missions(self) -> None:
        assert track_offsets(WIDTH_M, NADIR_GAP_M, 145) == [145, 250, 540, 645, 935, 1040, 1067]
        assert track_offsets(WIDTH_M, NADIR_GAP_M, 120) == [120, 200, 440, 520, 760, 840, 1012, 1092]


class TestTrackCount:
    @pytest.mark.parametrize(
        ("width_m", "tracks"),
        [
            (-5, 0),
            (0, 0),
            (1e-6, 0),
            (NARROWEST_M, 0),
            (0.1, 1),
            (80, 1),  # r - r_min
            (80 + 5e-7, 1),
            (80 + NARROWEST_M, 1),
            (80.01, 2),
            (320, 2),  # 3 r - r_min
            (320 + 5e-7, 2),
            (320 - 5e-7, 2),
            (320.01, 3),
            (400, 3),
            (400.01, 4),
            (640, 4),
        ],
    )
    def test_by_hand_for_a_range_of_120(self, width_m: float, tracks: int) -> None:
        assert track_count(width_m, 40, 120) == tracks
        assert len(track_offsets(max(width_m, 0), 40, 120)) == tracks

    def test_a_range_may_be_a_micrometre_short_of_three_nadir_gaps(self) -> None:
        assert track_count(100, 40, 120 - TOLERANCE_M) == 2
        with pytest.raises(ValueError, match=r"at least three nadir gaps \(120 m\)"):
            track_count(100, 40, 120 - 2 * TOLERANCE_M)

    def test_a_range_may_be_less_than_two_metres(self) -> None:
        assert track_count(6.5, 0, 1) == 5  # two pairs of 3 m, and half a metre

    @pytest.mark.parametrize(
        ("width_m", "nadir_gap_m", "range_m"),
        [(100, 40, 119), (100, -1, 120), (100, 0, 0), (math.nan, 40, 120), (math.inf, 40, 120), (100, 40, math.nan)],
    )
    def test_refuses_what_makes_no_sense(self, width_m: float, nadir_gap_m: float, range_m: float) -> None:
        with pytest.raises(ValueError, match="must be"):
            track_count(width_m, nadir_gap_m, range_m)


class TestAdaptRange:
    @given(
        width_m=st.floats(0, 20_000),
        nadir_gap_m=st.integers(0, 50),
        lowest_m=st.integers(1, 60),
        margin_m=st.integers(0, 60),
    )
    def test_is_the_smallest_of_the_best(self, width_m: float, nadir_gap_m: int, lowest_m: int, margin_m: int) -> None:
        lowest_m = max(lowest_m, 3 * nadir_gap_m)
        choice = adapt_range(width_m, nadir_gap_m, lowest_m, lowest_m + margin_m)
        counts = {r: track_count(width_m, nadir_gap_m, r) for r in range(lowest_m, lowest_m + margin_m + 1)}
        assert counts[choice.range_m] == choice.tracks == min(counts.values())
        assert all(count > choice.tracks for r, count in counts.items() if r < choice.range_m)

    def test_searches_whole_metres_only(self) -> None:
        assert adapt_range(1212, 40, 120.5, 138.9) == RangeChoice(138, 7)

    def test_refuses_an_interval_without_a_whole_metre(self) -> None:
        with pytest.raises(ValueError, match=r"no whole metre lies between .* 120.2 and 120.9 m"):
            adapt_range(1212, 40, 120.2, 120.9)
        with pytest.raises(ValueError, match="no whole metre"):
            adapt_range(1212, 40, 120, 95)

    def test_the_lower_limit_may_be_a_micrometre_short_of_three_nadir_gaps(self) -> None:
        assert adapt_range(1212, 40, 120 - TOLERANCE_M, 145) == RangeChoice(138, 7)
        with pytest.raises(ValueError, match="only from 120 m on"):
            adapt_range(1212, 40, 120 - 2 * TOLERANCE_M, 145)

    def test_refuses_a_range_below_three_nadir_gaps(self) -> None:
        with pytest.raises(ValueError, match="only from 120 m on"):
            adapt_range(1212, 40, 119, 130)

    @pytest.mark.parametrize("limits", [(math.nan, 130), (120, math.inf)])
    def test_refuses_limits_that_are_not_finite(self, limits: tuple[float, float]) -> None:
        with pytest.raises(ValueError, match="finite"):
            adapt_range(1212, 40, *limits)


class TestTrackOffsets:
    def test_a_last_pair_is_pulled_in(self) -> None:
        # One pair covers 320 m; of 450 m, 130 m are left, more than one side's 80 m.
        assert track_offsets(450, 40, 120) == [120, 200, 250, 330]

    def test_an_only_pair_is_centred(self) -> None:
        assert track_offsets(200, 40, 120) == [60, 140]
        assert track_offsets(200, 40, 120, covered_m=TOLERANCE_M) == [60, 140]
        assert track_offsets(200, 40, 120, covered_m=2 * TOLERANCE_M) == [0, 80]

    def test_a_last_pair_beyond_a_covered_edge_is_pulled_in_even_if_no_other_is_left(self) -> None:
        assert track_offsets(520, 40, 120, covered_m=320) == [320, 400]

    def test_a_single_track_may_lie_outside_a_narrow_area(self) -> None:
        assert track_offsets(60, 40, 120) == [-60]

    def test_leaves_no_gap_in_20000_random_areas(self) -> None:
        rng = np.random.default_rng(1)
        for _ in range(20_000):
            nadir_gap_m = float(rng.choice([0.0, rng.uniform(0, 60)]))
            range_m = float(rng.uniform(max(3 * nadir_gap_m, 5.0), 3 * nadir_gap_m + 100))
            width_m = float(rng.uniform(1e-3, 20 * range_m))
            covered_m = float(rng.choice([0.0, rng.uniform(0, width_m)]))
            offsets = track_offsets(width_m, nadir_gap_m, range_m, covered_m=covered_m)
            assert len(offsets) == track_count(width_m - covered_m, nadir_gap_m, range_m)
            assert widest_gap_m(offsets, nadir_gap_m, range_m, covered_m, width_m) <= 1e-3 + 1e-6

    @given(pairs=st.integers(0, 8), beyond_m=st.sampled_from([-2e-3, 0.0, 2e-3]), side=st.integers(0, 1))
    def test_leaves_no_gap_where_the_count_changes(self, pairs: int, beyond_m: float, side: int) -> None:
        width_m = pairs * 320 + side * 80 + beyond_m
        offsets = track_offsets(width_m, 40, 120)
        assert len(offsets) == track_count(width_m, 40, 120)
        assert widest_gap_m(offsets, 40, 120, 0, width_m) <= 1e-6

    def test_offsets_ascend_and_keep_the_spacing_within_pairs(self) -> None:
        offsets = track_offsets(3000, 40, 133)
        assert offsets == sorted(offsets)
        assert {b - a for a, b in zip(offsets[0::2], offsets[1::2], strict=False)} == {93}

    @pytest.mark.parametrize("covered_m", [-1.0, math.nan])
    def test_refuses_a_covered_edge_outside_the_area(self, covered_m: float) -> None:
        with pytest.raises(ValueError, match="covered so far"):
            track_offsets(1212, 40, 120, covered_m=covered_m)
