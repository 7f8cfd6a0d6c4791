"""The recording as something to draw on: single entries at a simulated time, long columns sent in pieces, and when to
draw what changes often."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from viz.live_feed import LiveFeed, new_stream, send_blueprint
from viz.paths import TIMELINE
from viz.recording_file import RecordingFile


class Pace:
    """Notes changes, and tells when they are to be drawn: at most once per `every_ms` of simulated time."""

    def __init__(self, every_ms: int) -> None:
        self._every_ms = every_ms
        self._changed_ms = 0
        self._is_drawn = True
        self._due_ms = 0

    def note(self, time_ms: int) -> None:
        """There is a change of this time to be drawn."""
        self._changed_ms = max(self._changed_ms, time_ms)
        self._is_drawn = False

    def due(self, time_ms: int) -> int | None:
        """The time of the latest change of all if what was noted is to be drawn now, else None.

        A change that comes late is so drawn over those after it, which it has to be if it is to show.
        """
        if self._is_drawn or time_ms <= self._changed_ms or time_ms < self._due_ms:
            return None
        self._due_ms = time_ms + self._every_ms
        return self.rest()

    def rest(self) -> int | None:
        """The same for what is not drawn yet, however soon it is."""
        if self._is_drawn:
            return None
        self._is_drawn = True
        return self._changed_ms


Build = Callable[[Sequence[Any]], Iterable[rr.ComponentColumn]]

TOGETHER_S = 0.8  # of the wall clock; each piece of the file costs some 2 kB, so an entity's rows go together
LIVE_EVERY_S = 0.25  # of the wall clock; how long a live view waits for columns


class Column:
    """Rows of one entity, held until they are sent: a call a row would cost far more."""

    def __init__(self, path: str, build: Build, sheets: Iterable[_Sheet]) -> None:
        self._path = path
        self._build = build
        self._held: dict[_Sheet, tuple[list[int], list[Any]]] = {sheet: ([], []) for sheet in sheets}

    def add(self, time_ms: int, row: Any) -> None:
        """Holds one row."""
        for times_ms, rows in self._held.values():
            times_ms.append(time_ms)
            rows.append(row)

    def send(self, sheet: _Sheet) -> None:
        """Sends what is held for it."""
        times_ms, rows = self._held[sheet]
        if times_ms:
            times = np.array(times_ms, dtype="timedelta64[ms]")
            sheet.stream.send_columns(self._path, [rr.TimeColumn(TIMELINE, duration=times)], self._build(rows))
            self._held[sheet] = ([], [])


class _Sheet:
    """One stream of the recording, and when columns are sent to it: once so much of the wall clock has passed since
    they were last."""

    def __init__(self, stream: rr.RecordingStream, every_s: float) -> None:
        self.stream = stream
        self._every_s = every_s
        self._sent_s = time.monotonic()
        self._drawn_ms: int | None = None

    def put(self, time_ms: int, path: str, *parts: rr.AsComponents) -> None:
        if time_ms != self._drawn_ms:
            self._drawn_ms = time_ms
            self.stream.set_time(TIMELINE, duration=time_ms / 1000)
        self.stream.log(path, parts[0], *parts[1:])

    def is_due(self) -> bool:
        if time.monotonic() - self._sent_s < self._every_s:
            return False
        self._sent_s = time.monotonic()
        return True


class Canvas:
    """One recording, written to a file, and shown live where there is a `live_pipe` (see LiveFeed).

    Its only timeline is the simulated time. It is drawn on by one thread.

    What is drawn within TOGETHER_S of the wall clock is held back for the file; so much is lost if the process is
    killed. Raises FileError where the file cannot be written.
    """

    def __init__(self, path: Path, recording_id: str, live_pipe: Path | None) -> None:
        file = new_stream(recording_id, rr.ChunkBatcherConfig(flush_tick=TOGETHER_S))
        self._file = RecordingFile(path, file)
        self._live = LiveFeed(live_pipe, recording_id) if live_pipe else None
        # Two streams of one id: in one stream, a viewer that stalls would hold up the file too.
        self._sheets = [_Sheet(file, TOGETHER_S)]
        if self._live is not None:
            self._sheets.append(_Sheet(self._live.stream, LIVE_EVERY_S))
        # A name from the start: without any entry the file would not get the footer that completes it.
        for sheet in self._sheets:
            sheet.stream.send_recording_name(recording_id)
        self._columns: dict[str, Column] = {}

    def present(self, name: str, blueprint: rrb.Blueprint, mission: rr.AnyValues) -> None:
        """Says what the recording is called, how it is laid out and what mission it is of."""
        for sheet in self._sheets:
            sheet.stream.send_recording_name(name)
            sheet.stream.send_property("mission", mission)
            send_blueprint(sheet.stream, blueprint)

    def put(self, time_ms: int, path: str, *parts: rr.AsComponents) -> None:
        """Logs one entry at a simulated time."""
        for sheet in self._sheets:
            sheet.put(time_ms, path, *parts)

    def put_static(self, path: str, *parts: rr.AsComponents) -> None:
        """Logs what holds at all times."""
        for sheet in self._sheets:
            sheet.stream.log(path, parts[0], *parts[1:], static=True)

    def column(self, path: str, build: Build) -> Column:
        """The column of an entity, which is sent in pieces; `build` makes its components from a piece's rows."""
        if path not in self._columns:
            self._columns[path] = Column(path, build, self._sheets)
        return self._columns[path]

    def advance(self) -> None:
        """Sends the columns where it is time for that."""
        for sheet in self._sheets:
            if sheet.is_due():
                self._file.check()
                self._send(sheet)

    def close(self) -> None:
        """Sends what is held and completes the file."""
        for sheet in self._sheets:
            self._send(sheet)
        file = self._sheets[0].stream
        file.flush()
        file.disconnect()
        if self._live is not None:
            self._live.close()
        self._file.close()

    def _send(self, sheet: _Sheet) -> None:
        for column in self._columns.values():
            column.send(sheet)
