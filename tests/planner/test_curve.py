"""Detection curves from looks, and the effective range read off them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.curve import RangeTally, effective_range_m, mean_curve
from planner.types import DetectionCurve


def curve_of(*points: tuple[float, float]) -> DetectionCurve:
    ranges_m, p_detect = zip(*points, strict=True)
    return DetectionCurve(np.array(ranges_m, dtype=float), np.array(p_detect, dtype=float))


class TestRangeTally:
    def test_takes_the_mean_over_sides_and_along_track(self) -> None:
        tally = RangeTally(5)
        tally.add(np.array([[[0.0, 0.2], [0.0, 0.4]], [[0.1, 0.6], [0.1, 0.8]]]))
        curve = tally.curve()
        assert curve.range_m.tolist() == [0, 5]
        assert curve.p_detect == pytest.approx([0.05, 0.5])

    def test_weighs_looks_by_their_along_track_bins(self) -> None:
        tally = RangeTally(1)
        tally.add(np.full((2, 3, 2), 0.1))
        tally.add(np.full((2, 1, 2), 0.5))
        assert tally.curve().p_detect == pytest.approx([0.2, 0.2])

    def test_a_shorter_look_saw_nothing_beyond_its_end(self) -> None:
        tally = RangeTally(1)
        tally.add(np.full((2, 1, 2), 0.4))
        tally.add(np.full((2, 1, 3), 0.4))
        tally.add(np.full((2, 2, 2), 0.4))
        assert tally.curve().p_detect == pytest.approx([0.4, 0.4, 0.1])

    @given(st.lists(arrays(np.float64, (2, 2, 4), elements=st.floats(0, 0.999)), min_size=1, max_size=5))
    def test_does_not_depend_on_the_order_of_looks(self, looks: list[np.ndarray]) -> None:
        forward, backward = RangeTally(1), RangeTally(1)
        for look in looks:
            forward.add(look)
        for look in reversed(looks):
            backward.add(look)
        assert forward.curve().p_detect == pytest.approx(backward.curve().p_detect)
        assert forward.curve().p_detect == pytest.approx(np.concatenate(looks, axis=1).mean(axis=(0, 1)))

    def test_a_curve_is_not_changed_by_later_looks(self) -> None:
        tally = RangeTally(1)
        tally.add(np.full((2, 1, 2), 0.4))
        curve = tally.curve()
        tally.add(np.zeros((2, 1, 2)))
        assert curve.p_detect == pytest.approx([0.4, 0.4])

    @pytest.mark.parametrize("shape", [(2, 4), (2, 0, 4), (2, 4, 1)])
    def test_refuses_other_shapes(self, shape: tuple[int, ...]) -> None:
        with pytest.raises(ValueError, match="shape"):
            RangeTally(1).add(np.zeros(shape))

    @pytest.mark.parametrize("p_detect", [1.0, -0.1, math.nan])
    def test_refuses_what_is_no_probability(self, p_detect: float) -> None:
        look = np.zeros((2, 1, 3))
        look[1, 0, 2] = p_detect
        with pytest.raises(ValueError, match=r"\[0, 1\)"):
            RangeTally(1).add(look)

    def test_refuses_a_curve_without_a_look(self) -> None:
        with pytest.raises(ValueError, match="without a look"):
            RangeTally(1).curve()

    @pytest.mark.parametrize("range_bin_m", [0, -1, math.nan, math.inf])
    def test_refuses_a_range_bin_without_width(self, range_bin_m: float) -> None:
        with pytest.raises(ValueError, match="range bin"):
            RangeTally(range_bin_m)


def test_the_mean_of_curves_is_told_at_the_points_of_the_one_that_has_most() -> None:
    # At 15 and 25 m the first one is halfway between its points, at 40 m beyond its end.
    mean = mean_curve([curve_of((10, 0.2), (20, 0.4), (30, 0.6)), curve_of((10, 0.0), (15, 0.1), (25, 0.5), (40, 0.8))])
    assert mean.range_m.tolist() == [10, 15, 25, 40]
    assert mean.p_detect == pytest.approx([0.1, 0.2, 0.5, 0.4])


class TestEffectiveRange:
    def test_is_where_the_curve_falls_to_the_threshold(self) -> None:
        # Falls from 0.1 at 120 m to 0 at 140 m: 0.05 at 130 m.
        assert effective_range_m(curve_of((25, 0), (70, 0.5), (120, 0.1), (140, 0)), 0.05) == 130

    def test_is_rounded_down_to_a_whole_metre(self) -> None:
        assert effective_range_m(curve_of((70, 0.5), (120, 0.1), (139, 0)), 0.05) == 129

    def test_a_point_at_the_threshold_counts_as_admissible(self) -> None:
        assert effective_range_m(curve_of((70, 0.5), (130, 0.05), (131, 0.0499)), 0.05) == 130

    def test_the_last_bits_of_a_mean_do_not_count(self) -> None:
        assert effective_range_m(curve_of((70, 0.5), (100, np.nextafter(0.05, 0)), (130, 0.05), (131, 0)), 0.05) == 130
        for short_by in (5e-10, 1e-9):
            assert effective_range_m(curve_of((70, 0.5), (100, 0.05 - short_by), (130, 0.05 - 2e-9)), 0.05) == 100

    def test_nor_do_those_of_the_place_where_the_threshold_is_crossed(self) -> None:
        assert effective_range_m(curve_of((2, 0.06), (12, 0.04)), 0.05) == 7

    def test_goes_outward_from_the_peak_only(self) -> None:
        # Below the threshold inside the peak, and above it once more beyond a first fall.
        assert effective_range_m(curve_of((0, 0), (70, 0.4), (90, 0.0), (110, 0.3), (130, 0)), 0.1) == 85

    def test_ends_with_the_curve(self) -> None:
        assert effective_range_m(curve_of((0, 0.2), (70, 0.4), (130.9, 0.2)), 0.05) == 130

    def test_is_none_below_the_threshold(self) -> None:
        assert effective_range_m(curve_of((0, 0), (70, 0.04), (140, 0)), 0.05) is None

    @given(
        arrays(np.float64, 40, elements=st.floats(0, 0.99)),
        st.floats(0.01, 0.9),
        st.sampled_from([1.0, 2.5, 5.0]),
    )
    def test_the_curve_stays_admissible_up_to_it_and_no_metre_farther(
        self, p_detect: np.ndarray, threshold: float, range_bin_m: float
    ) -> None:
        curve = DetectionCurve(np.arange(40, dtype=float) * range_bin_m, p_detect)
        r_eff_m = effective_range_m(curve, threshold)
        if r_eff_m is None:
            assert p_detect.max() < threshold
            return

        def lowest_between_peak_and(range_m: float) -> float:
            peak_m = curve.range_m[np.argmax(p_detect)]
            # Linear in between: the minimum lies at a point of the curve or at the end.
            points_m = curve.range_m[(curve.range_m >= peak_m) & (curve.range_m <= range_m)]
            return float(curve.at(np.append(points_m, max(range_m, peak_m))).min())

        assert lowest_between_peak_and(r_eff_m) >= threshold - 1e-8
        if r_eff_m + 1 <= curve.range_m[-1]:
            assert lowest_between_peak_and(r_eff_m + 1) < threshold

    @pytest.mark.parametrize("threshold", [0, 1, -0.1, math.nan])
    def test_refuses_a_threshold_that_is_none(self, threshold: float) -> None:
        with pytest.raises(ValueError, match="threshold"):
            effective_range_m(curve_of((0, 0.1), (1, 0.2)), threshold)
