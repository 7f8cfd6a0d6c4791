"""The recorder's side of a live view: a second stream of the recording into a pipe, which never holds anyone up."""

from __future__ import annotations

import logging
import os
import select
import threading
import time
from collections import deque
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

log = logging.getLogger(__name__)

APPLICATION = "secondlook"
PIECE_EVERY_S = 0.1  # of the wall clock: how far the view lags behind at least
HELD_BYTES = 32 << 20  # kept for a viewer that is behind; a whole mission takes about 5 MB
REST_WITHIN_S = 1.0  # at the end, for what is still held


def new_stream(recording_id: str, batches: rr.ChunkBatcherConfig | None = None) -> rr.RecordingStream:
    """A stream of the recording, without the wall clock: that has no place in a recording of simulated time.

    `batches`: when it sends what it holds; soon, if left out.
    """
    # Rerun keeps what it has of a stream that is gone, two threads among that, until it is told to let go of it.
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
    stream = rr.RecordingStream(APPLICATION, recording_id=recording_id, send_properties=False, batcher_config=batches)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    return stream


def send_blueprint(stream: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
    """Says how the recording is laid out.

    As `RecordingStream.send_blueprint` does, but that leaves the layout's own stream and its memory holding each other.
    """
    made = rerun_bindings.new_blueprint(
        application_id=APPLICATION, make_default=False, make_thread_default=False, default_enabled=True
    )
    layout = rr.RecordingStream._from_native(made)
    layout.set_time("blueprint", sequence=0)
    blueprint._log_to_stream(layout)
    held = layout.memory_recording().storage
    rerun_bindings.send_blueprint(held, make_active=True, make_default=True, recording=stream.to_native())
    layout.disconnect()


class LiveFeed:
    """Passes what is drawn on `stream` to the pipe of a LiveServer, from a thread of its own.

    Drawing on `stream` writes to memory only, so it is as fast whether somebody reads or not. Each piece of bytes is a
    recording by itself; while the reader is more than `held_bytes` behind, new pieces are left out, which the log says
    once and `dropped` counts. Nobody at the other end, from the start or later, is said once in the log too.
    """

    def __init__(self, pipe: Path, recording_id: str, *, held_bytes: int = HELD_BYTES) -> None:
        self.stream = new_stream(recording_id)
        self.dropped = 0
        self._bytes = rr.binary_stream(self.stream)
        self._limit = held_bytes
        self._held: deque[bytes] = deque()
        self._held_bytes = 0
        self._written = 0  # of the first piece that is held
        self._pipe: int | None = None
        try:
            self._pipe = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as error:
            log.warning("the mission is not shown live, the recording goes on: %s", error.strerror)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="live feed", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Passes on what is still held, for at most a second, and ends."""
        self._closing.set()
        self._thread.join()
        self.stream.disconnect()

    def _run(self) -> None:
        while not self._closing.wait(PIECE_EVERY_S):
            self._collect()
            self._write()
        self._collect()
        deadline = time.monotonic() + REST_WITHIN_S
        while self._write() and self._pipe is not None and time.monotonic() < deadline:
            select.select([], [self._pipe], [], PIECE_EVERY_S)
        if self.dropped or self._held:
            left_out = self.dropped + len(self._held)
            log.warning("the live view lacks %d pieces of the recording; the file has them", left_out)
        self._hang_up()

    def _collect(self) -> None:
        """Collects what has been drawn since; read also where it leads nowhere, or it would pile up."""
        piece = self._bytes.read()
        if not piece or self._pipe is None:
            return
        if self._held_bytes + len(piece) > self._limit:
            if not self.dropped:
                log.warning("the live view is too far behind: pieces are left out there, the file has them")
            self.dropped += 1
            return
        self._held.append(piece)
        self._held_bytes += len(piece)

    def _write(self) -> bool:
        """Writes as much as the pipe takes; whether anything is left."""
        while self._pipe is not None and self._held:
            piece = self._held[0]
            try:
                self._written += os.write(self._pipe, memoryview(piece)[self._written :])
            except BlockingIOError:
                return True
            except OSError:
                log.warning("the live view is gone; the recording goes on")
                self._hang_up()
                return False
            if self._written == len(piece):
                self._held.popleft()
                self._held_bytes -= len(piece)
                self._written = 0
        return False

    def _hang_up(self) -> None:
        if self._pipe is not None:
            os.close(self._pipe)
            self._pipe = None
        self._held.clear()
