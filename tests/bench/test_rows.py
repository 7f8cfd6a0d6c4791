"""Tables of means over missions, from rows by hand."""

from __future__ import annotations

from operator import itemgetter
from typing import Any

from bench.rows import Column, mean_table


def row(mean: float | None, *overrides: str, failure: str | None = None) -> dict[str, Any]:
    return {"scenario": "toy", "overrides": list(overrides), "seed": 1, "failure": failure, "risk.mean": mean}


def test_a_line_for_each_combination_has_the_means_of_those_that_flew() -> None:
    rows = [
        row(0.25, "mission.rho=1"),
        row(0.75, "mission.rho=1"),
        row(0.125),
        row(0.9, failure="node died"),
        row(None),
    ]
    columns = [Column("left", itemgetter("risk.mean")), Column("seen", lambda one: 1 - one["risk.mean"], 1)]
    assert mean_table(rows, ["scenario", "mission.rho"], columns, "risk.mean") == [
        "| `scenario` | `mission.rho` | missions | left | seen |",
        "|---|---|---|---|---|",
        "| `toy` | `1` | 2 | 0.500 | 0.5 |",
        "| `toy` | `-` | 1 | 0.125 | 0.9 |",
    ]


def test_the_end_of_a_key_stands_for_the_key_of_every_vehicle() -> None:
    told = [f"vehicles.{one}.sensor.estimate={{bias: 0.2}}" for one in ("primary", "helper")]
    (*_, line) = mean_table([row(0.5, "vehicles.helper.sensor.no_estimate=1", *told)], ["sensor.estimate"], [], "seed")
    assert line == "| `{bias: 0.2}` | 1 |"
