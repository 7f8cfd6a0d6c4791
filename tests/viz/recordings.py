"""Reads recordings back, without the viewer."""

from __future__ import annotations

import subprocess
import warnings
from collections import defaultdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import rerun_cli  # type: ignore[import-untyped]
from rerun.chunk import RrdReader


def rows(recording: Path, entity: str, component: str) -> list[tuple[int, Any]]:
    """(milliseconds, value) of each row that changes over time, in the order of time; of one time as written."""
    found: list[tuple[int, int, Any]] = []
    for chunk, batch in _of(recording, entity):
        if chunk.is_static or component not in batch.schema.names:
            continue
        times = batch.column("sim_time").cast("int64").to_pylist()
        row_ids = batch.column("rerun.controls.RowId").to_pylist()
        values = batch.column(component).to_pylist()
        found += zip((time // 1_000_000 for time in times), row_ids, values, strict=True)
    return [(time_ms, value) for time_ms, _, value in sorted(found, key=lambda row: row[:2]) if value is not None]


def static(recording: Path, entity: str, component: str) -> Any:
    """The value that holds at all times."""
    for chunk, batch in _of(recording, entity):
        if chunk.is_static and component in batch.schema.names:
            return batch.column(component).to_pylist()[-1]
    raise KeyError(f"{entity} has no static {component}")


def entities(recording: Path) -> set[str]:
    """All entity paths but the recording's properties."""
    return {path for path in _read_again_if_changed(recording) if not path.startswith("/__properties")}


def timelines(recording: Path) -> set[str]:
    """The names of all index columns."""
    chunks = [chunk for its in _read_again_if_changed(recording).values() for chunk, _ in its]
    return {name for chunk in chunks for name in chunk.timeline_names}


def rows_so_far(recording: Path, entities: str = "/**") -> int:
    """How many rows of some entities a recording has that is still being written; 0 as long as it cannot be read."""
    try:
        with warnings.catch_warnings():  # it has no end yet, which the reader mentions
            warnings.simplefilter("ignore")
            return sum(chunk.num_rows for chunk in RrdReader(recording).stream().filter(content=entities))
    except (OSError, RuntimeError, ValueError):  # not there, empty, or just in the middle of an entry
        return 0


def verify(recording: Path) -> subprocess.CompletedProcess[str]:
    """What the viewer's own command says of the file."""
    command = [str(Path(rerun_cli.__file__).with_name("rerun")), "rrd", "verify", str(recording)]
    # CI keeps the command from sending usage statistics.
    environment = {"CI": "1", "HOME": str(recording.parent), "PATH": ""}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def _of(recording: Path, entity: str) -> list[tuple[Any, Any]]:
    """Chunks and record batches of one entity path."""
    return _read_again_if_changed(recording).get(entity, [])


def _read_again_if_changed(recording: Path) -> dict[str, list[tuple[Any, Any]]]:
    stat = recording.stat()
    return _read(recording, (stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=2)
def _read(recording: Path, version: tuple[int, int]) -> dict[str, list[tuple[Any, Any]]]:
    """All chunks with their record batches, by entity path."""
    found = defaultdict(list)
    for chunk in RrdReader(recording).stream():
        found[str(chunk.entity_path)].append((chunk, chunk.to_record_batch()))
    return dict(found)
