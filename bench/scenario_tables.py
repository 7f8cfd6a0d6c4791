"""The tables of docs/scenarios.md: what is flown for them, and how they are written."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path

from bench.flown import Case, Document, Table, fly_overridden, some
from bench.rows import MISSION, Column, mean_table
from secondlook.sweeps.rows import flat
from secondlook.testing import Fleet

PAGE = "docs/scenarios.md"
BOTH = ("primary", "helper")
MANY = "targets.count=1000"

LEFT = (
    Column("the survey alone: mean", itemgetter("risk_primary_alone.mean")),
    Column("worst 30 %", itemgetter("risk_primary_alone.worst30_mean")),
    Column("with the helper: mean", itemgetter("risk.mean")),
    Column("worst 30 %", itemgetter("risk.worst30_mean")),
)
LEFT_FIGURES = (*MISSION, "risk_primary_alone.mean", "risk_primary_alone.worst30_mean")
HELPERS: tuple[Case, ...] = tuple(
    ("tellaro", (f"vehicles.helper.sensor.p_detect={p_detect}",)) for p_detect in (0.7, 0.485, 0.3)
)
SHOWCASES: tuple[Case, ...] = (("clear", ()), ("ripples", ()), ("turns", ()))

MISSED = (
    Column("missed", itemgetter("truth.missed_share")),
    Column("predicted by the map", itemgetter("truth.predicted_missed_share")),
)
MISSED_FIGURES = (*MISSION, "truth.missed_share", "truth.predicted_missed_share")
ALIKE: tuple[Case, ...] = (
    ("tellaro", (MANY,)),
    ("tellaro", (MANY, "targets.correlation=1", "mission.rho=1")),
    ("tellaro", (MANY, "targets.correlation=1")),
    ("tellaro", (MANY, "mission.rho=1")),
    ("tellaro", (MANY, "targets.correlation=1", "targets.aspect_deg=90", "mission.rho=1")),
    ("tellaro", (MANY, "targets.kinds=mines")),
)
ESTIMATES: tuple[Case, ...] = tuple(
    (scenario, (MANY, *(f"vehicles.{one}.sensor.estimate={told}" for one in BOTH if told)))
    for scenario, told in (
        *(("tellaro", ""), ("tellaro", "{bias: 0.2}"), ("tellaro", "{bias_after_turn: 0.5}")),
        *(("tellaro", "{drift_per_km: 0.3}"), ("tellaro", "{noise_along_m: 100}")),
        *(("patchy", ""), ("patchy", "{blind_to_seabed: true}")),
    )
)

HARBOUR_LINES = (
    ("mean residual risk", "risk_primary_alone.mean", "risk.mean"),
    ("of the worst 30 %", "risk_primary_alone.worst30_mean", "risk.worst30_mean"),
    ("of the fairway", "priorities.0.mean_primary_alone", "priorities.0.mean"),
)
ENDS, NEAREST = "time.mission_s", "separation.closest.0.closest_m"
HOME, BATTERY = (f"vehicles.inspector.{figure}" for figure in ("ended_s", "battery_left"))
HARBOUR_FIGURES = ("seed", ENDS, NEAREST, HOME, BATTERY, *(name for _, *names in HARBOUR_LINES for name in names))


def fly_harbour(folder: Path) -> Document:
    """The mission as it is."""
    summary = flat(Fleet("harbour", folder=folder).run().summary)
    return {"rows": [{"scenario": "harbour", "overrides": [], **some(summary, HARBOUR_FIGURES)}]}


def harbour_lines(document: Document) -> list[str]:
    """A line for each figure."""
    (row,) = document["rows"]
    return [
        *("| `secondlook run harbour` | the survey alone | with the helpers |", "|---|---|---|"),
        *(f"| {told} | {row[alone]:.3f} | {row[left]:.3f} |" for told, alone, left in HARBOUR_LINES),
        f"| the mission is over | | after {row[ENDS]:.0f} s |",
        f"| the two that come nearest to each other are | | {row[NEAREST]:.1f} m apart |",
        f"| `inspector` is home | | after {row[HOME]:.0f} s |",
        f"| its battery then has | | {row[BATTERY]:.0%} |",
    ]


def _means(
    flown: Sequence[Case], seeds: str, varied: Sequence[str], columns: Sequence[Column], figures: Sequence[str]
) -> Table:
    """A table of means over seeds."""
    return Table(
        page=PAGE,
        fly=lambda folder: fly_overridden(folder, flown, seeds, figures),
        lines=lambda document: mean_table(document["rows"], varied, columns, "risk.mean"),
    )


_left = partial(_means, columns=LEFT, figures=LEFT_FIGURES)
_missed = partial(_means, columns=MISSED, figures=MISSED_FIGURES)
TABLES = {
    "helpers": _left(HELPERS, "1..8", ("helper.sensor.p_detect",)),
    "second-looks": _left(SHOWCASES, "4", ("scenario",)),
    "alike": _missed(ALIKE, "1..3", ("correlation", "aspect_deg", "kinds", "rho")),
    "estimates": _missed(ESTIMATES, "1..3", ("scenario", "estimate")),
    "harbour": Table(PAGE, fly_harbour, harbour_lines),
}
