"""The fewest single tracks: by hand, and against integer programming."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import cover
from planner.cover import Cover, Span, fewest_tracks, spans_left
from planner.spacing import adapt_range, track_count

spans = st.lists(st.tuples(st.integers(0, 150), st.integers(1, 60)), min_size=1, max_size=4).map(
    lambda pairs: [(float(near), float(near + length)) for near, length in pairs]
)
slivers = st.lists(st.tuples(st.integers(0, 25), st.integers(1, 30)), min_size=2, max_size=9)
gaps_and_ranges = st.integers(0, 15).flatmap(lambda gap: st.tuples(st.just(gap), st.integers(gap + 1, 3 * gap + 10)))


def seen(offset_m: float, gap_m: float, range_m: float, at_m: np.ndarray) -> np.ndarray:
    """The sensor's model: from the nadir gap to the range, either side."""
    lateral_m = np.abs(at_m - offset_m)
    return (lateral_m > gap_m) & (lateral_m < range_m)


def fewest_by_integer_programming(left: list[Span], gap_m: int, range_m: int) -> int:
    """An independent answer: a set cover with a variable for every offset within a range of what is left."""
    import scipy.optimize  # it takes half a second to import
    import scipy.sparse

    cells_m = np.unique(np.concatenate([np.arange(near_m, far_m) for near_m, far_m in left])) + 0.5
    offsets_m = np.arange(np.floor(cells_m.min()) - range_m, np.ceil(cells_m.max()) + range_m + 1)
    lateral_m = np.abs(cells_m[:, np.newaxis] - offsets_m)
    covers = scipy.sparse.csr_matrix((lateral_m > gap_m) & (lateral_m < range_m), dtype=float)
    found = scipy.optimize.milp(
        np.ones(offsets_m.size),
        constraints=scipy.optimize.LinearConstraint(covers, lb=1),
        integrality=np.ones(offsets_m.size),
        bounds=scipy.optimize.Bounds(0, 1),
    )
    assert found.success
    return round(float(found.fun))


def assert_the_fewest(left: list[Span], gap_m: int, range_m: int) -> None:
    """Proven, and as many as an independent solver finds."""
    found = fewest_tracks(left, gap_m, range_m)
    assert found.fewest
    assert len(found.offsets_m) == fewest_by_integer_programming(left, gap_m, range_m)


def after_a_survey(rng: random.Random, width_m: int, gap_m: int, range_m: int) -> list[Span]:
    """What is left of an area after up to three pairs laid for more than the sonar then saw."""
    told_m = 3 * gap_m + rng.randint(0, gap_m)
    looked = [
        (told_m + pair * (3 * told_m - gap_m) + within, max(0.0, min(told_m + 5.0, range_m + rng.randint(-15, 15))))
        for pair in range(rng.randint(0, 3))
        for within in (0.0, float(told_m - gap_m))
    ]
    return spans_left(width_m, gap_m, looked)


class TestByHand:
    @pytest.mark.parametrize(
        ("width_m", "tracks"),
        # A side sees 60 m, and its like 140 m beyond: three tracks close each other's gaps and cover 180 + 140 m.
        [(1, 1), (60, 1), (61, 2), (120, 2), (121, 3), (320, 3), (321, 4), (380, 4), (381, 5), (640, 6), (1212, 12)],
    )
    def test_a_width_from_its_edge(self, width_m: float, tracks: int) -> None:
        found = fewest_tracks([(0, width_m)], 40, 100)
        assert len(found.offsets_m) == tracks
        assert found.fewest

    def test_three_tracks_side_by_side_close_each_others_gaps(self) -> None:
        assert fewest_tracks([(0, 320)], 40, 100).offsets_m == (100, 160, 220)
        assert fewest_tracks([(500, 820)], 40, 100).offsets_m == (600, 660, 720)

    def test_an_only_group_wider_than_what_is_left_is_centred_on_it_and_the_last_of_several_pulled_in(self) -> None:
        # 317 m: to 99 m three tracks cover 316 m, to 100 m 320 m, 2 m of these before and 1 m behind.
        assert fewest_tracks([(500, 817)], 40, 100).offsets_m == (598, 658, 718)
        # 637 m: twice three; the second three end where it ends.
        assert fewest_tracks([(500, 1137)], 40, 100).offsets_m == (600, 660, 720, 917, 977, 1037)

    def test_two_gaps_behind_take_one_track_where_one_sees_both(self) -> None:
        # 140 m apart, as the two sides of one track are.
        found = fewest_tracks([(0, 30), (140, 170)], 40, 100)
        assert (len(found.offsets_m), found.range_m) == (1, 85)  # from 70 m: 40 to 70 m one way, 70 to 100 m the other
        assert len(fewest_tracks([(0, 30), (250, 280)], 40, 100).offsets_m) == 2

    def test_of_covers_of_as_few_tracks_it_is_that_which_sees_the_nearest_first_and_then_leaves_least(self) -> None:
        # A side sees 1 m, the other 5 m beyond. From 4 m 1 to 2 and 6 to 7 m are seen; for 0 to 1 m -2 m would do, too.
        assert fewest_tracks([(0, 2), (6, 7)], 2, 3).offsets_m == (3, 4)
        # With 11 m a side sees 9 m, the other 13 m beyond. For what begins at 24 m 29 m would do, too, but leaves 8 m
        # from 40 m on; 35 m leaves 1 m at 33 m and 2 at 46 m.
        left: list[Span] = [(0, 4), (5, 9), (24, 27), (31, 34), (37, 48)]
        assert fewest_tracks(left, 2, 13).offsets_m == (11, 35, 44)

    def test_what_a_side_sees_at_once_is_rather_left_than_less_in_two_places(self) -> None:
        # With 7 m a side sees 4 m, the other 10 m beyond. From 7 m 0 to 4 and 10 to 14 m are seen, and 4 m are left;
        # from 4 m 0 to 1 and 7 to 11 m, and 1 m is left at 6, 1 m at 13 m.
        assert fewest_tracks([(0, 1), (6, 11), (13, 14)], 3, 9) == Cover((3, 7), 7, fewest=True)

    def test_a_track_that_leaves_a_run_is_taken_only_if_there_are_tracks_for_that(self) -> None:
        # From 5 m 6 to 11 m are seen with a range of 6 m.
        assert fewest_tracks([(6, 8), (9, 11)], 1, 9) == Cover((5,), 6, fewest=True)
        assert len(fewest_tracks([(2, 5), (7, 16)], 1, 9).offsets_m) == 2

    def test_two_tracks_are_found_that_see_something_with_the_first_cell_of_a_side_or_the_last(self) -> None:
        # From 3 m 6 to 10 m are seen, from 7 m 0 to 4 m and 10 to 14 m.
        assert len(fewest_tracks([(1, 2), (6, 9), (10, 13)], 3, 7).offsets_m) == 2
        # From 3 m 8 to 15 m are seen, from 10 m -2 to 5 m and 15 to 22 m.
        assert len(fewest_tracks([(1, 4), (8, 9), (11, 14), (15, 16)], 5, 12).offsets_m) == 2

    def test_three_tracks_are_found_where_what_lies_last_needs_two(self) -> None:
        # A side sees 2 m, the other 4 m beyond: 1 to 3 and 5 to 7 m, 3 to 5 and 7 to 9 m, 5 to 7 and 9 to 11 m.
        assert fewest_tracks([(1, 3), (4, 11)], 1, 3) == Cover((4, 6, 8), 3, fewest=True)

    def test_where_nothing_is_left_no_track_is_needed(self) -> None:
        assert fewest_tracks([], 40, 100).offsets_m == ()
        assert fewest_tracks([(5, 5), (320, 400)], 40, 100) == fewest_tracks([(320, 400)], 40, 100)

    def test_lengths_between_whole_metres(self) -> None:
        # Counted inward: a nadir gap of 40.2 m as 41 m, a range of 99.9 m as 99 m, 3.5 to 59.2 m as 3 to 60 m.
        found = fewest_tracks([(3.5, 59.2)], 40.2, 99.9)
        assert (len(found.offsets_m), found.range_m) == (1, 98)
        assert seen(found.offsets_m[0], 40.2, 99.9, np.arange(3.5, 59.2, 0.05)).all()

    def test_rounding_makes_no_length_a_metre_longer_or_shorter(self) -> None:
        for by_m in (-1e-7, 1e-7):
            found = fewest_tracks([(3 + by_m, 60 - by_m), (200 - by_m, 290 + by_m)], 40 + by_m, 100 - by_m)
            assert found == fewest_tracks([(3, 60), (200, 290)], 40, 100)
        assert spans_left(100, 10, [(50, 30), (70 + 1e-7, 30)]) == [(0, 20)]

    def test_a_search_that_takes_too_long_gives_a_cover_that_may_not_be_the_fewest(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        left = after_a_survey(random.Random(31), 1212, 40, 66)
        best = fewest_tracks(left, 40, 66)
        monkeypatch.setattr(cover, "MOST_STEPS", 0)
        monkeypatch.setattr(cover, "STEPS_FOR_ANY", 50)
        found = fewest_tracks(left, 40, 66)
        assert (best.fewest, found.fewest) == (True, False)
        assert len(found.offsets_m) > len(best.offsets_m)

    def test_a_search_with_less_time_than_a_cover_has_tracks_ends_all_the_same(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        left = after_a_survey(random.Random(31), 1212, 40, 66)
        monkeypatch.setattr(cover, "MOST_STEPS", 0)
        monkeypatch.setattr(cover, "STEPS_FOR_ANY", 5)
        found = fewest_tracks(left, 40, 66)
        assert not found.fewest
        assert len(found.offsets_m) > 5

    def test_once_the_fewest_are_found_a_smaller_range_is_looked_for_as_long(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        left: list[Span] = [(0, 4), (5, 9), (24, 27), (31, 34), (37, 48)]
        found = fewest_tracks(left, 2, 40)
        monkeypatch.setattr(cover, "STEPS_FOR_ANY", 0)
        assert fewest_tracks(left, 2, 40) == found
        assert found.range_m < 40


class TestSearch:
    def test_what_surveys_leave_takes_few_steps_to_prove_and_is_always_covered_alike(self) -> None:
        steps, offsets, ranges = [], [], []
        for seed in range(200):
            rng = random.Random(seed)
            range_m = rng.randint(11, 29)
            left = after_a_survey(rng, 303, 10, range_m)
            cells = sum(cover._run(int(near_m), int(far_m)) for near_m, far_m in left)
            search = cover._Search(cells, 10, range_m)
            found, proven = search.fewest()
            assert proven
            steps.append(search._steps)
            offsets += found
            if seed < 60:
                ranges.append(fewest_tracks(left, 10, range_m).range_m)
        # As it is: what is a lower bound of what a part needs leaves more to be tried.
        assert (sum(steps), len(offsets), sum(offsets), sum(ranges)) == (3590, 5370, 859_787, 1169)


class TestWhatIsLeft:
    def test_of_two_tracks_with_ranges_of_their_own(self) -> None:
        # 138 m sees 38 to 98 and 178 to 238 m; 236 m, to 110 m, sees 126 to 196 and 276 to 346 m.
        assert spans_left(1212, 40, [(236, 110), (138, 100)]) == [(0, 38), (98, 126), (238, 276), (346, 1212)]

    def test_nothing_of_what_is_covered_and_all_of_what_is_not(self) -> None:
        assert spans_left(100, 0, [(50, 50)]) == []
        assert spans_left(100, 40, []) == [(0, 100)]
        assert spans_left(100, 40, [(50, 40), (50, 0)]) == [(0, 100)]

    @given(
        st.floats(1, 300), st.integers(0, 50), st.lists(st.tuples(st.floats(-50, 350), st.integers(0, 150)), max_size=5)
    )
    def test_is_what_the_sensor_model_leaves(
        self, width_m: float, gap_m: int, looked: list[tuple[float, float]]
    ) -> None:
        left = spans_left(width_m, gap_m, looked)
        at_m = np.linspace(0.01, width_m - 0.01, 501)
        covered = np.zeros(at_m.size, dtype=bool)
        for across_m, range_m in looked:
            covered |= seen(across_m, gap_m - 1e-5, range_m + 1e-5, at_m)
        told = np.array([any(near_m - 1e-5 <= one <= far_m + 1e-5 for near_m, far_m in left) for one in at_m])
        assert (covered | told).all()
        inside = np.array([any(near_m + 1e-4 < one < far_m - 1e-4 for near_m, far_m in left) for one in at_m])
        strictly = np.zeros(at_m.size, dtype=bool)
        for across_m, range_m in looked:
            strictly |= seen(across_m, gap_m + 1e-4, range_m - 1e-4, at_m)
        assert not (inside & strictly).any()


class TestEveryCover:
    @given(spans, gaps_and_ranges)
    def test_leaves_nothing_and_stays_within_a_nadir_gap(self, left: list[Span], sensor: tuple[int, int]) -> None:
        gap_m, range_m = sensor
        found = fewest_tracks(left, gap_m, range_m)
        assert found.range_m <= range_m
        at_m = np.concatenate([np.arange(near_m + 0.05, far_m, 0.1) for near_m, far_m in left])
        covered = np.zeros(at_m.size, dtype=bool)
        for offset_m in found.offsets_m:
            covered |= seen(offset_m, gap_m, found.range_m, at_m)
        assert covered.all()
        assert list(found.offsets_m) == sorted(found.offsets_m)
        assert min(found.offsets_m) >= min(near_m for near_m, _ in left) - gap_m
        assert max(found.offsets_m) <= max(far_m for _, far_m in left) + gap_m

    @given(spans, gaps_and_ranges)
    def test_is_laid_for_the_smallest_range(self, left: list[Span], sensor: tuple[int, int]) -> None:
        gap_m, range_m = sensor
        found = fewest_tracks(left, gap_m, range_m)
        assert len(fewest_tracks(left, gap_m, found.range_m).offsets_m) == len(found.offsets_m)
        if found.range_m > gap_m + 1:
            assert len(fewest_tracks(left, gap_m, found.range_m - 1).offsets_m) > len(found.offsets_m)

    @given(st.integers(1, 2000), st.integers(1, 60), st.integers(0, 60))
    def test_of_a_whole_width_from_three_nadir_gaps_on_takes_as_many_as_algorithm_1(
        self, width_m: int, gap_m: int, more_m: int
    ) -> None:
        highest_m = 3 * gap_m + more_m
        choice = adapt_range(width_m, gap_m, 3 * gap_m, highest_m)
        found = fewest_tracks([(0, width_m)], gap_m, highest_m)
        assert len(found.offsets_m) == choice.tracks == track_count(width_m, gap_m, highest_m)


SLOW_FOR_THE_OTHER = {0, 5, 12, 13, 24, 27, 30, 33, 34, 35, 36, 45}


class TestOptimality:
    """Against integer programming by scipy (HiGHS), which knows nothing of how it is done here."""

    @given(spans, gaps_and_ranges)
    def test_of_small_covers(self, left: list[Span], sensor: tuple[int, int]) -> None:
        assert_the_fewest(left, *sensor)

    @given(slivers, gaps_and_ranges)
    def test_of_covers_of_many_pieces(self, pieces: list[tuple[int, int]], sensor: tuple[int, int]) -> None:
        ends_m = np.cumsum(np.array(pieces).ravel()).reshape(-1, 2)
        left = [(float(near_m), float(far_m)) for near_m, far_m in ends_m]
        assert_the_fewest(left, *sensor)

    @pytest.mark.parametrize("seed", sorted({*range(50)} - SLOW_FOR_THE_OTHER))
    def test_of_covers_of_a_quarter_of_that(self, seed: int) -> None:
        rng = random.Random(seed)
        range_m = rng.randint(11, 29)
        left = after_a_survey(rng, 303, 10, range_m)
        assert_the_fewest(left, 10, range_m)

    @pytest.mark.parametrize("seed", [7, 8, 10, 11, 13])  # of which the other solver is not slow
    def test_of_covers_of_the_papers_size(self, seed: int) -> None:
        rng = random.Random(seed)
        range_m = rng.randint(75, 119)
        left = after_a_survey(rng, 1212, 40, range_m)
        assert_the_fewest(left, 40, range_m)

    @pytest.mark.parametrize(
        ("gap_m", "range_m"), [(40, 119), (40, 100), (40, 80), (40, 65), (40, 50), (7, 12), (0, 9)]
    )
    def test_of_a_whole_width(self, gap_m: int, range_m: int) -> None:
        for width_m in (range_m, 3 * range_m, 350):
            left = [(0.0, float(width_m))]
            found = fewest_tracks(left, gap_m, range_m)
            assert len(found.offsets_m) == fewest_by_integer_programming(left, gap_m, range_m)

    @pytest.mark.parametrize("seed", range(20))
    def test_of_covers_that_take_long_is_proven(self, seed: int) -> None:
        # Beyond what the other solver can do in time. From 46 to 50 m on a side is a tenth as wide as the gap.
        rng = random.Random(seed)
        range_m = rng.randint(46, 50)
        assert fewest_tracks(after_a_survey(rng, 1212, 40, range_m), 40, range_m).fewest


class TestRefusals:
    @pytest.mark.parametrize(
        ("left", "gap_m", "range_m", "message"),
        [
            ([(0, 10)], 40, 40, "covers nothing beyond a nadir gap of 40 m"),
            ([(0, 10)], 40.2, 41.9, "covers nothing beyond"),
            ([(0, 10)], -1, 40, "finite and 0 or more"),
            ([(0, 10)], 40, float("inf"), "finite and 0 or more"),
            ([(0, 10)], float("nan"), 100, "finite and 0 or more"),
            ([(-5, 10)], 40, 100, "must lie at 0 or more"),
            ([(20, 30), (-0.5, 10)], 40, 100, "must lie at 0 or more, not from -0.5 to 10 m"),
            ([(0, float("inf"))], 40, 100, "must lie at 0 or more"),
        ],
    )
    def test_of_what_cannot_be_covered(self, left: list[Span], gap_m: float, range_m: float, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            fewest_tracks(left, gap_m, range_m)
