"""The side-looking sonar's footprint, and the reach that all kinds have."""

import numpy as np
import pytest

from planner.footprints import footprint_of
from planner.footprints.footprint import Reach
from planner.footprints.side import SideLooking
from planner.types import DetectionCurve, LookGeometry, SonarShape

LOOK = LookGeometry((0.0, 0.0), 0.0, 20.0, along_bin_m=5.0, range_bin_m=2.0, along_bins=3, range_bins=4)


def sonar(near_m: float, far_m: float) -> SideLooking:
    return SideLooking(SonarShape("side", near_m, far_m))


def test_it_is_found_by_its_name_and_another_is_not() -> None:
    # It looks along a line, every 20 m where nothing else is told.
    assert footprint_of(SonarShape("side", 40, 130, half_angle_rad=0.0, look_m=20.0)) == sonar(40, 130)
    with pytest.raises(ValueError, match="there is no footprint square; must be side"):
        footprint_of(SonarShape("square", 40, 130))


def test_its_outline_leaves_out_the_nadir_gap() -> None:
    assert sonar(40, 130).outline == (((-40, 0), (-130, 0)), ((40, 0), (130, 0)))


def test_a_pass_covers_one_side_where_there_is_a_nadir_gap_and_else_both() -> None:
    gap, narrow, none = sonar(40, 130).reach, sonar(0.5, 25).reach, sonar(0, 25).reach
    assert (gap.strip_width_m, gap.beside_m) == (90, 85)
    assert (narrow.strip_width_m, narrow.beside_m) == (24.5, 12.75)
    assert (none.strip_width_m, none.beside_m) == (50, 0)


def test_a_plan_counts_on_the_range_it_is_told() -> None:
    assert sonar(40, 130).told(145).reach == Reach(40, 145)


def test_a_look_stands_for_the_track_beside_it_and_is_all_that_a_place_gets() -> None:
    curve, p_detect = DetectionCurve(np.array([0.0, 30.0]), np.array([0.2, 0.1])), np.full((2, 3, 4), 0.5)
    assert sonar(0, 30).track_length_m(LOOK) == 15
    assert sonar(0, 30).pass_curve(curve) is curve
    assert sonar(0, 30).pass_profile(LOOK, p_detect) is p_detect
    assert (sonar(0, 30).ahead_m, sonar(0, 30).lead_m) == (0, 0)


def test_a_looks_reach_is_from_the_first_to_the_last_range_bin_that_saw() -> None:
    p_detect = np.zeros((2, 3, 4))
    assert Reach.of_look(LOOK, p_detect) is None
    p_detect[0, 1, 1] = p_detect[1, 2, 3] = 0.1
    assert Reach.of_look(LOOK, p_detect) == Reach(2, 6)
    assert Reach(2, 6).joined(Reach(3, 8)) == Reach(2, 8)
