"""How near contenders come to the best schedule of second looks: what `bench.clairvoyant` is asked for each of the
three tables of docs/comparing.md, and how they are written."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

from bench.clairvoyant import TOLD, Row, summary
from bench.flown import ROOT, Case, Document, Table, all_rounded, fly_overridden
from bench.rows import MISSION, head, line

PAGE = "docs/comparing.md"
SCENARIOS = ("tellaro", "two-helpers", "patchy", "clear")
RIVALS = ("plan", "lawnmower", "across", "beforehand")
BY_BOTH = ("plan", "across", "greedy", "cbba")

Rows = dict[str, list[Row]]
"""What was found, by scenario, a row for each seed."""


def _fly(folder: Path, asked: Sequence[str], again: Case) -> Document:
    """Asks that of each scenario; `again`: a mission of those flown for it, which a test flies again."""
    found = {}
    for scenario in SCENARIOS:
        command = [sys.executable, "-m", "bench.clairvoyant", scenario, *asked, "--first-seed", "1001", "--json"]
        told = subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.PIPE, text=True).stdout
        found[scenario] = kept_of(json.loads(told))
    return {**fly_overridden(folder, [again], "1001", MISSION), "scenarios": found}


def kept_of(told: Document) -> list[Document]:
    """What is kept of what the clairvoyant prints for programs: its rows, rounded, the first seed first."""
    rows = [{name: row[name] for name in Row.__dataclass_fields__} for row in told["seeds"]]
    return sorted(all_rounded(rows), key=lambda row: int(row["seed"]))


def left_lines(found: Rows) -> list[str]:
    """Two lines for each scenario: the mean residual risk left, and the share of what the best removes."""
    columns = ("survey", "bound", "best", *RIVALS)
    lines = head((), ["scenario", "survey alone", "bound", "best", *(f"`{name}`" for name in RIVALS)])
    for scenario, rows in found.items():
        lines.append(line((scenario,), [f"{_mean(row.left[name] for row in rows):.3f}" for name in columns]))
        lines.append(line((), ["of the best", "", "", "", *_shares(rows, RIVALS)]))
    return lines


def both_lines(found: Rows) -> list[str]:
    """A line for each scenario: mean and worst 30 % that each leaves."""
    lines = head((), ["scenario", "the schedule", *(f"`{name}`" for name in BY_BOTH)])
    for scenario, rows in found.items():
        told = []
        for name in ("schedule", *BY_BOTH):
            mean, worst30 = _mean(row.left[name] for row in rows), _mean(row.worst30[name] for row in rows)
            told.append(f"{mean:.3f}, {worst30:.3f}")
        lines.append(line((scenario,), told))
    return lines


def told_lines(found: Rows) -> list[str]:
    """A line for each scenario: the share of what the best gains, not told and told."""
    lines = head((), ["scenario", "`plan`", "`plan`, told"])
    return [*lines, *(line((scenario,), _shares(rows, ("plan", TOLD))) for scenario, rows in found.items())]


def _shares(rows: list[Row], names: Sequence[str]) -> list[str]:
    """Of what the best gains by the objective that each does, mean and least over the seeds."""
    ratios = summary(rows)
    return [f"{ratios[name]['to_best']['mean']:.3f}, {ratios[name]['to_best']['least']:.3f}" for name in names]


def _mean(values: Iterable[float | None]) -> float:
    return fmean(value for value in values if value is not None)


def _table(asked: str, again: Case, lines: Callable[[Rows], list[str]]) -> Table:
    def lines_of(document: Document) -> list[str]:
        kept: dict[str, list[dict[str, Any]]] = document["scenarios"]
        return lines({scenario: [Row(**row) for row in rows] for scenario, rows in kept.items()})

    return Table(PAGE, partial(_fly, asked=asked.split(), again=again), lines_of)


TABLES = {
    "near-best": _table(
        f"--allocators {','.join(RIVALS)} --seeds 3 --steps 500000",
        ("tellaro", ("coordinator.strips=lanes_across",)),
        left_lines,
    ),
    "near-best-both": _table(
        f"--allocators {','.join(BY_BOTH)} --seeds 4 --objective both",
        ("two-helpers", ("coordinator.allocator=greedy",)),
        both_lines,
    ),
    "near-best-told": _table(
        "--allocators plan --seeds 3 --objective both --told",
        ("clear", ()),
        told_lines,
    ),
}
