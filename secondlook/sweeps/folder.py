"""The folder of a sweep: its rows as Parquet, readable at any time, and what they were flown with.

Rows are written a file at a time into `rows`, each whole or not at all, and joined into `missions.parquet` when all
missions are there. A file holds at most what came in FILE_EVERY_S, so that no more is flown again, whatever ends the
process that writes.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from secondlook.engine.code_here import code_here, code_of, differing
from secondlook.errors import UserError
from secondlook.files import CannotWriteError, own_folder, whole_file, write_whole
from secondlook.scenario.errors import dotted
from secondlook.scenario.plug_ins import modules_in
from secondlook.sweeps.plan import Combination, SweepPlan
from secondlook.sweeps.rows import TEXT, WHOLE, Row, as_cell, schema_of

MADE_WITH, PLAN, ROWS, MISSIONS = "made_with.json", "sweep.yaml", "rows", "missions.parquet"
BROKEN_OFF = ".*.part"  # what was left by a process that was killed while it wrote
FIRST_FILE_S, FILE_EVERY_S = 0.5, 10.0  # of the wall clock; twice as long after each file until then
MOST_IN_FILE = 5000


class MadeWith(BaseModel):
    """What must be the same for rows to be of one sweep, and which seeds and values there are: the first seed and the
    last, and by key the values that were asked for. `scenario`: with the first values; `missions`: by the hash of each
    combination its values; empty in a folder of an earlier version."""

    model_config = ConfigDict(strict=True)

    version: str
    code: dict[str, str]
    scenario: dict[str, Any]
    vary: dict[str, list[Any]]
    missions: dict[str, str] = Field(default_factory=dict)
    seeds: tuple[int, int]


def read_made_with(folder: Path) -> MadeWith:
    """What the sweep in a folder was made with. Raises OSError, and ValueError, in words, for what no sweep wrote."""
    try:
        return MadeWith.model_validate_json((folder / MADE_WITH).read_bytes())
    except ValidationError as error:
        key = dotted(error.errors()[0]["loc"])
        raise ValueError(f"{key or 'all of it'} must be as the sweep wrote it") from error


@contextmanager
def sweep_folder(folder: Path, plan: SweepPlan) -> Iterator[SweepFolder]:
    """The folder for a sweep, new, or one of the same sweep that is to go on; nobody else writes to it meanwhile.

    The same is one of the same scenario, settings, code and varied keys; seeds and values may have been fewer. Raises
    UserError for a folder that holds anything else.
    """
    schema, made_with = schema_of(plan), json.dumps(_made_with(plan), indent=2)
    with own_folder(folder):
        for left in (*folder.glob(BROKEN_OFF), *(folder / ROWS).glob(BROKEN_OFF)):
            left.unlink()
        if any(folder.iterdir()):
            _check_same(folder, plan, MadeWith.model_validate_json(made_with))
        opened = SweepFolder(folder, schema)
        opened.tidy()
        write_whole(folder / MADE_WITH, made_with + "\n")
        write_whole(folder / PLAN, plan.to_yaml(folder))
        yield opened


def _made_with(plan: SweepPlan) -> dict[str, Any]:
    """As the file holds it."""
    # What is varied, too: in a scenario a curve is what its maker has made.
    texts = [
        json.dumps(dict(plan.vary), ensure_ascii=False),
        *(one.scenario.model_dump_json() for one in plan.combinations),
    ]
    modules = set[str]().union(*map(modules_in, texts))
    return {
        "version": version("secondlook"),
        "code": {**code_of(modules), **code_here()},
        "scenario": _as_told(plan.combinations[0]),
        "vary": {key: list(values) for key, values in plan.vary.items()},
        "missions": {one.hash: " ".join(one.settings) for one in plan.combinations},
        "seeds": [plan.seeds[0], plan.seeds[-1]],
    }


def _as_told(combination: Combination) -> dict[str, Any]:
    return {**combination.scenario.model_dump(mode="json", exclude_none=True), "seed": 0}


def _check_same(folder: Path, plan: SweepPlan, now: MadeWith) -> None:
    try:
        before = read_made_with(folder)
    except FileNotFoundError:
        raise UserError(
            f"--out {folder}: holds other files; must be a new or empty folder, or that of a sweep"
        ) from None
    except (OSError, ValueError) as error:
        raise UserError(f"--out {folder}: {MADE_WITH} cannot be read: {error}") from error
    both = before.code.keys() & now.code.keys()  # new values may be of modules that are new
    if code := [name for name in differing(before.code, now.code) if name in both]:
        told = f"other code: {', '.join(code)} {'has' if len(code) == 1 else 'have'} changed"
    elif before.vary.keys() != now.vary.keys():
        told = f"{', '.join(before.vary) or 'nothing'} varied"
    elif gone := [
        f"{key}={json.dumps(value)}"
        for key, values in before.vary.items()
        for value in values
        if value not in now.vary[key]
    ]:
        told = f"{gone[0]}, too"
    elif not (now.seeds[0] <= before.seeds[0] and before.seeds[1] <= now.seeds[1]):
        told = f"seeds {before.seeds[0]} to {before.seeds[1]}"
    elif other := _other_scenario(before, plan):
        told = f"another scenario: {other}"
    elif changed := [values for mission, values in before.missions.items() if mission not in now.missions]:
        told = f"another scenario: a file that {changed[0]} names has changed"
    else:
        return
    raise UserError(f"--out {folder}: was flown with {told}; must be a new folder, or asked for as before")


def _other_scenario(before: MadeWith, plan: SweepPlan) -> str:
    """Where the scenario with the first values of before differs from what it was, see `_other`."""
    first = {key: values[0] for key, values in before.vary.items()}
    now = next(one for one in plan.combinations if {**one.values} == first)
    return _other(before.scenario, json.loads(json.dumps(_as_told(now))), {tuple(key.split(".")) for key in plan.vary})


def _other(before: Any, now: Any, but: set[tuple[str, ...]], path: tuple[str, ...] = ()) -> str:
    """The first key at which two scenarios differ, and how, apart from what is varied; "" if none does."""
    if path in but or before == now:
        return ""
    if isinstance(before, dict) and isinstance(now, dict):
        return next(
            (
                other
                for key in sorted(before.keys() | now.keys())
                if (other := _other(before.get(key), now.get(key), but, (*path, key)))
            ),
            "",
        )
    return f"{'.'.join(path)} was {json.dumps(before)} and is {json.dumps(now)}"


class SweepFolder:
    """`schema`: of its rows."""

    def __init__(self, folder: Path, schema: pa.Schema) -> None:
        self.path = folder
        self.schema = schema
        self._rows: list[Row] = []
        self._began_s = time.monotonic()
        self._every_s = FIRST_FILE_S
        self._next = 1 + max((int(one.stem) for one in self._files()), default=0)

    def done(self) -> set[str]:
        """The keys of the missions that are there."""
        files = [*filter(Path.exists, [self.path / MISSIONS]), *self._files()]
        return {key for file in files for key in _read(file, ["key"])["key"].to_pylist()}

    def add(self, row: Row) -> None:
        """Takes a row; it is written within some seconds. Raises CannotWriteError."""
        if not self._rows:
            self._began_s = time.monotonic()
        self._rows.append(row)
        if len(self._rows) >= MOST_IN_FILE or time.monotonic() - self._began_s >= self._every_s:
            self.write()
            self._every_s = min(2 * self._every_s, FILE_EVERY_S)

    def write(self) -> None:
        """Writes what was added since the last time. Raises CannotWriteError."""
        if self._rows:
            rows, self._rows = self._rows, []
            folder = self.path / ROWS
            try:
                folder.mkdir(exist_ok=True)
            except OSError as error:
                raise CannotWriteError(folder, error) from error
            _write(folder / f"{self._next:06}.parquet", pa.Table.from_pylist(rows, self.schema))
            self._next += 1

    def join(self) -> None:
        """Writes all rows into one file, sorted by seed and as the plan has them. Raises CannotWriteError."""
        self.write()
        if self._files():
            _write(self.path / MISSIONS, read_rows(self.path, self.schema))
            self.tidy()

    def tidy(self) -> None:
        """Takes away what was joined already, in case that was broken off in between."""
        if (self.path / MISSIONS).exists():
            joined = _read(self.path / MISSIONS, ["key"])["key"]
            for file in self._files():
                if pc.all(pc.is_in(_read(file, ["key"])["key"], joined)).as_py():
                    file.unlink()
            if (self.path / ROWS).exists() and not self._files():
                (self.path / ROWS).rmdir()

    def _files(self) -> list[Path]:
        return sorted((self.path / ROWS).glob("*.parquet"))


def read_rows(folder: Path, schema: pa.Schema | None = None) -> pa.Table:
    """All rows that are there, joined or not, by seed and as the plan has them; with the columns of a schema, or of the
    newest file."""
    tables = [_read(file) for file in sorted((folder / ROWS).glob("*.parquet"))]
    if (folder / MISSIONS).exists():
        joined = _read(folder / MISSIONS)
        tables = [joined, *(one.filter(pc.invert(pc.is_in(one["key"], joined["key"]))) for one in tables)]
    if schema is None:
        schema = tables[-1].schema if tables else pa.schema({"key": TEXT, "seed": WHOLE})
    vary = read_made_with(folder).vary if tables else {}
    alike = [schema.empty_table(), *(_alike(one, schema, vary) for one in tables)]
    table = pa.concat_tables(alike, promote_options="default").select(schema.names)
    places = _places(table, vary)
    return table.take(pc.sort_indices(places, [(name, "ascending") for name in places.column_names]))


def _alike(table: pa.Table, schema: pa.Schema, vary: Mapping[str, Sequence[Any]]) -> pa.Table:
    """A table with columns of the schema's kinds: where there were numbers alone, or nothing, there may be texts as
    well now."""
    for place, name in enumerate(table.column_names):
        kind = schema.field(name).type if name in schema.names else None
        if kind not in (None, table.schema.field(name).type):
            cells = table[name].to_pylist()
            if kind == TEXT:  # of numbers, as the plan has them: 1 lies as 1.0 in a column that has 1.5, too
                numbers = [one for one in vary.get(name, ()) if isinstance(one, int | float)]
                texts = {(type(one) is bool, one): as_cell(one) for one in numbers}
                cells = [None if one is None else texts[type(one) is bool, one] for one in cells]
            table = table.set_column(place, name, pa.array(cells, kind))
    return table


def _places(table: pa.Table, vary: Mapping[str, Sequence[Any]]) -> pa.Table:
    """Of each row its seed, and the place of each of its values among those that the plan has."""
    places = {"seed": table["seed"]}
    for key, values in vary.items():
        if key in table.column_names:  # of a table without rows nothing is known
            kind = table.schema.field(key).type
            cells = [as_cell(value) if kind == TEXT and value is not None else value for value in values]
            places[key] = pc.index_in(table[key], value_set=pa.array(cells, kind))
    return pa.table(places)


def _read(file: Path, columns: list[str] | None = None) -> pa.Table:
    try:
        return pq.read_table(file, columns=columns)
    except (OSError, pa.ArrowException) as error:
        raise UserError(f"{file}: cannot be read: {error}; what it held is flown again without it") from error


def _write(path: Path, table: pa.Table) -> None:
    with whole_file(path) as file:
        try:
            pq.write_table(table, file, compression="zstd")
        except OSError as error:  # Arrow's own have no sentence of the system's
            raise CannotWriteError(path, error) from error
