"""What is lost where helpers are not where they believe they are, from rows by hand."""

from __future__ import annotations

from typing import Any

from bench.position_errors import table


def row(seed: int, true: float, alone: float, *overrides: str) -> dict[str, Any]:
    told = {"scenario": "toy", "overrides": list(overrides), "seed": seed, "failure": None}
    return told | {"risk.mean": 0.3, "true.mean": true, "true_alone.mean": alone}


def test_what_is_lost_is_of_the_gain_without_an_error_seed_by_seed() -> None:
    error = "vehicles.helper.position_error_m=5"
    rows = [row(0, 0.3, 0.5), row(1, 0.3, 0.7), row(0, 0.35, 0.5, error), row(1, 0.3, 0.7, error)]
    _, _, exact, wrong = table(rows)
    assert exact == "| `-` | `-` | 0.300 | 0.300 | 0.300 |  |  |"
    assert wrong == "| `5` | `-` | 0.300 | 0.325 | 0.275 | 8.3% | 0.0% to 25.0% |"
