"""Reads the JSON lines that a child writes to its status pipe, without ever waiting for it."""

from __future__ import annotations

import json
import os
from typing import Any

CHUNK_BYTES = 65_536


class StatusLines:
    """The reading end of a pipe, which it takes over and closes."""

    def __init__(self, read_fd: int) -> None:
        os.set_blocking(read_fd, False)
        self._fd = read_fd
        self._unread = b""

    def fileno(self) -> int:
        """For `select`: readable when there are lines, or no more will come."""
        return self._fd

    def read(self) -> list[dict[str, Any]] | None:
        """The lines that have come since the last time; None when no more will come.

        A line without its end is kept until that comes; what a killed child has not finished is left out.
        """
        ended = False
        try:
            while chunk := os.read(self._fd, CHUNK_BYTES):
                self._unread += chunk
            ended = True
        except BlockingIOError:
            pass
        *lines, self._unread = self._unread.split(b"\n")
        return None if ended and not lines else [json.loads(line) for line in lines]

    def close(self) -> None:
        """Closes the pipe."""
        os.close(self._fd)
