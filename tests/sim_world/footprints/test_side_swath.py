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
