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
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from urllib.parse import quote

import rerun as rr

from viz.live_feed import new_stream
from viz.viewer_program import BIND, LISTENING, PROGRAM, quiet_environment

WEB_PAGE = re.compile(r"Hosting a web-viewer at (http://127\.0\.0\.1:\d+)")
DRAWS = re.compile(r"wgpu adapter")
WINDOW = ("--expect-data-soon", "--hide-welcome-screen")
SERVER_MEMORY = "1GiB"  # of this, the oldest entries go first
READY_WITHIN_S = 20.0
WINDOW_WITHIN_S = 8.0  # a window that is still there then is taken for open, even if it has not said so
POLL_S = 0.05

# Both outlive this process if they must, and need no Python for it.
# Standard input closes when this process ends, however it ends.
GUARD = 'read -r word; [ "$word" = keep ] || kill -9 "$1"; rm -rf "$2"'
# The window has all it shows from the server.
WINDOW_WITH_SERVER = 'server=$1; shift; "$@"; code=$?; kill -9 "$server"; exit $code'


class LiveViewError(RuntimeError):
    """The mission cannot be shown live; the text says why and what helps, in one sentence."""


def check_display() -> None:
    """Raises LiveViewError where there is no display for a window."""
    if sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return
    raise LiveViewError("--live: there is no display for the viewer's window; add --web to watch in a browser")


class LiveServer:
    """Use as a context. It listens on this machine only, on ports that the system picks.

    `recording_id`: that of the recorder. `pipe`: for the recorder's config. `url`: what a viewer connects to. `page`:
    for a browser, with `web`. On leaving the context the server ends, unless `open_window` has been called: then it
    ends with the window, which stays for the user. If this process is killed, server and window's contents go too.
    Raises LiveViewError where the server does not start.
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
        self.server = _start(command, log, reader)
        os.close(reader)
        self._guard = subprocess.Popen(
            ["/bin/sh", "-c", GUARD, "sh", str(self.server.pid), str(self._folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            # The server opens its ports once it has read something.
            os.write(self._writer, _opening(recording_id))
            listening = _wait_for(LISTENING, self.server, log, READY_WITHIN_S)
            page = _wait_for(WEB_PAGE, self.server, log, READY_WITHIN_S) if web else ""
            if listening is None or page is None:
                raise LiveViewError(f"--live: the viewer was not ready after {READY_WITHIN_S:.0f} s")
            self.url = f"rerun+http://{listening}/proxy"
            self.page = f"{page}/?url={quote(self.url, safe='')}" if web else ""
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> LiveServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open_window(self) -> None:
        """Opens the viewer's window, and returns when it draws. Raises LiveViewError where it cannot."""
        command = [PROGRAM, *WINDOW, *BIND, "--connect", self.url]
        wrapper = ["/bin/sh", "-c", WINDOW_WITH_SERVER, "sh", str(self.server.pid), *command]
        window = _start(wrapper, self.window_log, subprocess.DEVNULL, held_open=(self._writer,))
        try:
            _wait_for(DRAWS, window, self.window_log, WINDOW_WITHIN_S)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(window.pid, signal.SIGKILL)
            window.wait()
            raise
        self.window = window

    def wait(self) -> None:
        """Waits until the server has ended, by itself or by what interrupts this process."""
        self.server.wait()

    def close(self) -> None:
        """Ends the server, or leaves it to the window."""
        stays = self.window is not None
        with contextlib.suppress(BrokenPipeError):
            self._guard.communicate(b"keep\n" if stays else b"")
        if not stays:
            self.server.wait()
        os.close(self._writer)


def _wait_for(words: re.Pattern[str], process: subprocess.Popen[bytes], log: Path, within_s: float) -> str | None:
    """What a program says, None where it has not after a while; raises LiveViewError where it has ended instead."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        ended = process.poll() is not None  # before the log is read: then it is complete
        text = log.read_text(errors="replace")
        if found := words.search(text):
            return found[found.lastindex or 0]
        if ended:
            said = [line for line in text.splitlines() if "rror" in line or "panicked" in line]
            why = said[-1].rsplit(": ", 1)[-1] if said else "it does not say why"
            raise LiveViewError(f"--live: the viewer does not start: {why}")
        time.sleep(POLL_S)
    return None


def _opening(recording_id: str) -> bytes:
    """The first words of the recording: its name."""
    stream = new_stream(recording_id)
    opening = rr.binary_stream(stream)
    stream.send_recording_name(recording_id)
    return opening.read() or b""


def _start(command: list[str], log: Path, stdin: int, held_open: tuple[int, ...] = ()) -> subprocess.Popen[bytes]:
    """Starts a program in a session of its own: Ctrl-C is for the mission."""
    with log.open("wb") as output:
        return subprocess.Popen(
            command,
            stdin=stdin,
            stdout=output,
            stderr=output,
            env=quiet_environment(),
            cwd="/",
            start_new_session=True,
            pass_fds=held_open,
        )
