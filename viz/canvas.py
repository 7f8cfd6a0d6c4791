"""The recording as something to draw on: single entries at a simulated time, and long columns sent in pieces."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from planner.types import FloatArray
from viz.live_feed import LiveFeed, new_stream
from viz.paths import TIMELINE

Build = Callable[[FloatArray], Iterable[rr.ComponentColumn]]

TOGETHER_S = 1.0  # of the wall clock; each piece of the file costs some 2 kB, so an entity's rows go together


class Column:
    """Rows of numbers of one entity, held until the canvas sends them: a call a row would cost far more."""

    def __init__(self, path: str, build: Build) -> None:
        self.path = path
        self._build = build
        self._times_ms: list[int] = []
        self._rows: list[tuple[float, ...]] = []

    def add(self, time_ms: int, *numbers: float) -> None:
        """Holds one row."""
        self._times_ms.append(time_ms)
        self._rows.append(numbers)

    def send(self, streams: Iterable[rr.RecordingStream]) -> None:
        """Sends what is held."""
        if self._times_ms:
            times = np.array(self._times_ms, dtype="timedelta64[ms]")
            rows = np.array(self._rows, dtype=np.float64)
            for stream in streams:
                stream.send_columns(self.path, [rr.TimeColumn(TIMELINE, duration=times)], self._build(rows))
            self._times_ms, self._rows = [], []


class Canvas:
    """One recording, written to a file, and shown live where there is a `live_pipe` (see LiveFeed).

    Its only timeline is the simulated time.

    `piece_ms`: how much simulated time the columns hold back at most; so much is lost if the process is killed.
    """

    def __init__(self, path: Path, recording_id: str, piece_ms: int, live_pipe: Path | None) -> None:
        self._file = new_stream(recording_id, rr.ChunkBatcherConfig(flush_tick=TOGETHER_S))
        self._file.save(path)
        self._live = LiveFeed(live_pipe, recording_id) if live_pipe else None
        # Two streams of one id: in one stream, a viewer that stalls would hold up the file too.
        self._streams = (self._file, self._live.stream) if self._live else (self._file,)
        # A name from the start: without any entry the file would not get the footer that completes it.
        for stream in self._streams:
            stream.send_recording_name(recording_id)
        self._piece_ms = piece_ms
        self._piece_from_ms = 0
        self._columns: list[Column] = []

    def present(self, name: str, blueprint: rrb.Blueprint, mission: rr.AnyValues) -> None:
        """Says what the recording is called, how it is laid out and what mission it is of."""
        for stream in self._streams:
            stream.send_recording_name(name)
            stream.send_property("mission", mission)
            stream.send_blueprint(blueprint)

    def put(self, time_ms: int, path: str, *parts: rr.AsComponents) -> None:
        """Logs one entry at a simulated time."""
        for stream in self._streams:
            stream.set_time(TIMELINE, duration=np.timedelta64(time_ms, "ms"))
            stream.log(path, parts[0], *parts[1:])

    def put_static(self, path: str, *parts: rr.AsComponents) -> None:
        """Logs what holds at all times."""
        for stream in self._streams:
            stream.log(path, parts[0], *parts[1:], static=True)

    def column(self, path: str, build: Build) -> Column:
        """A column that is sent in pieces; `build` makes its components from an array of shape (rows, numbers)."""
        column = Column(path, build)
        self._columns.append(column)
        return column

    def advance(self, time_ms: int) -> None:
        """Sends the columns if they hold a whole piece."""
        if abs(time_ms - self._piece_from_ms) >= self._piece_ms:
            self._piece_from_ms = time_ms
            self._send()

    def close(self) -> None:
        """Sends what is held and completes the file."""
        self._send()
        self._file.flush()
        self._file.disconnect()
        if self._live is not None:
            self._live.close()

    def _send(self) -> None:
        for column in self._columns:
            column.send(self._streams)
