"""The cells of a look: where they lie, and which way they are looked at."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.types import SonarShape
from sim_world.footprints.side import SideSwath
from sim_world.footprints.swath import SIDES


def swath(heading_rad: float) -> SideSwath:
    return SideSwath.over(SonarShape("side", 0.0, 30.0), (10.0, 20.0), heading_rad, 20.0, 2, (5.0, 10.0))


def test_heading_north_port_is_west() -> None:
    x_m, y_m = np.broadcast_arrays(*swath(0.0).cell_centres())
    assert x_m.shape == (2, 2, 4)
    assert x_m[0, 0] == pytest.approx(np.array([10.0, 0.0, -10.0, -20.0]))
    assert x_m[1, 1] == pytest.approx(np.array([10.0, 20.0, 30.0, 40.0]))
    assert y_m[:, 0] == pytest.approx(np.full((2, 4), 42.5))
    assert y_m[:, 1] == pytest.approx(np.full((2, 4), 47.5))
    assert swath(0.0).bearing_rad(swath(0.0).along_m, SIDES).ravel() == pytest.approx(
        np.array([-math.pi / 2, math.pi / 2])
    )


def test_heading_east_port_is_north() -> None:
    x_m, y_m = np.broadcast_arrays(*swath(math.pi / 2).cell_centres())
    assert x_m[:, 0] == pytest.approx(np.full((2, 4), 32.5))
    assert y_m[0, 0] == pytest.approx(np.array([20.0, 30.0, 40.0, 50.0]))
    assert y_m[1, 0] == pytest.approx(np.array([20.0, 10.0, 0.0, -10.0]))


def test_it_ends_after_its_bins_and_reaches_its_last_range() -> None:
    assert swath(1.0).end_along_m == 30.0
    assert swath(1.0).reach_m == 30.0
    assert swath(1.0).lateral_m.tolist() == [[[-0.0, -10.0, -20.0, -30.0]], [[0.0, 10.0, 20.0, 30.0]]]


def test_to_the_sides_it_has_a_cell_at_range_0_and_all_that_reach_the_farthest_range() -> None:
    assert SideSwath.bins_of(SonarShape("side", 5.0, 30.0), 2, (5.0, 10.0)) == (2, 4)
    assert SideSwath.bins_of(SonarShape("side", 5.0, 30.1), 3, (5.0, 10.0)) == (3, 5)


def test_it_sees_from_where_it_begins_to_just_before_its_end_and_to_its_reach_on_either_side() -> None:
    look = SideSwath.over(SonarShape("side", 5.0, 42.0), (10.0, 20.0), 1.0, 20.0, 3, (5.0, 6.0))
    along_m = np.array([20.0, 19.999, 34.999, 35.0, 20.0, 20.0, 20.0, 20.0, 20.0])
    lateral_m = np.array([0.0, 0.0, 0.0, 0.0, 42.0, -42.0, 42.001, -42.001, 4.0])
    assert look.sees(along_m, lateral_m).tolist() == [True, False, True, False, True, True, False, False, True]


def test_all_cells_are_seen_each_from_abeam_at_its_lateral_range() -> None:
    look = swath(1.0)
    p_detect = np.array([[[0.0, 0.3, 0.2, 0.1]] * 2, [[0.1, 0.4, 0.5, 0.6]] * 2])
    assert look.seen(p_detect).tolist() == p_detect.tolist()
    along_m, lateral_m = np.array([21.0, 29.0]), np.array([-7.0, 12.0])
    assert look.seen_from_m(along_m).tolist() == [21.0, 29.0]
    assert look.range_m(along_m, lateral_m).tolist() == [7.0, 12.0]
    assert look.bearing_rad(along_m, lateral_m) == pytest.approx([1.0 - math.pi / 2, 1.0 + math.pi / 2])


def test_what_is_scattered_lies_evenly_on_both_sides_between_two_ranges() -> None:
    look = swath(1.0)
    assert look.area_m2(5.0, 25.0) == 2 * 20 * 10
    along_m, lateral_m = look.scattered(10_000, 5.0, 25.0, np.random.default_rng(1))
    assert along_m.shape == lateral_m.shape == (10_000,)
    assert (along_m.min(), along_m.max()) == pytest.approx((20.0, 30.0), abs=0.02)
    for side in (-1, 1):
        on_side_m = side * lateral_m[lateral_m * side > 0]
        assert on_side_m.size == pytest.approx(5000, abs=200)  # 4 standard deviations
        assert (on_side_m.min(), on_side_m.max()) == pytest.approx((5.0, 25.0), abs=0.05)
        assert on_side_m.mean() == pytest.approx(15.0, abs=0.33)


def test_places_of_cells_that_looks_have_in_common_are_read_only() -> None:
    look = swath(1.0)
    assert look.along_m is swath(2.0).along_m
    assert look.lateral_m is swath(2.0).lateral_m
    for places_m in (look.along_m, look.lateral_m):
        with pytest.raises(ValueError, match="read-only"):
            places_m[0] = 1.0


@given(st.floats(0.0, 6.28))
def test_the_cells_lie_in_the_tracks_frame_where_the_look_says(heading_rad: float) -> None:
    cells = swath(heading_rad)
    along_m, lateral_m = cells.to_track(*cells.cell_centres())
    assert along_m == pytest.approx(np.broadcast_to(np.array([22.5, 27.5])[None, :, None], (2, 2, 4)))
    assert lateral_m == pytest.approx(np.broadcast_to(cells.lateral_m, (2, 2, 4)), abs=1e-9)


def test_askew_it_sees_abeam_of_the_bow_and_not_beyond_the_tracks_ends() -> None:
    # The bow 30 degrees to starboard of the way: a place 10 m to starboard, 50 m on, is abeam from 10 tan 30 = 5.77 m
    # farther on, at 10 / cos 30 = 11.55 m.
    along_m, lateral_m = (
        np.array([50.0, 50.0, 95.0, 5.0, 0.0, 100.0]),
        np.array([10.0, -10.0, 10.0, -10.0, 10.0, -10.0]),
    )
    range_m, bearing_rad, seen = swath(0.0).askew(along_m, lateral_m, math.pi / 6, 100.0)
    assert range_m == pytest.approx(np.full(6, 11.547), abs=1e-3)
    assert bearing_rad[:2] == pytest.approx([2 * math.pi / 3, -math.pi / 3])
    assert seen.tolist() == [True, True, False, False, True, True]


def test_where_the_bow_points_down_the_track_it_sees_from_its_start_to_its_end() -> None:
    along_m = np.array([-0.001, 0.0, 100.0, 100.001])
    assert swath(0.0).askew(along_m, np.full(4, 10.0), 0.0, 100.0)[2].tolist() == [False, True, True, False]
