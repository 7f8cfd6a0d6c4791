"""What looks at one target have in common: sets of looks miss together as often as the map's residual risk says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.risk import NATS_PER_LEVEL, residual_risk
from planner.types import FloatArray
from sim_world.strengths import Shared, Strengths, Unshared, make_strengths

COUNT = 20_000
SURE = 5.0  # standard deviations: one share in two million lies farther off by chance
RARE = 10  # and so many more, where few are to be expected


def missed_by_all(
    strengths: Strengths, p_detect: list[float], bearings_rad: list[float], count: int, seed: int
) -> tuple[float, list[float]]:
    """Of so many targets the share that a set of looks misses, and the share that each of them detects."""
    generator, numbers = np.random.default_rng([seed, 1]), np.arange(count)
    missed, shares = np.ones(count, dtype=np.bool_), []
    for p, bearing_rad in zip(p_detect, bearings_rad, strict=True):
        chances = strengths.chances(numbers, np.full(count, p), np.full(count, bearing_rad))
        detected = generator.random(count) < chances
        missed &= ~detected
        shares.append(float(detected.mean()))
    return float(missed.mean()), shares


def is_near(share: float, chance: float, count: int) -> bool:
    """Whether so many draws with that chance come to a share, as far as the binomial lets them."""
    return abs(share - chance) <= SURE * math.sqrt(chance * (1.0 - chance) / count) + RARE / count


levels = st.lists(st.integers(1, 120), min_size=1, max_size=5)
correlations = st.floats(0.0, 1.0)


@settings(max_examples=60)
@given(looks=levels, correlation=correlations, seed=st.integers(0, 1000))
def test_looks_miss_together_what_the_map_says_for_that_rho(looks: list[int], correlation: float, seed: int) -> None:
    p_detect = [-math.expm1(-NATS_PER_LEVEL * level) for level in looks]
    strengths = make_strengths(correlation, None, COUNT, np.random.default_rng(seed))
    share, shares = missed_by_all(strengths, p_detect, [0.0, 1.0, 2.0, 3.0, 4.0][: len(looks)], COUNT, seed)
    risk = float(residual_risk(np.array([sum(looks)]), np.array([max(looks)]), correlation)[0])
    assert is_near(share, risk, COUNT)
    assert all(is_near(one, p, COUNT) for one, p in zip(shares, p_detect, strict=True))


class TestByHand:
    """Two looks of P_d 0.5 and 0.8, so q is 0.5 and 0.2."""

    P_DETECT = np.array([0.5, 0.8])

    def chances(self, correlation: float, strength: float) -> list[float]:
        strengths = Shared(correlation, None, 2, np.random.default_rng(1))
        strengths._strengths[:] = strength
        chances = strengths.chances(np.arange(2), self.P_DETECT, np.zeros(2))
        return [float(one) for one in chances]

    def test_a_weakness_below_what_a_look_overcomes_is_seen_by_it(self) -> None:
        # -0.5 ln 0.5 is 0.347, -0.5 ln 0.2 is 0.805; what its own draw misses is 0.5^0.5 and 0.2^0.5.
        assert self.chances(0.5, 0.3) == [1.0, 1.0]
        assert self.chances(0.5, 0.4) == pytest.approx([1.0 - math.sqrt(0.5), 1.0])
        assert self.chances(0.5, 0.9) == pytest.approx([1.0 - math.sqrt(0.5), 1.0 - math.sqrt(0.2)])

    def test_with_correlation_1_the_strength_alone_decides(self) -> None:
        assert self.chances(1.0, 0.6) == [1.0, 1.0]
        assert self.chances(1.0, 0.7) == [0.0, 1.0]  # ln 2 is 0.693
        assert self.chances(1.0, 1.7) == [0.0, 0.0]  # ln 5 is 1.609

    def test_with_correlation_0_looks_have_the_very_p_detect(self) -> None:
        strengths = make_strengths(0.0, 1.0, 2, np.random.default_rng(1))
        assert isinstance(strengths, Unshared)
        assert strengths.chances(np.arange(2), self.P_DETECT, np.zeros(2)) is self.P_DETECT

    @pytest.mark.parametrize("correlation", [0.3, 1.0])
    def test_who_is_not_seen_at_all_has_no_chance(self, correlation: float) -> None:
        strengths = Shared(correlation, 1.0, 3, np.random.default_rng(1))
        assert strengths.chances(np.arange(3), np.zeros(3), np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


def shares_of(aspect_deg: float, bearings_deg: list[float]) -> FloatArray:
    strengths = Shared(1.0, math.radians(aspect_deg), 1, np.random.default_rng(1))
    return strengths._shares(np.radians(bearings_deg))


def in_common(aspect_deg: float, one_deg: float, other_deg: float) -> float:
    one, other = shares_of(aspect_deg, [one_deg, other_deg])
    return float(np.minimum(one, other).sum())


class TestAspects:
    def test_a_window_lies_about_the_bearing(self) -> None:
        (shares,) = shares_of(5.0, [0.5])  # four directions wide: from -1.5 to 2.5 degrees
        expected = {358: 0.5, 359: 1.0, 0: 1.0, 1: 1.0, 2: 0.5}
        assert {int(one): float(shares[one]) * 4 for one in shares.nonzero()[0]} == pytest.approx(expected)

    @given(aspect_deg=st.floats(5.0, 180.0), bearing_deg=st.floats(-720.0, 720.0))
    def test_shares_sum_to_1(self, aspect_deg: float, bearing_deg: float) -> None:
        (shares,) = shares_of(aspect_deg, [bearing_deg])
        assert shares.sum() == pytest.approx(1.0)
        assert (shares >= 0.0).all()

    @given(
        aspect_deg=st.floats(5.0, 180.0),
        bearing_deg=st.floats(0.0, 360.0),
        apart_deg=st.lists(st.floats(0.0, 180.0), min_size=2, max_size=2).map(sorted),
    )
    def test_the_farther_apart_the_less_is_in_common(
        self, aspect_deg: float, bearing_deg: float, apart_deg: list[float]
    ) -> None:
        near, far = (in_common(aspect_deg, bearing_deg, bearing_deg + one) for one in apart_deg)
        assert far <= near + 1e-9
        assert near >= 1.0 - apart_deg[0] / (aspect_deg - 1.0) - 1e-9
        assert near <= max(0.0, 1.0 - (apart_deg[0] - 1.0) / (aspect_deg - 1.0)) + 1e-9

    @given(aspect_deg=st.floats(5.0, 180.0), bearing_deg=st.floats(0.0, 360.0), more_deg=st.floats(0.0, 1.0))
    def test_aspect_deg_apart_nothing_is_in_common_and_along_one_bearing_all(
        self, aspect_deg: float, bearing_deg: float, more_deg: float
    ) -> None:
        apart_deg = aspect_deg + more_deg * (180.0 - aspect_deg)
        assert in_common(aspect_deg, bearing_deg, bearing_deg + apart_deg) == pytest.approx(0.0, abs=1e-9)
        assert in_common(aspect_deg, bearing_deg, bearing_deg + 360.0) == pytest.approx(1.0)

    @settings(max_examples=20)
    @given(
        looks=st.lists(st.tuples(st.floats(0.05, 0.9), st.floats(0.0, 360.0)), min_size=1, max_size=4),
        correlation=st.floats(0.1, 1.0),
        aspect_deg=st.floats(10.0, 180.0),
        seed=st.integers(0, 1000),
    )
    def test_sets_of_looks_miss_together_as_a_min_stable_process_says(
        self, looks: list[tuple[float, float]], correlation: float, aspect_deg: float, seed: int
    ) -> None:
        count = 3000
        p_detect, bearings_deg = (list(one) for one in zip(*looks, strict=True))
        strengths = make_strengths(correlation, math.radians(aspect_deg), count, np.random.default_rng(seed))
        share, shares = missed_by_all(strengths, p_detect, np.radians(bearings_deg).tolist(), count, seed)
        nats = -np.log1p(-np.array(p_detect))
        shared = (correlation * nats[:, None] * shares_of(aspect_deg, bearings_deg)).max(axis=0).sum()
        assert is_near(share, math.exp(-(1.0 - correlation) * nats.sum() - shared), count)
        assert all(is_near(one, p, count) for one, p in zip(shares, p_detect, strict=True))

    def test_looks_from_opposite_sides_are_independent_and_from_one_side_not(self) -> None:
        strengths = make_strengths(1.0, math.pi, COUNT, np.random.default_rng(1))
        for bearing_rad, expected in ((0.0, 0.5), (math.pi, 0.25)):
            share, _ = missed_by_all(strengths, [0.5, 0.5], [0.0, bearing_rad], COUNT, 2)
            assert is_near(share, expected, COUNT)


def test_a_seed_gives_the_same_strengths() -> None:
    one, same, other = (Shared(0.5, 1.0, 20, np.random.default_rng(seed)) for seed in (1, 1, 2))
    asked = np.arange(20), np.full(20, 0.5), np.linspace(0.0, 6.0, 20)
    assert np.array_equal(one.chances(*asked), same.chances(*asked))
    assert not np.array_equal(one.chances(*asked), other.chances(*asked))
