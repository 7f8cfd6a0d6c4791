"""How far vehicles' places lie apart, by what they have seen."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.registration import Frame, registered
from planner.types import FloatArray


def seen(*places: tuple[float, float], sigma_m: float) -> FloatArray:
    """What a vehicle has seen that tells this standard deviation of all of it."""
    return np.array([(*place, sigma_m) for place in places], dtype=np.float64)


def strewn(count: int, seed: int, side_m: float = 600.0) -> FloatArray:
    """Places at random in a square; shape (count, 2)."""
    return np.random.default_rng(seed).uniform(0.0, side_m, (count, 2))


def test_vehicles_that_are_where_they_believe_lie_as_they_tell() -> None:
    both = {"primary": seen((0, 0), (50, 0), sigma_m=0.0), "helper": seen((1, 0), (51, 0), sigma_m=0.0)}
    assert registered(both) == {"primary": Frame(), "helper": Frame()}
    assert registered({}) == {}


def test_a_single_pair_tells_little_and_two_that_agree_nearly_all() -> None:
    """A guess of 8 m of 5 each way; where it falls it is 117 times as dense as over all that is within reach."""
    denser, shares = math.pi * 9.0 * 26.0 / (2.0 * math.pi), np.arange(0.025, 1.0, 0.05)
    for pairs in (1, 2):
        places = [(200 * pair, 0) for pair in range(pairs)]
        moved = [(east_m + 8, north_m) for east_m, north_m in places]
        told = {"helper": seen(*places, sigma_m=3.0), "primary": seen(*moved, sigma_m=4.0)}
        right = ((1.0 - shares + shares * denser) ** pairs).mean() * math.exp(-0.5 * 64.0 / 25.0) / 25.0
        share = right / (right + ((1.0 - shares) ** pairs).mean())
        off_m = math.sqrt(share * (8.0 - 8.0 * share) ** 2 / 2 + (1.0 - share) * (25.0 + (8.0 * share) ** 2 / 2))
        frame = registered(told)["primary"]
        assert (frame.east_m, frame.north_m) == pytest.approx((8.0 * share, 0.0), abs=0.006)
        assert frame.sigma_m == pytest.approx(min(off_m, 5.0), abs=0.006)
        assert frame.placed_m == pytest.approx(math.hypot(3.0, min(off_m, 5.0)), abs=0.006)
        assert share == pytest.approx({1: 0.57, 2: 0.99}[pairs], abs=0.02)


def test_however_much_both_have_seen_the_guess_that_fits_all_of_it_is_taken() -> None:
    """Of 200 things each makes it some 1,800 times as likely: more than a number can hold."""
    places = [(200.0 * place, 0.0) for place in range(200)]
    moved = [(east_m + 12.0, north_m - 5.0) for east_m, north_m in places]
    told = {"helper": seen(*places, sigma_m=0.0), "primary": seen(*moved, sigma_m=20.0)}
    frame = registered(told)["primary"]
    assert (frame.east_m, frame.north_m, frame.sigma_m) == pytest.approx((12.0, -5.0, 0.0), abs=0.006)


@pytest.mark.parametrize("seed", range(6))
def test_guesses_weigh_as_bayes_rule_has_it(seed: int) -> None:
    """Five places on six, the same thing told as far apart as both have drifted, and a metre."""
    rng = np.random.default_rng(seed)
    known = np.column_stack([rng.uniform(0.0, 60.0, (6, 2)), rng.uniform(1.0, 3.0, 6)])
    places = np.column_stack([known[:5, :2] + (3.0, 4.0) + rng.normal(0.0, 1.0, (5, 2)), rng.uniform(4.0, 9.0, 5)])
    prior_m2 = known[:, 2].mean() ** 2 + places[:, 2].mean() ** 2
    drift_m2 = known[:, 2].var() + places[:, 2].var()
    reach_m2, same_m2 = 9.0 * (prior_m2 + drift_m2 + 1.0), drift_m2 + 1.0

    def falls(apart: FloatArray, guess: FloatArray) -> float:
        return math.exp(-((apart - guess) ** 2).sum() / same_m2 / 2)

    pairs = [[one - other for other in known[:, :2]] for one in places[:, :2]]
    pairs = [[apart for apart in of_one if (apart**2).sum() <= reach_m2] for of_one in pairs]
    guesses = [apart for of_one in pairs for apart in of_one]
    of_each = sum(map(bool, pairs))
    weights = []
    for guess in guesses:
        told = [sum(falls(apart, guess) for apart in of_one) / same_m2 / 2 * reach_m2 for of_one in pairs if of_one]
        told = [one * of_each / len(guesses) for one in told]
        seen_so = sum(math.prod(1 - share + share * one for one in told) for share in np.arange(0.025, 1.0, 0.05))
        as_likely = math.exp(-(guess**2).sum() / prior_m2 / 2) * same_m2 / prior_m2
        weights.append(seen_so * as_likely / sum(falls(other, guess) for other in guesses))
    none = sum((1 - share) ** of_each for share in np.arange(0.025, 1.0, 0.05))
    mean = sum(weight * guess for weight, guess in zip(weights, guesses, strict=True)) / (sum(weights) + none)
    off_m2 = sum(weight * ((guess - mean) ** 2).sum() for weight, guess in zip(weights, guesses, strict=True)) / 2
    off_m2 = (off_m2 + none * (prior_m2 + (mean**2).sum() / 2)) / (sum(weights) + none)
    frame = registered({"helper": known, "primary": places})["primary"]
    assert (frame.east_m, frame.north_m) == pytest.approx(mean, abs=0.006)
    assert frame.sigma_m == pytest.approx(min(math.sqrt(off_m2 + drift_m2), math.sqrt(prior_m2)), abs=0.006)


def test_those_who_have_seen_nothing_together_lie_where_they_say() -> None:
    apart = {"helper": seen((0, 0), (10, 0), sigma_m=3.0), "primary": seen((500, 0), sigma_m=4.0)}
    assert registered(apart)["primary"] == Frame(0.0, 0.0, 5.0, round(math.hypot(3.0, 5.0), 2))


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    off_m=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    known_to_m=st.sampled_from([0.0, 5.0, 10.0]),
)
def test_what_both_have_seen_tells_how_far_they_are_apart(
    seed: int, off_m: tuple[float, float], known_to_m: float
) -> None:
    """Of 60 each has seen half, and ten that are nothing; as mines lie 50 m apart."""
    places, rng = strewn(60, seed), np.random.default_rng(seed + 1)
    told = {}
    for name, moved_m, sigma_m in (("helper", (0.0, 0.0), known_to_m), ("primary", off_m, 20.0)):
        own = places[rng.random(60) < 0.5]
        own = (
            np.concatenate([own, rng.uniform(0.0, 600.0, (10, 2))]) + moved_m + rng.normal(0.0, 0.3, (len(own) + 10, 2))
        )
        told[name] = np.column_stack([own, np.full(len(own), sigma_m)])
    frames = registered(told)
    assert frames["helper"] == Frame()
    frame = frames["primary"]
    assert math.hypot(frame.east_m - off_m[0], frame.north_m - off_m[1]) < max(1.0, 3.0 * frame.sigma_m)
    assert frame.sigma_m < 1.0
    assert frame.placed_m == pytest.approx(math.hypot(known_to_m, frame.sigma_m), abs=0.01)


def test_chance_alone_tells_nothing() -> None:
    """Where nothing is of both, how far they are apart is as unsure as before, or nearly."""
    sure = 0
    for seed in range(200):
        told = {
            name: np.column_stack([strewn(30, 2 * seed + place), np.full(30, 10.0)])
            for place, name in enumerate(("helper", "primary"))
        }
        frame = registered(told)["primary"]
        sure += frame.sigma_m < 3.0
    assert sure <= 10


def test_drift_is_left_in_what_they_are_apart_by() -> None:
    places, drifted_m = strewn(40, 1), np.linspace(0.0, 6.0, 40)
    told = {
        "helper": np.column_stack([places, np.zeros(40)]),
        "primary": np.column_stack([places[:, 0] + drifted_m, places[:, 1], drifted_m]),
    }
    frame = registered(told)["primary"]
    assert frame.east_m == pytest.approx(3.0, abs=1.0)
    assert frame.sigma_m == pytest.approx(drifted_m.std(), abs=0.3)


def test_each_joins_all_who_know_better_where_they_are() -> None:
    """The third has seen half of what the first has, and half of what the second has, which lie apart."""
    west, east = strewn(20, 1), strewn(20, 2) + np.array([900.0, 0.0])
    both = np.concatenate([west[:10], east[:10]])
    told = {
        "third": np.column_stack([both + np.array([9.0, -4.0]), np.full(20, 12.0)]),
        "second": np.column_stack([east, np.full(20, 5.0)]),
        "first": np.column_stack([west, np.full(20, 0.0)]),
    }
    frames = registered(told)
    assert list(frames) == ["first", "second", "third"]
    assert frames["second"] == Frame(0.0, 0.0, 5.0, 5.0)
    assert (frames["third"].east_m, frames["third"].north_m) == pytest.approx((9.0, -4.0), abs=0.1)


def test_thousands_in_one_place_are_not_all_weighed() -> None:
    heap = np.zeros((3000, 3))
    heap[:, 2] = 10.0
    frame = registered({"helper": heap, "primary": heap})["primary"]
    assert (frame.east_m, frame.north_m) == (0.0, 0.0)
