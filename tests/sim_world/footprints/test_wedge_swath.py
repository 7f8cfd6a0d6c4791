"""A forward-looking sonar's look: which cells it has, which of them it sees, and how."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.footprints.wedge import ForwardLooking
from planner.types import SonarShape
from sim_world.config import TargetsConfig
from sim_world.footprints.wedge import WedgeSwath
from sim_world.targets import make_targets

QUARTER = math.pi / 4
SHAPE = SonarShape("wedge", 0.0, 15.0, QUARTER, 10.0)


def look(shape: SonarShape, heading_rad: float = 0.0, first_along_m: float = 20.0) -> WedgeSwath:
    return WedgeSwath.over(shape, (10.0, 20.0), heading_rad, first_along_m, 2, (5.0, 5.0))


def test_its_cells_reach_beyond_the_stretch_and_to_the_sectors_widest() -> None:
    # 2 bins beside the stretch, 3 ahead of it; 15 m times sin 45 degrees is 10.6 m.
    assert WedgeSwath.bins_of(SHAPE, 2, (5.0, 5.0)) == (5, 4)
    assert WedgeSwath.bins_of(SonarShape("wedge", 0.0, 15.0, math.pi / 2, 10.0), 1, (5.0, 5.0)) == (4, 4)
    # Bins of 2 m across: as many more as it takes.
    assert WedgeSwath.bins_of(SHAPE, 2, (5.0, 2.0)) == (5, 7)


def test_by_hand_which_cells_are_seen() -> None:
    # Cells 2.5, 7.5, ... m ahead of where the stretch begins and 0, 5, 10 and 15 m to a side: at 2.5 m the second lies
    # 63 degrees off the bow, at 7.5 m the third 53; at 12.5 m the second is 13.5 m away, the third 16 m.
    swath = look(SHAPE)
    seen = np.broadcast_to(swath.sees(swath.along_m, swath.lateral_m), (2, 5, 4)).astype(int)
    assert seen[1].tolist() == [[1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]
    assert seen[0].tolist() == seen[1].tolist()
    p_detect = np.arange(1.0, 41.0).reshape(2, 5, 4)
    assert swath.seen(p_detect)[1].tolist() == [[21, 0, 0, 0], [25, 26, 0, 0], [29, 30, 0, 0], [0] * 4, [0] * 4]


@pytest.mark.parametrize(("lateral_m", "bearing_deg"), [(3.0, 90 + 36.8699), (-3.0, 90 - 36.8699), (0.0, 90)])
def test_a_place_is_seen_off_the_bow_from_where_the_stretch_begins(lateral_m: float, bearing_deg: float) -> None:
    swath = look(SHAPE, heading_rad=math.pi / 2)
    place = np.array([24.0]), np.array([lateral_m])
    assert swath.range_m(*place) == pytest.approx(math.hypot(4, lateral_m))
    assert np.degrees(swath.bearing_rad(*place)) == pytest.approx(bearing_deg)
    assert swath.seen_from_m(np.array([24.0, 31.0])).tolist() == [20.0, 20.0]
    # Wherever its bow points, and wherever the track ends.
    range_m, bearing_rad, seen = swath.askew(*place, 0.3, 10.0)
    assert range_m == pytest.approx(math.hypot(4, lateral_m))
    assert np.degrees(bearing_rad) == pytest.approx(bearing_deg)
    assert seen.all()


def test_targets_in_the_sector_are_passed_and_others_are_not() -> None:
    targets = make_targets(TargetsConfig(1), ((0.0, 0.0), (1000.0, 0.0), (1000.0, 400.0), (0.0, 400.0)), 1)
    (target,) = targets.truth().targets

    def passed(bearing_deg: float, range_m: float) -> list[float]:
        """How far to the side it lies, heading south, if it lies so far off the bow to starboard and is seen."""
        turned = math.pi + math.radians(bearing_deg)
        x_m, y_m = target.x_m - range_m * math.sin(turned), target.y_m - range_m * math.cos(turned)
        swath = WedgeSwath.over(SonarShape("wedge", 3, 40, QUARTER, 10), (x_m, y_m + 20), math.pi, 20, 2, (5, 5))
        lateral_m: list[float] = targets.passed(swath).lateral_m.tolist()
        return lateral_m

    assert passed(0, 20) == [pytest.approx(0, abs=1e-9)]
    assert passed(44, 20) == [pytest.approx(20 * math.sin(math.radians(44)))]
    assert passed(-44, 39.9) == [pytest.approx(-39.9 * math.sin(math.radians(44)))]
    for bearing_deg, range_m in ((46, 20), (-46, 20), (180, 20), (0, 2.9), (0, 40.1)):
        assert passed(bearing_deg, range_m) == []


def test_what_is_scattered_lies_evenly_in_the_sector() -> None:
    swath = look(SonarShape("wedge", 10.0, 40.0, QUARTER, 10.0))
    along_m, lateral_m = swath.scattered(20_000, 0.0, 40.0, np.random.default_rng(1))
    assert swath.sees(along_m, lateral_m).all()
    # A quarter of a ring from 10 to 40 m; half of it lies beyond the root of (100 + 1600) / 2.
    assert swath.area_m2(0.0, 40.0) == pytest.approx(math.pi / 4 * 1500)
    assert np.mean(np.hypot(along_m - 20.0, lateral_m) > math.sqrt(850)) == pytest.approx(0.5, abs=0.015)
    assert np.mean(lateral_m > 0) == pytest.approx(0.5, abs=0.015)
    assert swath.area_m2(0.0, 5.0) == 0.0


@given(
    near_m=st.floats(0, 10),
    deeper_m=st.floats(1, 40),
    half_angle_rad=st.floats(0.2, math.pi / 2),
    look_bins=st.integers(1, 4),
    track_bins=st.integers(1, 25),
    range_bin_m=st.sampled_from([1.0, 2.5]),
)
def test_a_pass_sees_all_of_its_swath_and_nothing_outside_the_sector(
    near_m: float, deeper_m: float, half_angle_rad: float, look_bins: int, track_bins: int, range_bin_m: float
) -> None:
    shape = SonarShape("wedge", near_m, near_m + 5.0 * look_bins + deeper_m, half_angle_rad, 5.0 * look_bins)
    footprint = ForwardLooking(shape)
    all_bins = track_bins + footprint.bins_ahead(5.0)
    looks = np.zeros(all_bins, dtype=int)
    for first in range(0, track_bins, look_bins):
        bins = min(look_bins, track_bins - first)
        swath = WedgeSwath.over(shape, (0.0, 0.0), 1.0, 5.0 * first, bins, (5.0, range_bin_m))
        seen = np.broadcast_to(swath.sees(swath.along_m, swath.lateral_m), (2, swath.bins, swath.range_bins))
        ahead_m = swath.along_m - 5.0 * first
        off_bow = np.abs(swath.lateral_m) > ahead_m * math.tan(half_angle_rad) + 1e-6
        assert not (seen & (off_bow | (np.hypot(ahead_m, swath.lateral_m) > shape.far_m))).any()
        within = np.abs(swath.lateral_m[0, 0]) <= footprint.reach.far_m - 1e-6
        looks[first : first + swath.bins] += seen[:, :, within].all(axis=(0, 2))
    centres_m = (np.arange(all_bins) + 0.5) * 5.0
    beside = (centres_m >= footprint.lead_m) & (centres_m <= footprint.lead_m + 5.0 * track_bins)
    assert (looks[beside] >= 1).all()
