"""Reads recordings back, without the viewer."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import rerun_cli  # type: ignore[import-untyped]
from rerun.chunk import RrdReader


def rows(recording: Path, entity: str, component: str) -> list[tuple[int, Any]]:
    """(milliseconds, value) of each row that changes over time, in the order of time; of one time as written."""
    found: list[tuple[int, int, Any]] = []
    for chunk in RrdReader(recording).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        if chunk.is_static or component not in batch.schema.names:
            continue
        times = batch.column("sim_time").cast("int64").to_pylist()
        row_ids = batch.column("rerun.controls.RowId").to_pylist()
        values = batch.column(component).to_pylist()
        found += zip((time // 1_000_000 for time in times), row_ids, values, strict=True)
    return [(time_ms, value) for time_ms, _, value in sorted(found, key=lambda row: row[:2]) if value is not None]


def static(recording: Path, entity: str, component: str) -> Any:
    """The value that holds at all times."""
    for chunk in RrdReader(recording).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        if chunk.is_static and component in batch.schema.names:
            return batch.column(component).to_pylist()[-1]
    raise KeyError(f"{entity} has no static {component}")


def entities(recording: Path) -> set[str]:
    """All entity paths but the recording's properties."""
    paths = {str(chunk.entity_path) for chunk in RrdReader(recording).stream()}
    return {path for path in paths if not path.startswith("/__properties")}


def timelines(recording: Path) -> set[str]:
    """The names of all index columns."""
    return {name for chunk in RrdReader(recording).stream() for name in chunk.timeline_names}


def verify(recording: Path) -> subprocess.CompletedProcess[str]:
    """What the viewer's own command says of the file."""
    command = [str(Path(rerun_cli.__file__).with_name("rerun")), "rrd", "verify", str(recording)]
    # CI keeps the command from sending usage statistics.
    environment = {"CI": "1", "HOME": str(recording.parent), "PATH": ""}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
