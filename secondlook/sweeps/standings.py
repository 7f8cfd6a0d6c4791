"""How the combinations of a sweep stand: medians and bands over the seeds, and differences from the first, paired by
seed."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from rich.table import Table

from planner.types import FloatArray
from secondlook.compare.paired import FEWEST_SEEDS, interval_of_mean
from secondlook.errors import UserError
from secondlook.scenario.explain import nearest
from secondlook.scenario.text import Value
from secondlook.sweeps.folder import MADE_WITH, read_made_with, read_rows
from secondlook.sweeps.plan import as_text

SHOWN = ("risk.mean", "risk.worst30_mean")
BAND_PERCENT = (10.0, 50.0, 90.0)


@dataclass(frozen=True)
class Sweep:
    """A sweep as far as it was flown. `table`: a row for each mission, by seed (see `secondlook.sweeps.rows`). `vary`:
    by key the values that were asked for. `missions`: how many there are to be."""

    scenario: str
    table: pa.Table
    vary: Mapping[str, Sequence[Value]]
    missions: int


def load_sweep(folder: str | os.PathLike[str]) -> Sweep:
    """The sweep in a folder as far as it was flown, also while it is. Raises UserError for what is none."""
    try:
        told = read_made_with(Path(folder))
        scenario = told.scenario["name"]
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{folder}: is not the folder of a sweep, {MADE_WITH} cannot be read") from error
    first, last = told.seeds
    missions = (last - first + 1) * math.prod(len(values) for values in told.vary.values())
    return Sweep(scenario, read_rows(Path(folder)), told.vary, missions)


@dataclass(frozen=True)
class Spread:
    """Of a figure over the seeds: the median, and from `low` to `high` the middle 80 %. `above_first`: the mean of how
    far it lies above that of the first combination with the same seed, `least` to `most` with 95 % certainty, which of
    few seeds is None; all None for the first itself. `higher`, `lower`: on how many seeds it does."""

    low: float
    median: float
    high: float
    above_first: float | None
    least: float | None
    most: float | None
    higher: int
    lower: int


@dataclass(frozen=True)
class Standing:
    """One combination. `name`: its values, keys as short as they are told apart. `figures`: by name, None where no
    mission has it."""

    name: str
    missions: int
    failed: int
    figures: Mapping[str, Spread | None]


def standings(sweep: Sweep, figures: Sequence[str] = SHOWN) -> list[Standing]:
    """Those that have flown, in the order of the values asked for. Raises UserError for a figure that is no number of
    the table, which of one without rows nobody can tell."""
    if not len(sweep.table):
        return []
    check_figures(sweep.table.schema, figures)
    names = short_names(list(sweep.vary))
    found, first = list[Standing](), dict[str, dict[int, float]]()
    for values, rows in _groups(sweep):
        failed = len(rows) - rows["failure"].null_count
        flown = rows.filter(pc.is_null(rows["failure"]))
        spreads = dict[str, Spread | None]()
        for name in figures:
            there = flown.filter(pc.is_valid(flown[name]))
            by_seed = dict(zip(there["seed"].to_pylist(), map(float, there[name].to_pylist()), strict=True))
            spreads[name] = _spread(by_seed, first.get(name)) if by_seed else None
            first.setdefault(name, by_seed)
        label = ", ".join(f"{name}={text}" for name, text in zip(names, values, strict=True)) or sweep.scenario
        found.append(Standing(label, len(rows), failed, spreads))
    return found


def _groups(sweep: Sweep) -> list[tuple[tuple[str, ...], pa.Table]]:
    """The rows of each combination, under its values as texts."""
    keys = list(sweep.vary)
    columns = [[_text(value) for value in sweep.table[key].to_pylist()] for key in keys]
    rows = dict[tuple[str, ...], list[int]]()
    for place in range(len(sweep.table)):
        rows.setdefault(tuple(column[place] for column in columns), []).append(place)
    order = [{_text(value): place for place, value in enumerate(sweep.vary[key])} for key in keys]
    ordered = sorted(rows, key=lambda one: [places.get(text, -1) for places, text in zip(order, one, strict=True)])
    return [(one, sweep.table.take(rows[one])) for one in ordered]


def check_figures(schema: pa.Schema, figures: Sequence[str]) -> None:
    """Raises UserError for a figure that is no number of a table with these columns."""
    numbers = [field.name for field in schema if _is_number(field.type)]
    for name in figures:
        if name not in numbers:
            such_as = nearest(name, numbers) or SHOWN[0]
            raise UserError(f"--figures: {name} is not allowed; must be a column of numbers, such as {such_as}")


def short_names(keys: Sequence[str]) -> list[str]:
    """Of each key as much of its end as tells it from the others."""
    names = []
    for key in keys:
        parts = key.split(".")
        others = [f".{other}" for other in keys if other != key]
        ends = (".".join(parts[-count:]) for count in range(1, len(parts) + 1))
        names.append(next((end for end in ends if not any(one.endswith(f".{end}") for one in others)), key))
    return names


def _text(value: Any) -> str:
    """The same for a value that was asked for and for its cell: 2 and 2.0, a list and its text."""
    if isinstance(value, str):
        return value
    return as_text(int(value) if isinstance(value, float) and value.is_integer() else value)


def _is_number(kind: pa.DataType) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind))


def _spread(by_seed: Mapping[int, float], first: Mapping[int, float] | None) -> Spread:
    low, median, high = np.percentile(list(by_seed.values()), BAND_PERCENT).tolist()
    both = [] if first is None else sorted(by_seed.keys() & first.keys())
    if first is None or not both:
        return Spread(low, median, high, None, None, None, 0, 0)
    above: FloatArray = np.array([by_seed[seed] - first[seed] for seed in both])
    least, most = interval_of_mean(above) if above.size >= FEWEST_SEEDS else (None, None)
    return Spread(low, median, high, float(above.mean()), least, most, int((above > 0).sum()), int((above < 0).sum()))


def table_of(sweep: Sweep, stood: Sequence[Standing], figures: Sequence[str] = SHOWN) -> Table:
    """A line for each combination."""
    flown = f"{len(sweep.table)} of {sweep.missions} missions"
    title = f"{sweep.scenario}, {flown}; the median, and from where to where 80 % of the seeds lie"
    made = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="")
    made.add_column("")
    made.add_column("missions", justify="right")
    if any(one.failed for one in stood):
        made.add_column("failed", justify="right")
    is_paired = len(stood) > 1
    for name in figures:
        made.add_column(name, justify="right", no_wrap=True)
        if is_paired:
            made.add_column("above the first's (95 %)", justify="right", no_wrap=True)
    for one in stood:
        cells = [one.name, str(one.missions)]
        if any(other.failed for other in stood):
            cells.append(str(one.failed))
        for name in figures:
            spread = one.figures[name]
            cells.append(band(spread))
            if is_paired:
                cells.append(above(spread))
        made.add_row(*cells)
    return made


def band(spread: Spread | None) -> str:
    """A median and its band in words."""
    return "" if spread is None else f"{spread.median:.4g} ({spread.low:.4g} to {spread.high:.4g})"


def above(spread: Spread | None) -> str:
    """A difference from the first combination in words."""
    if spread is None or spread.above_first is None:
        return ""
    interval = "" if spread.least is None else f" ({spread.least:+.3g}, {spread.most:+.3g})"
    return f"{spread.above_first:+.3g}{interval}"
