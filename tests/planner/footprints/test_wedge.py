"""The forward-looking sonar's footprint: what a pass covers, how its looks add up, what a look stands for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.footprints import footprint_of
from planner.footprints.wedge import ForwardLooking
from planner.types import DetectionCurve, LookGeometry, SonarShape

QUARTER = math.pi / 4


def sonar(near_m: float, far_m: float, half_angle_rad: float, look_m: float) -> ForwardLooking:
    return ForwardLooking(SonarShape("wedge", near_m, far_m, half_angle_rad, look_m))


def flat(p_detect: float, near_m: float, far_m: float) -> DetectionCurve:
    return DetectionCurve(np.array([near_m, far_m]), np.array([p_detect, p_detect]))


@st.composite
def sonars(draw: st.DrawFn) -> ForwardLooking:
    """Of all that a scenario may hold, with bins of 5 m in a look."""
    near_m, look_m = draw(st.floats(0, 10)), 5.0 * draw(st.integers(1, 4))
    far_m = near_m + look_m + draw(st.floats(0.1, 60))
    return sonar(near_m, far_m, math.radians(draw(st.floats(5, 90))), look_m)


class TestASwath:
    def test_its_corners_lie_on_the_edges_and_the_far_arc(self) -> None:
        # From (30, 30) on the edge at 45 degrees 10 m on to (30, 40), which is 50 m away.
        found = sonar(3, 50, QUARTER, 10)
        assert (found.reach.near_m, found.reach.far_m) == pytest.approx((0, 30))
        assert (found.lead_m, found.ahead_m) == pytest.approx((30, 50))
        assert found.widest_m == pytest.approx(50 / math.sqrt(2))
        assert (found.reach.strip_width_m, found.reach.beside_m) == pytest.approx((60, 0))

    def test_or_as_far_ahead_as_the_near_arc(self) -> None:
        # With a quarter turn to each side, from (30, 20) 20 m on to (30, 40).
        found = sonar(20, 50, math.pi / 2, 20)
        assert (found.reach.far_m, found.lead_m) == pytest.approx((30, 20))

    @given(sonars())
    def test_is_a_rectangle_within_the_sector(self, found: ForwardLooking) -> None:
        ahead_m = found.lead_m + np.linspace(0, found.shape.look_m, 21)[1:-1, np.newaxis]
        lateral_m = found.reach.far_m * np.linspace(-1, 1, 21)[1:-1]
        assert found.sees(ahead_m, lateral_m).all()
        assert not found.sees(ahead_m, lateral_m * 1.01 + np.copysign(found.shape.far_m, lateral_m)).any()

    @given(sonars(), st.floats(1, 200))
    def test_can_be_told(self, found: ForwardLooking, range_m: float) -> None:
        told = found.told(range_m)
        assert (told.reach.near_m, told.reach.far_m) == pytest.approx((0, range_m))
        assert told.shape.half_angle_rad == found.shape.half_angle_rad

    def test_what_it_is_told_changes_the_range_alone(self) -> None:
        told = sonar(3, 80, QUARTER, 10).told(30)
        assert told.shape.far_m == pytest.approx(50)
        assert told.shape == replace(sonar(3, 80, QUARTER, 10).shape, far_m=told.shape.far_m)


def test_it_is_found_by_its_name() -> None:
    assert footprint_of(SonarShape("wedge", 3, 50, QUARTER, 10)) == sonar(3, 50, QUARTER, 10)


def test_places_are_seen_within_the_range_and_the_angle_on_either_side() -> None:
    # 36.9 degrees off the bow and 5 m away, 53.1 degrees, straight ahead too near and too far, behind.
    ahead_m, lateral_m = np.array([4.0, 3.0, 1.9, 50.1, -4.0]), np.array([3.0, 4.0, 0.0, 0.0, 3.0])
    for side in (-1, 1):
        assert sonar(2, 50, QUARTER, 10).sees(ahead_m, side * lateral_m).tolist() == [True, False, False, False, False]


def test_what_lies_on_an_edge_is_seen() -> None:
    ahead_m, lateral_m = np.array([3.0, 3.01, 2.0, 50.0, 2.0]), np.array([3.0, 3.0, 0.0, 0.0, 2.01])
    assert sonar(2, 50, QUARTER, 10).sees(ahead_m, lateral_m).tolist() == [True, True, True, True, False]


class TestALook:
    LOOK = LookGeometry((0.0, 0.0), 0.0, 20.0, along_bin_m=5.0, range_bin_m=1.0, along_bins=12, range_bins=3)

    @pytest.mark.parametrize(("far_m", "ahead"), [(40, 8), (40.004, 8), (40.01, 9), (41, 9)])
    def test_stands_for_the_bins_that_are_not_ahead(self, far_m: float, ahead: int) -> None:
        found = sonar(3, far_m, QUARTER, 20)
        assert found.bins_ahead(5) == ahead
        assert found.track_length_m(self.LOOK) == 5 * (12 - ahead)

    def test_with_fewer_bins_than_the_sonar_sees_ahead_stands_for_no_track(self) -> None:
        assert sonar(3, 100, QUARTER, 20).track_length_m(self.LOOK) == 0  # 12 bins, and 20 ahead

    def test_adds_up_with_those_before_and_behind(self) -> None:
        # Two bins a stretch. What lies in the first of them has been 4 bins ahead, then 2, then beside the vehicle.
        look = LookGeometry((0.0, 0.0), 0.0, 0.0, 5.0, 1.0, along_bins=5, range_bins=2)
        p_detect = np.zeros((2, 5, 2))
        p_detect[1, :, 0] = [0.5, 0.1, 0.2, 0.0, 0.4]
        profile = sonar(0, 20, QUARTER, 10).pass_profile(look, p_detect)
        assert profile.shape == (2, 2, 2)
        assert profile[1, :, 0] == pytest.approx(np.array([1 - 0.5 * 0.8 * 0.6, 0.1]))
        assert not profile[0].any()
        assert not profile[:, :, 1].any()

    def test_never_adds_up_to_certainty(self) -> None:
        profile = sonar(0, 50, QUARTER, 5).pass_profile(self.LOOK, np.full((2, 12, 3), 0.999))
        assert profile.max() == 0.999


class TestAPass:
    def test_by_hand(self) -> None:
        # Straight ahead each place has a look every 10 m of 40 m; 24 m to a side it is in sight over 32 m, so that it
        # has 4 looks in 2 of 10 places, else 3.
        curve = sonar(0, 40, math.pi / 2, 10).pass_curve(flat(0.5, 0, 40))
        assert curve.at(0.0) == pytest.approx(1 - 0.5**4)
        assert curve.at(24.0) == pytest.approx(0.2 * (1 - 0.5**4) + 0.8 * (1 - 0.5**3), abs=0.01)
        assert curve.at(40.1) == 0

    @given(sonars(), st.floats(0.05, 0.95), st.floats(0.0, 0.95))
    def test_is_the_mean_over_where_its_looks_are_made(self, found: ForwardLooking, best: float, share: float) -> None:
        shape = found.shape
        curve = DetectionCurve(np.array([shape.near_m, shape.far_m]), np.array([best, best / 3]))
        lateral_m = share * shape.far_m * math.sin(shape.half_angle_rad)
        missed = []
        for first_m in (np.arange(400) + 0.5) / 400 * shape.look_m:
            looks_m = np.arange(first_m, shape.far_m + 1, shape.look_m)
            range_m = np.hypot(looks_m, lateral_m)
            in_sight = (range_m >= shape.near_m) & (range_m <= shape.far_m)
            in_sight &= lateral_m <= looks_m * math.tan(shape.half_angle_rad)
            missed.append(np.prod(np.where(in_sight, 1 - curve.at(range_m), 1.0)))
        assert found.pass_curve(curve).at(lateral_m) == pytest.approx(1 - np.mean(missed), abs=0.05)


def test_the_outline_is_the_sector_closed() -> None:
    (line,) = sonar(10, 40, QUARTER, 10).outline
    assert line[0] == line[-1] == pytest.approx((-10 * math.sqrt(0.5), 10 * math.sqrt(0.5)))
    assert {round(math.hypot(*point), 6) for point in line} == {10, 40}
    assert max(abs(math.atan2(*point)) for point in line) == pytest.approx(QUARTER)
    assert any(point == pytest.approx((0, 40)) for point in line)


def test_people_are_told_its_range_and_angle() -> None:
    assert sonar(3, 40, 1.047198, 10).words == "40 m ahead, 60° to a side"
