"""The file of a recording, written by a thread of our own: where Rerun's own writer cannot write, as the disk is full,
it tells nobody, and the process may never end."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import rerun as rr

from comms.errors import FileError

PIECE_BYTES = 1 << 16


class RecordingFile:
    """Takes all that `stream` says from now on, and hands it to the system at once. Raises FileError; what comes after
    that is left out."""

    def __init__(self, path: Path, stream: rr.RecordingStream) -> None:
        self._path = path
        self._error: OSError | None = None
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise FileError(path, error) from error
        self._pipe, writer = os.pipe()
        stream.save(f"/dev/fd/{writer}")
        os.close(writer)  # the stream has one of its own
        self._thread = threading.Thread(target=self._write, name=f"write {path.name}", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raises FileError where something could not be written."""
        if self._error is not None:
            raise FileError(self._path, self._error) from self._error

    def close(self) -> None:
        """Waits until all is written; the stream has to be disconnected before."""
        self._thread.join()
        self.check()

    def _write(self) -> None:
        while piece := os.read(self._pipe, PIECE_BYTES):
            try:
                if self._error is None:
                    self._file.write(piece)
                    self._file.flush()
            except OSError as error:
                self._error = error
        os.close(self._pipe)
        try:
            self._file.close()
        except OSError as error:
            self._error = self._error or error
