"""Rows of missions as lines of Markdown: grouped by what was flown otherwise, and the means of their figures."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean
from typing import Any, NamedTuple

Row = dict[str, Any]
MISSION = ("seed", "failure", "risk.mean", "risk.worst30_mean")
"""What a mission is known again by."""


class Column(NamedTuple):
    """A column of means: of what of a mission, and with how many digits."""

    title: str
    of: Callable[[Row], float]
    digits: int = 3


def by(rows: Iterable[Row], varied: Sequence[str], figure: str) -> dict[tuple[str, ...], list[Row]]:
    """The missions that have a figure, by what was varied in them; those that failed are left out."""
    found = defaultdict[tuple[str, ...], list[Row]](list)
    for row in rows:
        if row["failure"] is None and row[figure] is not None:
            found[values_of(row, varied)].append(row)
    return found


def values_of(row: Row, varied: Sequence[str]) -> tuple[str, ...]:
    """What a mission was flown with, as lines tell it."""
    return tuple(_cell(row, key) for key in varied)


def _cell(row: Row, key: str) -> str:
    """What a mission was flown with: under a key, or of its `overrides` that of the key, or of the end of one."""
    value = row.get(key)
    if value is None and key not in row:
        parts = (one.partition("=") for one in row.get("overrides", ()))
        told = [told for path, _, told in parts if f".{path}".endswith(f".{key}")]
        value = told[0] if told else None
    if isinstance(value, list):
        value = "` `".join(value)
    return "-" if value in (None, "") else str(value)


def head(varied: Sequence[str], titles: Sequence[str]) -> list[str]:
    """The first two lines of a table: what was varied, then its figures."""
    cells = [*(f"`{key}`" for key in varied), *titles]
    return [f"| {' | '.join(cells)} |", f"|{'---|' * len(cells)}"]


def line(values: Sequence[str], figures: Sequence[str]) -> str:
    """A line of it."""
    return f"| {' | '.join([*(f'`{one}`' for one in values), *figures])} |"


def mean_table(rows: Iterable[Row], varied: Sequence[str], columns: Sequence[Column], figure: str) -> list[str]:
    """The lines of a table with a line for each combination of what was varied: how many missions have the figure,
    and the mean of each column over them."""
    lines = head(varied, ["missions", *(column.title for column in columns)])
    for values, missions in by(rows, varied, figure).items():
        means = [f"{fmean(map(column.of, missions)):.{column.digits}f}" for column in columns]
        lines.append(line(values, [str(len(missions)), *means]))
    return lines
