"""Shows a mission while it runs: a server of the viewer's own between the recorder and whoever watches.

The recorder writes into a named pipe, the server keeps what it reads for viewers that come late, and a window or a
browser gets it from there. A viewer that is slow, stopped or killed so is the server's concern alone.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType

import rerun as rr

from viz.live_feed import new_stream
from viz.viewer_program import BIND, PROGRAM, guard, server_url, start, wait_for, wait_for_end, web_address
from viz.web_page import WebPage

DRAWS = re.compile(r"wgpu adapter")
WINDOW = ("--expect-data-soon", "--hide-welcome-screen")
SERVER_MEMORY = "1GiB"  # of this, the oldest entries go first
WINDOW_WITHIN_S = 8.0  # a window that is still there then is taken for open, even if it has not said so

# The window has all it shows from the server.
WINDOW_WITH_SERVER = 'server=$1; shift; "$@"; code=$?; kill -9 "$server"; exit $code'


class LiveServer:
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
        self.server = start(command, log, reader)
        os.close(reader)
        self._guard = guard(self.server, self._folder)
        self._page: WebPage | None = None
        try:
            # The server opens its ports once it has read something.
            os.write(self._writer, _opening(recording_id))
            self.url = server_url(self.server, log)
            self._page = WebPage(web_address(self.server, log), self.url) if web else None
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> LiveServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def page(self) -> str:
        """The address for a browser; "" without `web`."""
        return self._page.address if self._page else ""

    def open_window(self) -> None:
        """Opens the viewer's window, and returns when it draws. Raises ViewerError where it cannot."""
        command = [PROGRAM, *WINDOW, *BIND, "--connect", self.url]
        wrapper = ["/bin/sh", "-c", WINDOW_WITH_SERVER, "sh", str(self.server.pid), *command]
        window = start(wrapper, self.window_log, subprocess.DEVNULL, held_open=(self._writer,))
        try:
            wait_for(DRAWS, window, self.window_log, WINDOW_WITHIN_S)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(window.pid, signal.SIGKILL)
            window.wait()
            raise
        self.window = window

    def wait(self) -> None:
        """Waits until the server has ended, by itself or by what interrupts this process."""
        wait_for_end(self.server)

    def close(self) -> None:
        """Ends the server, or leaves it to the window."""
        if self._page is not None:
            self._page.close()
        stays = self.window is not None
        with contextlib.suppress(BrokenPipeError):
            self._guard.communicate(b"keep\n" if stays else b"")
        if not stays:
            self.server.wait()
        os.close(self._writer)


def _opening(recording_id: str) -> bytes:
    """The first words of the recording: its name."""
    stream = new_stream(recording_id)
    opening = rr.binary_stream(stream)
    stream.send_recording_name(recording_id)
    return opening.read() or b""
