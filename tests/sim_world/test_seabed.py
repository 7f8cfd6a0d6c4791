"""The seabed's factor: hand-computed values of one patch, and what holds for every seabed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_world.config import SeabedConfig
from sim_world.seabed import HALF_WEIGHT, Patch, PatchySeabed, make_seabed
from sim_world.sonar import SufferedSeabed, UniformSeabed

AREA = ((0.0, 0.0), (1212.0, 0.0), (1212.0, 400.0), (0.0, 400.0))
PATCHY = SeabedConfig("patchy", ripple_fields=7, vegetation_patches=7)


def patchy(seed: int, config: SeabedConfig = PATCHY) -> PatchySeabed:
    seabed = make_seabed(config, AREA, seed)
    assert isinstance(seabed, PatchySeabed)
    return seabed


def test_a_uniform_seabed_weakens_nothing() -> None:
    seabed = make_seabed(SeabedConfig(), AREA, 1)
    assert isinstance(seabed, UniformSeabed)
    factor = seabed.factor(np.zeros((2, 1, 5)), np.zeros((1, 3, 1)), 0.5)
    assert factor.shape == (2, 3, 5)
    assert np.all(factor == 1.0)


def test_vegetation_takes_its_strength_at_the_centre_half_of_it_at_half_weight_and_nothing_outside() -> None:
    # The long axis points east: half axes 50 m east, 25 m north.
    seabed = PatchySeabed((Patch(100.0, 200.0, math.pi / 2, 50.0, 25.0, 0.6),))
    x_m = np.array([100.0, 100.0 + 50.0 * HALF_WEIGHT, 100.0, 125.0, 150.0, 100.0, 500.0])
    y_m = np.array([200.0, 200.0, 200.0 - 25.0 * HALF_WEIGHT, 200.0, 200.0, 225.5, 200.0])
    # At half the half axis the weight is (1 - 1/4)^2 = 0.5625.
    expected = [0.4, 0.7, 0.7, 1.0 - 0.6 * 0.5625, 1.0, 1.0, 1.0]
    assert seabed.factor(x_m, y_m, 1.234) == pytest.approx(np.array(expected))


def test_ripples_weaken_most_across_their_crests_and_nothing_along_them() -> None:
    seabed = PatchySeabed((Patch(0.0, 0.0, 0.0, 60.0, 20.0, 0.8, ripple_normal_rad=0.3),))
    x_m, y_m = np.zeros(5), np.zeros(5)
    bearings = 0.3 + np.array([0.0, math.pi, math.pi / 2, -math.pi / 2, math.pi / 4])
    assert seabed.factor(x_m, y_m, bearings) == pytest.approx(np.array([0.2, 0.2, 1.0, 1.0, 0.6]))


@pytest.mark.parametrize(
    ("crests_deg", "least_deg", "largest_deg"),
    [((0.0, 20.0), 90.0, 110.0), ((160.0, 160.0), 250.0, 250.0), (None, 0.0, 180.0)],
)
def test_crests_run_as_the_config_says_else_in_any_direction(
    crests_deg: tuple[float, float] | None, least_deg: float, largest_deg: float
) -> None:
    crests_rad = None if crests_deg is None else (math.radians(crests_deg[0]), math.radians(crests_deg[1]))
    patches = patchy(3, SeabedConfig("patchy", 300, ripple_crests_rad=crests_rad)).patches
    normals_deg = [math.degrees(patch.ripple_normal_rad or 0.0) for patch in patches]
    assert (min(normals_deg), max(normals_deg)) == pytest.approx((least_deg, largest_deg), abs=3.0)
    assert least_deg - 1e-9 <= min(normals_deg) <= max(normals_deg) <= largest_deg + 1e-9


@pytest.mark.parametrize("heading_rad", [0.0, math.pi])
def test_along_crests_a_side_looking_sonar_is_blind_and_across_them_it_sees(heading_rad: float) -> None:
    config = SeabedConfig("patchy", 1, strength=(0.9, 0.9), ripple_crests_rad=(math.pi, math.pi))
    seabed = patchy(1, config)
    centre = np.array([seabed.patches[0].x_m]), np.array([seabed.patches[0].y_m])
    assert seabed.factor(*centre, heading_rad + math.pi / 2) == pytest.approx(0.1)
    assert seabed.factor(*centre, heading_rad) == pytest.approx(1.0)


def test_a_sonar_that_suffers_a_share_of_the_seabed_loses_that_share_of_what_is_taken_away() -> None:
    seabed = PatchySeabed((Patch(0.0, 0.0, 0.0, 60.0, 20.0, 0.8),))
    places = np.array([0.0, 0.0]), np.array([0.0, 60.0])
    for share, expected in ((0.0, 1.0), (0.5, 0.6), (1.0, 0.2)):
        assert SufferedSeabed(seabed, share).factor(*places, 0.3) == pytest.approx(np.array([expected, 1.0]))


def test_overlapping_patches_multiply() -> None:
    patch = Patch(0.0, 0.0, 0.0, 60.0, 20.0, 0.5)
    assert PatchySeabed((patch, patch)).factor(np.zeros(1), np.zeros(1), 0.0) == pytest.approx(0.25)


def test_what_is_drawn_keeps_to_the_config() -> None:
    config = SeabedConfig("patchy", 300, 300, scale_m=(40.0, 200.0), strength=(0.3, 0.8))
    patches = patchy(3, config).patches
    ripples = [patch for patch in patches if patch.ripple_normal_rad is not None]
    assert (len(ripples), len(patches)) == (300, 600)
    lengths = [2.0 * HALF_WEIGHT * patch.half_length_m for patch in patches]
    assert 40.0 <= min(lengths) < 45.0
    assert 195.0 < max(lengths) <= 200.0
    assert all(0.3 <= patch.strength <= 0.8 for patch in patches)
    assert all(0.0 <= patch.x_m <= 1212.0 and 0.0 <= patch.y_m <= 400.0 for patch in patches)
    assert all(patch.half_width_m <= 0.5 * patch.half_length_m for patch in ripples)


def test_a_seed_gives_one_seabed_and_ripples_do_not_depend_on_vegetation() -> None:
    assert patchy(5).patches == patchy(5).patches != patchy(6).patches
    alone = SeabedConfig("patchy", ripple_fields=7, vegetation_patches=0)
    assert patchy(5, alone).patches == patchy(5).patches[:7]


@given(
    seed=st.integers(0, 50), x_m=st.floats(-100.0, 1300.0), y_m=st.floats(-100.0, 500.0), spread=st.floats(1.0, 200.0)
)
def test_factors_are_positive_smooth_and_the_same_point_by_point(
    seed: int, x_m: float, y_m: float, spread: float
) -> None:
    seabed = patchy(seed)
    grid_x, grid_y = np.meshgrid(x_m + np.linspace(0.0, spread, 7), y_m + np.linspace(0.0, spread, 5))
    factor = seabed.factor(grid_x, grid_y, 0.7)
    assert np.all((factor > 0.0) & (factor <= 1.0))
    singly = [
        float(seabed.factor(np.array([x]), np.array([y]), 0.7)[0])
        for x, y in zip(grid_x.flat, grid_y.flat, strict=True)
    ]
    assert factor.ravel() == pytest.approx(np.array(singly), abs=1e-12)
    # The slope of (1 - r^2)^2 is at most 8 / (3 sqrt 3), r in half axes.
    steepest = sum(patch.strength * 8.0 / (3.0 * math.sqrt(3.0)) / patch.half_width_m for patch in seabed.patches)
    assert np.all(np.abs(seabed.factor(grid_x + 0.01, grid_y, 0.7) - factor) <= 0.01 * steepest + 1e-12)


def test_no_points_have_no_factors() -> None:
    assert patchy(1).factor(np.empty(0), np.empty(0), 0.0).shape == (0,)


@pytest.mark.parametrize(
    "wrong",
    [
        {"kind": "rocky"},
        {"ripple_fields": -1},
        {"scale_m": (200.0, 40.0)},
        {"scale_m": (0.0, 40.0)},
        {"strength": (0.3, 1.0)},
        {"strength": (float("nan"), 0.5)},
        {"ripple_crests_rad": (0.2, 0.1)},
        {"ripple_crests_rad": (0.0, 3.2)},
        {"ripple_crests_rad": (-0.1, 0.0)},
        {"ripple_crests_rad": (6.0, 6.3)},
        {"ripple_crests_rad": (float("nan"), 1.0)},
    ],
)
def test_a_seabed_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SeabedConfig(**wrong)  # type: ignore[arg-type]
