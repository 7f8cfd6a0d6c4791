"""Contenders seed by seed: differences and intervals by hand, and whether reacting was worth it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from results import result

from secondlook.compare.flights import Contender, Result
from secondlook.compare.paired import OBJECTIVES, Paired, Verdict, objective_of, paired, verdict
from secondlook.errors import UserError
from secondlook.scenario import load_scenario

SCENARIO = load_scenario("tellaro")
MEAN = OBJECTIVES["mean"]


def missions(*ends: float) -> dict[int, Result]:
    """Missions with seeds from 1, of these mean risks."""
    return {seed: result(seed, end) for seed, end in enumerate(ends, start=1)}


def compared(own: dict[int, Result], first: dict[int, Result], objective: str = "mean") -> Paired:
    found = paired(own, first, OBJECTIVES[objective])
    assert found is not None
    return found


class TestDifferences:
    def test_seeds_that_both_have_flown_are_compared(self) -> None:
        first, own = missions(0.3, 0.5, 0.4), missions(0.4, 0.4, 0.6, 0.9)
        del own[1]
        found = compared(own, first)
        assert (found.seeds, found.better, found.worse) == (2, 1, 1)
        assert (found.own, found.first, found.difference) == pytest.approx((0.5, 0.45, 0.05))

    def test_without_a_common_seed_there_is_nothing_to_compare(self) -> None:
        assert paired({1: result(1, 0.4)}, {2: result(2, 0.4)}, MEAN) is None
        assert paired({}, {}, MEAN) is None

    def test_of_targets_more_is_better_and_missions_without_any_do_not_count(self) -> None:
        first = {seed: result(seed, 0.4, expected=0.5) for seed in (1, 2, 3)}
        own = {1: result(1, 0.4, expected=0.7), 2: result(2, 0.4, expected=0.6), 3: result(3, 0.4, expected=None)}
        found = compared(own, first, "targets")
        assert (found.seeds, found.better, found.worse) == (2, 2, 0)
        assert found.difference == pytest.approx(0.15)

    def test_each_objective_by_its_name(self) -> None:
        one = result(1, 0.4, worse=0.25, found=0.9, expected=0.5)
        assert {name: objective.of(one) for name, objective in OBJECTIVES.items()} == pytest.approx(
            {"mean": 0.4, "worst30": 0.65, "both": 0.475, "targets": 0.5}
        )
        assert objective_of(SCENARIO) in OBJECTIVES

    def test_it_is_the_scenarios_whatever_that_is(self) -> None:
        for name in OBJECTIVES:
            assert objective_of(load_scenario("tellaro", [f"coordinator.objective={name}"])) == name

    def test_targets_are_no_objective_where_there_are_none(self) -> None:
        without = load_scenario("tellaro", ["coordinator.objective=targets", "targets.count=0"])
        with pytest.raises(
            UserError, match=r"^coordinator\.objective: targets is not allowed here, .*must be mean or worst30 or both$"
        ):
            objective_of(without)


class TestIntervals:
    def test_five_seeds_are_too_few(self) -> None:
        found = compared(missions(*[0.5] * 5), missions(*[0.4] * 5))
        assert (found.low, found.high) == (None, None)

    def test_where_all_seeds_differ_alike_there_is_no_doubt(self) -> None:
        found = compared(missions(*[0.5] * 6), missions(*[0.4] * 6))
        assert (found.low, found.high) == pytest.approx((0.1, 0.1))

    def test_of_six_seeds_of_which_one_differs_by_hand(self) -> None:
        # A sixth of it for each time that its seed is drawn: never in 33 % of resamples, 3 times or more in 6.2 %, 4
        # times or more in 0.9 %.
        found = compared(missions(0.46, *[0.4] * 5), missions(*[0.4] * 6))
        assert (found.low, found.high) == pytest.approx((0.0, 0.03))

    def test_of_many_seeds_it_is_that_of_the_normal_distribution(self) -> None:
        differences = np.random.default_rng(7).normal(0.01, 0.02, 400)
        found = compared(missions(*(0.4 + differences)), missions(*[0.4] * 400))
        half = 1.96 * differences.std() / math.sqrt(400)
        assert (found.low, found.high) == pytest.approx(
            (differences.mean() - half, differences.mean() + half), abs=0.1 * half
        )

    @given(st.lists(st.floats(0, 1), min_size=6, max_size=12), st.randoms())
    def test_it_is_the_same_again_in_whatever_order_seeds_were_flown(self, ends: list[float], chance: object) -> None:
        own, first = missions(*ends), missions(*[0.4] * len(ends))
        found = compared(own, first)
        seeds = list(own)
        chance.shuffle(seeds)  # type: ignore[attr-defined]
        assert compared({seed: own[seed] for seed in seeds}, first) == found
        assert found.low is not None
        assert found.high is not None
        assert min(ends) - 0.4 - 1e-9 <= found.low <= found.difference + 1e-9
        assert found.difference - 1e-9 <= found.high <= max(ends) - 0.4 + 1e-9


def contender(name: str, *, told_nothing: bool = False) -> Contender:
    return Contender(name, SCENARIO, told_nothing)


CHOSEN = [
    contender("plan"), contender("greedy"), contender("mow", told_nothing=True), contender("fixed", told_nothing=True)
]  # fmt: skip


def judged(first: dict[int, Result], objective: str = "mean", **others: dict[int, Result]) -> Verdict | None:
    against_first = {name: {objective: compared(own, first, objective)} for name, own in others.items()}
    return verdict(CHOSEN, against_first, objective)


class TestVerdict:
    def test_worth_it_against_the_best_of_those_that_are_told_nothing(self) -> None:
        found = judged(
            missions(*[0.4] * 6), greedy=missions(*[0.3] * 6), mow=missions(*[0.41] * 6), fixed=missions(*[0.5] * 6)
        )
        assert found == Verdict(
            True,
            "mow",
            "reacting was worth it: plan leaves 0.400, 0.010 less than mow (95 %: 0.010 to 0.010), on 6 of 6 seeds",
        )

    def test_not_worth_it(self) -> None:
        first = missions(0.42, 0.43, *[0.44] * 8)
        found = judged(first, mow=missions(0.43, *[0.39] * 9), fixed=missions(*[0.6] * 10))
        assert found is not None
        assert found.worth is False
        assert found.sentence.startswith("reacting was not worth it: plan leaves 0.437, 0.043 more than mow (95 %: 0.0")
        assert found.sentence.endswith("), on 9 of 10 seeds")

    def test_it_cannot_be_told_where_the_interval_holds_0(self) -> None:
        found = judged(missions(*[0.4] * 6), mow=missions(0.38, 0.46, *[0.4] * 4))
        assert found is not None
        assert found.worth is None
        assert found.sentence == (
            "whether reacting was worth it cannot be told from these seeds: plan leaves 0.400, 0.007 less than mow "
            "(95 %: 0.030 less to 0.010 more), on 1 of 6 seeds"
        )

    def test_nor_from_a_few_seeds(self) -> None:
        found = judged(missions(0.4, 0.4), mow=missions(0.5, 0.5))
        assert found is not None
        assert found.worth is None
        assert found.sentence.endswith("than mow (fewer than 6 seeds give no interval), on 2 of 2 seeds")

    def test_of_targets_more_is_better(self) -> None:
        first = {seed: result(seed, 0.4, expected=0.7) for seed in range(1, 7)}
        few, many = ({seed: result(seed, 0.4, expected=share) for seed in range(1, 7)} for share in (0.5, 0.6))
        found = judged(first, "targets", mow=few, fixed=many)
        assert found == Verdict(
            True,
            "fixed",
            "reacting was worth it: plan is expected to find 0.700, 0.100 more than fixed (95 %: 0.100 to 0.100), "
            "on 6 of 6 seeds",
        )

    def test_without_one_that_is_told_nothing_there_is_no_verdict(self) -> None:
        assert judged(missions(0.4), greedy=missions(0.3)) is None
        assert judged(missions(0.4)) is None

    @pytest.mark.parametrize("first", [contender("none"), contender("lanes", told_nothing=True)])
    def test_nor_where_the_first_does_not_react_itself(self, first: Contender) -> None:
        against_first = {"mow": {"mean": compared(missions(0.5), missions(0.4))}}
        assert verdict([first, *CHOSEN[1:]], against_first, "mean") is None
