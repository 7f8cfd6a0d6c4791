"""The tables of how near contenders come to the best: by hand, of two missions."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from bench.clairvoyant import Row
from bench.near_best import both_lines, kept_of, left_lines, told_lines


def row(seed: int, removed_m2: dict[str, float | None], worst30: dict[str, float | None], objective: str) -> Row:
    """100 m2, of which the survey leaves a risk of 0.8, and the schedule 0.4."""
    return Row(
        seed=seed, area_m2=100.0, there_m2=80.0, bound_m2=50.0, found_m2=40.0, started_m2=30.0, legs=3,
        removed_m2=removed_m2, measured_m2=removed_m2, worst30={"survey": 1.0, "schedule": 0.5, **worst30},
        steps=100, objective=objective,
    )  # fmt: skip


def test_the_risk_that_each_leaves_and_its_share_of_what_the_best_removes() -> None:
    rivals = ("plan", "lawnmower", "across", "beforehand")
    rows = [
        row(seed, dict(zip(rivals, removed_m2, strict=True)), dict.fromkeys(rivals, 0.6), "mean")
        for seed, removed_m2 in ((1, (40.0, 30.0, 20.0, 10.0)), (2, (30.0, 30.0, 20.0, 10.0)))
    ]
    assert left_lines({"bay": rows}) == [
        "| scenario | survey alone | bound | best | `plan` | `lawnmower` | `across` | `beforehand` |",
        "|---|---|---|---|---|---|---|---|",
        "| `bay` | 0.800 | 0.300 | 0.400 | 0.450 | 0.500 | 0.600 | 0.700 |",
        "| of the best |  |  |  | 0.875, 0.750 | 0.750, 0.750 | 0.500, 0.500 | 0.250, 0.250 |",
    ]


def test_mean_and_worst_that_each_leaves() -> None:
    rivals = ("plan", "across", "greedy", "cbba")
    worst30: dict[str, float | None] = dict(zip(rivals, (0.5, 0.6, 0.7, 0.8), strict=True))
    failed = row(2, {"plan": 20.0, "across": None, "greedy": 40.0, "cbba": 40.0}, worst30 | {"across": None}, "both")
    rows = [row(1, dict.fromkeys(rivals, 40.0), worst30, "both"), failed]
    assert both_lines({"bay": rows})[2:] == [
        "| `bay` | 0.400, 0.500 | 0.500, 0.500 | 0.400, 0.600 | 0.400, 0.700 | 0.400, 0.800 |"
    ]


def test_what_is_gained_by_the_objective_told_and_not_told() -> None:
    # The schedule gains 0.7 * 0.4 + 0.3 * 0.5 = 0.43; who removes 20 m2 and leaves 0.9: 0.7 * 0.2 + 0.3 * 0.1 = 0.17.
    one = row(1, {"plan": 20.0, "told": 40.0}, {"plan": 0.9, "told": 0.5}, "both")
    assert told_lines({"bay": [one]})[2:] == ["| `bay` | 0.395, 0.395 | 1.000, 1.000 |"]


def test_what_is_kept_makes_the_same_rows_the_first_seed_first() -> None:
    rows = [row(seed, {"plan": 100 / 3}, {"plan": 0.9}, "both") for seed in (2, 1)]
    told: dict[str, Any] = {"seeds": [asdict(one) | {"best_by": "plan", "left": one.left} for one in rows]}
    kept = [Row(**one) for one in kept_of(told)]
    assert [one.seed for one in kept] == [1, 2]
    assert kept[0].removed_m2 == {"plan": 33.333333}
    assert kept[0].left["survey"] == 0.8
