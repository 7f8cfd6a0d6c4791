"""Shows a mission while it runs: a server of the viewer's own between the recorder and whoever watches.

The recorder writes into a named pipe, the server keeps what it reads for viewers that come late, and a window or a
browser gets it from there. A viewer that is slow, stopped or killed so is the server's concern alone.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
from pathlib import Path

import rerun as rr

from viz.live_feed import new_stream
from viz.viewer_program import BIND, PROGRAM, RunningViewer, server_url, start, wait_until_drawn, web_address
from viz.web_page import WebPage

WINDOW = ("--expect-data-soon", "--hide-welcome-screen")
SERVER_MEMORY = "1GiB"  # of this, the oldest entries go first

# The window has all it shows from the server.
WINDOW_WITH_SERVER = 'server=$1; shift; "$@"; code=$?; kill -9 "$server"; exit $code'


class LiveServer(RunningViewer):
    """Use as a context. It listens on this machine only, on ports that the system picks.

    `recording_id`: that of the recorder. `pipe`: for the recorder's config. `url`: what a viewer connects to. With
    `web` there is a `page` for a browser. On leaving the context the server ends, unless `open_window` has been called:
    then it ends with the window, which stays for the user. If this process is killed, server and window's contents go
    too. Raises ViewerError where the server does not start.
    """

    def __init__(self, recording_id: str, *, web: bool) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="secondlook-live-"))
        self.pipe = self._folder / "pipe"
        self.window_log = self._folder / "window.txt"
        self.window: subprocess.Popen[bytes] | None = None
        os.mkfifo(self.pipe)
        reader = os.open(self.pipe, os.O_RDONLY | os.O_NONBLOCK)
        # Held open as long as the server lives: with nobody to write it would look again and again, a core's worth.
        self._writer = os.open(self.pipe, os.O_WRONLY)
        os.set_blocking(reader, True)
        how = ("--serve-web", "--web-viewer-port", "0") if web else ("--serve-grpc",)
        log = self._folder / "server.txt"
        command = [PROGRAM, *how, *BIND, "--server-memory-limit", SERVER_MEMORY, "-"]
        super().__init__(command, log, reader, self._folder)
        os.close(reader)
        try:
            # The server opens its ports once it has read something.
            os.write(self._writer, _opening(recording_id))
            self.url = server_url(self.process, log)
            self._page = WebPage(web_address(self.process, log), self.url) if web else None
        except BaseException:
            self.close()
            raise

    def open_window(self) -> None:
        """Opens the viewer's window, and returns when it draws. Raises ViewerError where it cannot."""
        command = [PROGRAM, *WINDOW, *BIND, "--connect", self.url]
        wrapper = ["/bin/sh", "-c", WINDOW_WITH_SERVER, "sh", str(self.process.pid), *command]
        window = start(wrapper, self.window_log, subprocess.DEVNULL, held_open=(self._writer,))
        try:
            wait_until_drawn(window, self.window_log)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(window.pid, signal.SIGKILL)
            window.wait()
            raise
        self.window = window

    def close(self) -> None:
        """Ends the server, or leaves it to the window."""
        self._end(stays=self.window is not None)
        os.close(self._writer)


def _opening(recording_id: str) -> bytes:
    """The first words of the recording: its name."""
    stream = new_stream(recording_id)
    opening = rr.binary_stream(stream)
    stream.send_recording_name(recording_id)
    return opening.read() or b""
