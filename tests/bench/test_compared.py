"""The table of comparisons, from results by hand."""

from __future__ import annotations

from typing import Any

from bench.compared import table


def told(scenario: str, low: float | None = 0.01) -> dict[str, Any]:
    """A comparison of two, of which the second leaves more on 3 of 4 seeds."""
    pair = {"difference": 0.02, "low": low, "high": None if low is None else 0.03, "better": 1, "worse": 3}
    contenders = [
        {"name": "plan", "mean_end": {"mean": 0.1234}, "worst30_mean_end": {"mean": 0.25}, "against_first": {}},
        {
            "name": "lawnmower",
            "mean_end": {"mean": 0.1434},
            "worst30_mean_end": {"mean": 0.27},
            "against_first": {"mean": pair, "worst30": pair, "both": pair},
        },
    ]
    return {"scenario": scenario, "objective": "both", "contenders": contenders}


def test_a_row_for_each_contender_of_each_comparison() -> None:
    head, _, *rows = table([told("clear"), told("turns", low=None)]).splitlines()
    assert "mean above `plan`'s (95 %)" in head
    assert rows == [
        "| `clear` | `plan` | 0.123 | 0.250 |  |  |  |",
        "| `clear` | `lawnmower` | 0.143 | 0.270 | +0.020 (+0.010, +0.030) | +0.020 (+0.010, +0.030) | 3, 1 |",
        "| `turns` | `plan` | 0.123 | 0.250 |  |  |  |",
        "| `turns` | `lawnmower` | 0.143 | 0.270 | +0.020 | +0.020 | 3, 1 |",
    ]
