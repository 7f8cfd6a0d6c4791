"""Kinds of targets: how much of each shows, and what that makes of P_d."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from secondlook.scenario import load_scenario
from sim_world.kinds import ALIKE, CYLINDER, MIXTURES, TRUNCATED_CONE, Alike, Kind, Mixture, make_kinds

MINES = MIXTURES["mines"]


def mixture(count: int, seed: int = 1, kinds: tuple[Kind, ...] = MINES) -> Mixture:
    return Mixture(kinds, count, np.random.default_rng(seed))


def test_a_cylinder_shows_its_length_abeam_and_its_width_from_its_ends() -> None:
    turned_rad = np.array([0.0, math.pi / 2, math.pi, -math.pi / 2, math.pi / 6])
    expected = [0.6, 2.0, 0.6, 2.0, 1.0 + 0.6 * math.sqrt(0.75)]
    assert CYLINDER.shown_m(turned_rad).tolist() == pytest.approx(expected)
    assert TRUNCATED_CONE.shown_m(turned_rad).tolist() == [0.75] * 5


@pytest.mark.parametrize("kind", MINES)
def test_the_mean_over_bearings_is_as_told(kind: Kind) -> None:
    turned_rad = np.linspace(0.0, 2 * math.pi, 10_000, endpoint=False)
    assert kind.shown_m(turned_rad).mean() == pytest.approx(kind.mean_shown_m, rel=1e-6)


def test_a_scenario_may_name_every_mixture() -> None:
    for name in MIXTURES:
        assert load_scenario("tellaro", [f"targets.kinds={name}"]).targets.kinds == (None if name == ALIKE else name)


@pytest.mark.parametrize("kinds", [kinds for kinds in MIXTURES.values() if kinds])
def test_strengths_have_the_mean_1_over_the_mixture(kinds: tuple[Kind, ...]) -> None:
    targets = mixture(200_000, kinds=kinds)
    strengths = targets.strength(np.arange(200_000), np.full(200_000, 0.7))
    assert strengths.mean() == pytest.approx(1.0, abs=4.0 * strengths.std() / math.sqrt(200_000))
    assert strengths.min() > 0.0
    assert strengths.std() > 0.3
    assert {kinds[number] for number in targets._kind} == set(kinds)


def test_the_strength_of_one_target_by_hand() -> None:
    targets = mixture(1, kinds=(CYLINDER,))
    targets._heading_rad[:] = 0.0
    abeam, ahead = (float(targets.strength(np.array([0]), np.array([one]))[0]) for one in (math.pi / 2, 0.0))
    assert abeam / ahead == pytest.approx(2.0 / 0.6)
    # As large as told and half buried: 0.5 of 2 m by 0.6 m, over what cylinders show on average.
    targets._per_m[:] = 0.6 * 0.5 / (0.6 * 2 / math.pi * 2.6 * (1.2**3 - 0.8**3) / 1.2 * 0.75)
    strength = float(targets.strength(np.array([0]), np.array([math.pi / 2]))[0])
    assert strength == pytest.approx(0.5 * 2.0 / (1.6552 * 1.0133 * 0.75), rel=1e-4)
    assert targets.p_detect(np.array([0]), np.array([0.5]), np.array([math.pi / 2])) == pytest.approx(
        1.0 - 0.5**strength
    )


@given(p_detect=st.floats(0.01, 0.95), bearing_rad=st.floats(0.0, 6.3), seed=st.integers(0, 100))
def test_what_is_seen_worse_is_missed_more_on_the_whole(p_detect: float, bearing_rad: float, seed: int) -> None:
    """By Jensen's inequality: with a mean strength of 1 the mean of q to its power is more than q."""
    targets, numbers = mixture(2000, seed), np.arange(2000)
    bearings = np.full(2000, bearing_rad)
    strengths = targets.strength(numbers, bearings)
    own = targets.p_detect(numbers, np.full(2000, p_detect), bearings)
    assert (np.diff(own[np.argsort(strengths)]) >= 0.0).all()
    assert 1.0 - own.mean() > (1.0 - p_detect) ** strengths.mean()
    assert own.max() <= 0.999


def test_those_that_are_alike_are_seen_as_p_detect_says() -> None:
    p_detect = np.array([0.1, 0.2])
    kinds = make_kinds("alike", 2, np.random.default_rng(1))
    assert isinstance(kinds, Alike)
    assert kinds.p_detect(np.arange(2), p_detect, np.zeros(2)) is p_detect


def test_what_is_not_seen_stays_so() -> None:
    kinds = make_kinds("mines", 2, np.random.default_rng(1))
    assert kinds.p_detect(np.arange(2), np.array([0.0, 0.5]), np.zeros(2))[0] == 0.0
